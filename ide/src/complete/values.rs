//! Completion of values: after a colon, and between quotes.
use super::super::expect::Expect;
use super::super::file::Section;
use super::super::view::Value;
use super::super::walk::{Visit, walk};
use super::{Ask, Completion, Sort, Topic};
use shibo_graph::schema::PARAM_TYPES;
use shibo_node::{ParamType, parse_color};
use shibo_picture::export::{ExportTarget, TARGETS};
use shibo_value::{Accepts, Type};
use std::collections::BTreeMap;
use std::ops::Range;

impl<'a> Ask<'a> {
    /// Completes after a colon.
    pub(super) fn value(&self, expect: Expect<'a>) -> Vec<Completion> {
        let mut found = self.choices(expect);
        let declared = self.declared(expect);
        if declared.as_deref() == Some("Bool") {
            found.extend(self.bools());
        }
        if expect.takes_nodes() && declared.is_none() {
            found.extend(self.kinds(expect).into_iter().map(|c| Completion { score: c.score + 20.0, ..c }));
        }
        if let Some(fits) = expect.reference(self.cx) {
            found.extend(self.references(expect, &|ty| fitness(ty, fits)));
        }
        match expect {
            Expect::Entry(Section::Params, _) => found.extend(self.declarations(PARAM_TYPES.map(|ty| ty.name()))),
            Expect::Entry(Section::Inputs, _) => found.extend(self.declarations(Accepts::all().map(Accepts::name))),
            Expect::Entry(Section::Outputs, _) => found.extend(self.output_forms()),
            Expect::Value(_, param) => {
                found.extend(self.default(&param.written));
                if param.ty == ParamType::Bool {
                    found.extend(self.bools());
                }
            }
            _ => {}
        }
        found.extend(self.params(expect));
        if takes_color(expect) {
            found.extend(self.colors_used());
        }
        if let Some(names) = self.named(expect) {
            found.extend(names);
        }
        found
    }

    /// Completes between quotes: `typed` is the text before the cursor, `inside` the range of the whole text.
    pub(super) fn text(&mut self, expect: Expect<'a>, typed: &str, inside: Range<usize>) -> Vec<Completion> {
        self.replace = inside.start..self.word_end(inside.end);
        match expect {
            Expect::Note => return Vec::new(),
            Expect::Entry(Section::Imports, _) => return self.import_paths(typed, inside),
            Expect::Use(_, _, Some("preset")) => {
                let start = typed.rfind('+').map_or(0, |i| i + 1);
                self.replace.start = inside.start + start;
            }
            Expect::Value(_, param) if param.ty == ParamType::Path && !typed.starts_with('$') => {
                let mut found = self.files(typed, inside);
                found.extend(self.params(expect));
                return found;
            }
            _ => {}
        }
        let mut found = self.named(expect).unwrap_or_default();
        found.extend(self.declared_options(expect));
        if let Some(fits) = expect.reference(self.cx) {
            let fits = |ty| fitness(ty, fits);
            found.extend(self.references(expect, &fits));
            if let Some((base, _)) = typed.rsplit_once('.') {
                found.extend(self.behind(base, &fits));
            }
        }
        if takes_color(expect) {
            found.extend(self.colors_used());
        }
        found.extend(self.params(expect));
        found
    }

    /// Imports and presets, where one is expected.
    fn named(&self, expect: Expect<'a>) -> Option<Vec<Completion>> {
        let names: Vec<String> = match expect {
            Expect::Use(_, _, Some("graph")) => {
                let used = self.cx.file.entries(Section::Nodes);
                let count = |name: &str| {
                    let uses = |v: &&Value| self.cx.file.text_of(v, "graph") == Some(name);
                    used.iter().filter_map(|item| item.value.as_ref()).filter(uses).count()
                };
                let locals = self.cx.file.locals().filter_map(|local| local.local_name().map(str::to_owned));
                let mut names: Vec<String> = self.cx.file.names(Section::Imports).map(str::to_owned).collect();
                names.extend(locals);
                names.sort_by_key(|name| count(name));
                names
            }
            Expect::Use(args, _, Some("preset")) => {
                let import = args.value("graph").and_then(Value::text)?;
                let file = self.cx.imported(import)?;
                file.names(Section::Presets).map(str::to_owned).collect()
            }
            Expect::Param("Choice", Some("default")) => {
                self.cx.file.options(self.trail.entry().and_then(|(_, item)| item.name())?)
            }
            _ => return None,
        };
        let offer =
            |(i, name): (usize, &String)| self.offer_text(name, Sort::Name, "", Topic::Text(String::new()), i as f64);
        Some(names.iter().enumerate().map(offer).collect())
    }

