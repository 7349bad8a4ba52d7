//! Renders one picture on many machines: data that all of them need is prepared once, and each computes some rows.
use super::bands::near;
use super::job::Job;
use super::plan::{OutputPart, Planned, wanted};
use super::render::{Render, make_dir};
use super::sink::Sink;
use super::{Failure, RenderRequest, Session, located};
use crate::eval::{CancelToken, Neighbor, NodeStats, Observer, Shelf, Stored, code};
use crate::graph::Graph;
use crate::picture::{PartHeader, PartOf, PartPicture, PartWriter, is_whole};
use crate::value::{Key, TILE, Window};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// The result of rendering a part.
#[derive(Clone, Debug)]
pub struct PartReport {
    /// The file of the part.
    pub file: PathBuf,
    /// True if the complete file existed before.
    pub known: bool,
    /// The work done for each node.
    pub nodes: Vec<NodeStats>,
}

/// The result of preparing a render.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The results that were stored, in the order of the graph.
    pub stored: Vec<Stored>,
    /// The work done for each node.
    pub nodes: Vec<NodeStats>,
}

impl Session {
    /// Renders one of several parts of the outputs of `graph` into a file in `request.dir`, named after `stem`. The
    /// function
    /// [`join`](crate::picture::join) joins all parts. A complete part is not rendered again.
    ///
    /// # Errors
    /// Errors of the graph, at their places; outputs that need whole pictures.
    pub fn render_part(
        &self,
        graph: &Graph,
        request: &RenderRequest,
        (part, stem): (PartOf, &str),
        cancel: &CancelToken,
        observer: &dyn Observer,
    ) -> Result<PartReport, Failure> {
        let wanted = wanted(graph, &request.outputs)?;
        let area = rows(graph, part)?;
        make_dir(&request.dir)?;
        self.run(graph, cancel, observer, |run| {
            let window = Window::full(graph.canvas.resolution);
            let mut render = Render { area, ..Render::new(self, run, (graph, request), observer, window) };
            let pictures = render.pictures(&wanted)?;
            let refused = pictures.iter().find_map(|picture| Some((picture, needs_whole(picture)?)));
            if let Some((picture, [reason, remedy])) = refused {
                let name = &picture.output.name;
                return Err(Failure::Usage(format!("`{name}` {reason}; {remedy}, or leave --part out")));
            }
            let file = request.dir.join(part.file_name(stem));
            let mut header = render.header(part, stem, &pictures);
            let report = |known: bool| {
                let nodes = run.stats_for(wanted.iter().map(|(output, _)| *output));
                Ok(PartReport { file: file.clone(), known, nodes })
            };
            if is_whole(&file, &header) {
                return report(true);
            }
            render.neighbors = self.neighbors(graph, &header)?;
            let jobs = render.made(pictures)?;
            for (picture, job) in header.pictures.iter_mut().zip(&jobs) {
                picture.spec = job.lines.is_none().then(|| render.spec(job));
            }
            render.write_part(&file, &header, &jobs)?;
            if let Some(store) = &self.caches.store {
                store.put(Shelf::Tiles, handed_over(&header, part.number), &[], Duration::ZERO, &|| false);
            }
            report(false)
        })
    }

    /// The parts near the part with this header, if there is a store through which they hand over their overlap. Checks
    /// only once, here, which of them are complete: the overlap with a neighbour that is computed meanwhile is computed
    /// twice.
    fn neighbors(&self, graph: &Graph, header: &PartHeader) -> Result<Vec<Neighbor>, Failure> {
        let Some(store) = &self.caches.store else { return Ok(Vec::new()) };
        let PartOf { number: own, count } = header.part;
        let neighbor = |number: u32| {
            let window = rows(graph, PartOf { number, count })?;
            let is_pending = store.get(Shelf::Tiles, handed_over(header, number)).is_none();
            Ok(Neighbor { window, store: store.clone(), is_pending })
        };
        (1..=count).filter(|other| near(own as usize, *other as usize, count as usize)).map(neighbor).collect()
    }

    /// Computes everything that pictures of `graph` need before their first pixel, so that the caches contain it.
    ///
    /// # Errors
    /// Errors of the graph, at their places.
    pub fn prepare(
        &self,
        graph: &Graph,
        request: &RenderRequest,
        cancel: &CancelToken,
        observer: &dyn Observer,
    ) -> Result<Prepared, Failure> {
        let wanted = wanted(graph, &request.outputs)?;
        self.run(graph, cancel, observer, |run| {
            let window = Window::full(graph.canvas.resolution);
            let render = Render::new(self, run, (graph, request), observer, window);
            let pictures = render.pictures(&wanted)?;
            let jobs = render.made(pictures)?;
            let grid = graph.canvas.grid(graph.canvas.resolution);
            for (_, field) in jobs.iter().flat_map(|job| &job.fields) {
                run.prepare(field, &grid).map_err(|stop| located(run, graph, stop))?;
            }
            Ok(Prepared { stored: run.stored(), nodes: run.stats_for(wanted.iter().map(|(output, _)| *output)) })
        })
    }
}

