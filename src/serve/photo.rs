//! A photograph beside the picture: compared with it in words, and fitted (`shibo fit`). It stays in memory. Only the
//! preset that the user keeps is written, by a change of the file.
use super::app::{ApiError, App, Query2, aside};
use super::edits::tried;
use super::photographs::Held;
use super::stage::Stage;
use crate::library;
use axum::body::{Bytes, to_bytes};
use axum::extract::{Request as HttpRequest, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use serde::Deserialize;
use serde_json::{Value as Data, json};
use shibo_bridge::compare::{CompareRequest, compare};
use shibo_bridge::scene::{Preview, Scene, Target, lock};
use shibo_bridge::{GraphText, Tools};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Failure, Look};
use shibo_fit::graph::{Bench, Fitting, Photo, Preset, Refused, Request, name_for};
use shibo_picture::{Picture, ReadLimits, contained, read_bytes};
use shibo_value::Window;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// The largest file in bytes.
const MOST: usize = 64 << 20;
/// Limits for decoding.
const LIMITS: ReadLimits =
    ReadLimits { max_file_bytes: MOST as u64, max_pixels: 1 << 26, max_bytes_decoded: 768 << 20 };
/// Longest side of the picture that is compared, in pixels.
const SIDE: u32 = 512;
/// Minimum time between two reports of progress.
const PROGRESS: Duration = Duration::from_millis(150);

fn held(app: &App) -> Result<Arc<Held>, ApiError> {
    app.stage.photographs.held().ok_or_else(|| ApiError::Failed("no photograph is on the page".to_owned()))
}

/// Query: the name of the file.
#[derive(Debug, Deserialize)]
pub(super) struct Named {
    name: String,
}

/// Takes a photograph; without content, the page has put it away.
pub(super) async fn take(
    State(app): State<App>,
    query: Query2<Named>,
    request: HttpRequest,
) -> Result<Response, Response> {
    let name = query.map_err(|error| ApiError::from(error).into_response())?.0.name;
    if request.headers().get(header::CONTENT_TYPE).is_none_or(|kind| kind != "application/octet-stream") {
        return Err(StatusCode::UNSUPPORTED_MEDIA_TYPE.into_response());
    }
    let large = format!("the file has more than {} MiB; scale it down", MOST >> 20);
    let large = |_| (StatusCode::PAYLOAD_TOO_LARGE, large).into_response();
    let bytes = to_bytes(request.into_body(), MOST).await.map_err(large)?;
    if bytes.is_empty() {
        app.stage.photographs.hold(None);
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    let held = aside(move || read(&bytes, &name)).await.map_err(IntoResponse::into_response)?;
    let held = held.map_err(|why| ApiError::Failed(why).into_response())?;
    let answer = json!({ "name": held.name, "size": [held.picture.width, held.picture.height] });
    app.stage.photographs.hold(Some(held));
    Ok(Json(answer).into_response())
}

/// Reads a photograph and checks that it can be fitted.
fn read(bytes: &[u8], name: &str) -> Result<Held, String> {
    let name: String = name.chars().filter(|c| !c.is_control()).take(200).collect();
    let picture = read_bytes(bytes, &LIMITS).map_err(|error| error.to_string())?;
    Photo::of(&picture, (&name, &name), None, None).map_err(|refused| why(&refused))?;
    Ok(Held { name, picture })
}

/// The message of a fit that cannot be made.
fn why(refused: &Refused) -> String {
    match refused {
        Refused::Usage(message) | Refused::Unfit(message) => message.clone(),
        Refused::Graph(Failure::Errors(errors), _) => {
            errors.first().map_or_else(|| "the graph has errors".to_owned(), |error| error.message.clone())
        }
        Refused::Graph(failure, _) => failure.to_string(),
        Refused::Cancelled => "cancelled before the first render".to_owned(),
    }
}

/// Query: a target, and the width of the photograph in mm.
#[derive(Debug, Deserialize)]
pub(super) struct Beside {
    g: u64,
    t: String,
    mm: Option<f64>,
}

/// Compares the picture of a target with the photograph: the differences of the picture from the photograph.
pub(super) async fn beside(State(app): State<App>, query: Query2<Beside>) -> Result<Response, ApiError> {
    let Beside { g, t, mm } = query?.0;
    let (scene, held) = (app.scene(g)?, held(&app)?);
    let target = scene.target(&t).ok_or(ApiError::Nothing)?;
    let picture = app.look(&scene, move |look, _, scene| picture(look, scene, &target)).await?;
    let picture = picture.ok_or(ApiError::Nothing)?;
    let request = CompareRequest { width_mm_a: mm.map(|_| scene.graph.canvas.size_mm.x), width_mm_b: mm };
    let found = aside(move || compare(&picture, &held.picture, &request)).await?;
    Ok(Json(found.map_err(ApiError::Failed)?).into_response())
}

/// The samples of a target; `None` if they are no grey values or colours.
fn picture(look: &Look<'_>, scene: &Scene, target: &Target) -> Result<Option<Picture>, Failure> {
    let Some(Preview::Field(field, _)) = scene.sight(look, target)? else { return Ok(None) };
    let size = scene.size(SIDE);
    let tile = look.raster(&field, &scene.graph.canvas.grid(size), Window::full(size))?;
    Ok(matches!(tile.channels(), 1 | 3).then(|| shibo_bridge::picture(&tile, tile.channels() == 3)))
}

/// Request: a fit.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Wish {
    g: u64,
    /// Width of the photograph in mm; found too if absent.
    mm: Option<f64>,
}

