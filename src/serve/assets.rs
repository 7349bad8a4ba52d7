//! The files of the page.
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
    "app.js" "text/javascript; charset=utf-8",
    "stream.js" "text/javascript; charset=utf-8",
}

/// The file of that name.
pub(super) fn asset(name: &str) -> Option<Response> {
    let name = if name.is_empty() { "index.html" } else { name };
    let (_, kind, text) = ASSETS.iter().find(|(n, ..)| *n == name)?;
    Some(([(header::CONTENT_TYPE, *kind)], *text).into_response())
}
