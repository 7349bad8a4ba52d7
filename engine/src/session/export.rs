//! Exported files: which textures they consist of, and what their rows are written to.
use super::Failure;
use super::plan::{Part, Planned};
use super::render::{Job, Render, job};
use crate::diagnostics::{Code, Diagnostic};
use crate::eval::Event;
use crate::export::{Exported, GlbWriter, Shape};
use crate::graph::{ExportMesh, GraphOutput};
use crate::picture::{Compression, WriteError, Writer, Written};
use crate::value::{Atlas, Carried, Channel, Field, Material, Tiling, Value};
use glam::UVec2;

/// What the rows of a job are written to.
pub(super) enum Sink {
    Picture(Box<Writer>),
    Glb(Box<GlbWriter>),
}

impl Sink {
    pub(super) fn write_rows(&mut self, planes: &[&[f32]], rows: u32) -> Result<(), Failure> {
        let done = match self {
            Self::Picture(writer) => writer.write_rows(planes, rows),
            Self::Glb(writer) => writer.write_rows(planes, rows),
        };
        done.map_err(|error| Failure::File(error.to_string()))
    }

    /// What became of the pictures, once the file has its name.
    pub(super) fn finish(self) -> Result<Vec<Written>, Failure> {
        let done = match self {
            Self::Picture(writer) => writer.finish().map(|written| vec![written]),
            Self::Glb(writer) => writer.finish(),
        };
        done.map_err(|error| Failure::File(error.to_string()))
    }
}

impl Render<'_, '_> {
    /// What must be computed for a planned file.
    pub(super) fn job<'g>(&self, planned: Planned<'g>, value: &Value) -> Result<Job<'g>, Failure> {
        let (Value::Material(material), Part::Gltf, Some(mesh)) = (value, &planned.part, planned.output.mesh) else {
            return Ok(job(planned, value));
        };
        let canvas = &self.planner.graph.canvas;
        let (material, shape) = match mesh {
            ExportMesh::Plane => ((**material).clone(), Shape::plane(canvas.size_mm)),
            ExportMesh::Atlas { node, output } => {
                let mut values = self.run.values(&[(node, output)])?;
                let Some(atlas) = values.pop().and_then(Atlas::unwrap) else { return Ok(job(planned, value)) };
                let filled =
                    |(channel, field): &(Channel, Field)| (*channel, self.session.registry.with_gutter(field, &atlas));
                (Material::new(material.channels().iter().map(filled)), Shape::atlas(&atlas))
            }
        };
        let exported = Exported::new(material);
        self.warn_lost(planned.output, &exported);
        let fields = exported.textures.iter().flat_map(|texture| &texture.fields);
        let fields = fields.map(|field| (String::new(), field.clone())).collect();
        Ok(Job { planned, fields, lines: None, export: Some((exported, shape)) })
    }

    fn warn_lost(&self, output: &GraphOutput, exported: &Exported) {
        for channel in exported.lost() {
            let message = format!("glTF has no texture for the channel `{}`, which is left out", channel.name());
            let warning = Diagnostic::new(Code::Advice, output.span, message);
            self.observer.event(Event::Warning(warning.as_warning()));
        }
    }

    /// Starts a glTF file.
    pub(super) fn glb(
        &self,
        job: &Job<'_>,
        export: &(Exported, Shape),
        compression: Compression,
    ) -> Result<Sink, Failure> {
        let (planned, window) = (&job.planned, self.planner.window);
        // The textures of an atlas end at its edges.
        let tile = self.planner.graph.canvas.tile;
        let tile = if planned.output.mesh == Some(ExportMesh::Plane) { tile } else { Tiling::NONE };
        let (name, wraps) = (&planned.output.name, [tile.x, tile.y]);
        let size = UVec2::new(window.width, window.height);
        let how = (self.planner.request.dither, compression);
        let glb = GlbWriter::create(&planned.path, name, export.clone(), size, wraps, how)
            .map_err(|e: WriteError| Failure::File(e.to_string()))?;
        Ok(Sink::Glb(Box::new(glb)))
    }
}