/// The rows of a part, in whole rows of tiles.
fn rows(graph: &Graph, part: PartOf) -> Result<Window, Failure> {
    let size = graph.canvas.resolution;
    let tiles = size.y.div_ceil(TILE);
    if part.number == 0 || part.number > part.count {
        return Err(Failure::Usage(format!("there is no part {part}; parts are numbered from 1")));
    }
    if part.count > tiles {
        let message = format!("the picture has {tiles} rows of tiles, {TILE} pixels each, so at most as many parts");
        return Err(Failure::Usage(format!("{message}; {} are too many", part.count)));
    }
    let own = part.of(tiles);
    let (y, end) = (own.start * TILE, (own.end * TILE).min(size.y));
    Ok(Window { x: 0, y: y.cast_signed(), width: size.x, height: end - y })
}

/// The key of an empty entry: part `number` of the pictures in a header has handed over its overlap.
fn handed_over(header: &PartHeader, number: u32) -> Key {
    let pictures = header.pictures.iter().flat_map(|picture| [picture.file.as_bytes(), picture.key.as_bytes()]);
    let numbers = [number, header.part.count].map(u32::to_le_bytes);
    Key::of("part", &pictures.chain([numbers.as_flattened()]).collect::<Vec<_>>())
}

/// The reason why a picture cannot be made in parts, and the remedy.
fn needs_whole(picture: &Planned<'_>) -> Option<[&'static str; 2]> {
    let storage = picture.output.storage;
    match picture.part {
        OutputPart::Export(_) => {
            Some(["is made for another program, with whole pictures", "name other outputs with --output"])
        }
        _ if storage.mip && picture.format.has_mips() => {
            Some(["has mip levels, which are made of whole pictures", "write it without `mip`"])
        }
        _ if storage.fit && picture.depth.is_integer() => {
            Some(["has the range of the whole picture", "state a range as numbers"])
        }
        _ => None,
    }
}

impl<'r> Render<'r, '_> {
    /// The header of a part of these pictures, without their encodings, which are not known yet.
    fn header(&self, part: PartOf, stem: &str, pictures: &[Planned<'r>]) -> PartHeader {
        let graph = self.planner.graph;
        let parameters: Vec<String> = graph.params.iter().map(|p| format!("{}: {}", p.name, p.value)).collect();
        let name = |picture: &Planned<'_>| picture.path.file_name().map(|name| name.to_string_lossy().into_owned());
        let of = |picture: &Planned<'_>| PartPicture {
            file: name(picture).unwrap_or_default(),
            key: picture.key.to_string(),
            spec: None,
        };
        PartHeader {
            version: env!("CARGO_PKG_VERSION").into(),
            build: code(&self.session.registry).to_string(),
            graph: stem.into(),
            parameters: parameters.join(", "),
            seed: graph.canvas.seed,
            size: graph.canvas.resolution.to_array(),
            part,
            rows: [self.area.y.cast_unsigned(), self.area.height],
            pictures: pictures.iter().map(of).collect(),
        }
    }

    fn write_part(&self, file: &Path, header: &PartHeader, jobs: &[Job<'_>]) -> Result<(), Failure> {
        let failed = |error: crate::picture::WriteError| Failure::File(error.to_string());
        let graph = self.planner.graph;
        let grid = graph.canvas.grid(graph.canvas.resolution);
        let (numbers, rows): (Vec<usize>, Vec<&Job<'_>>) =
            jobs.iter().enumerate().filter(|(_, job)| job.lines.is_none()).unzip();
        self.ready(&rows, &grid)?;
        let writer = Arc::new(Mutex::new(PartWriter::create(file, header).map_err(failed)?));
        let sink = |number| Sink::Part(writer.clone(), number);
        let mut sinks: Vec<Sink> = numbers.into_iter().map(sink).collect();
        if !rows.is_empty() {
            drop(self.bands(&rows, &mut sinks, &grid)?);
        }
        drop(sinks);
        let writer = Arc::into_inner(writer).expect("the sinks, the only other owners, are gone");
        let mut writer = writer.into_inner().unwrap_or_else(PoisonError::into_inner);
        if header.part.number == 1 {
            for (number, job) in jobs.iter().enumerate() {
                let Some(segments) = &job.lines else { continue };
                let bytes = self.drawn(job, segments, &grid)?;
                writer.put(number, &bytes).map_err(failed)?;
            }
        }
        writer.finish().map_err(failed)
    }
}
