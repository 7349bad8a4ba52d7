//! Targets: the formats of other programs that graphs are written in.
//!
//! A target is one file with an `impl ExportTarget`, and its entry in the table
//! [`TARGETS`]. The loader, editors, the command line,
//! the Python module, the planning of files and the writing follow from it.
use super::TARGETS;
use super::bundle::{Bundle, BundleWriter, ExportContext};
use super::decl::{FieldDecl, Takes};
use super::glb::GlbWriter;
use super::gltf::Exported;
use super::shape::Shape;
use crate::diagnostics::Problem;
use crate::picture::{Compression, WriteError, WriteStats};
use crate::value::{Channel, Field, Material};
use glam::UVec2;
use std::fmt::Debug;
use std::io;
use std::path::Path;
use std::sync::Arc;

/// The target with this word in graph files.
pub fn target_named(name: &str) -> Option<&'static dyn ExportTarget> {
    TARGETS.iter().copied().find(|target| target.name() == name)
}

/// A format of another program, with its options. Its `Debug` text is part of the keys of its files, so that text must
/// contain all options.
pub trait ExportTarget: Debug + Send + Sync {
    /// The word in graph files: `Gltf` in `Gltf(material: "node")`.
    fn name(&self) -> &'static str;

    /// The name in messages.
    fn title(&self) -> &'static str {
        self.name()
    }

    /// One sentence about the format, for editors.
    fn doc(&self) -> &'static str;

    /// The fields of its brackets in graph files. A target has a field that takes a [`Takes::Material`], which must be
    /// written, or fields that take [`Takes::Gray`], of which one must be written. The others are options.
    fn fields(&self) -> &'static [FieldDecl];

    /// This target with the options of a graph file, which have the types that [`fields`](Self::fields) states.
    ///
    /// # Errors
    /// An option is missing, or contradicts another one; at that field, or at the word if it has none.
    fn with(&self, options: &Options) -> Result<Arc<dyn ExportTarget>, Problem>;

    /// The choices for all materials of a graph, `shibo render --as NAME`.
    fn variants(&self) -> Vec<Variant>;

    /// The files that it makes.
    fn plan(&self) -> Plan;

    /// The pictures and documents of an output. Fields are not evaluated here.
    ///
    /// # Errors
    /// A document cannot be written.
    fn write(&self, source: &Source<'_>) -> io::Result<Files>;

    /// Returns true if its files contain a mesh.
    fn has_mesh(&self) -> bool {
        self.fields().iter().any(|field| matches!(field.takes, Takes::Mesh))
    }
}

/// A choice on the command line.
#[derive(Clone, Debug)]
pub struct Variant {
    /// The word after `--as`.
    pub name: &'static str,
    /// One sentence about it.
    pub doc: &'static str,
    /// The target with its options.
    pub target: Arc<dyn ExportTarget>,
}

impl Variant {
    pub(super) fn new(name: &'static str, doc: &'static str, target: impl ExportTarget + 'static) -> Self {
        Self { name, doc, target: Arc::new(target) }
    }

    /// All choices, in the order of [`TARGETS`].
    pub fn all() -> Vec<Self> {
        TARGETS.iter().flat_map(|target| target.variants()).collect()
    }
}

/// The names of the files of an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// The extension of the main file, which is named like the output.
    pub extension: &'static str,
    /// True if there are no other files. Otherwise each channel may have a picture, `output_channel`.
    pub one_file: bool,
    /// Further names of pictures, after `output_`.
    pub also: &'static [&'static str],
}

impl Plan {
    /// A main file with the pictures of channels beside it.
    pub(super) const fn several(extension: &'static str) -> Self {
        Self { extension, one_file: false, also: &[] }
    }

    /// One file.
    pub(super) const fn one(extension: &'static str) -> Self {
        Self { extension, one_file: true, also: &[] }
    }
}

