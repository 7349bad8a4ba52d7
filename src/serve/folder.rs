//! The graphs in the folder of the graph, between which a page can switch.
use super::app::{ApiError, App, Wish, aside};
use axum::body::Bytes;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Json;
use serde::Deserialize;
use serde_json::{Value as Data, json};
use shibo_graph::syntax::Tree;
use std::fs;
use std::io::Read;
use std::path::Path;

/// The most files of a folder that are listed.
const MOST: usize = 500;
/// The most files that are looked into.
const READ: usize = 4 * MOST;
/// Larger files are not listed, in bytes.
const LARGEST: u64 = 1 << 20;

/// Request: the name of a file in the list.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Open {
    name: String,
}

/// Returns the names of the graphs in the folder, and that of the shown one.
pub(super) async fn graphs(State(app): State<App>) -> Result<Json<Data>, ApiError> {
    let path = app.stage.path();
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
    let names = aside(move || names(folder(&path))).await?;
    Ok(Json(json!({ "names": names, "shown": name })))
}

/// Shows another graph of the folder. The name is compared with the list and never used as a path by itself.
pub(super) async fn open(State(app): State<App>, body: Bytes) -> Result<StatusCode, ApiError> {
    let Open { name } = serde_json::from_slice(&body).map_err(|error| ApiError::Bad(error.to_string()))?;
    let path = app.stage.path();
    let listed = aside({
        let path = path.clone();
        move || names(folder(&path))
    });
    let found = listed.await?.into_iter().find(|listed| *listed == name).ok_or(ApiError::Unknown)?;
    if app.wish(Wish::Open(path.with_file_name(found))) { Ok(StatusCode::ACCEPTED) } else { Err(ApiError::Busy) }
}

/// The folder of a file.
fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The names of the files in a folder that are graphs: their top level has `nodes`.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.retain(|name| name.ends_with(".ron"));
    names.sort();
    names.truncate(READ);
    names.into_iter().filter(|name| is_graph(&folder.join(name))).take(MOST).collect()
}

fn is_graph(path: &Path) -> bool {
    let file = fs::metadata(path).is_ok_and(|found| found.is_file() && found.len() <= LARGEST);
    let mut text = String::new();
    let read = file && fs::File::open(path).and_then(|file| file.take(LARGEST).read_to_string(&mut text)).is_ok();
    read && text.contains("nodes") && Tree::parse(text).value().is_some_and(|root| root.entry("nodes").is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_graphs_only() {
        let dir = tempfile::tempdir().unwrap();
        for (name, text) in [
            ("b.ron", "(version: 1, nodes: {})"),
            ("a.ron", "// nodes\n(version: 1, nodes: { \"x\": Perlin(size: 2) })"),
            ("palette.ron", "(nodes_of: 3)"),
            ("notes.txt", "(nodes: {})"),
            ("broken.ron", "(nodes: { \"x\": "),
        ] {
            fs::write(dir.path().join(name), text).unwrap();
        }
        fs::create_dir(dir.path().join("folder.ron")).unwrap();
        assert_eq!(names(dir.path()), ["a.ron", "b.ron", "broken.ron"]);
        assert_eq!(folder(Path::new("a.ron")), Path::new("."));
    }
}