    /// Parameters of the graph as `$name`; those of a matching type and name come first.
    pub(super) fn params(&self, expect: Expect<'a>) -> Vec<Completion> {
        let mut found = Vec::new();
        let point = matches!(expect, Expect::Port(_, port, _) if !super::super::docs::only_wires(port));
        if point && !self.quoted {
            found.push(self.any_formula("a formula", 40.0));
        }
        let Some(fits) = param_types(expect, self) else { return found };
        let file = self.cx.file;
        let field = self.port_name(expect);
        let habits = self.cx.world.habits();
        let alike = self.alike(field);
        for (i, item) in file.entries(Section::Params).iter().enumerate() {
            let Some(name) = item.name() else { continue };
            let head = file.head(item).unwrap_or_default();
            let label = format!("${name}");
            let mut score = 0.02 * i as f64;
            score += if fits.contains(&head) { 0.0 } else { 6.0 };
            score += match expect {
                Expect::Port(_, port, _) if super::super::docs::only_wires(port) => 6.0,
                Expect::Port(..) => 3.0,
                _ => 0.0,
            };
            score -= if name == field { 6.0 } else { 0.0 };
            let part = name.split('_').any(|a| field.split('_').any(|b| a == b));
            score -= if part && name != field { 2.0 } else { 0.0 };
            score -= 1.5 * (1.0 + habits.param(field, name)).ln();
            score -= 2.5 * (1.0 + alike.get(label.as_str()).copied().unwrap_or_default()).ln();
            let doc = item.value.as_ref().and_then(|value| file.text_of(value, "doc")).unwrap_or_default();
            found.push(self.offer_text(&label, Sort::Param, head, Topic::Text(doc.to_owned()), score));
        }
        if matches!(expect, Expect::Value(..) | Expect::With(..)) && !self.quoted && !found.is_empty() {
            found.push(self.any_formula("an expression", 9.0));
        }
        if self.trail.levels.iter().any(|level| matches!(level.inside, Expect::Use(_, true, _))) {
            let doc = "The number of the instance, from 0.".to_owned();
            found.push(self.offer_text("$index", Sort::Param, "Integer", Topic::Text(doc), 3.0));
        }
        found
    }

    /// The quotes of a formula.
    pub(super) fn any_formula(&self, what: &str, score: f64) -> Completion {
        let offer = self.offer("= …", Sort::Value, what, Topic::Text(String::new()), score);
        Completion { insert: "\"= $0\"".to_owned(), snippet: true, ..offer }
    }

    /// Texts of fields of this name elsewhere in the file, with counts.
    fn alike(&self, field: &str) -> BTreeMap<&'a str, f64> {
        struct Texts<'a, 'f> {
            field: &'f str,
            at: usize,
            found: BTreeMap<&'a str, f64>,
        }
        impl<'a> Visit<'a> for Texts<'a, '_> {
            fn key(&mut self, inside: Expect<'a>, item: &'a super::super::view::Item) {
                let text = item.value.as_ref().and_then(Value::text);
                let here = item.range.start <= self.at && self.at <= item.range.end;
                let node = matches!(inside, Expect::Kind(_) | Expect::With(..) | Expect::Struct(_));
                if let Some(text) = text.filter(|t| t.starts_with('$') && node && !here)
                    && item.name() == Some(self.field)
                {
                    *self.found.entry(text).or_default() += 1.0;
                }
            }

