//! Targets: the formats of other programs that graphs are written in.
//!
//! A target is one file with an `impl ExportTarget`, and its entry in the table
//! [`TARGETS`]. The loader, editors, the command line,
//! the Python module, the planning of files and the writing follow from it.
use super::TARGETS;
use super::bundle::{Bundle, BundleWriter, ExportContext};
use super::colors::Colors;
use super::decl::{FieldDecl, Takes};
use super::glb::GlbWriter;
use super::gltf::Exported;
use super::heights::{Heights, HeightsWriter, Maker, Stop, Told};
use super::shape::Shape;
use crate::value::diagnostics::Problem;
use crate::value::{Channel, Field, Material, Mesh};
use crate::{Compression, WriteError, WriteStats};
use glam::UVec2;
use std::fmt;
use std::io;
use std::path::Path;
use std::sync::Arc;

/// The target with this word in graph files.
pub fn target_named(name: &str) -> Option<&'static dyn ExportTarget> {
    TARGETS.iter().copied().find(|target| target.info().name == name)
}

/// A format of another program.
pub trait ExportTarget: Sync {
    /// Its names and fields.
    fn info(&self) -> &'static TargetInfo;

    /// The files that it makes.
    fn plan(&self, options: &Options) -> Plan;

    /// True if the files are bodies, whose triangles and form the options `triangles`, `over` and `format` choose.
    fn is_body(&self) -> bool {
        false
    }

    /// Options that contradict each other.
    fn check(&self, _options: &Options) -> Option<Problem> {
        None
    }

    /// The pictures and documents of an output. Fields are not evaluated here.
    ///
    /// # Errors
    /// A document cannot be written.
    fn write(&self, source: &Source<'_>, options: &Options) -> io::Result<Files>;
}

/// A choice for `--as`: its name, one sentence, and the options that it sets.
pub type Variant = (&'static str, &'static str, &'static [(&'static str, OptionValue)]);

/// The names and the fields of a target.
#[derive(Debug)]
pub struct TargetInfo {
    /// The word in graph files: `Gltf` in `Gltf(material: "node")`.
    pub name: &'static str,
    /// The name in messages.
    pub title: &'static str,
    /// One sentence for editors.
    pub doc: &'static str,
    /// The fields of its brackets in graph files: one that takes a [`Takes::Material`], which must be written, or some
    /// that take a [`Takes::Gray`], of which one must be written, or one that takes a [`Takes::Height`] or a
    /// [`Takes::Body`]; and options.
    pub fields: &'static [FieldDecl],
    /// The choices for all materials of a graph, `shibo render --as NAME`: name, one sentence, and options.
    pub variants: &'static [Variant],
}

impl TargetInfo {
    /// Returns true if its files contain a mesh.
    pub fn has_mesh(&self) -> bool {
        self.fields.iter().any(|field| matches!(field.takes, Takes::Mesh))
    }

    /// Returns true if its files are a mesh alone.
    pub fn has_body(&self) -> bool {
        self.fields.iter().any(|field| matches!(field.takes, Takes::Body))
    }

    /// Returns true if its files are made of a height.
    pub fn has_height(&self) -> bool {
        self.fields.iter().any(|field| matches!(field.takes, Takes::Height))
    }
}

/// A target with options.
#[derive(Clone)]
pub struct Chosen {
    /// The target.
    pub target: &'static dyn ExportTarget,
    /// Its options.
    pub options: Options,
}

impl Chosen {
    /// The choices on the command line, in the order of [`TARGETS`]: name, one sentence, and the target.
    pub fn variants() -> Vec<(&'static str, &'static str, Self)> {
        let of = |target: &'static dyn ExportTarget| {
            let info = target.info();
            let chosen = move |options: &[_]| Self { target, options: Options::new(info.fields, options) };
            info.variants.iter().map(move |(name, doc, options)| (*name, *doc, chosen(options)))
        };
        TARGETS.iter().copied().flat_map(of).collect()
    }

    /// The files that it makes.
    pub fn plan(&self) -> Plan {
        self.target.plan(&self.options)
    }

    /// The same body for a view: as PLY, z up, and its report. A body of a height has at most `triangles` triangles. `None`
    /// for files that are no body.
    pub fn preview(&self, triangles: f64) -> Option<Self> {
        let changes = [
            ("format", OptionValue::Word("Ply")),
            ("over", OptionValue::Word("Coarsen")),
            ("triangles", OptionValue::Numbers([triangles].into())),
            ("report", OptionValue::Truth(true)),
            ("up", OptionValue::Word("Z")),
        ];
        let changed = |(name, value): &(&'static str, OptionValue)| {
            let change = changes.iter().find(|(option, _)| option == name);
            (*name, change.map_or_else(|| value.clone(), |(_, value)| value.clone()))
        };
        let options = Options(self.options.0.iter().map(changed).collect());
        self.target.is_body().then_some(Self { target: self.target, options })
    }
}

