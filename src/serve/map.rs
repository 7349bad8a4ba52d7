//! Fields as textures for the lit view: plain samples without a file around them.
use super::handlers::{App, No};
use super::scene::Sight;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Query, State};
use axum::http::HeaderName;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use half::f16;
use serde::Deserialize;
use shibo_engine::picture::SrgbEncoder;
use shibo_engine::value::{Tile, Type, Window};

/// The longest side of a texture.
const LONGEST: u32 = 2048;

/// What a query about a texture says.
#[derive(Debug, Deserialize)]
pub(super) struct Texture {
    g: u64,
    t: String,
    /// The longest side.
    s: u32,
}

/// A field by rows from the top. The header `x-map` says `WIDTH HEIGHT FORM`: `rgba8` for colours (sRGB-encoded) and
/// normals, `r16f` for everything that has one channel.
pub(super) async fn map(State(app): State<App>, query: Result<Query<Texture>, QueryRejection>) -> Result<Response, No> {
    let Query(Texture { g, t, s }) = query?;
    let scene = app.scene(g)?;
    let target = scene.target(&t).ok_or(No::Unknown)?;
    let size = scene.size(s.clamp(1, LONGEST));
    let samples = app
        .look(&scene, move |look, _, scene| {
            let Some(Sight::Field(field, _)) = scene.sight(look, &target)? else { return Ok(None) };
            let tile = look.raster(&field, &scene.graph.canvas.grid(size), Window::full(size))?;
            Ok(Some(samples(field.ty(), &tile)))
        })
        .await?;
    let (form, bytes) = samples.ok_or(No::Unknown)?;
    let head = [
        (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
        (HeaderName::from_static("x-map"), format!("{} {} {form}", size.x, size.y)),
    ];
    Ok((head, bytes).into_response())
}

fn samples(ty: Type, tile: &Tile) -> (&'static str, Vec<u8>) {
    if tile.channels() == 1 {
        let bytes = tile.plane(0).iter().flat_map(|v| f16::from_f32(*v).to_le_bytes()).collect();
        return ("r16f", bytes);
    }
    let srgb = (ty == Type::Rgb).then(SrgbEncoder::new);
    let code = |v: f32| match &srgb {
        Some(srgb) => srgb.code(v),
        None => byte(v),
    };
    let mut bytes = vec![255; tile.window.len() * 4];
    for c in 0..tile.channels().min(3) {
        for (pixel, v) in bytes.chunks_exact_mut(4).zip(tile.plane(c)) {
            pixel[c] = code(*v);
        }
    }
    ("rgba8", bytes)
}

#[expect(clippy::cast_possible_truncation, reason = "the cast saturates")]
#[expect(clippy::cast_sign_loss, reason = "the cast saturates")]
fn byte(v: f32) -> u8 {
    (v * 255.0 + 0.5) as u8
}
