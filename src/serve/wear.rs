//! Textures that cut solids along a shape: see [`shibo_bridge::page::worn`].
use super::app::{ApiError, App, Query2};
use super::map::samples;
use axum::extract::{Query, State};
use axum::http::{HeaderName, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use shibo_bridge::page::{SolidShape, worn};

/// Query: a texture of a shape.
#[derive(Debug, Deserialize)]
pub(super) struct Worn {
    g: u64,
    t: String,
    shape: SolidShape,
    s: u32,
}

/// Returns a texture of a shape in the format of `map`.
pub(super) async fn wear(State(app): State<App>, query: Query2<Worn>) -> Result<Response, ApiError> {
    let Query(Worn { g, t, shape, s }) = query?;
    let scene = app.scene(g)?;
    let target = scene.target(&t).ok_or(ApiError::Nothing)?;
    let made = app.look(&scene, move |look, _, scene| {
        let worn = worn(look, scene, &target, shape, s)?;
        Ok(worn.map(|(field, tile)| (tile.window, samples(field.ty(), target.channel, &tile))))
    });
    let (window, (form, bytes)) = made.await?.ok_or(ApiError::Nothing)?;
    let head = [
        (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
        (HeaderName::from_static("x-map"), format!("{} {} {form}", window.width, window.height)),
    ];
    Ok((head, bytes).into_response())
}
