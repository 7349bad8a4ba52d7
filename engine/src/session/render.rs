//! Renders the outputs of a graph to picture files.
use super::fitted::Fitted;
use super::job::{Job, files};
use super::plan::{OutputPart, Planned, Planner, Wanted, decode_channels, encode_channels, wanted};
use super::sink::Sink;
use super::storage::{self, encoding};
use super::warned::{self, FileReport};
use super::{Failure, Session, located};
use crate::diagnostics::{Code, Diagnostic, Problem, Span};
use crate::eval::{CancelToken, Event, Fields, Gathered, Neighbor, NodeStats, Observer, Run, Shelf, Warnings};
use crate::export::{SimpleShape, Told};
use crate::graph::{ExportMesh, Graph, GraphOutput};
use crate::picture::{
    AtomicFile, Compression, Depth, Drawing, Encoding, Format, PictureSpec, WriteError, Writer,
    remove_stale_temporaries, svg,
};
use crate::value::{Channel, Field, Grid, Key, Renders, Segments, TILE, Value, Window};
use glam::DVec2;
use petgraph::graph::NodeIndex;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The outputs to render, and the form of their files.
#[derive(Clone, Debug, Default)]
pub struct RenderRequest {
    /// The folder for the files; created if needed.
    pub dir: PathBuf,
    /// Prefix of all file names.
    pub prefix: String,
    /// Outputs, as `NAME` or, for a material, `NAME.CHANNEL`; all outputs if empty.
    pub outputs: Vec<String>,
    /// Region of the picture to render: x, y, width, height in pixels.
    pub region: Option<[u32; 4]>,
    /// Format of all files; overrides the graph.
    pub format: Option<Format>,
    /// Sample type of all files; overrides the graph.
    pub depth: Option<Depth>,
    /// Dither values that are rounded to integers.
    pub dither: bool,
    /// Prefer small files over short encoding time.
    pub best_compression: bool,
    /// Write all channels of a material into one EXR file.
    pub combined: bool,
    /// This is the only render of the session: tiles that it will not read again are not kept in memory.
    pub once: bool,
}

/// The result of a render.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The files, in the order of the graph's outputs.
    pub files: Vec<PathBuf>,
    /// Figures of files, such as the number of triangles of a body.
    pub notes: Vec<(PathBuf, String)>,
    /// The work done for each node.
    pub nodes: Vec<NodeStats>,
}

impl Session {
    /// Renders outputs of `graph` to files. Either all files are written, or the previous files remain.
    ///
    /// # Errors
    /// Errors of the graph, at their places.
    pub fn render(
        &self,
        graph: &Graph,
        request: &RenderRequest,
        cancel: &CancelToken,
        observer: &dyn Observer,
    ) -> Result<Report, Failure> {
        let wanted = wanted(graph, &request.outputs)?;
        let window = window(graph, request)?;
        make_dir(&request.dir)?;
        self.run(graph, cancel, observer, |run| {
            let render = Render::new(self, run, (graph, request), observer, window);
            let pictures = render.pictures(&wanted)?;
            let planned: Vec<PathBuf> = pictures.iter().map(|p| p.path.clone()).collect();
            let (jobs, copies) = render.jobs(pictures)?;
            let notes = render.write(&jobs)?;
            for copy in copies {
                let path = copy.target().to_owned();
                copy.commit().map_err(|error| unwritten(&path, &error))?;
            }
            Ok(Report {
                files: files(&planned, &jobs),
                notes,
                nodes: run.stats_for(wanted.iter().map(|(output, _)| *output)),
            })
        })
    }
}

pub(super) fn window(graph: &Graph, request: &RenderRequest) -> Result<Window, Failure> {
    let size = graph.canvas.resolution;
    let Some([x, y, width, height]) = request.region else { return Ok(Window::full(size)) };
    let fits = |at: u32, length: u32, whole: u32| length > 0 && at.checked_add(length).is_some_and(|end| end <= whole);
    if fits(x, width, size.x) && fits(y, height, size.y) {
        return Ok(Window { x: x.cast_signed(), y: y.cast_signed(), width, height });
    }
    let message =
        format!("the region {x},{y},{width},{height} does not lie within the picture of {} × {}", size.x, size.y);
    Err(Failure::Usage(message))
}