/// Starts a fit and returns its number. A fit that is at work ends.
pub(super) async fn fit(State(app): State<App>, body: Bytes) -> Result<Json<Data>, ApiError> {
    let wish: Wish = serde_json::from_slice(&body).map_err(|error| ApiError::Bad(error.to_string()))?;
    let (scene, held) = (app.scene(wish.g)?, held(&app)?);
    let stage = app.stage.clone();
    let text = stage.texts.get(&scene.sha256).ok_or(ApiError::Nothing)?;
    let cancel = CancelToken::default();
    let id = {
        let mut work = lock(&stage.photographs.work);
        if let Some(running) = work.running.replace(cancel.clone()) {
            running.cancel();
        }
        work.found = None;
        work.last += 1;
        work.last
    };
    tokio::task::spawn_blocking(move || {
        let made = contained(|| fitted(&stage, &scene, (&held, &text), &wish, (id, &cancel)));
        let made = made.unwrap_or_else(|said| Err(format!("there is a defect: {said}")));
        let mut work = lock(&stage.photographs.work);
        let news = match made {
            _ if work.last != id || !is_shown(&stage, &wish) => json!({ "id": id, "state": "cancelled" }),
            Ok((preset, report)) => {
                let news =
                    json!({ "id": id, "state": "done", "set": preset.values, "name": preset.name, "report": report });
                work.found = Some(preset);
                news
            }
            Err(message) => json!({ "id": id, "state": "failed", "message": message }),
        };
        if work.last == id {
            work.running = None;
        }
        drop(work);
        stage.tell("fit", &news);
    });
    Ok(Json(json!({ "id": id })))
}

/// Ends the fit; its best values so far are the result.
pub(super) async fn stop(State(app): State<App>) -> StatusCode {
    if let Some(running) = &lock(&app.stage.photographs.work).running {
        running.cancel();
    }
    StatusCode::ACCEPTED
}

/// Returns true if the graph of the request is still the one that is shown.
fn is_shown(stage: &Stage, wish: &Wish) -> bool {
    stage.scene().is_some_and(|scene| scene.generation == wish.g)
}

/// Runs a fit: the preset and the report. Any edit of the graph ends it.
fn fitted(
    stage: &Stage,
    scene: &Scene,
    (held, text): (&Held, &Arc<str>),
    wish: &Wish,
    (id, cancel): (u64, &CancelToken),
) -> Result<(Preset, Data), String> {
    let values = stage.values();
    let request = Request {
        preset: name_for(Path::new(&held.name)),
        start: values.preset,
        set: values.set,
        seed: 1,
        ..Request::default()
    };
    request.check("", wish.mm).map_err(|refused| why(&refused))?;
    let tools: Tools = library::tools();
    let photo = Photo::of(&held.picture, (&held.name, &held.name), wish.mm, None).map_err(|refused| why(&refused))?;
    let bench = Bench { tools: &tools, session: &stage.session, cancel };
    let path = stage.path();
    let (text, _) = tried(&path, text, stage.session.registry(), &stage.values(), &stage.unsaved());
    let text = text.into_owned();
    let file = GraphText { path, text };
    let fitting = Fitting::of(bench, &file, &scene.graph, &photo, &request).map_err(|refused| why(&refused))?;
    let last = Mutex::new(Instant::now());
    let fitted = fitting.run(&|done, status| {
        if !is_shown(stage, wish) {
            cancel.cancel();
        }
        let mut last = lock(&last);
        if last.elapsed() >= PROGRESS {
            *last = Instant::now();
            let best = status.best.as_ref();
            let set = best.map(|best| fitting.values(&best.amounts, best.combination)).unwrap_or_default();
            let news = json!({
                "id": id, "state": "running", "done": done, "total": status.planned,
                "best": best.map(|best| best.distance), "floor": status.floor, "set": set,
            });
            stage.tell("fit", &news);
        }
    });
    let fitted = fitted.map_err(|refused| why(&refused))?;
    Ok((fitted.preset(), fitted.json()))
}
