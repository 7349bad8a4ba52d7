//! An output as written.
use super::part::SyntaxValue;
use super::storage::Storage;
use crate::diagnostics::Span;
use crate::export::{Chosen, SimpleShape};
use crate::picture::{Depth, Format};

/// An output as written.
#[derive(Debug)]
pub(super) struct OutputDecl {
    pub(super) name: String,
    pub(super) key: SyntaxValue,
    /// The reference; `None` after an error.
    pub(super) from: Option<SyntaxValue>,
    pub(super) format: Option<Format>,
    pub(super) depth: Option<Depth>,
    /// The channels of a material go into one file.
    pub(super) combined: bool,
    pub(super) range: Option<(f64, f64)>,
    /// Other options for stored pictures.
    pub(super) storage: Storage,
    /// The export written instead of pictures.
    pub(super) export: Option<ExportDecl>,
    /// The mesh of the export, if the format has one.
    pub(super) mesh: Option<MeshDecl>,
}

/// The export of an output, as written.
#[derive(Debug)]
pub(super) struct ExportDecl {
    pub(super) target: Chosen,
    /// False after an error in an option.
    pub(super) good: bool,
    /// The references to single fields, by the names of the target's fields.
    pub(super) fields: Vec<(&'static str, SyntaxValue)>,
    /// The places of the values that are written, by the names of the target's fields.
    pub(super) places: Vec<(&'static str, Span)>,
}

/// The mesh of an exported file, as written.
#[derive(Debug)]
pub(super) enum MeshDecl {
    /// A shape that needs no mesh.
    Simple(SimpleShape),
    /// A reference to an atlas.
    Node(SyntaxValue),
}
