//! Renders one picture on many machines: data that all of them need is prepared once, and each computes some rows.
use super::bands::near;
use super::job::Job;
use super::plan::{OutputPart, Planned, Planner, wanted};
use super::render::{Render, make_dir};
use super::sink::Sink;
use super::{Failure, RenderRequest, Session, located};
use crate::eval::{CancelToken, Neighbor, NodeStats, Observer, OverlapStore, Seal, Stored, code};
use crate::graph::Graph;
use crate::picture::{PartHeader, PartOf, PartPicture, PartWriter, is_overlap, is_whole};
use crate::value::{TILE, Window};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Maximum bytes of an overlap file if there is no store whose size bounds it.
const ROOM: u64 = 4 << 30;

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
            let planner = Planner { graph, keys: run.keys(), request, window };
            let render = Render::new(self, run, planner, observer, area);
            let pictures = render.pictures(&wanted)?;
            if let Some(export) = pictures.iter().find(|picture| matches!(picture.part, OutputPart::Export(_))) {
                let message = format!("`{}` is made for another program, with whole pictures", export.output.name);
                return Err(Failure::Usage(format!(
                    "{message}; name other outputs with --output, or leave --part out"
                )));
            }
            let leveled = |picture: &&Planned<'_>| picture.output.storage.mip && picture.format.has_mips();
            if let Some(picture) = pictures.iter().find(leveled) {
                let message = format!("`{}` has mip levels, which are made of whole pictures", picture.output.name);
                return Err(Failure::Usage(format!("{message}; write it without `mip`, or leave --part out")));
            }
            if let Some(picture) =
                pictures.iter().find(|picture| picture.output.storage.fit && picture.depth.is_integer())
            {
                let message = format!("`{}` has the range of the whole picture", picture.output.name);
                return Err(Failure::Usage(format!("{message}; state a range as numbers, or leave --part out")));
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
            let seal = Seal::new(code(&self.registry));
            let room = self.caches.store.as_ref().map_or(ROOM, |store| store.room());
            let (beside, neighbors) = Beside::new(graph, part, (&request.dir, stem), seal, room)?;
            let render = Render { neighbors, ..render };
            let jobs = render.made(pictures)?;
            for (picture, job) in header.pictures.iter_mut().zip(&jobs) {
                picture.spec = job.lines.is_none().then(|| render.spec(job));
            }
            render.write_part(&file, &header, &jobs)?;
            beside.done();
            report(false)
        })
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
            let planner = Planner { graph, keys: run.keys(), request, window };
            let render = Render::new(self, run, planner, observer, window);
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

/// The other parts near a part of a picture.
fn beside(part: PartOf) -> impl Iterator<Item = PartOf> {
    let others = (1..=part.count).map(move |number| PartOf { number, ..part });
    others.filter(move |other| near(part.number as usize, other.number as usize, part.count as usize))
}

/// The overlap files of a part and of the parts near it.
struct Beside<'p> {
    part: PartOf,
    dir: &'p Path,
    stem: &'p str,
    own: Option<Arc<OverlapStore>>,
}

impl<'p> Beside<'p> {
    /// Finds the neighbours of a part. Checks only once, here, which of them are complete: the overlap with a neighbour
    /// that is computed meanwhile is computed twice.
    fn new(
        graph: &Graph,
        part: PartOf,
        (dir, stem): (&'p Path, &'p str),
        seal: Seal,
        room: u64,
    ) -> Result<(Self, Vec<Neighbor>), Failure> {
        let own = OverlapStore::create(&dir.join(part.overlap_name(stem)), seal, room).ok().map(Arc::new);
        let this = Self { part, dir, stem, own };
        let mut neighbors = Vec::new();
        for other in beside(part) {
            let (window, is_pending) = (rows(graph, other)?, !this.is_there(other));
            let made = || OverlapStore::open(&this.overlap(other), seal).map(Arc::new);
            let store = if is_pending { this.own.clone() } else { made() };
            neighbors.extend(store.map(|store| Neighbor { window, store, is_pending }));
        }
        Ok((this, neighbors))
    }

    fn is_there(&self, part: PartOf) -> bool {
        self.dir.join(part.file_name(self.stem)).exists()
    }

    fn overlap(&self, part: PartOf) -> PathBuf {
        self.dir.join(part.overlap_name(self.stem))
    }

    /// Must be called when the part is complete. Publishes its overlap file if a neighbour is still missing, and
    /// removes overlap files that no part needs any more. Failures are ignored: the neighbours then compute the
    /// overlap.
    fn done(&self) {
        let is_used = |part: PartOf| beside(part).all(|other| self.is_there(other));
        if let Some(own) = self.own.as_ref().filter(|_| !is_used(self.part)) {
            let _ = own.publish();
        }
        // Includes the part's own file, since its neighbours may have been completed meanwhile.
        let used = beside(self.part).chain([self.part]).filter(|part| is_used(*part));
        for file in used.map(|part| self.overlap(part)).filter(|file| is_overlap(file)) {
            let _ = std::fs::remove_file(file);
        }
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
            self.bands(&rows, &mut sinks, &grid)?;
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
