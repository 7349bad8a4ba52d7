//! A mesh as a file, for printers and mills.
use super::body::{Common, FORMAT, Format, REPORT, files_of, write_model};
use super::decl::{FieldDecl, Takes, names};
use super::heights::{HeightMap, Heights, Maker, Part, Stop, refused, told};
use super::target::{ExportTarget, Files, Options, Plan, Source, TargetInfo};
use crate::WriteError;
use crate::value::Mesh;
use crate::value::diagnostics::{Code, Problem};
use shibo_kernel::body::{self, Facing};
use std::io;
use std::path::Path;
use std::sync::Arc;

/// Names of the directions that point up; true for y.
const UP: [(&str, bool); 2] = [("Z", false), ("Y", true)];
/// Names of the answers to a mesh with holes; true to write it.
const OPEN: [(&str, bool); 2] = [("Refuse", false), ("Keep", true)];

/// The target.
pub(super) struct Model;

impl ExportTarget for Model {
    fn info(&self) -> &'static TargetInfo {
        const {
            &TargetInfo {
                name: "Model",
                title: "a model",
                doc: "A mesh, such as one with a relief by `DisplaceMesh`: a body for printers and mills.",
                fields: &[
                    FieldDecl::new("mesh", "The mesh, or an atlas, which has one.", Takes::Body),
                    FORMAT,
                    FieldDecl::new("up", "The axis that points up in the file.", Takes::Words(|| names(&UP))),
                    FieldDecl::new(
                        "open",
                        "For a mesh that is not closed: `Refuse` writes nothing, `Keep` writes it as it is.",
                        Takes::Words(|| names(&OPEN)),
                    ),
                    REPORT,
                ],
                variants: &[],
            }
        }
    }

    fn is_body(&self) -> bool {
        true
    }

    fn plan(&self, options: &Options) -> Plan {
        Plan::body(Common::format(options).extension(), options.is("report"))
    }

    fn write(&self, source: &Source<'_>, options: &Options) -> io::Result<Files> {
        let maker = ModelMaker {
            stem: source.place.stem.clone(),
            mesh: source.mesh.clone().unwrap_or_default(),
            format: Common::format(options),
            y_up: options.word("up", &UP),
            keeps_open: options.word("open", &OPEN),
            reports: options.is("report"),
        };
        Ok(Files::Heights(Heights::of(source, Arc::new(maker))))
    }
}

#[derive(Clone, Debug)]
struct ModelMaker {
    stem: String,
    mesh: Arc<Mesh>,
    format: Format,
    y_up: bool,
    keeps_open: bool,
    /// True if a report is wanted.
    reports: bool,
}

impl Maker for ModelMaker {
    fn names(&self) -> Vec<String> {
        files_of(&self.stem, self.format, self.reports)
    }

    fn make(&self, map: &HeightMap, folder: &Path, stop: Stop<'_>) -> Result<Vec<Part>, WriteError> {
        let path = folder.join(format!("{}.{}", self.stem, self.format.extension()));
        let open = body::open_edge(&self.mesh, stop).map_err(|error| WriteError::at(&path, error))?;
        if let Some(at) = open.filter(|_| !self.keeps_open) {
            let [x, y, z] = at.to_array().map(told);
            let message =
                format!("the mesh is not closed: an edge at ({x}, {y}, {z}) mm has not exactly two triangles");
            return Err(refused(Code::OpenMesh, message, "close the mesh, or write `open: Keep`"));
        }
        let facing = if open.is_none() { body::facing(&self.mesh) } else { Facing::Outwards };
        let turned = match facing {
            Facing::Outwards => None,
            Facing::Inwards => {
                let message = "the mesh is inside out: its triangles are turned round in the file";
                let help = "turn the faces round in the program that made the mesh; a relief goes inwards now";
                Some(Problem::new(Code::Advice, message).help(help))
            }
            Facing::Mixed(at) => {
                let [x, y, z] = at.to_array().map(told);
                let message =
                    format!("a piece of the mesh is inside out, at ({x}, {y}, {z}) mm, and other pieces are not");
                let help = "reduce the depth of its relief, or turn its faces round in the program that made the mesh";
                return Err(refused(Code::BadValue, message, help));
            }
        };
        let how = (self.y_up, turned.is_some());
        let build = |receiver: &mut dyn body::Receiver| body::model(&self.mesh, how, receiver);
        let findings = self.reports.then(|| map.findings.iter().chain(&turned).cloned().collect::<Vec<_>>());
        let model = (&*self.stem, open.is_none(), findings.as_deref());
        let mut parts = write_model(&build, (&path, self.format, stop), model)?;
        parts.extend(turned.map(Part::Advice));
        Ok(parts)
    }
}
