//! One picture from up to four fields of numbers from 0 to 1: red, green, blue and opacity.
use super::bundle::packed;
use super::decl::{FieldDecl, Takes};
use super::target::{ExportTarget, Files, Options, Plan, Source, TargetInfo};
use crate::value::{Field, Type};
use std::io;

/// The target.
pub(super) struct Pack;

impl ExportTarget for Pack {
    fn info(&self) -> &'static TargetInfo {
        const {
            &TargetInfo {
                name: "Pack",
                title: "a picture",
                doc: "One picture of up to four fields.",
                fields: &[
                    FieldDecl::new("r", "The field that becomes red.", Takes::Gray),
                    FieldDecl::new("g", "The field that becomes green.", Takes::Gray),
                    FieldDecl::new("b", "The field that becomes blue.", Takes::Gray),
                    FieldDecl::new("a", "The field that becomes opacity.", Takes::Gray),
                ],
                variants: &[],
            }
        }
    }

    fn plan(&self, _: &Options) -> Plan {
        Plan::one("png")
    }

    fn write(&self, source: &Source<'_>, _: &Options) -> io::Result<Files> {
        let get = |name| source.fields.iter().find(|(field, _)| *field == name).map(|(_, field)| field.clone());
        let color = |name| get(name).unwrap_or_else(|| Field::constant(Type::Gray, &[0.0]));
        let fields = ["r", "g", "b"].map(color).into_iter().chain(get("a")).collect();
        Ok(Files::Bundle(packed(fields, &source.place)))
    }
}
