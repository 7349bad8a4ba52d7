//! Makes the pictures.
use super::sketch::{self, SIDE};
use super::{Made, Subject, Wish};
use crate::environment;
use crate::library;
use glam::UVec2;
use shibo_bridge::scene::{Preview, Scene, Store};
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Session, Settings};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_picture::{Conversion, ReadLimits, header, read};
use shibo_value::linear_to_srgb;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tempfile::TempDir;

/// Memory for results in bytes.
const MEMORY: u64 = 512 << 20;
/// Larger pictures are not read for a hover, in pixels.
const PIXELS: u64 = 64 << 20;

/// A session and its pictures.
pub(super) struct Studio {
    cache_dir: Option<PathBuf>,
    session: Option<Session>,
    store: Store,
    /// Folder with the files that examples of manuals read.
    examples: Option<TempDir>,
}

impl Studio {
    /// Creates a studio; sessions start when first used.
    pub(super) fn new(cache_dir: Option<PathBuf>) -> Self {
        Self { cache_dir, session: None, store: Store::new(MEMORY), examples: None }
    }

    /// Makes a picture; `None` if that fails or is cancelled.
    pub(super) fn make(&mut self, wish: &Wish, cancel: &CancelToken) -> Option<Made> {
        match &wish.subject {
            Subject::Kind(kind) => self.kind(kind, cancel),
            Subject::Node(path, node) => {
                let session = self.session()?;
                let graph = load(session, path, wish.text.as_deref()?, wish)?;
                self.node(graph, node, cancel)
            }
            Subject::File(path, _) => file(path),
        }
    }

    fn session(&mut self) -> Option<&Session> {
        if self.session.is_none() {
            // Half of the cores are left to the editor.
            let threads = std::thread::available_parallelism().map_or(1, |n| n.get().div_ceil(2));
            let cache_dir = self.cache_dir.clone();
            let settings = Settings { threads, memory: MEMORY, cache_dir, ..Settings::default() };
            self.session = Session::new(library::registry(), &settings).ok();
        }
        self.session.as_ref()
    }

    /// Folder of the examples with their files.
    fn examples(&mut self) -> Option<&Path> {
        if self.examples.is_none() {
            let folder = tempfile::tempdir().ok()?;
            for (name, bytes) in library::EXAMPLE_FILES {
                std::fs::write(folder.path().join(name), bytes).ok()?;
            }
            self.examples = Some(folder);
        }
        self.examples.as_ref().map(TempDir::path)
    }

    /// Picture of the example in a kind's manual.
    fn kind(&mut self, kind: &str, cancel: &CancelToken) -> Option<Made> {
        let path = self.examples()?.join("example.ron");
        let session = self.session()?;
        let doc = &session.registry().info(kind)?.doc;
        let example = doc.split("```ron\n").nth(1)?.split("```").next().filter(|e| e.contains("\"example\""))?;
        let canvas = format!("canvas: (size_mm: 40, resolution: {SIDE}, tile: Both, seed: 1)");
        let text = format!("(version: 1, {canvas}, nodes: {{\n{example}\n}})");
        let wish = Wish::new(Subject::Kind(kind.to_owned()));
        let graph = load(session, &path, &text, &wish)?;
        let made = self.node(graph, "example", cancel)?;
        Some(Made { about: String::new(), ..made })
    }

    /// Picture of a node, or `node.port`, of a graph.
    fn node(&mut self, graph: Graph, node: &str, cancel: &CancelToken) -> Option<Made> {
        let target = target(&graph, node)?;
        self.session()?;
        let session = self.session.as_ref()?;
        let keys = session.keys(&graph).ok()?;
        let scene = Arc::new(Scene::new(0, String::new(), graph, keys));
        let target = scene.target(&target)?;
        let looked = session.look(&scene.graph, &scene.keys, cancel, &Silent, |look| {
            let value = look.value(target.node, target.output)?;
            let bytes = value.as_ref().filter(|value| value.field().is_none()).map(|value| value.bytes());
            let png = match scene.sight(look, &target)? {
                Some(Preview::Field(field, manner)) => {
                    let size = scene.size(SIDE);
                    Some(scene.picture(look, &self.store, &target, (&field, manner), size)?.png.to_vec())
                }
                Some(Preview::Pixels(pixels)) => Some(scene.pixels(&self.store, &target, &pixels, SIDE).png.to_vec()),
                Some(Preview::Object(_, Some(sketch))) => {
                    sketch::draw(&sketch, scene.graph.canvas.size_mm).and_then(|p| png(&p, UVec2::splat(SIDE), 1))
                }
                _ => None,
            };
            let seconds = look.stats().get(target.node.index()).map(|stats| stats.seconds);
            Ok((png, bytes, seconds))
        });
        let (png, bytes, seconds) = looked.ok()?;
        let mut about = Vec::new();
        about.extend(bytes.map(size));
        about.extend(
            seconds.filter(|seconds| *seconds >= 1e-4).map(|s| format!("{:.1} ms for this picture", 1000.0 * s)),
        );
        Some(Made { png, about: about.join(", ") })
    }
}

