//! Exported files: their textures, and the writers that receive their rows.
use super::Failure;
use super::part::PartSink;
use super::plan::{OutputPart, Planned};
use super::render::{Job, Render, job};
use crate::diagnostics::{Code, Diagnostic};
use crate::eval::Event;
use crate::export::{
    Bundle, BundleWriter, ExportContext, Exported, GlbWriter, Shape, SimpleShape, materialx, obj, pack, preset, usd,
};
use crate::graph::{Export, ExportMesh, GraphOutput};
use crate::picture::{Compression, WriteError, WriteStats, Writer};
use crate::value::{Atlas, Carried, Channel, Field, Material, Tiling, Value};
use glam::UVec2;
use std::path::PathBuf;

/// The writer that receives the rows of a job.
pub(super) enum Sink {
    Picture(Box<Writer>),
    Glb(Box<GlbWriter>),
    Bundle(Box<BundleWriter>),
    Part(PartSink),
}

/// Files that a job writes besides a picture of its fields.
pub(super) enum Files {
    /// A glTF file: the material and the mesh.
    Glb(Box<(Exported, Shape)>),
    /// Several files.
    Bundle(Bundle),
}

impl Sink {
    pub(super) fn write_rows(&mut self, planes: &[&[f32]], rows: u32) -> Result<(), Failure> {
        let done = match self {
            Self::Picture(writer) => writer.write_rows(planes, rows),
            Self::Glb(writer) => writer.write_rows(planes, rows),
            Self::Bundle(writer) => writer.write_rows(planes, rows),
            Self::Part(writer) => writer.write_rows(planes, rows),
        };
        done.map_err(|error| Failure::File(error.to_string()))
    }

    /// The writer of a part of the pictures, if it is one.
    pub(super) fn part(&self) -> Option<&PartSink> {
        if let Self::Part(part) = self { Some(part) } else { None }
    }

    /// Closes the file under its final name; returns statistics of the pictures written.
    pub(super) fn finish(self) -> Result<Vec<WriteStats>, Failure> {
        let done = match self {
            Self::Picture(writer) => writer.finish().map(|written| vec![written]),
            Self::Glb(writer) => writer.finish(),
            Self::Bundle(writer) => writer.finish(),
            Self::Part(_) => Ok(Vec::new()),
        };
        done.map_err(|error| Failure::File(error.to_string()))
    }
}

