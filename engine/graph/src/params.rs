//! The parameters of a graph: their declarations and their allowed values.
use super::color_names::color_meant;
use super::part::{Entry, Shape, SyntaxValue};
use super::read::{self, mismatch, not_finite, shorten};
use super::report::Report;
use super::ron_text::ron_string;
use super::schema::{self, PARAM_TYPES};
use crate::diagnostics::{Code, Span};
use crate::expression::{Meaning, UserFunction, Value};
use crate::node::{ParamType, parse_color};
use crate::syntax::is_name;
use crate::value::Canvas;
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A parameter as declared.
#[derive(Debug)]
pub(super) struct ParamDecl {
    pub(super) name: String,
    pub(super) key: SyntaxValue,
    pub(super) ty: ParamType,
    pub(super) default: SyntaxValue,
    pub(super) range: Option<(f64, f64)>,
    pub(super) unit: Option<String>,
    pub(super) group: Option<String>,
    pub(super) doc: String,
    pub(super) options: Vec<String>,
}

/// The value of a parameter.
#[derive(Clone, Debug)]
pub(super) struct ParamValue {
    /// The value as RON.
    pub(super) text: String,
    /// The value in an expression; `None` for a text.
    pub(super) meaning: Option<Meaning>,
    /// The value is a text or a path.
    pub(super) is_text: bool,
    /// The place of the value.
    pub(super) span: Span,
    /// The value was given outside the file that declares the parameter.
    pub(super) outside: bool,
    /// The folder that a path is relative to.
    pub(super) base: Option<PathBuf>,
}

/// Values by name; `None` for a faulty parameter.
pub(super) type Values = BTreeMap<String, Option<ParamValue>>;

/// Functions by name.
pub(super) type Callable = BTreeMap<String, Arc<UserFunction>>;

/// Facts of the canvas that expressions can use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Facts {
    pub(super) size_mm: [f64; 2],
    pub(super) seed: u64,
}

impl Facts {
    /// The facts of a canvas.
    pub(super) fn of(canvas: &Canvas) -> Self {
        Self { size_mm: canvas.size_mm.to_array(), seed: canvas.seed }
    }
}

/// The current values. All uses of a graph share its defaults.
#[derive(Clone, Default)]
pub(super) struct Params {
    defaults: Arc<Values>,
    given: Values,
    /// `None` while the canvas is being read.
    pub(super) facts: Option<Facts>,
    /// Parameters that depend on the canvas, while it is being read.
    pub(super) late: BTreeSet<String>,
    /// The names of the nodes in the graph of the parameters.
    pub(super) nodes: Arc<BTreeSet<String>>,
    /// The functions that formulas in parameters call: those of the graph, and `name.function` of its imports.
    pub(super) functions: Arc<Callable>,
    /// True if a value was requested that is unknown until the canvas is known.
    pub(super) asked_early: Cell<bool>,
}

impl Params {
    /// Parameters that all have their defaults.
    pub(super) fn new(defaults: Arc<Values>) -> Self {
        Self { defaults, ..Self::default() }
    }

    /// Replaces the defaults.
    pub(super) fn set_defaults(&mut self, defaults: Arc<Values>) {
        self.defaults = defaults;
    }

    /// Returns true if a parameter was given another value.
    pub(super) fn is_given(&self, name: &str) -> bool {
        self.given.contains_key(name)
    }

    /// The default of a parameter.
    pub(super) fn default_of(&self, name: &str) -> Option<&ParamValue> {
        self.defaults.get(name)?.as_ref()
    }

    /// Sets the value of a parameter.
    pub(super) fn give(&mut self, name: String, value: Option<ParamValue>) {
        self.given.insert(name, value);
    }

    /// Sets the values of several parameters.
    pub(super) fn give_all(&mut self, values: Values) {
        self.given.extend(values);
    }

    /// The value of the parameter of that name, if there is one; its value is `None` after an error.
    pub(super) fn get(&self, name: &str) -> Option<Option<&ParamValue>> {
        self.given.get(name).or_else(|| self.defaults.get(name)).map(Option::as_ref)
    }

    /// Returns true if a parameter depends on the canvas, which is not known yet.
    pub(super) fn is_late(&self, name: &str) -> bool {
        let late = self.late.contains(name) && !self.given.contains_key(name);
        if late {
            self.asked_early.set(true);
        }
        late
    }

    /// All names.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.defaults.keys().map(String::as_str)
    }
}

/// Reads the declaration of a parameter; reports errors.
pub(super) fn declare(entry: &Entry, report: &mut Report) -> Option<ParamDecl> {
    read::check_name(&entry.key, &entry.name, "a parameter", report);
    let Some((word, Some(body))) = entry.value.head() else {
        report.push(mismatch(&entry.value, &format!("parameter `{}`", entry.name), "like `Number(default: 1)`"));
        return None;
    };
    let Some(ty) = PARAM_TYPES.into_iter().find(|ty| ty.name() == word.str()) else {
        let message = format!("there is no type of parameters `{}`", shorten(word.str()));
        report.unknown(word.error(Code::UnknownVariant, message), word.str(), "type", PARAM_TYPES.map(ParamType::name));
        return None;
    };
    let fields = read::fields(&body, &format!("`{}`", ty.name()), &schema::param(ty.name()), report)?;
    let Some(default) = read::get(&fields, "default") else {
        let message = format!("parameter `{}` has no `default`", entry.name);
        report.push(word.error(Code::MissingInput, message));
        return None;
    };
    let decl = ParamDecl {
        name: entry.name.clone(),
        key: entry.key.clone(),
        ty,
        default: default.clone(),
        range: read::get(&fields, "range").and_then(|part| range(part, report)),
        unit: read::get(&fields, "unit").and_then(|part| read::text(part, "unit", report)),
        group: read::get(&fields, "group").and_then(|part| read::text(part, "group", report)),
        doc: read::get(&fields, "doc").and_then(|part| read::text(part, "doc", report)).unwrap_or_default(),
        options: read::get(&fields, "options").map(|part| options(part, report)).unwrap_or_default(),
    };
    Some(decl)
}

