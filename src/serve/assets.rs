//! Static files of the page.
use axum::http::header;
use axum::response::{IntoResponse, Response};

macro_rules! assets {
    ($($name:literal $kind:literal,)*) => {
        const ASSETS: &[(&str, &str, &str)] = &[$(($name, $kind, include_str!(concat!("page/", $name))),)*];
    };
}

assets! {
    "index.html" "text/html; charset=utf-8",
    "style.css" "text/css; charset=utf-8",
    "icon.svg" "image/svg+xml",
    "panels.css" "text/css; charset=utf-8",
    "app.js" "text/javascript; charset=utf-8",
    "bodies.js" "text/javascript; charset=utf-8",
    "box.js" "text/javascript; charset=utf-8",
    "camera.js" "text/javascript; charset=utf-8",
    "compare.js" "text/javascript; charset=utf-8",
    "control.js" "text/javascript; charset=utf-8",
    "connection.js" "text/javascript; charset=utf-8",
    "contact.js" "text/javascript; charset=utf-8",
    "controls.js" "text/javascript; charset=utf-8",
    "dom.js" "text/javascript; charset=utf-8",
    "drop.js" "text/javascript; charset=utf-8",
    "entry.js" "text/javascript; charset=utf-8",
    "environment.js" "text/javascript; charset=utf-8",
    "errors.js" "text/javascript; charset=utf-8",
    "export.js" "text/javascript; charset=utf-8",
    "facts.js" "text/javascript; charset=utf-8",
    "field.js" "text/javascript; charset=utf-8",
    "frames.js" "text/javascript; charset=utf-8",
    "graphs.js" "text/javascript; charset=utf-8",
    "inspector.js" "text/javascript; charset=utf-8",
    "latest.js" "text/javascript; charset=utf-8",
    "light.js" "text/javascript; charset=utf-8",
    "lit.js" "text/javascript; charset=utf-8",
    "looks.js" "text/javascript; charset=utf-8",
    "meshes.js" "text/javascript; charset=utf-8",
    "measure.js" "text/javascript; charset=utf-8",
    "minimap.js" "text/javascript; charset=utf-8",
    "net.js" "text/javascript; charset=utf-8",
    "nodes.js" "text/javascript; charset=utf-8",
    "objects.js" "text/javascript; charset=utf-8",
    "outputs.js" "text/javascript; charset=utf-8",
    "overlay.js" "text/javascript; charset=utf-8",
    "params.js" "text/javascript; charset=utf-8",
    "peek.js" "text/javascript; charset=utf-8",
    "photo.js" "text/javascript; charset=utf-8",
    "picture.js" "text/javascript; charset=utf-8",
    "settings.js" "text/javascript; charset=utf-8",
    "shaders.js" "text/javascript; charset=utf-8",
    "shapes.js" "text/javascript; charset=utf-8",
    "share.js" "text/javascript; charset=utf-8",
    "sheet.js" "text/javascript; charset=utf-8",
    "slots.js" "text/javascript; charset=utf-8",
    "staging.js" "text/javascript; charset=utf-8",
    "stream.js" "text/javascript; charset=utf-8",
    "marks.js" "text/javascript; charset=utf-8",
    "wire.js" "text/javascript; charset=utf-8",
    "wires.js" "text/javascript; charset=utf-8",
    "strokes.js" "text/javascript; charset=utf-8",
    "tabs.js" "text/javascript; charset=utf-8",
    "textures.js" "text/javascript; charset=utf-8",
    "tone.js" "text/javascript; charset=utf-8",
    "values.js" "text/javascript; charset=utf-8",
    "viewer.js" "text/javascript; charset=utf-8",
}

/// Returns the static file `name`.
pub(super) fn asset(name: &str) -> Option<Response> {
    let name = if name.is_empty() { "index.html" } else { name };
    let (_, kind, text) = ASSETS.iter().find(|(n, ..)| *n == name)?;
    Some(([(header::CONTENT_TYPE, *kind)], *text).into_response())
}
