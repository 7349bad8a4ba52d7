//! A photograph beside the picture: compared with it in words, and fitted (`shibo fit`). It stays in memory. Only the
//! preset that the user keeps is written, by a change of the file.
use super::app::{ApiError, App, Query2, aside};
use super::edits::tried;
use super::stage::Stage;
use crate::library;
use axum::body::{Bytes, to_bytes};
use axum::extract::{Request as HttpRequest, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Json, Response};
use serde::Deserialize;
use serde_json::{Value as Data, json};
use shibo_bridge::scene::{Scene, lock};
use shibo_bridge::{GraphText, Tools};
use shibo_engine::eval::CancelToken;
use shibo_fit::graph::{Bench, Fitting, Preset, Refused};
use shibo_fit::page::{self, Held, MOST_BYTES, picture, progress, too_large, why};
use shibo_picture::contained;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

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
    let large = |_| (StatusCode::PAYLOAD_TOO_LARGE, too_large()).into_response();
    let bytes = to_bytes(request.into_body(), MOST_BYTES).await.map_err(large)?;
    if bytes.is_empty() {
        app.stage.photographs.hold(None);
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    let held = aside(move || Held::read(&bytes, &name)).await.map_err(IntoResponse::into_response)?;
    let held = held.map_err(|why| ApiError::Failed(why).into_response())?;
    let answer = json!({ "name": held.name(), "size": held.size() });
    app.stage.photographs.hold(Some(held));
    Ok(Json(answer).into_response())
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
    let found = aside(move || held.compared(&picture, &scene, mm)).await?;
    Ok(Json(found.map_err(ApiError::Failed)?).into_response())
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
        let made = match made {
            Ok(made) => made.map_err(|refused| why(&refused)),
            Err(said) => Err(format!("there is a defect: {said}")),
        };
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
) -> Result<(Preset, Data), Refused> {
    let values = stage.values();
    let (request, photo) = held.asked(page::Wish { preset: values.preset, set: values.set, mm: wish.mm })?;
    let tools: Tools = library::tools();
    let bench = Bench { tools: &tools, session: &stage.session, cancel };
    let path = stage.path();
    let (text, _) = tried(&path, text, stage.session.registry(), &stage.values(), &stage.unsaved());
    let text = text.into_owned();
    let file = GraphText { path, text };
    let fitting = Fitting::of(bench, &file, &scene.graph, &photo, &request)?;
    let last = Mutex::new(Instant::now());
    let fitted = fitting.run(&|done, status| {
        if !is_shown(stage, wish) {
            cancel.cancel();
        }
        let mut last = lock(&last);
        if last.elapsed() >= PROGRESS {
            *last = Instant::now();
            let mut news = progress(&fitting, done, status);
            news.extend([("id".to_owned(), json!(id)), ("state".to_owned(), json!("running"))]);
            stage.tell("fit", &news.into());
        }
    })?;
    Ok((fitted.preset(), fitted.json()))
}