impl Render<'_, '_> {
    /// The fields and files to compute for a planned file.
    pub(super) fn job<'g>(&self, planned: Planned<'g>, value: &Value) -> Result<Job<'g>, Failure> {
        let OutputPart::Export(export) = planned.part else { return Ok(job(planned, value)) };
        let (output, canvas) = (planned.output, &self.planner.graph.canvas);
        let place = |once: bool| ExportContext {
            stem: self.planner.stem(output),
            size_mm: canvas.size_mm,
            wraps: if once { [false; 2] } else { [canvas.tile.x, canvas.tile.y] },
        };
        if let Export::Pack(sources) = export {
            let mut fields = [const { None }; 4];
            for (field, source) in fields.iter_mut().zip(sources) {
                let Some(source) = source else { continue };
                *field = self.run.values(&[source])?.first().and_then(Value::field);
            }
            return Ok(bundled(planned, pack(fields, &place(false))));
        }
        let Value::Material(material) = value else { return Ok(job(planned, value)) };
        let (material, shape) = self.on_mesh(output, material)?;
        let (bundle, target) = match export {
            Export::MaterialX(shading) => {
                let made = materialx(&material, &place(false), shading);
                (made.map_err(|error| Failure::File(error.to_string()))?, "MaterialX")
            }
            Export::Obj(colors) => (obj(&material, &shape, &place(false), colors), "OBJ"),
            Export::Usd { packed, colors } => {
                let once = output.mesh.is_some_and(ExportMesh::is_atlas);
                (usd(&material, &shape, &place(once), packed, colors), "the shaders of USD")
            }
            Export::Preset(program) => (preset(&material, &place(false), program), "this target"),
            Export::Pack(_) => return Ok(job(planned, value)),
            Export::Gltf { embed, colors } => {
                let exported = Exported::new(material, colors, (!embed).then(|| self.planner.stem(output)));
                self.warn_lost(output, "glTF", &exported.lost());
                let fields = exported.textures.iter().flat_map(|texture| &texture.fields);
                let fields = fields.map(|field| (String::new(), field.clone())).collect();
                let files = Some(Files::Glb(Box::new((exported, shape))));
                return Ok(textures(planned, fields, files));
            }
        };
        self.warn_lost(output, target, &bundle.lost);
        Ok(bundled(planned, bundle))
    }

    /// The material as laid on the mesh of an output, and the mesh.
    fn on_mesh(&self, output: &GraphOutput, material: &Material) -> Result<(Material, Shape), Failure> {
        let size = self.planner.graph.canvas.size_mm;
        let simple = |shape| (material.clone(), Shape::simple(shape, size));
        let (node, output) = match output.mesh {
            None => return Ok(simple(SimpleShape::Plane)),
            Some(ExportMesh::Simple(shape)) => return Ok(simple(shape)),
            Some(ExportMesh::Atlas { node, output }) => (node, output),
        };
        let mut values = self.run.values(&[(node, output)])?;
        let Some(atlas) = values.pop().and_then(Atlas::unwrap) else { return Ok(simple(SimpleShape::Plane)) };
        let filled = |(channel, field): &(Channel, Field)| (*channel, self.session.registry.with_gutter(field, &atlas));
        Ok((Material::new(material.channels().iter().map(filled)), Shape::atlas(&atlas)))
    }

    fn warn_lost(&self, output: &GraphOutput, target: &str, lost: &[Channel]) {
        for channel in lost {
            let message = format!("{target} has no texture for the channel `{}`, which is left out", channel.name());
            let warning = Diagnostic::new(Code::Advice, output.span, message);
            self.observer.event(Event::Warning(warning.as_warning()));
        }
    }

    /// Opens the writer for the rows of an exported file.
    pub(super) fn exported(&self, job: &Job<'_>, files: &Files, compression: Compression) -> Result<Sink, Failure> {
        let bundle = match files {
            Files::Glb(export) => return self.glb(job, export, compression),
            Files::Bundle(bundle) => bundle.clone(),
        };
        let window = self.planner.window;
        let folder = job.planned.path.parent().unwrap_or_else(|| std::path::Path::new(""));
        let how = (self.planner.request.dither, compression);
        let size = (UVec2::new(window.width, window.height), self.pixel_mm());
        let writer = BundleWriter::create(folder, bundle, size, how).map_err(|e| Failure::File(e.to_string()))?;
        Ok(Sink::Bundle(Box::new(writer)))
    }

    /// Starts a glTF file.
    fn glb(&self, job: &Job<'_>, export: &(Exported, Shape), compression: Compression) -> Result<Sink, Failure> {
        let (planned, window) = (&job.planned, self.planner.window);
        // The textures of an atlas end at its edges.
        let tile = self.planner.graph.canvas.tile;
        let tile = if planned.output.mesh.is_some_and(ExportMesh::is_atlas) { Tiling::NONE } else { tile };
        let (name, wraps) = (&planned.output.name, [tile.x, tile.y]);
        let size = (UVec2::new(window.width, window.height), self.pixel_mm());
        let how = (self.planner.request.dither, compression);
        let glb = GlbWriter::create(&planned.path, name, export.clone(), size, wraps, how)
            .map_err(|e: WriteError| Failure::File(e.to_string()))?;
        Ok(Sink::Glb(Box::new(glb)))
    }
}

/// The job of an export with several files.
fn bundled(planned: Planned<'_>, bundle: Bundle) -> Job<'_> {
    let fields = bundle.maps.iter().flat_map(|map| &map.fields);
    let fields = fields.map(|field| (String::new(), field.clone())).collect();
    textures(planned, fields, Some(Files::Bundle(bundle)))
}

/// A job whose fields are the textures of files.
fn textures(planned: Planned<'_>, fields: Vec<(String, Field)>, files: Option<Files>) -> Job<'_> {
    Job { planned, fields, lines: None, beyond: 0, mips: Vec::new(), files }
}

/// Paths of the files that jobs write or that are copied from the cache, in planned order.
pub(super) fn files(planned: &[PathBuf], jobs: &[Job<'_>]) -> Vec<PathBuf> {
    let made = |path: &PathBuf| {
        let job = jobs.iter().find(|job| job.planned.path == *path);
        match job.and_then(|job| job.files.as_ref()) {
            Some(Files::Bundle(bundle)) => bundle.files().map(|file| path.with_file_name(file)).collect(),
            Some(Files::Glb(export)) if export.0.apart.is_some() => {
                export.0.files().map(|file| path.with_file_name(file)).collect()
            }
            _ => vec![path.clone()],
        }
    };
    planned.iter().flat_map(made).collect()
}