/// The options in a graph file, by name; those that were not written are missing.
#[derive(Clone, Debug, Default)]
pub struct Options(pub Vec<(&'static str, OptionValue)>);

/// The value of an option.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OptionValue {
    /// For [`Takes::Truth`].
    Truth(bool),
    /// For [`Takes::Words`]: one of the words.
    Word(&'static str),
    /// For [`Takes::Whole`].
    Whole(u8),
}

impl Options {
    fn get(&self, name: &str) -> Option<OptionValue> {
        self.0.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
    }

    /// The value of an option that is true or false.
    pub fn truth(&self, name: &str) -> Option<bool> {
        if let Some(OptionValue::Truth(value)) = self.get(name) { Some(value) } else { None }
    }

    /// The meaning of the word that an option has.
    pub fn word<T: Copy>(&self, name: &str, words: &[(&str, T)]) -> Option<T> {
        let Some(OptionValue::Word(value)) = self.get(name) else { return None };
        words.iter().find(|(word, _)| *word == value).map(|(_, meaning)| *meaning)
    }

    /// The value of an option that is a whole number.
    pub fn whole(&self, name: &str) -> Option<u8> {
        if let Some(OptionValue::Whole(value)) = self.get(name) { Some(value) } else { None }
    }
}

/// The contents of an output.
pub struct Source<'a> {
    /// The material; without channels if the target takes none.
    pub material: &'a Material,
    /// The mesh that shows the material: a plane if the target takes none.
    pub shape: &'a Shape,
    /// The fields for [`Takes::Gray`], by the names of the target's fields.
    pub fields: Vec<(&'static str, Field)>,
    /// The names of the files, and the canvas.
    pub place: ExportContext,
}

/// The files of an output before their pictures are computed.
pub enum Files {
    /// A glTF file: the material and the mesh.
    Glb(Box<(Exported, Shape)>),
    /// Pictures and documents.
    Bundle(Bundle),
}

impl Files {
    /// The fields of all pictures, one picture after another.
    pub fn fields(&self) -> Vec<Field> {
        match self {
            Self::Glb(export) => export.0.textures.iter().flat_map(|texture| texture.fields.clone()).collect(),
            Self::Bundle(bundle) => bundle.maps.iter().flat_map(|map| map.fields.clone()).collect(),
        }
    }

    /// The names of all files; empty if there is only the main one.
    pub fn names(&self) -> Vec<String> {
        match self {
            Self::Glb(export) => export.0.files().collect(),
            Self::Bundle(bundle) => bundle.files().map(str::to_owned).collect(),
        }
    }

    /// The channels that the format cannot express.
    pub fn lost(&self) -> Vec<Channel> {
        match self {
            Self::Glb(export) => export.0.lost(),
            Self::Bundle(bundle) => bundle.lost.clone(),
        }
    }

    /// Starts the files of an output `name`; `path` is that of the main file. `size` is that of the pictures in pixels
    /// and that of a pixel in mm; `wraps` tells in which directions pictures repeat beyond their edges; `how` is whether
    /// to dither, and how to compress.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn create(
        &self,
        path: &Path,
        name: &str,
        size: (UVec2, [f32; 2]),
        wraps: [bool; 2],
        how: (bool, Compression),
    ) -> Result<FilesWriter, WriteError> {
        Ok(match self {
            Self::Glb(export) => {
                FilesWriter::Glb(Box::new(GlbWriter::create(path, name, (**export).clone(), size, wraps, how)?))
            }
            Self::Bundle(bundle) => {
                let folder = path.parent().unwrap_or_else(|| Path::new(""));
                FilesWriter::Bundle(Box::new(BundleWriter::create(folder, bundle.clone(), size, how)?))
            }
        })
    }
}

/// The files of an output while their rows are computed. Dropping the writer leaves no files.
#[derive(Debug)]
pub enum FilesWriter {
    /// A glTF file.
    Glb(Box<GlbWriter>),
    /// Pictures and documents.
    Bundle(Box<BundleWriter>),
}

impl FilesWriter {
    /// Writes the next rows of all pictures. `planes` holds the channels of [`Files::fields`].
    ///
    /// # Errors
    /// If the system refuses.
    pub fn write_rows(&mut self, planes: &[&[f32]], rows: u32) -> Result<(), WriteError> {
        match self {
            Self::Glb(writer) => writer.write_rows(planes, rows),
            Self::Bundle(writer) => writer.write_rows(planes, rows),
        }
    }

    /// Completes all files and gives them their names; returns statistics of the pictures.
    ///
    /// # Errors
    /// If rows are missing or the system refuses.
    pub fn finish(self) -> Result<Vec<WriteStats>, WriteError> {
        match self {
            Self::Glb(writer) => writer.finish(),
            Self::Bundle(writer) => writer.finish(),
        }
    }
}
