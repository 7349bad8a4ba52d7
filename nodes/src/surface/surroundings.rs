//! Light around a surface, for nodes that make lit pictures.
use shibo_kernel::surface::environment::{Environment, Panorama, Scene, panorama};
use shibo_node::{Context, choice};
use shibo_picture::{self as picture, Conversion, ReadLimits};
use shibo_value::Stop;
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::files::FileHandle;
use std::sync::Arc;

/// Light around the surface.
#[choice]
pub enum Surroundings {
    /// A lamp at `azimuth` and `elevation`, a weak fill light and a sky. Nothing else is reflected.
    #[default]
    Lamp,
    /// Soft boxes in a gray room: the light for judging a material. It has no colour.
    Studio,
    /// A cloudy sky: soft light, hardly any shadow.
    Overcast,
    /// A room with one window.
    Window,
    /// The sun in a blue sky.
    Sky,
}

impl Surroundings {
    /// The light of the file `panorama` of the node, if it has one, else of this environment; `None` for the lamp.
    pub(super) fn light(self, cx: &Context<'_>) -> Result<Option<Arc<Environment>>, Stop> {
        let scene = match (cx.files("panorama").first(), self) {
            (Some(path), _) => return Ok(Some(Arc::new(of_file(path, cx)?))),
            (None, Self::Lamp) => return Ok(None),
            (None, Self::Studio) => Scene::Studio,
            (None, Self::Overcast) => Scene::Overcast,
            (None, Self::Window) => Scene::Window,
            (None, Self::Sky) => Scene::Sky,
        };
        Ok(Some(Environment::of(scene)))
    }
}

/// Checks that panoramas can be read, without decoding them.
pub(super) fn check(files: &[(&'static str, FileHandle)]) -> Vec<Problem> {
    let limits = ReadLimits { max_bytes_decoded: u64::MAX, ..ReadLimits::default() };
    let check = |(_, file): &(&'static str, FileHandle)| picture::check(file, None, &limits).err();
    files.iter().filter_map(check).map(|error| unreadable(&error)).collect()
}

/// The problem of a panorama that cannot be read.
fn unreadable(error: &picture::FileError) -> Problem {
    let code = match &error.reason {
        reason if reason.is_not_found() => Code::FileNotFound,
        reason if reason.is_too_large() => Code::TooLarge,
        _ => Code::BadFile,
    };
    Problem::new(code, error.to_string()).at("panorama")
}

/// Most bytes of a decoded panorama: 8192 × 4096 pixels of four floats fit.
const MOST_DECODED: u64 = 768 << 20;

/// The light of a panorama.
fn of_file(path: &FileHandle, cx: &Context<'_>) -> Result<Environment, Stop> {
    let bad = |why: String| {
        let message = format!("`{}` cannot light the surface: {why}", path.display());
        Problem::new(Code::BadFile, message)
            .at("panorama")
            .help("use a panorama of all directions, twice as wide as high")
    };
    let max_bytes_decoded = MOST_DECODED.min(cx.evaluator.memory());
    let limits = ReadLimits { max_bytes_decoded, ..ReadLimits::default() };
    let header = picture::header(path).map_err(|error| unreadable(&error))?;
    let mut picture = picture::read(path, &limits).map_err(|error| unreadable(&error))?;
    Conversion::of_file(&header).0.apply(&mut picture);
    let plane = |channel: u8| picture.plane(if picture.channels < 3 { 0 } else { channel });
    let (width, height) = (picture.width as usize, picture.height as usize);
    panorama(&Panorama { width, height, planes: [plane(0), plane(1), plane(2)] }).map_err(|why| bad(why).into())
}