impl fmt::Debug for Chosen {
    /// Formats the target with all options, as for keys.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut list = f.debug_struct(self.target.info().name);
        for (name, value) in &self.options.0 {
            list.field(name, value);
        }
        list.finish()
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
    /// True if the files may come from a cache.
    pub cached: bool,
}

impl Plan {
    /// A main file with the pictures of channels beside it.
    pub(super) const fn several(extension: &'static str) -> Self {
        Self { extension, one_file: false, also: &[], cached: false }
    }

    /// One file.
    pub(super) const fn one(extension: &'static str) -> Self {
        Self { extension, one_file: true, also: &[], cached: true }
    }

    /// One file, and a report beside it if wanted. It is made in each run, because the run tells its figures.
    pub(super) const fn body(extension: &'static str, report: bool) -> Self {
        Self { extension, one_file: true, also: if report { &["report"] } else { &[] }, cached: false }
    }
}

/// The options of a target by name, in the order of its fields. A quality that was not written is missing.
#[derive(Clone, Debug)]
pub struct Options(Vec<(&'static str, OptionValue)>);

/// The value of an option.
#[derive(Clone, PartialEq)]
pub enum OptionValue {
    /// For [`Takes::Truth`].
    Truth(bool),
    /// For [`Takes::Words`] and [`Takes::Word`]: one of the words.
    Word(&'static str),
    /// For [`Takes::Quality`], 1 to 100.
    Quality(u8),
    /// For [`Takes::Numbers`]: all numbers, pairs one after another.
    Numbers(Arc<[f64]>),
}

impl fmt::Debug for OptionValue {
    /// Formats the value as in a graph file.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Truth(value) => value.fmt(f),
            Self::Word(word) => f.write_str(word),
            Self::Quality(value) => value.fmt(f),
            Self::Numbers(values) => values.fmt(f),
        }
    }
}

impl Options {
    /// The options that are given, and the defaults of the others.
    pub fn new(fields: &[FieldDecl], given: &[(&str, OptionValue)]) -> Self {
        let value = |field: &FieldDecl| {
            let given = given.iter().find(|(name, _)| *name == field.name).map(|(_, value)| value.clone());
            given.or_else(|| match field.takes {
                Takes::Truth(value) => Some(OptionValue::Truth(value)),
                Takes::Words(words) => words().first().copied().map(OptionValue::Word),
                Takes::Numbers(numbers) => match (numbers.words)().first() {
                    Some(word) => Some(OptionValue::Word(word)),
                    None => (!numbers.default.is_empty()).then(|| OptionValue::Numbers(numbers.default.into())),
                },
                _ => None,
            })
        };
        Self(fields.iter().filter_map(|field| Some((field.name, value(field)?))).collect())
    }

    fn get(&self, name: &str) -> Option<&OptionValue> {
        self.0.iter().find(|(known, _)| *known == name).map(|(_, value)| value)
    }

    /// The numbers of an option, if it has some.
    pub fn numbers(&self, name: &str) -> Option<&[f64]> {
        if let Some(OptionValue::Numbers(numbers)) = self.get(name) { Some(numbers) } else { None }
    }

    /// The only number of an option, if it has one.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.numbers(name)?.first().copied()
    }

    /// Returns true if an option is `true`.
    pub fn is(&self, name: &str) -> bool {
        self.get(name) == Some(&OptionValue::Truth(true))
    }

    /// The meaning of the word that an option has; the first choice if it has none.
    pub fn word<T: Copy, const N: usize>(&self, name: &str, choices: &[(&'static str, T); N]) -> T {
        let chosen = choices.iter().find(|(word, _)| self.get(name) == Some(&OptionValue::Word(word)));
        chosen.unwrap_or(&choices[0]).1
    }

    /// The format of colours, from the options `colors` and `quality`.
    pub fn colors(&self) -> Colors {
        match (self.word("colors", &Colors::ALL), self.get("quality")) {
            (false, _) => Colors::Png,
            (true, Some(OptionValue::Quality(quality))) => Colors::Jpeg(*quality),
            (true, _) => Colors::Jpeg(Colors::QUALITY),
        }
    }
}

/// The contents of an output.
pub struct Source<'a> {
    /// The material; without channels if the target takes none.
    pub material: &'a Material,
    /// The mesh that shows the material: a plane if the target takes none.
    pub shape: &'a Shape,
    /// The mesh for [`Takes::Body`].
    pub mesh: Option<Arc<Mesh>>,
    /// The fields for [`Takes::Gray`] and [`Takes::Height`], by the names of the target's fields.
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
    /// Files of a height that are made when all of it is known, or of a mesh.
    Heights(Heights),
}

impl Files {
    /// The fields of all pictures, one picture after another.
    pub fn fields(&self) -> Vec<Field> {
        match self {
            Self::Glb(export) => export.0.textures.iter().flat_map(|texture| texture.fields.clone()).collect(),
            Self::Bundle(bundle) => bundle.maps.iter().flat_map(|map| map.fields.clone()).collect(),
            Self::Heights(heights) => heights.field.iter().cloned().collect(),
        }
    }

    /// The names of all files; empty if there is only the main one.
    pub fn names(&self) -> Vec<String> {
        match self {
            Self::Glb(export) => export.0.files().collect(),
            Self::Bundle(bundle) => bundle.files().map(str::to_owned).collect(),
            Self::Heights(heights) => heights.maker.names(),
        }
    }

    /// The channels that the format cannot express.
    pub fn lost(&self) -> Vec<Channel> {
        match self {
            Self::Glb(export) => export.0.lost(),
            Self::Bundle(bundle) => bundle.lost.clone(),
            Self::Heights(_) => Vec::new(),
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
            Self::Heights(heights) => {
                let folder = path.parent().unwrap_or_else(|| Path::new(""));
                FilesWriter::Heights(Box::new(HeightsWriter::new(heights, folder, size.0, how.1)))
            }
        })
    }
}

