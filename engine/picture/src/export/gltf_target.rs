//! The export target glTF; `gltf` makes its document.
use super::decl::{COLORS, FieldDecl, MATERIAL, MESH, QUALITY, Takes};
use super::gltf::{Exported, Role};
use super::target::{ExportTarget, Files, OptionValue, Options, Plan, Source, TargetInfo};
use std::io;

/// The target.
pub(super) struct Gltf;

impl ExportTarget for Gltf {
    fn info(&self) -> &'static TargetInfo {
        const {
            &TargetInfo {
                name: "Gltf",
                title: "glTF",
                doc: "A material on a mesh as glTF 2.0.",
                fields: &[
                    MATERIAL,
                    MESH,
                    FieldDecl::new(
                        "embed",
                        "Writes one `.glb`; otherwise mesh and pictures lie beside a `.gltf`.",
                        Takes::Truth(true),
                    ),
                    COLORS,
                    QUALITY,
                ],
                variants: &[
                    ("gltf", "A binary glTF file", &[]),
                    (
                        "gltf-files",
                        "A glTF file with its mesh and its pictures beside it",
                        &[("embed", OptionValue::Truth(false))],
                    ),
                ],
            }
        }
    }

    fn plan(&self, options: &Options) -> Plan {
        match options.is("embed") {
            true => Plan::one("glb"),
            false => Plan { also: const { &[Role::Surface.name()] }, ..Plan::several("gltf") },
        }
    }

    fn write(&self, source: &Source<'_>, options: &Options) -> io::Result<Files> {
        let apart = (!options.is("embed")).then(|| source.place.stem.clone());
        let exported = Exported::new(source.material.clone(), options.colors(), apart);
        Ok(Files::Glb(Box::new((exported, source.shape.clone()))))
    }
}