/// Formats a number of bytes.
fn size(bytes: usize) -> String {
    match bytes {
        0..10_240 => format!("{bytes} bytes"),
        10_240..10_485_760 => format!("{} KiB", bytes >> 10),
        _ => format!("{} MiB", bytes >> 20),
    }
}

fn load(session: &Session, path: &Path, text: &str, wish: &Wish) -> Option<Graph> {
    let options = LoadOptions {
        import_paths: environment::import_paths().to_vec(),
        overlay: wish.open.clone(),
        ..LoadOptions::default()
    };
    load_text(path, text, session.registry(), &options).graph
}

/// Target of `node` or `node.port`; for a sub-graph, the node that makes the output.
fn target(graph: &Graph, node: &str) -> Option<String> {
    let (name, port) = match node.split_once('.') {
        Some((name, port)) => (name, Some(port)),
        None => (node, None),
    };
    if let Some(found) = graph.uses.iter().find(|found| found.name == name) {
        let (_, node, output) = match port {
            Some(port) => found.outputs.iter().find(|(name, ..)| name == port)?,
            None => found.outputs.first()?,
        };
        let node = &graph.nodes[*node];
        let output = node.node.outputs().get(*output)?;
        return Some(format!("@{}:{}", node.name, output.name));
    }
    Some(port.map_or(format!("@{name}"), |port| format!("@{name}:{port}")))
}

/// Thumbnail of a picture file.
fn file(path: &Path) -> Option<Made> {
    let limits = ReadLimits { max_pixels: PIXELS, ..ReadLimits::default() };
    let conversion = Conversion::of_file(&header(path).ok()?).0;
    let mut picture = read(path, &limits).ok()?;
    conversion.apply(&mut picture);
    let longest = picture.width.max(picture.height);
    let step = longest.div_ceil(SIDE).max(1);
    let size = UVec2::new(picture.width.div_ceil(step), picture.height.div_ceil(step));
    let channels = usize::from(picture.data_channels()).min(3);
    let channels = if channels == 2 { 1 } else { channels.max(1) };
    let mut pixels = Vec::with_capacity((size.x * size.y) as usize * channels);
    for y in 0..size.y {
        for x in 0..size.x {
            let at = ((y * step) * picture.width + x * step) as usize;
            for channel in 0..channels {
                let value = picture.planes[channel * picture.pixels() + at];
                let is_light = channels == 3 || picture.source.is_float();
                let shown = if is_light { linear_to_srgb(value.max(0.0)) } else { value };
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a byte")]
                pixels.push((shown.clamp(0.0, 1.0) * 255.0).round() as u8);
            }
        }
    }
    Some(Made { png: png(&pixels, size, channels), about: String::new() })
}

/// Encodes bytes with one or three channels as PNG.
fn png(pixels: &[u8], size: UVec2, channels: usize) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, size.x, size.y);
    encoder.set_color(if channels == 1 { png::ColorType::Grayscale } else { png::ColorType::Rgb });
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().ok()?;
    writer.write_image_data(pixels).ok()?;
    writer.finish().ok()?;
    Some(out)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
    use super::*;

    #[test]
    fn every_kind_has_a_picture() {
        let mut studio = Studio::new(None);
        let kinds: Vec<String> = library::registry().kinds().map(str::to_owned).collect();
        let made = |kind: &String| {
            let made = studio.make(&Wish::new(Subject::Kind(kind.clone())), &CancelToken::default());
            made.is_some_and(|made| made.png.is_some())
        };
        let (with, without): (Vec<_>, Vec<_>) = kinds.into_iter().partition(made);
        assert!(with.len() > 100);
        assert_eq!(without, Vec::<String>::new());
    }
}
