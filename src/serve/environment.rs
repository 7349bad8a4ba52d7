//! Light for the lit view, in one format: the environments of `Relief`, and the user's own. For the latter, a page sends
//! a panorama (EXR or HDR) and gets back its light. That light is kept in memory for this run, so a reloaded page can
//! fetch it again; nothing is written to disk.
use super::app::{ApiError, App, Query2, aside};
use axum::body::{Bytes, to_bytes};
use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use half::f16;
use serde::Deserialize;
use shibo_bridge::scene::lock;
use shibo_kernel::surface::environment::{Environment, Map, Panorama, Scene, panorama};
use shibo_picture::{Conversion, FileFormat, Header, ReadError, ReadLimits, header_bytes, read_bytes};

/// Maximum file size in bytes: 8192 × 4096 pixels with 16 bits per channel fit.
const MOST: usize = 256 << 20;
/// Limits for decoding.
const LIMITS: ReadLimits =
    ReadLimits { max_file_bytes: MOST as u64, max_pixels: 1 << 26, max_bytes_decoded: 768 << 20 };

/// The maximum of half precision.
const GREATEST: f32 = 65504.0;

fn answer(bytes: Bytes) -> Response {
    ([(header::CONTENT_TYPE, "application/octet-stream")], bytes).into_response()
}

/// Encodes an environment for pages. Integers: the number of levels, then the texels along an edge of each, without the
/// border. Floats: the nine coefficients of diffuse light, then direction, light and colour of the key light, three each,
/// and its angular radius. Then the levels by rows, with their borders, as four numbers of half precision per texel.
fn encoded(environment: &Environment) -> Bytes {
    let levels = environment.levels();
    let sizes = std::iter::once(levels.len()).chain(levels.iter().map(Map::size));
    let head = sizes.flat_map(|n| u32::try_from(n).unwrap_or(0).to_le_bytes());
    let (toward, light) = environment.key();
    let key = [toward, light, environment.key_color()].into_iter().flatten().chain([environment.key_radius()]);
    let floats = environment.diffuse().iter().flatten().copied().chain(key).flat_map(f32::to_le_bytes);
    let numbers = levels.iter().flat_map(Map::texels).flatten();
    let texels = numbers.flat_map(|v| f16::from_f32(v.clamp(0.0, GREATEST)).to_le_bytes());
    head.chain(floats).chain(texels).collect()
}

/// Query: light.
#[derive(Debug, Deserialize)]
pub(super) struct Asked {
    /// Name of a built-in environment; without it, the last panorama.
    scene: Option<BuiltIn>,
}

/// The environments of `Relief` that have maps.
#[derive(Clone, Copy, Debug, Deserialize)]
enum BuiltIn {
    Studio,
    Overcast,
    Window,
    Sky,
}

impl BuiltIn {
    fn light(self) -> Bytes {
        encoded(&Environment::of(match self {
            Self::Studio => Scene::Studio,
            Self::Overcast => Scene::Overcast,
            Self::Window => Scene::Window,
            Self::Sky => Scene::Sky,
        }))
    }
}

/// Reads a panorama and returns its light.
pub(super) async fn take(State(app): State<App>, request: Request) -> Result<Response, Response> {
    if request.headers().get(header::CONTENT_TYPE).is_none_or(|kind| kind != "application/octet-stream") {
        return Err(StatusCode::UNSUPPORTED_MEDIA_TYPE.into_response());
    }
    let environment = &app.stage.environment;
    let _turn = environment.turn.try_acquire().map_err(|_| ApiError::Busy.into_response())?;
    let large = format!("the file has more than {} MiB; scale it down", MOST >> 20);
    let large = |_| (StatusCode::PAYLOAD_TOO_LARGE, large).into_response();
    let file = to_bytes(request.into_body(), MOST).await.map_err(large)?;
    // Runs on the engine's threads, like all computations for pages.
    let scene =
        app.stage.scene().ok_or_else(|| ApiError::Failed("no graph is shown yet".to_owned()).into_response())?;
    let made = app.look(&scene, move |_, _, _| Ok(light(&file))).await.map_err(IntoResponse::into_response)?;
    let bytes = made.map_err(|why| ApiError::Failed(why).into_response())?;
    *lock(&environment.bytes) = Some(bytes.clone());
    Ok(answer(bytes))
}

fn light(file: &[u8]) -> Result<Bytes, String> {
    let is_light = |header: &Header| matches!(header.format, FileFormat::Exr | FileFormat::Hdr);
    let header = match header_bytes(file) {
        Ok(header) if is_light(&header) => header,
        Ok(_) | Err(ReadError::UnknownFormat(_)) => return Err("it is neither OpenEXR nor Radiance HDR".to_owned()),
        Err(error) => return Err(error.to_string()),
    };
    let mut picture = read_bytes(file, &LIMITS).map_err(|error| error.to_string())?;
    Conversion::of_file(&header).0.apply(&mut picture);
    let plane = |channel: u8| picture.plane(if picture.channels < 3 { 0 } else { channel });
    let (width, height) = (picture.width as usize, picture.height as usize);
    Ok(encoded(&panorama(&Panorama { width, height, planes: [plane(0), plane(1), plane(2)] })?))
}

/// Returns a built-in environment, or the last panorama taken in this run.
pub(super) async fn give(State(app): State<App>, query: Query2<Asked>) -> Result<Response, ApiError> {
    if let Some(built_in) = query?.0.scene {
        return aside(move || built_in.light()).await.map(answer);
    }
    let bytes = lock(&app.stage.environment.bytes).clone();
    bytes.map(answer).ok_or(ApiError::Nothing)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The page reads these places: see environment.js.
    #[test]
    fn encodes_levels_after_coefficients_and_key_light() {
        let (environment, bytes) = (Environment::of(Scene::Window), BuiltIn::Window.light());
        let word = |i: usize| <[u8; 4]>::try_from(&bytes[4 * i..4 * i + 4]).unwrap();
        let sizes: Vec<usize> = environment.levels().iter().map(Map::size).collect();
        let count = sizes.len();
        assert_eq!(u32::from_le_bytes(word(0)) as usize, count);
        assert_eq!((1..=count).map(|i| u32::from_le_bytes(word(i)) as usize).collect::<Vec<_>>(), sizes);
        let float = |i: usize| f32::from_le_bytes(word(1 + count + i));
        assert_eq!(float(3), environment.diffuse()[1][0]);
        let (toward, light) = environment.key();
        assert_eq!([27, 28, 29].map(float), toward);
        assert_eq!([30, 31, 32].map(float), light);
        assert_eq!([33, 34, 35].map(float), environment.key_color());
        assert_eq!(float(36), environment.key_radius());
        let texels: usize = sizes.iter().map(|size| (size + 2) * (size + 2)).sum();
        let start = 4 * (1 + count + 37);
        assert_eq!(bytes.len(), start + 8 * texels);
        let last = f16::from_le_bytes([bytes[bytes.len() - 2], bytes[bytes.len() - 1]]).to_f32();
        let expected = environment.levels()[count - 1].texels().last().unwrap()[3];
        assert!((last - expected).abs() <= 1e-3 * expected.abs(), "{last} {expected}");
    }

    #[test]
    fn rejects_files_that_are_no_panoramas() {
        assert!(light(b"not a picture").unwrap_err().contains("neither OpenEXR nor Radiance HDR"));
    }
}