/// Creates the folder of a request if it does not exist.
pub(super) fn make_dir(dir: &std::path::Path) -> Result<(), Failure> {
    if cfg!(target_family = "wasm") {
        // Files in memory need no folder.
        return Ok(());
    }
    let dir = if dir.as_os_str().is_empty() { std::path::Path::new(".") } else { dir };
    std::fs::create_dir_all(dir)
        .map_err(|e| Failure::File(format!("cannot make the folder `{}`: {e}", dir.display())))?;
    // Remove temporary files that killed processes left.
    let _ = remove_stale_temporaries(dir);
    Ok(())
}

/// One render.
pub(super) struct Render<'r, 'g> {
    pub(super) session: &'r Session,
    pub(super) run: &'r Run<'g>,
    pub(super) planner: Planner<'r>,
    pub(super) observer: &'r dyn Observer,
    /// The pixels to compute: whole pictures, or some of their rows.
    pub(super) area: Window,
    /// Parts of the pictures that other processes compute.
    pub(super) neighbors: Vec<Neighbor>,
}

impl<'r, 'g> Render<'r, 'g> {
    /// Renders `window` of the pictures of a graph, without neighbours.
    pub(super) fn new(
        session: &'r Session,
        run: &'r Run<'g>,
        (graph, request): (&'r Graph, &'r RenderRequest),
        observer: &'r dyn Observer,
        window: Window,
    ) -> Self {
        let planner = Planner { graph, keys: run.keys(), request, window };
        Self { session, run, planner, observer, area: window, neighbors: Vec::new() }
    }
}

