//! The photograph of a page.
use crate::graph::{Photo, Refused, Request, name_for};
use shibo_bridge::compare::{CompareRequest, Comparison, compare};
use shibo_bridge::scene::{Preview, Scene, Target};
use shibo_engine::session::{Failure, Look};
use shibo_picture::{Picture, ReadLimits, read_bytes};
use shibo_value::Window;
use std::path::Path;

/// The largest file of a photograph in bytes.
pub const MOST_BYTES: usize = 64 << 20;
/// Limits for decoding.
const LIMITS: ReadLimits =
    ReadLimits { max_file_bytes: MOST_BYTES as u64, max_pixels: 1 << 26, max_bytes_decoded: 768 << 20 };
/// Longest side of the picture that is compared, in pixels.
const SIDE: u32 = 512;

/// A photograph.
pub struct Held {
    name: String,
    picture: Picture,
}

/// Values of parameters with which a fit begins.
#[derive(Clone, Debug, Default)]
pub struct Wish {
    /// The preset.
    pub preset: Option<String>,
    /// Names and values of parameters, as RON.
    pub set: Vec<(String, String)>,
    /// Width of the photograph in mm; found too if absent.
    pub mm: Option<f64>,
}

/// The message for a larger file.
pub fn too_large() -> String {
    format!("the file has more than {} MiB; scale it down", MOST_BYTES >> 20)
}

impl Held {
    /// Reads the file of a photograph, and checks that it can be fitted. `name` is the name of the file.
    ///
    /// # Errors
    /// The reason why it is not taken: it is too large, no picture, or has nothing to fit. No memory is taken for a picture that is too
    /// large.
    pub fn read(bytes: &[u8], name: &str) -> Result<Self, String> {
        let name: String = name.chars().filter(|c| !c.is_control()).take(200).collect();
        let picture = read_bytes(bytes, &LIMITS).map_err(|error| error.to_string())?;
        Photo::of(&picture, (&name, &name), None, None).map_err(|refused| why(&refused))?;
        Ok(Self { name, picture })
    }

    /// The name of the file, without control characters.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.picture.width, self.picture.height]
    }

    /// The differences of a picture of `scene` from the photograph, which is `mm` wide.
    ///
    /// # Errors
    /// The reason why they cannot be compared.
    pub fn compared(&self, picture: &Picture, scene: &Scene, mm: Option<f64>) -> Result<Comparison, String> {
        let request = CompareRequest { width_mm_a: mm.map(|_| scene.graph.canvas.size_mm.x), width_mm_b: mm };
        compare(picture, &self.picture, &request)
    }

    /// The options of a fit, and the photograph for it.
    ///
    /// # Errors
    /// The photograph cannot be fitted, or its width is no width.
    pub fn asked(&self, Wish { preset, set, mm }: Wish) -> Result<(Request, Photo), Refused> {
        let preset_name = name_for(Path::new(&self.name));
        let request = Request { preset: preset_name, start: preset, set, seed: 1, ..Request::default() };
        request.check("", mm)?;
        Ok((request, Photo::of(&self.picture, (&self.name, &self.name), mm, None)?))
    }
}

/// The samples of a target; `None` if they are no grey values or colours.
///
/// # Errors
/// The target cannot be rendered.
pub fn picture(look: &Look<'_>, scene: &Scene, target: &Target) -> Result<Option<Picture>, Failure> {
    let Some(Preview::Field(field, _)) = scene.sight(look, target)? else { return Ok(None) };
    let size = scene.size(SIDE);
    let tile = look.raster(&field, &scene.graph.canvas.grid(size), Window::full(size))?;
    Ok(matches!(tile.channels(), 1 | 3).then(|| shibo_bridge::picture(&tile, tile.channels() == 3)))
}

/// The message of a fit that cannot be made.
pub fn why(refused: &Refused) -> String {
    match refused {
        Refused::Usage(message) | Refused::Unfit(message) => message.clone(),
        Refused::Graph(Failure::Errors(errors), _) => {
            errors.first().map_or_else(|| "the graph has errors".to_owned(), |error| error.message.clone())
        }
        Refused::Graph(failure, _) => failure.to_string(),
        Refused::Cancelled => "cancelled before the first render".to_owned(),
    }
}
