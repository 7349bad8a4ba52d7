//! Declarations of the fields that may stand in brackets of a graph file.
use super::colors::Colors;
use super::solids::SimpleShape;
use crate::value::{Atlas, Carried, Type};

/// A field in brackets, `(name: value)`.
#[derive(Clone, Copy, Debug)]
pub struct FieldDecl {
    /// The name before the colon.
    pub name: &'static str,
    /// What the field is for, in a sentence of Markdown.
    pub doc: &'static str,
    /// The values that it takes.
    pub takes: Takes,
}

impl FieldDecl {
    /// A field of this name and description that takes such values.
    pub const fn new(name: &'static str, doc: &'static str, takes: Takes) -> Self {
        Self { name, doc, takes }
    }

    /// The description with the words that may stand there, for manuals and editors.
    pub fn manual(&self) -> String {
        match self.takes {
            Takes::Truth(default) => format!("{} Default `{default}`.", self.doc),
            Takes::Numbers(numbers) => format!("{} {}", self.doc, numbers.manual()),
            Takes::Words(words) | Takes::Word(words) => format!("{} One of `{}`.", self.doc, words().join("`, `")),
            _ => self.doc.to_owned(),
        }
    }
}

/// A field with one number.
pub(super) const fn number(
    name: &'static str,
    doc: &'static str,
    range: [f64; 2],
    default: &'static [f64],
) -> FieldDecl {
    FieldDecl::new(name, doc, Takes::Numbers(Numbers::new(NumberForm::One, range, default)))
}

/// A field with one whole number.
pub(super) const fn count(
    name: &'static str,
    doc: &'static str,
    range: [f64; 2],
    default: &'static [f64],
) -> FieldDecl {
    FieldDecl::new(name, doc, Takes::Numbers(Numbers::new(NumberForm::Whole, range, default)))
}

/// The field of a height.
pub(super) const HEIGHT: FieldDecl =
    FieldDecl::new("height", "The height in mm, or a material that has one.", Takes::Height);

/// The values that a field takes.
#[derive(Clone, Copy, Debug)]
pub enum Takes {
    /// `true` or `false`, with the value if it is left out.
    Truth(bool),
    /// One of these words; the first if it is left out.
    Words(fn() -> Vec<&'static str>),
    /// One of these words, which must be written.
    Word(fn() -> Vec<&'static str>),
    /// The quality of JPEG, a number from 1 to 100 that is rounded; only beside `colors: Jpeg`.
    Quality,
    /// The name of a node or an output that makes a material.
    Material,
    /// The name of an output that is one number per pixel.
    Gray,
    /// The name of an output that is a height in mm, or of a material with a height.
    Height,
    /// The name of an output that is a mesh, or an atlas, which has one.
    Body,
    /// Numbers, or words instead of them.
    Numbers(Numbers),
    /// The name of an output of any type.
    Output,
    /// The name of an output that is ids.
    Ids,
    /// A [`SimpleShape`], or the name of an atlas whose mesh shows the material.
    Mesh,
    /// Values of a form of its own.
    Value,
}

impl Takes {
    /// The type of the outputs whose names may stand there, `Some(None)` for any; `None` if names cannot.
    pub fn reference(self) -> Option<Option<Type>> {
        match self {
            Self::Output | Self::Body => Some(None),
            Self::Material => Some(Some(Type::Material)),
            Self::Gray => Some(Some(Type::Gray)),
            Self::Height => Some(None),
            Self::Ids => Some(Some(Type::Ids)),
            Self::Mesh => Some(Some(Atlas::TYPE)),
            _ => None,
        }
    }

    /// The words that may stand there; empty if words cannot.
    pub fn words(self) -> Vec<&'static str> {
        match self {
            Self::Truth(_) => vec!["true", "false"],
            Self::Words(words) | Self::Word(words) => words(),
            Self::Numbers(numbers) => (numbers.words)(),
            Self::Mesh => names(&SimpleShape::ALL),
            _ => Vec::new(),
        }
    }
}

/// The form of numbers in a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberForm {
    /// A number.
    One,
    /// A whole number.
    Whole,
    /// Two whole numbers, `(1, 1)`.
    Counts,
    /// A list, `[0.1, 0.2]`, whose numbers rise.
    Rising,
    /// A list of pairs, `[(0, 0), (1, 1)]`. The numbers of both columns rise.
    Pairs,
}

/// Numbers that a field takes.
#[derive(Clone, Copy, Debug)]
pub struct Numbers {
    /// Their form.
    pub form: NumberForm,
    /// The least and the greatest number.
    pub range: [f64; 2],
    /// The numbers if the field is left out; empty if there are words, of which the first is the default, or no default.
    pub default: &'static [f64],
    /// Words that may stand instead of numbers.
    pub words: fn() -> Vec<&'static str>,
}

impl Numbers {
    /// Numbers of a form within a range, with their default.
    pub const fn new(form: NumberForm, range: [f64; 2], default: &'static [f64]) -> Self {
        Self { form, range, default, words: Vec::new }
    }

    /// Numbers, or words of which the first is the default.
    pub const fn or(form: NumberForm, range: [f64; 2], words: fn() -> Vec<&'static str>) -> Self {
        Self { form, range, default: &[], words }
    }

    /// The allowed values in a sentence.
    fn manual(&self) -> String {
        let [least, most] = self.range;
        let words = (self.words)();
        let listed = if words.is_empty() { String::new() } else { format!("One of `{}`, or ", words.join("`, `")) };
        let (one, several) = if listed.is_empty() { ("A number", "Numbers") } else { ("a number", "numbers") };
        let form = match self.form {
            NumberForm::One => format!("{one} from {least} to {most}."),
            NumberForm::Whole => format!("{} whole number from {least} to {most}.", &one[..1]),
            NumberForm::Counts => format!("{several}, `(1, 1)`, whole and from {least} to {most}."),
            NumberForm::Rising => format!("{several} in a list, rising, from {least} to {most}."),
            NumberForm::Pairs => format!("{several} in a list of pairs, rising, from {least} to {most}."),
        };
        let default = match (words.first(), self.default) {
            (Some(word), _) => format!(" Default `{word}`."),
            (None, [one]) => format!(" Default {one}."),
            _ => String::new(),
        };
        format!("{listed}{form}{default}")
    }
}

/// The names of a list of choices.
pub fn names<T>(choices: &[(&'static str, T)]) -> Vec<&'static str> {
    choices.iter().map(|(name, _)| *name).collect()
}

/// The material, for targets that take one.
pub(super) const MATERIAL: FieldDecl = FieldDecl::new("material", "The material.", Takes::Material);

/// The mesh, for targets that contain one.
pub(super) const MESH: FieldDecl = FieldDecl::new(
    "mesh",
    "The mesh with the material: `Plane` (the default), `Sphere`, `Cylinder`, `Cube`, or the name of an atlas.",
    Takes::Mesh,
);

/// The format of colours, see [`Options::colors`](super::Options::colors).
pub(super) const COLORS: FieldDecl = FieldDecl::new(
    "colors",
    "The format of base colour and emission. `Jpeg` is smaller and not exact; `Png` is the default.",
    Takes::Words(|| names(&Colors::ALL)),
);

/// The quality of JPEG.
pub(super) const QUALITY: FieldDecl =
    FieldDecl::new("quality", "The quality of JPEG, from 1 to 100. Default 90.", Takes::Quality);