/// Two numbers, the smaller first.
pub(super) fn range(part: &SyntaxValue, report: &mut Report) -> Option<(f64, f64)> {
    let (lo, hi) = read::pair(part, "range", report)?;
    if lo < hi {
        return Some((lo, hi));
    }
    let message = format!("range is `{}`; the smaller number must come first", part.str());
    report.push(part.error(Code::OutOfRange, message));
    None
}

fn options(part: &SyntaxValue, report: &mut Report) -> Vec<String> {
    let Shape::List(items) = part.shape() else {
        report.push(mismatch(part, "`options`", "a list of words, `[\"A\", \"B\"]`"));
        return Vec::new();
    };
    let mut words = Vec::new();
    for item in items {
        match item.shape() {
            Shape::Text(word) | Shape::Word(word) if is_name(&word) => words.push(word),
            Shape::Text(word) => {
                let message = format!("`{}` cannot be an option", shorten(&word));
                report.push(item.error(Code::BadName, message).help("an option is a word"));
            }
            _ => report.push(mismatch(&item, "an option", "a word")),
        }
    }
    words
}

impl ParamDecl {
    /// Returns true if a value on the command line may be written without quotes.
    pub(super) fn takes_bare_text(&self) -> bool {
        matches!(self.ty, ParamType::Color | ParamType::Text | ParamType::Path)
    }

    /// Checks a value; a path is relative to `folder`.
    pub(super) fn value(
        &self,
        part: &SyntaxValue,
        outside: bool,
        folder: &Path,
        report: &mut Report,
    ) -> Option<ParamValue> {
        let shape = part.shape();
        let mut value = ParamValue {
            text: part.str().to_owned(),
            meaning: None,
            is_text: false,
            span: part.span(),
            outside,
            base: None,
        };
        match (self.ty, &shape) {
            (ParamType::Number | ParamType::Integer, Shape::Number(number)) => {
                self.check_number(part, *number, report)?;
                value.meaning = Some(Meaning::Known(Value::Number(*number)));
            }
            (ParamType::Bool, Shape::Word(word)) if word == "true" || word == "false" => {
                value.meaning = Some(Meaning::Known(Value::Bool(word == "true")));
            }
            (ParamType::Color, Shape::Text(color)) if parse_color(color).is_some() => {
                let rgb = parse_color(color).unwrap_or_default().map(f64::from);
                value.meaning = Some(Meaning::Known(Value::Vector(rgb.to_vec())));
            }
            (ParamType::Color, Shape::Tuple(items)) if items.len() == 3 => {
                let mut rgb = Vec::with_capacity(3);
                for item in items {
                    rgb.push(read::number(item, &self.name, report)?);
                }
                value.meaning = Some(Meaning::Known(Value::Vector(rgb)));
            }
            (ParamType::Text | ParamType::Path, Shape::Text(text)) => {
                value.text = ron_string(text);
                value.is_text = true;
                value.base = (self.ty == ParamType::Path).then(|| folder.to_owned());
            }
            (ParamType::Choice, Shape::Text(word) | Shape::Word(word)) => {
                self.check_choice(part, word, report)?;
                value.text.clone_from(word);
                value.meaning = Some(Meaning::Choice(word.clone(), self.options.clone()));
            }
            _ => {
                let error = mismatch(part, &format!("parameter `{}`", self.name), self.ty.expected());
                let meant = match (self.ty, &shape) {
                    (ParamType::Color, Shape::Text(text)) => color_meant(text),
                    _ => None,
                };
                report.push(match meant {
                    Some(color) => error.help(format!("write `\"{color}\"`")),
                    None => error,
                });
                return None;
            }
        }
        Some(value)
    }

    fn check_number(&self, part: &SyntaxValue, number: f64, report: &mut Report) -> Option<()> {
        if !number.is_finite() {
            report.push(not_finite(part, &self.name));
            return None;
        }
        if self.ty == ParamType::Integer && (number.fract() != 0.0 || part.str().contains(['.', 'e', 'E'])) {
            report.push(mismatch(part, &format!("parameter `{}`", self.name), self.ty.expected()));
            return None;
        }
        if let Some((lo, hi)) = self.range.filter(|(lo, hi)| number < *lo || number > *hi) {
            let unit = self.unit.as_ref().map(|unit| format!(" {unit}")).unwrap_or_default();
            let message = format!("{} is `{}`; it must be between {lo} and {hi}{unit}", self.name, part.str());
            report.push(part.error(Code::OutOfRange, message).related(self.key.span(), "declared here"));
            return None;
        }
        Some(())
    }

    fn check_choice(&self, part: &SyntaxValue, word: &str, report: &mut Report) -> Option<()> {
        if self.options.iter().any(|option| option == word) {
            return Some(());
        }
        let message = format!("parameter `{}` has no option `{}`", self.name, shorten(word));
        let options = self.options.iter().map(String::as_str);
        report.unknown(part.error(Code::UnknownVariant, message), word, "option", options);
        None
    }
}