impl Heights {
    /// True if the whole height is held in memory.
    pub fn is_held(&self) -> bool {
        !self.maker.spools()
    }

    /// Files made by `maker` of the height of a source, if it has one.
    pub(super) fn of(source: &Source<'_>, maker: Arc<dyn Maker>) -> Self {
        let field = source.fields.first().map(|(_, field)| field.clone());
        Self { field, place: source.place.clone(), maker }
    }
}

/// The files of an output while their rows are computed. Dropping the writer leaves no files.
#[derive(Debug)]
pub enum FilesWriter {
    /// A glTF file.
    Glb(Box<GlbWriter>),
    /// Pictures and documents.
    Bundle(Box<BundleWriter>),
    /// Files of a height.
    Heights(Box<HeightsWriter>),
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
            Self::Heights(writer) => writer.add(planes),
        }
    }

    /// Makes files that need all rows, without their names. `findings` are the warnings about the values and the results
    /// that they were made of, for reports. After that, [`finish`](Self::finish) fails only if rows are missing or the
    /// system refuses.
    ///
    /// # Errors
    /// If files cannot be made of these values, or the system refuses.
    pub fn complete(&mut self, findings: Vec<Problem>, stop: Stop<'_>) -> Result<(), WriteError> {
        if let Self::Heights(writer) = self { writer.complete(findings, stop) } else { Ok(()) }
    }

    /// Texts for the user about files that [`complete`](Self::complete) made.
    pub fn told(&self) -> Told {
        if let Self::Heights(writer) = self { writer.told() } else { Told::default() }
    }

    /// Completes all files and gives them their names; returns statistics of the pictures.
    ///
    /// # Errors
    /// If rows are missing or the system refuses.
    pub fn finish(self) -> Result<Vec<WriteStats>, WriteError> {
        match self {
            Self::Glb(writer) => writer.finish(),
            Self::Bundle(writer) => writer.finish(),
            Self::Heights(writer) => writer.finish(),
        }
    }
}