impl<'r> Render<'r, '_> {
    /// Plans the pictures of the requested outputs.
    pub(super) fn pictures(&self, wanted: &[Wanted<'r>]) -> Result<Vec<Planned<'r>>, Failure> {
        let mut pictures = Vec::new();
        for (output, channel) in wanted {
            for (part, key) in self.parts(output, *channel)? {
                pictures.push(self.planner.picture(output, part, key)?);
            }
        }
        Ok(pictures)
    }

    /// The parts of an output that become pictures, with keys that identify their content.
    fn parts(&self, output: &GraphOutput, channel: Option<Channel>) -> Result<Vec<(OutputPart, Key)>, Failure> {
        let key = self.planner.keys.output(output.node, output.output);
        if let Some(export) = output.export.as_ref().filter(|_| channel.is_none()) {
            let mesh = match output.mesh {
                None => Key::of(SimpleShape::Plane.name(), &[]),
                Some(ExportMesh::Simple(shape)) => Key::of(shape.name(), &[]),
                Some(ExportMesh::Atlas { node, output }) => self.planner.keys.output(node, output),
            };
            // A file contains the options of its export, and the names of packed files.
            let (said, stem) = (format!("{:?}", export.target), self.planner.stem(output));
            let fields = export.fields.iter().map(|(name, (node, of))| (*name, self.planner.keys.output(*node, *of)));
            let fields: Vec<_> = fields.collect();
            let mut parts = vec![&key.as_bytes()[..], mesh.as_bytes(), said.as_bytes(), stem.as_bytes()];
            parts.extend(fields.iter().flat_map(|(name, key)| [name.as_bytes(), key.as_bytes()]));
            return Ok(vec![(OutputPart::Export(export.clone()), Key::of("export", &parts))]);
        }
        match output.ty.renders() {
            Some(Renders::Channels) => {}
            Some(Renders::Lines) => return Ok(vec![(OutputPart::Lines, key)]),
            Some(Renders::Field(_)) | None => return Ok(vec![(OutputPart::Field, key)]),
        }
        if channel.is_none() && (output.combined || self.planner.request.combined) {
            return Ok(vec![(OutputPart::All, key)]);
        }
        let mut channels = self.channels(output.node, output.output)?;
        if let Some(channel) = channel {
            channels.retain(|c| c.0 == channel);
            if channels.is_empty() {
                channels.extend(channel.default_field().key().map(|key| (channel, key)));
                self.warn_default(output, channel);
            }
        }
        Ok(channels.into_iter().map(|(channel, key)| (OutputPart::Channel(channel), key)).collect())
    }

    fn warn_default(&self, output: &GraphOutput, channel: Channel) {
        let message = format!(
            "the material has no channel `{}`; its picture shows the default, {}",
            channel.name(),
            channel.default_text()
        );
        let warning = Diagnostic::new(Code::Advice, output.span, message);
        self.observer.event(Event::Warning(warning.as_warning()));
    }

    /// The channels of a material and their keys. They are stored, so that cached files can be found without evaluating
    /// the material.
    fn channels(&self, node: NodeIndex, output: usize) -> Result<Vec<(Channel, Key)>, Failure> {
        let key = Key::of("channels", &[self.planner.keys.output(node, output).as_bytes()]);
        let store = self.session.caches.store.as_ref();
        if let Some(known) = store.and_then(|store| decode_channels(&store.get(Shelf::Channels, key)?)) {
            return Ok(known);
        }
        let values = self.run.values(&[(node, output)])?;
        let Some(Value::Material(material)) = values.first() else { return Ok(Vec::new()) };
        let keyed = |(channel, field): &(Channel, Field)| Some((*channel, field.key()?));
        let channels: Vec<_> = material.channels().iter().filter_map(keyed).collect();
        if let Some(store) = store {
            // Always stored: otherwise a second run would have to evaluate the nodes.
            store.put(Shelf::Channels, key, &encode_channels(&channels), Duration::ZERO, &|| false);
        }
        Ok(channels)
    }

    /// Jobs for files that are not cached, and copies of the others. Copies get their names after all jobs are done,
    /// because a job may refuse its values.
    fn jobs(&self, pictures: Vec<Planned<'r>>) -> Result<(Vec<Job<'r>>, Vec<AtomicFile>), Failure> {
        let (mut missing, mut copies) = (Vec::new(), Vec::new());
        for planned in pictures {
            // For an export of several files, or of a body, the cache holds only the tiles of its fields.
            let cached = match &planned.part {
                OutputPart::Export(export) => export.target.plan().cached,
                _ => true,
            };
            let copied = match &self.session.caches.store {
                Some(store) if cached => {
                    let copy = AtomicFile::create(&planned.path).and_then(|copy| {
                        Ok(warned::get(&**store, planned.key, copy.temporary())?.map(|found| (copy, found)))
                    });
                    copy.map_err(|error| unwritten(&planned.path, &error))?
                }
                _ => None,
            };
            match copied {
                Some((copy, report)) => {
                    self.run.note_kept(&report.found);
                    report.written.iter().for_each(|written| self.warn_clipped(&planned, written));
                    copies.push(copy);
                }
                None => missing.push(planned),
            }
        }
        Ok((self.made(missing)?, copies))
    }

    /// Evaluates pictures to jobs with fields.
    pub(super) fn made(&self, missing: Vec<Planned<'r>>) -> Result<Vec<Job<'r>>, Failure> {
        let wanted: Vec<_> = missing.iter().map(|p| (p.output.node, p.output.output)).collect();
        let values = self.run.values(&wanted)?;
        missing.into_iter().zip(values).map(|(planned, value)| self.job(planned, &value)).collect()
    }

    /// Computes and writes the files; returns figures of some of them.
    fn write(&self, jobs: &[Job<'_>]) -> Result<Vec<(PathBuf, String)>, Failure> {
        let mut notes = Vec::new();
        if jobs.is_empty() {
            return Ok(notes);
        }
        let graph = self.planner.graph;
        let grid = graph.canvas.grid(graph.canvas.resolution);
        let (lines, jobs): (Vec<&Job<'_>>, Vec<&Job<'_>>) = jobs.iter().partition(|job| job.lines.is_some());
        self.ready(&jobs, &grid)?;
        let mut writers = jobs.iter().map(|job| self.sink(job)).collect::<Result<Vec<_>, _>>()?;
        let of_values = if jobs.is_empty() { Vec::new() } else { self.bands(&jobs, &mut writers, &grid)? };
        let found: Vec<Warnings> = jobs.iter().zip(&of_values).map(|(job, values)| self.found(job, values)).collect();
        // All files are complete before the first one gets its name.
        for ((job, writer), found) in jobs.iter().zip(&mut writers).zip(&found) {
            let stop = || self.run.is_cancelled();
            let findings = found.iter().map(|warning| warning.problem().clone()).collect();
            let made = writer.complete(findings, &stop);
            made.map_err(|error| if stop() { Failure::Cancelled } else { unfit(error, job) })?;
        }
        for (job, writer) in jobs.iter().zip(&writers) {
            let Told { note, advice } = writer.told();
            notes.extend(note.map(|note| (job.planned.path.clone(), note)));
            for problem in advice {
                let span = place(&problem, job);
                let warning = Diagnostic::from_problem(problem, span);
                self.observer.event(Event::Warning(warning.as_warning()));
            }
        }
        for (job, segments) in lines.iter().filter_map(|job| Some((job, job.lines.as_ref()?))) {
            self.write_lines(job, segments, &grid)?;
        }
        for ((job, writer), found) in jobs.iter().zip(writers).zip(found) {
            let written = writer.finish()?;
            written.iter().for_each(|written| self.warn_clipped(&job.planned, written));
            self.keep(job, &FileReport { found, written });
        }
        Ok(notes)
    }

    /// The warnings about a job: about its output and the results that it was made of, and about the values of its
    /// pictures.
    fn found(&self, job: &Job<'_>, of_values: &Warnings) -> Warnings {
        let output = job.planned.output;
        let mut found = Gathered::default();
        found.add(&self.run.warnings((output.node, output.output)));
        found.add(of_values);
        found.warnings()
    }

    /// Checks sizes, prepares fields and limits the computed pixels to the area, before the first block of pictures.
    pub(super) fn ready(&self, jobs: &[&Job<'_>], grid: &Grid) -> Result<(), Failure> {
        self.check_size(jobs)?;
        let fields: Vec<&Field> = jobs.iter().flat_map(|job| &job.fields).map(|(_, field)| field).collect();
        for field in &fields {
            self.run.prepare(field, grid).map_err(|stop| located(self.run, self.planner.graph, stop))?;
        }
        if self.area != Window::full(self.planner.graph.canvas.resolution) {
            self.run.limit_to(&Fields::new(&fields, grid), self.area, self.neighbors.clone());
        }
        Ok(())
    }

    /// Refuses pictures that exceed the memory budget, before anything is allocated.
    fn check_size(&self, jobs: &[&Job<'_>]) -> Result<(), Failure> {
        let channels: usize = jobs.iter().map(|job| job.samples()).sum();
        let band = u64::from(self.planner.window.width) * u64::from(TILE) * 4 * channels as u64 * 2;
        let held: usize = jobs.iter().filter(|job| job.is_held()).map(|job| job.samples()).sum();
        let whole = self.planner.window.len() as u64 * 4 * held as u64;
        if band.max(whole) <= self.session.memory {
            return Ok(());
        }
        let (what, bytes) = if band > whole { ("a band of the picture", band) } else { ("the whole height", whole) };
        let message = format!("{what} needs {} MiB; {} MiB are allowed", bytes >> 20, self.session.memory >> 20);
        let help = "lower the resolution, render fewer outputs at a time, or raise --memory";
        let span = self.planner.graph.canvas_span;
        Err(Failure::Errors(vec![Diagnostic::new(Code::TooLarge, span, message).help(help)]))
    }

    fn sink(&self, job: &Job<'_>) -> Result<Sink, Failure> {
        let failed = |e: WriteError| Failure::File(e.to_string());
        if let Some(files) = &job.files {
            return self.exported(job, files, self.compression());
        }
        if job.is_fitted() {
            return Ok(Sink::Fitted(Box::new(Fitted::new(&job.planned, self.spec(job)))));
        }
        let writer = Writer::create(&job.planned.path, &self.spec(job));
        writer.map(|writer| Sink::Picture(Box::new(writer))).map_err(failed)
    }

    fn compression(&self) -> Compression {
        if self.planner.request.best_compression { Compression::Best } else { Compression::Fast }
    }

    /// The encoding of a picture.
    pub(super) fn spec(&self, job: &Job<'_>) -> PictureSpec {
        let (request, planned, window) = (self.planner.request, &job.planned, self.planner.window);
        PictureSpec {
            width: window.width,
            height: window.height,
            channels: job.channels(),
            format: planned.format,
            depth: planned.depth,
            encoding: Encoding {
                dither: request.dither,
                origin: (window.x.cast_unsigned(), window.y.cast_unsigned()),
                ..encoding(planned, job)
            },
            compression: self.compression(),
            mips: job.mips.clone(),
            chromaticities: storage::chromaticities(&planned.output.storage),
            pixel_mm: Some(self.pixel_mm()),
            metadata: planned.metadata.clone(),
        }
    }

    /// Width and height of a pixel in mm.
    pub(super) fn pixel_mm(&self) -> [f32; 2] {
        let canvas = &self.planner.graph.canvas;
        (canvas.size_mm / canvas.resolution.as_dvec2()).as_vec2().to_array()
    }

    /// Writes segments as lines on a page of the canvas, or of the requested region.
    fn write_lines(&self, job: &Job<'_>, segments: &Segments, grid: &Grid) -> Result<(), Failure> {
        let bytes = self.drawn(job, segments, grid)?;
        let path = &job.planned.path;
        let written = AtomicFile::create(path).and_then(|mut file| file.write_all(&bytes).and_then(|()| file.commit()));
        written.map_err(|e| Failure::File(WriteError::at(path, e).to_string()))?;
        self.keep(job, &FileReport { found: self.found(job, &Warnings::default()), written: Vec::new() });
        Ok(())
    }

    /// The drawing as bytes.
    pub(super) fn drawn(&self, job: &Job<'_>, segments: &Segments, grid: &Grid) -> Result<Vec<u8>, Failure> {
        let window = self.planner.window;
        let corner = grid.origin + DVec2::new(f64::from(window.x), f64::from(window.y)) * grid.step;
        let size = DVec2::new(f64::from(window.width), f64::from(window.height)) * grid.step;
        let lines = segments.within(corner.as_vec2(), (corner + size).as_vec2());
        let drawing = Drawing { corner, size, lines: &lines, metadata: &job.planned.metadata };
        svg(&drawing).map_err(|e| Failure::File(e.to_string()))
    }

    /// Stores the file of a job with its report.
    fn keep(&self, job: &Job<'_>, report: &FileReport) {
        let Some(store) = self.session.caches.store.as_ref().filter(|_| match &job.planned.part {
            OutputPart::Export(export) => export.target.plan().cached,
            _ => true,
        }) else {
            return;
        };
        let small = std::fs::metadata(&job.planned.path).is_ok_and(|meta| meta.len() <= store.room() / 16);
        if small {
            warned::put(&**store, job.planned.key, &job.planned.path, report, self.run.spent());
        }
    }
}

fn unwritten(path: &Path, error: &std::io::Error) -> Failure {
    Failure::File(format!("cannot write `{}`: {error}", path.display()))
}

/// The place of a problem of a job's files: the field of the output that it names, if it is written, else the output.
fn place(problem: &Problem, job: &Job<'_>) -> Span {
    let written = if let OutputPart::Export(export) = &job.planned.part { &export.places[..] } else { &[] };
    let named = written.iter().find(|(name, _)| problem.field.as_deref() == Some(*name));
    named.map_or(job.planned.output.span, |(_, span)| *span)
}

/// The failure of files that cannot be made of a job's values, at its place.
fn unfit(error: WriteError, job: &Job<'_>) -> Failure {
    match error {
        WriteError::Unfit(problem) => {
            let span = place(&problem, job);
            Failure::Errors(vec![Diagnostic::from_problem(*problem, span)])
        }
        error => Failure::File(error.to_string()),
    }
}
