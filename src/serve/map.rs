//! Sends fields as textures for the lit view: raw samples without a file format.
use super::app::{ApiError, App};
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use axum::http::HeaderName;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use half::f16;
use serde::Deserialize;
use shibo_bridge::scene::{DisplayStyle, Preview};
use shibo_picture::SrgbEncoder;
use shibo_value::{Channel, Tile, Type, Window};

/// Longest side of a texture in pixels.
const LONGEST: u32 = 2048;

/// Query: a texture.
#[derive(Debug, Deserialize)]
pub(super) struct Texture {
    g: u64,
    t: String,
    /// Longest side in pixels.
    s: u32,
    /// Sends unconverted values, for measuring.
    #[serde(default)]
    exact: bool,
}

/// Returns a field row by row from the top. The header `x-map` says `WIDTH HEIGHT FORM`: `rgba8` for colours
/// (sRGB-encoded) and normals, `r16f` for all types with one channel. For light, which may be brighter than white, a
/// factor follows by which the colours are multiplied. Exact values have the form `f32x1` to `f32x4`, interleaved by
/// pixel, and the header ends with the unit of the values if they have one.
pub(super) async fn map(
    State(app): State<App>,
    query: Result<Query<Texture>, QueryRejection>,
) -> Result<Response, ApiError> {
    let Query(Texture { g, t, s, exact }) = query?;
    let scene = app.scene(g)?;
    let target = scene.target(&t).ok_or(ApiError::Unknown)?;
    let size = scene.size(s.clamp(1, LONGEST));
    let samples = app
        .look(&scene, move |look, _, scene| {
            let Some(Preview::Field(field, manner)) = scene.sight(look, &target)? else { return Ok(None) };
            let tile = look.raster(&field, &scene.graph.canvas.grid(size), Window::full(size))?;
            Ok(Some(if exact { numbers(manner, &tile) } else { samples(field.ty(), target.channel, &tile) }))
        })
        .await?;
    let (form, bytes) = samples.ok_or(ApiError::Nothing)?;
    let head = [
        (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
        (HeaderName::from_static("x-map"), format!("{} {} {form}", size.x, size.y)),
    ];
    Ok((head, bytes).into_response())
}

fn numbers(manner: DisplayStyle, tile: &Tile) -> (String, Vec<u8>) {
    let channels = tile.channels();
    let mut bytes = vec![0; tile.window.len() * channels * 4];
    for c in 0..channels {
        let places = bytes.chunks_exact_mut(4).skip(c).step_by(channels);
        places.zip(tile.plane(c)).for_each(|(place, v)| place.copy_from_slice(&v.to_le_bytes()));
    }
    let unit = if manner.unit == "°" { "deg" } else { manner.unit };
    (format!("f32x{channels} {} {unit}", manner.ty), bytes)
}

/// Converts the samples of a tile to a texture; returns the form and the bytes.
pub(super) fn samples(ty: Type, channel: Option<Channel>, tile: &Tile) -> (String, Vec<u8>) {
    if tile.channels() == 1 {
        let bytes = tile.plane(0).iter().flat_map(|v| f16::from_f32(*v).to_le_bytes()).collect();
        return ("r16f".to_owned(), bytes);
    }
    let glow = channel == Some(Channel::Emission);
    let scale = tile.data().iter().filter(|v| glow && v.is_finite()).fold(1.0_f32, |most, v| most.max(*v));
    let srgb = (ty == Type::Rgb).then(SrgbEncoder::new);
    let code = |v: f32| match &srgb {
        Some(srgb) => srgb.code(v),
        None => byte(v),
    };
    let mut bytes = vec![255; tile.window.len() * 4];
    for c in 0..tile.channels().min(3) {
        for (pixel, v) in bytes.chunks_exact_mut(4).zip(tile.plane(c)) {
            pixel[c] = code(*v / scale);
        }
    }
    (if glow { format!("rgba8 {scale}") } else { "rgba8".to_owned() }, bytes)
}

#[expect(clippy::cast_possible_truncation, reason = "the cast saturates")]
#[expect(clippy::cast_sign_loss, reason = "the cast saturates")]
fn byte(v: f32) -> u8 {
    (v * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec2, UVec2};
    use shibo_value::Grid;

    #[test]
    fn keeps_light_brighter_than_white() {
        let grid = Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: None, shown: None };
        let mut tile = Tile::new(grid, Window::full(UVec2::new(2, 1)), 3);
        tile.data_mut().copy_from_slice(&[4.0, 0.0, 2.0, 0.0, f32::INFINITY, 1.0]);
        let (form, bytes) = samples(Type::Rgb, Some(Channel::Emission), &tile);
        assert_eq!(form, "rgba8 4");
        // A quarter and a half in sRGB; an infinite value becomes the brightest one.
        assert_eq!(bytes, [255, 188, 255, 255, 0, 0, 137, 255]);
        let (form, bytes) = samples(Type::Rgb, Some(Channel::BaseColor), &tile);
        assert_eq!((form.as_str(), &bytes[..3]), ("rgba8", &[255, 255, 255][..]));
        let dark = Tile::new(grid, Window::full(UVec2::new(1, 1)), 3);
        assert_eq!(samples(Type::Rgb, Some(Channel::Emission), &dark).0, "rgba8 1");
    }
}
