//! Exported files: their textures, and the writers that receive their rows.
use super::Failure;
use super::job::Job;
use super::plan::{OutputPart, Planned};
use super::render::Render;
use super::sink::Sink;
use super::storage::job;
use crate::diagnostics::{Code, Diagnostic};
use crate::eval::Event;
use crate::export::{Chosen, ExportContext, Files, Shape, SimpleShape, Source};
use crate::graph::{Export, ExportMesh, GraphOutput};
use crate::picture::Compression;
use crate::value::{Atlas, Carried, Channel, Field, Material, Mesh, Tiling, Value};
use glam::UVec2;

impl Render<'_, '_> {
    /// The fields and files to compute for a planned file.
    pub(super) fn job<'g>(&self, planned: Planned<'g>, value: &Value) -> Result<Job<'g>, Failure> {
        let OutputPart::Export(Export { target: Chosen { target, options }, fields: sources, .. }) = &planned.part
        else {
            return Ok(job(planned, value));
        };
        let output = planned.output;
        let mut fields = Vec::new();
        for (name, source) in sources {
            fields.extend(self.run.values(&[*source])?.first().and_then(Value::field).map(|field| (*name, field)));
        }
        if target.info().has_height() {
            let height = match value {
                Value::Material(material) => material.get(Channel::Height).cloned(),
                value => value.field(),
            };
            let Some(height) = height else {
                let message = format!("`{}` has no height", output.name);
                let help = "give the material the channel `height`, in mm, or name another output with `--output`";
                let error = Diagnostic::new(Code::TypeMismatch, output.span, message).help(help);
                return Err(Failure::Errors(vec![error]));
            };
            fields.push(("height", height));
        }
        let mesh = || Mesh::unwrap(value.clone()).or_else(|| Some(Atlas::unwrap(value.clone())?.mesh.clone()));
        let mesh = if target.info().has_body() { mesh() } else { None };
        let bare = Material::default();
        let material = if let Value::Material(material) = value { material } else { &bare };
        let (material, shape) = self.on_mesh(output, material)?;
        let canvas = &self.planner.graph.canvas;
        let place = ExportContext {
            stem: self.planner.stem(output),
            size_mm: canvas.size_mm,
            wraps: self.wraps(output, fields.first().map(|(_, field)| field)),
            metadata: planned.metadata.clone(),
        };
        let source = Source { material: &material, shape: &shape, mesh, fields, place };
        let files = target.write(&source, options).map_err(|error| Failure::File(error.to_string()))?;
        self.warn_lost(output, target.info().title, &files.lost());
        let fields = files.fields().into_iter().map(|field| (String::new(), field)).collect();
        Ok(Job { planned, fields, lines: None, beyond: 0, mips: Vec::new(), files: Some(files) })
    }

    /// Directions in which the pictures of an export repeat, or one of its fields. The pictures of an atlas do not
    /// repeat.
    fn wraps(&self, output: &GraphOutput, field: Option<&Field>) -> [bool; 2] {
        let tile = field.map_or(Tiling::BOTH, Field::tiling).and(self.planner.graph.canvas.tile);
        let tile = if output.mesh.is_some_and(ExportMesh::is_atlas) { Tiling::NONE } else { tile };
        [tile.x, tile.y]
    }

    /// The mesh of an output, and the material as it lies on this mesh.
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
        let (planned, window) = (&job.planned, self.planner.window);
        let size = (UVec2::new(window.width, window.height), self.pixel_mm());
        let how = (self.planner.request.dither, compression);
        let wraps = self.wraps(planned.output, None);
        let writer = files.create(&planned.path, &planned.output.name, size, wraps, how);
        writer.map(|writer| Sink::Export(Box::new(writer))).map_err(|error| Failure::File(error.to_string()))
    }
}
