//! Requests about one target: picture, tile, value of a pixel, data of an object.
use super::app::{AboutQuery, ApiError, App, Of, Query2, aside, png};
use super::stage::Stage;
use axum::extract::{Query, State};
use axum::response::{IntoResponse, Json, Response};
use glam::UVec2;
use serde::Deserialize;
use serde_json::{Value as Data, json};
use shibo_bridge::page;
use shibo_bridge::scene::paint::Painter;
use shibo_bridge::scene::{COARSE, Preview, Scene, Target, WHOLE, lock};
use shibo_engine::session::{Failure, Look};
use shibo_value::{Type, Window, linear_to_srgb};

/// Width and height of the tiles of pictures that are too large to be sent whole.
const TILE: u32 = 512;

/// Query: a target and a size.
#[derive(Debug, Deserialize)]
pub(super) struct Sized {
    g: u64,
    t: String,
    /// Longest side in pixels.
    s: u32,
}

/// Describes the picture of a target: its address and content. Objects have no picture.
pub(super) async fn look(State(app): State<App>, query: Query2<Sized>) -> Result<Response, ApiError> {
    let Query(Sized { g, t, s }) = query?;
    let scene = app.scene(g)?;
    // The node may have been deleted from the file while the page still shows it. Other reasons have no content.
    let Some(target) = scene.target(&t) else { return Ok(Json(Data::Null).into_response()) };
    app.stage.set_focus(&t);
    let longest = s.clamp(1, WHOLE);
    let answer = app.look(&scene, move |look, stage, scene| describe(look, stage, scene, &target, longest)).await?;
    Ok(Json(answer).into_response())
}

fn describe(look: &Look<'_>, stage: &Stage, scene: &Scene, target: &Target, longest: u32) -> Result<Data, Failure> {
    let mut about = page::about(scene, target, stage.session.registry());
    about["generation"] = scene.generation.into();
    match scene.sight(look, target)? {
        Some(Preview::Field(field, manner)) => {
            let stored = scene.picture(look, &stage.store, target, (&field, manner), scene.size(longest))?;
            about["shown"] = json!(scene.shown(target, manner.unit, stored));
        }
        Some(Preview::Pixels(pixels)) => {
            let stored = scene.pixels(&stage.store, target, &pixels, WHOLE);
            about["shown"] = json!(scene.shown_pixels(target, stored));
        }
        Some(Preview::Object(ty, _)) => about["object"] = ty.name().into(),
        None => {}
    }
    Ok(about)
}

/// Query: a tile.
#[derive(Debug, Deserialize)]
pub(super) struct Place {
    g: u64,
    t: String,
    /// Number of times the picture is halved.
    l: u32,
    x: u32,
    y: u32,
}

/// Returns a tile of 512² pixels of the full-size picture, halved `l` times.
pub(super) async fn tile(State(app): State<App>, query: Query2<Place>) -> Result<Response, ApiError> {
    let Query(place) = query?;
    let scene = app.scene(place.g)?;
    let target = scene.target(&place.t).ok_or(ApiError::Unknown)?;
    let full = scene.graph.canvas.resolution;
    let size = UVec2::new(full.x.div_ceil(1 << place.l.min(16)), full.y.div_ceil(1 << place.l.min(16)));
    let (Some(x), Some(y)) = (place.x.checked_mul(TILE), place.y.checked_mul(TILE)) else {
        return Err(ApiError::Unknown);
    };
    if x >= size.x || y >= size.y {
        return Err(ApiError::Unknown);
    }
    let window =
        Window { x: x.cast_signed(), y: y.cast_signed(), width: TILE.min(size.x - x), height: TILE.min(size.y - y) };
    let bytes = app
        .look(&scene, move |look, stage, scene| {
            let Some(Preview::Field(field, manner)) = scene.sight(look, &target)? else { return Ok(None) };
            // Tiles use the same black and white values as the whole picture.
            let known = lock(&scene.shown).get(&target.name).map(|shown| shown.range);
            let range = match known {
                Some(range) => range,
                None => scene.picture(look, &stage.store, &target, (&field, manner), scene.size(COARSE))?.range,
            };
            let tile = look.raster(&field, &scene.graph.canvas.grid(size), window)?;
            Ok(Painter::new(manner.ty, range).png(&tile, &|| look.is_over()))
        })
        .await?;
    bytes.map(|bytes| png(bytes.into())).ok_or(ApiError::Nothing)
}

/// Query: a pixel.
#[derive(Debug, Deserialize)]
pub(super) struct Pixel {
    g: u64,
    t: String,
    x: u32,
    y: u32,
}

/// Returns the values of a field at a pixel of the full-size picture.
pub(super) async fn probe(State(app): State<App>, query: Query2<Pixel>) -> Result<Response, ApiError> {
    let Query(Pixel { g, t, x, y }) = query?;
    let scene = app.scene(g)?;
    let target = scene.target(&t).ok_or(ApiError::Unknown)?;
    let size = scene.graph.canvas.resolution;
    if x >= size.x || y >= size.y {
        return Err(ApiError::Unknown);
    }
    let answer = app
        .look(&scene, move |look, _, scene| {
            let Some(Preview::Field(field, manner)) = scene.sight(look, &target)? else { return Ok(None) };
            let grid = scene.graph.canvas.grid(size);
            let (x, y) = (x.cast_signed(), y.cast_signed());
            let tile = look.raster(&field, &grid, Window { x, y, width: 1, height: 1 })?;
            let mut answer = json!({
                "mm": grid.center(x, y).to_array(),
                "values": tile.data(),
                "type": field.ty().to_string(),
                "unit": manner.unit,
            });
            if field.ty() == Type::Rgb {
                let codes = tile.data().iter().map(|v| (linear_to_srgb(v.clamp(0.0, 1.0)) * 255.0).round());
                answer["srgb"] = codes.collect();
            }
            Ok(Some(answer))
        })
        .await?;
    answer.map(|answer| Json(answer).into_response()).ok_or(ApiError::Nothing)
}

/// Returns the data of an object, thinned out for drawing.
pub(super) async fn object(State(app): State<App>, query: AboutQuery) -> Result<Response, ApiError> {
    let Query(about) = query?;
    let (scene, target) = app.about(&about)?;
    let data = app
        .look(&scene, move |look, _, scene| {
            let Some(Preview::Object(ty, Some(sketch))) = scene.sight(look, &target)? else { return Ok(None) };
            Ok(page::drawing(ty, &sketch, &scene.graph.canvas))
        })
        .await?;
    data.map(|data| Json(data).into_response()).ok_or(ApiError::Nothing)
}

/// Query: a level of the graph.
#[derive(Debug, Deserialize)]
pub(super) struct Level {
    g: u64,
    /// Name of the sub-graph; empty for the whole graph.
    #[serde(default)]
    u: String,
}

/// Returns the boxes and wires of the graph or of one of its sub-graphs; `null` if the sub-graph was deleted.
pub(super) async fn graph(State(app): State<App>, query: Query2<Level>) -> Result<Response, ApiError> {
    let Query(Level { g, u }) = query?;
    let scene = app.scene(g)?;
    Ok(Json(aside(move || page::level(&scene.graph, &u)).await?).into_response())
}

/// Returns the statistics of all nodes.
pub(super) async fn stats(State(app): State<App>, query: Query2<Of>) -> Result<Response, ApiError> {
    let scene = app.scene(query?.g)?;
    let stats = lock(&scene.stats).clone();
    Ok(Json(stats).into_response())
}