            fn value(&mut self, _expect: Expect<'a>, _value: &'a Value) {}
        }
        let mut texts = Texts { field, at: self.at, found: BTreeMap::new() };
        walk(self.cx, &mut texts);
        texts.found
    }

    /// Colours of this file, the most frequent first.
    pub(super) fn colors_used(&self) -> Vec<Completion> {
        struct Colors<'a>(BTreeMap<&'a str, usize>, usize);
        impl<'a> Visit<'a> for Colors<'a> {
            fn key(&mut self, _inside: Expect<'a>, _item: &'a super::super::view::Item) {}

            fn value(&mut self, _expect: Expect<'a>, value: &'a Value) {
                let here = value.range.start <= self.1 && self.1 <= value.range.end;
                if let Some(text) = value.text().filter(|t| t.starts_with('#') && parse_color(t).is_some() && !here) {
                    *self.0.entry(text).or_default() += 1;
                }
            }
        }
        let mut colors = Colors(BTreeMap::new(), self.at);
        walk(self.cx, &mut colors);
        let offer = |(color, count): (&&str, &usize)| {
            let topic = Topic::Text(String::new());
            self.offer_text(color, Sort::Color, "used in this file", topic, 12.0 - (*count).min(10) as f64 * 0.1)
        };
        colors.0.iter().map(offer).collect()
    }

    /// Declarations of these types, in this order.
    fn declarations<'t>(&self, types: impl IntoIterator<Item = &'t str>) -> Vec<Completion> {
        types.into_iter().enumerate().map(|(index, ty)| self.declaration(ty, index as f64)).collect()
    }

    /// A declaration of this type with its required fields.
    fn declaration(&self, ty: &str, score: f64) -> Completion {
        let default = match ty {
            "Number" | "Gray" | "Field" | "EveryField" | "Direction" => "${1:0.5}",
            "Integer" => "${1:1}",
            "Bool" => "${1:true}",
            "Color" | "Rgb" => "\"${1:#808080}\"",
            _ => "\"$1\"",
        };
        let body = match ty {
            "Choice" => "options: [\"$2\"], default: \"$1\", doc: \"$3\"".to_owned(),
            "Number" | "Integer" => format!("default: {default}, range: ($2), doc: \"$3\""),
            _ => format!("default: {default}, doc: \"$2\""),
        };
        let offer = self.offer(ty, Sort::Kind, "", Topic::Text(String::new()), score);
        if self.cx.file.text[self.replace.end..].trim_start().starts_with('(') {
            return offer;
        }
        Completion { insert: format!("{ty}({body})$0"), snippet: true, ..offer }
    }

    fn output_forms(&self) -> Vec<Completion> {
        let form = |label: &str, detail: &str, field: &str| {
            let offer = self.offer(label, Sort::Kind, detail, Topic::Text(String::new()), 30.0);
            let bare = self.cx.file.text[self.replace.end..].trim_start().starts_with('(');
            let insert = if bare { label.to_owned() } else { format!("{label}({field}: \"$1\"$0)") };
            Completion { insert, snippet: !bare, ..offer }
        };
        let target = |target: &&dyn ExportTarget| {
            let info = target.info();
            info.fields.first().map(|first| form(info.name, info.doc, first.name))
        };
        let file = form("File", "with settings of the file", "from");
        [file].into_iter().chain(TARGETS.iter().filter_map(target)).collect()
    }

    fn bools(&self) -> Vec<Completion> {
        ["true", "false"].map(|word| self.offer(word, Sort::Choice, "", Topic::Text(String::new()), 0.0)).into()
    }

    /// Default value of a parameter.
    fn default(&self, written: &str) -> Option<Completion> {
        let plain = !written.is_empty() && written.len() < 60 && !written.contains("None");
        let word = written.starts_with(|c: char| c.is_ascii_alphabetic());
        (plain && !word && !self.quoted)
            .then(|| self.offer(written, Sort::Value, "the default", Topic::Text(String::new()), 15.0))
    }
}

/// Penalty for a value of a type where another one is wanted, or any type.
fn fitness(ty: Option<Accepts>, wanted: Option<Accepts>) -> f64 {
    match (ty, wanted) {
        (_, None) => 0.0,
        (Some(ty), Some(wanted)) if ty == wanted => 0.0,
        (Some(ty), Some(wanted)) if ty.fits(wanted) => 0.3,
        (None, Some(_)) => 1.5,
        _ => 1000.0,
    }
}

/// Returns whether a literal colour is allowed here.
fn takes_color(expect: Expect<'_>) -> bool {
    match expect {
        Expect::Port(_, port, _) => Type::Rgb.fits(port.ty) && port.ty != Accepts::One(Type::Normal),
        Expect::Value(_, param) => matches!(param.ty, ParamType::Color | ParamType::List),
        Expect::Param("Color", Some("default")) | Expect::Preset(_) | Expect::Any => true,
        Expect::With(_, Some(_)) => true,
        _ => false,
    }
}

/// Types of parameters allowed here; `None` if no parameter is.
fn param_types(expect: Expect<'_>, ask: &Ask<'_>) -> Option<&'static [&'static str]> {
    let numbers: &[&str] = &["Number", "Integer", "Bool"];
    Some(match expect {
        Expect::Port(_, port, _) if Type::Rgb.fits(port.ty) && !Type::Gray.fits(port.ty) => &["Color"],
        Expect::Port(_, port, _) if port.ty == Accepts::One(Type::Rgb) => &["Color", "Number"],
        Expect::Port(..) => numbers,
        Expect::Value(_, param) => match param.ty {
            ParamType::Color => &["Color"],
            ParamType::Text => &["Text"],
            ParamType::Path => &["Path"],
            ParamType::Choice => &["Choice"],
            ParamType::Bool => &["Bool"],
            ParamType::List | ParamType::Value => &["Color", "Number"],
            _ => numbers,
        },
        Expect::With(import, Some(name)) => {
            let file = ask.cx.imported(import);
            let head = file.as_ref().and_then(|file| {
                let item = file.entry(Section::Params, name).or_else(|| file.entry(Section::Inputs, name))?;
                file.head(item)
            });
            match head {
                Some("Color" | "Rgb") => &["Color"],
                Some("Text") => &["Text"],
                Some("Path") => &["Path"],
                Some("Choice") => &["Choice"],
                Some("Bool") => &["Bool"],
                _ => numbers,
            }
        }
        Expect::Canvas(Some(_)) | Expect::Layout(Some(_)) | Expect::Param(_, Some("default")) | Expect::Any => numbers,
        Expect::Use(_, _, Some("seed" | "over")) => numbers,
        Expect::Use(_, _, Some("preset")) => &["Text", "Choice"],
        _ => return None,
    })
}
