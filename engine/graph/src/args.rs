//! The parameters of a node: their values, and checks that the values are allowed.
use super::explain::explain;
use super::imports;
use super::linker::Linker;
use super::part::{Shape, SyntaxValue};
use super::read::{not_finite, shorten};
use super::scope::check_note;
use super::structs::has_ports;
use super::subst::substitute;
use super::text_file::{Fault, check_file};
use crate::diagnostics::{Code, Diagnostic, Problem};
use crate::node::{Arg, Bounds, DynNode, KindInfo, ParamInfo, ParamType, Role};
use crate::picture::{is_udim, udim_files};
use crate::syntax::{TokenKind as Kind, is_infinity, number, suffix};
use crate::value::files::FileHandle;
use std::borrow::Cow;
use std::path::Path;

impl Linker<'_> {
    /// Reads the fields of a node: its wires, and its parameters with those of the graph substituted.
    pub(super) fn read_fields(&mut self, flat: usize) {
        let (args, scope) = (self.flats[flat].args.clone(), self.flats[flat].scope);
        let Some(info) = self.flats[flat].info else { return };
        let mut retired = false;
        for arg in args.iter() {
            match info.field(&arg.name) {
                None if arg.name == "note" => check_note(&arg.value, self.report),
                None => {
                    let names = info.fields.iter().map(|f| f.name.as_str());
                    let message = format!("`{}` has no field `{}`", info.kind, shorten(&arg.name));
                    let error = arg.key.error(Code::UnknownField, message);
                    if self.registry.is_retired_field(&info.kind, &arg.name) {
                        retired = true;
                        self.report.push(error.help("to replace it, run: shibo migrate FILE"));
                    } else {
                        self.report.unknown(error, &arg.name, "field", names);
                    }
                }
                Some(_) => {}
            }
        }
        // Slots are numbered in the order of the declaration, so the order in the file has no effect.
        for field in &info.fields {
            let arg = args.iter().find(|arg| arg.name == field.name);
            match (&field.role, arg) {
                // The error was already reported.
                (_, Some(arg)) if arg.value.is_broken() => self.flats[flat].good = false,
                // Its earlier form was reported.
                (Role::Port(_), None) if retired => self.flats[flat].good = false,
                (Role::Port(port), None) if port.required && !port.list => self.missing(flat, info, &field.name),
                (Role::Port(port), Some(arg)) => match self.read_port(flat, &field.name, port, &arg.value) {
                    Some(slots) if slots.is_empty() && port.required => self.missing(flat, info, &field.name),
                    Some(slots) => self.flats[flat].slots.extend(slots),
                    None => self.flats[flat].good = false,
                },
                (Role::Port(port), None) if port.required => self.missing(flat, info, &field.name),
                (Role::Param(param), Some(arg)) => {
                    let params = &self.scopes[scope].params;
                    let value = if has_ports(param) {
                        self.read_structs(flat, &field.name, param, &arg.value)
                    } else {
                        substitute(&arg.value, params, self.report)
                    };
                    let checked = value.filter(|value| self.check_param(&field.name, param, &value.part));
                    match checked {
                        Some(value) => self.flats[flat].params.push((field.name.clone(), value.part, value.base)),
                        None => self.flats[flat].good = false,
                    }
                }
                (_, None) => {}
            }
        }
    }

    fn missing(&mut self, flat: usize, info: &KindInfo, port: &str) {
        let kind = self.flats[flat].kind.clone();
        let ty = info.ports().find(|(field, _)| field.name == port).map(|(_, port)| port.ty);
        let wants = ty.map(|ty| format!(" ({ty})")).unwrap_or_default();
        let message = format!("`{}` needs `{port}`{wants}", info.kind);
        let help = format!("write `{port}: \"node\"`");
        self.report.push(kind.error(Code::MissingInput, message).help(help));
        self.flats[flat].good = false;
    }

    /// Checks the numbers of a parameter.
    fn check_param(&mut self, name: &str, info: &ParamInfo, part: &SyntaxValue) -> bool {
        let mut good = true;
        for (kind, word) in part.words() {
            let Some(value) = (kind == Kind::Number).then(|| number(word.str())).flatten() else { continue };
            let allowed = info.infinite && is_infinity(word.str());
            if !value.is_finite() && !allowed {
                self.report.push_value(&word, not_finite(&word, name));
                good = false;
            } else if let Some(error) = out_of_range(name, &info.bounds, &word, value) {
                self.report.push_value(&word, error);
                good = false;
            }
        }
        if let (true, ParamType::Range, Shape::Tuple(items)) = (good, info.ty, part.shape())
            && let [a, b] = &items[..]
            && let (Shape::Number(lo), Shape::Number(hi)) = (a.shape(), b.shape())
            && lo > hi
        {
            let message = format!("{name} is `{}`; the smaller number must come first", shorten(part.str()));
            let help = format!("write `({}, {})`", b.str(), a.str());
            self.report.push_value(part, part.error(Code::OutOfRange, message).help(help));
            good = false;
        }
        good
    }

    /// Builds the struct of a node and runs its own checks.
    pub(super) fn build(&mut self, flat: usize) {
        let version = self.earlier_version(flat);
        let node = &self.flats[flat];
        let Some(info) = node.info else { return };
        let mut slot_args: Vec<(&str, Arg<'_>)> = Vec::new();
        for (field, port) in info.ports() {
            let slots = (0_u32..).zip(&node.slots).filter(|(_, slot)| slot.port.is(&field.name)).map(|(i, _)| i);
            let slots: Vec<u32> = slots.collect();
            match (port.list, slots.first()) {
                (true, Some(_)) => slot_args.push((&field.name, Arg::Slots(slots))),
                (false, Some(slot)) => slot_args.push((&field.name, Arg::Slot(*slot))),
                _ => {}
            }
        }
        let mut params: Vec<_> = node.params.iter().collect();
        let mut errors = Vec::new();
        let built = loop {
            let mut args = slot_args.clone();
            let texts: Vec<_> = params.iter().map(|(_, part, _)| untyped(part)).collect();
            args.extend(params.iter().zip(&texts).map(|((name, ..), text)| (name.as_str(), Arg::Ron(text))));
            match self.registry.build(&info.kind, version, &args) {
                Some(Ok(built)) => break Some(built),
                Some(Err(error)) => {
                    let wrong = error.arg.and_then(|arg| arg.checked_sub(slot_args.len()));
                    let Some((name, part, _)) = wrong.and_then(|i| params.get(i)) else {
                        errors.push((node.kind.clone(), node.kind.error(Code::BadValue, error.message)));
                        break None;
                    };
                    let explained = explain(info, name, part, &error);
                    errors.push((part.clone(), self.or_ports(flat, name, part, explained)));
                    params.remove(wrong.unwrap_or_default());
                }
                None => break None,
            }
        };
        let good = errors.is_empty();
        errors.into_iter().for_each(|(part, error)| self.report.push_value(&part, error));
        self.flats[flat].good &= good;
        if let (Some(built), true) = (built, self.flats[flat].good) {
            self.check_node(flat, &*built);
            self.flats[flat].node = Some(built);
        }
    }

    /// An error about a parameter; if a node was written there, with the fields that accept nodes.
    fn or_ports(&self, flat: usize, name: &str, part: &SyntaxValue, error: Diagnostic) -> Diagnostic {
        let node = &self.flats[flat];
        let is_name = |text: &str| {
            let first = text.split('.').next().unwrap_or(text);
            self.scopes[node.scope].names.contains_key(first)
        };
        let is_node = match part.shape() {
            Shape::Text(text) => is_name(&text),
            Shape::Call | Shape::Word(_) => {
                part.head().is_some_and(|(kind, _)| self.registry.info(kind.str()).is_some())
            }
            _ => false,
        };
        let has_choices = node
            .info
            .is_some_and(|info| info.params().any(|(field, param)| field.name == name && !param.choices.is_empty()));
        if !is_node || has_choices {
            return error;
        }
        let ports: Vec<_> =
            node.info.iter().flat_map(|info| info.ports()).map(|(field, _)| format!("`{}`", field.name)).collect();
        let which =
            if ports.is_empty() { "this kind has none".to_owned() } else { format!("here: {}", ports.join(", ")) };
        error.help(format!("`{name}` is a parameter, one value for the whole picture; only ports take nodes ({which})"))
    }

    fn check_node(&mut self, flat: usize, built: &dyn DynNode) {
        let node = &self.flats[flat];
        let locate = |problem: &Problem| {
            let place = problem.field.as_deref().and_then(|field| node.field(field)).unwrap_or(&node.kind);
            at(place, problem)
        };
        let canvas = self.scopes[node.scope].canvas;
        let mut found: Vec<Diagnostic> = built.check(&canvas).iter().map(locate).collect();
        found.extend(built.advice(&canvas).iter().map(|problem| locate(problem).as_warning()));
        let folder = self.docs[self.scopes[node.scope].doc].folder();
        let mut files = Vec::new();
        let mut readable = true;
        for (field, path) in built.files() {
            let base = node.params.iter().find(|(name, ..)| name == field).and_then(|(.., base)| base.as_deref());
            let place = node.field(field).unwrap_or(&node.kind);
            if path.0.is_empty() {
                let help = format!("write `{field}: \"file\"`");
                let message = format!("`{field}` is not given; it must name a file");
                found.push(place.error(Code::MissingInput, message).help(help));
                readable = false;
                continue;
            }
            let named = base.unwrap_or(folder).join(&path.0);
            match self.files_of(&named, built.takes_udim()) {
                Ok(handles) => {
                    let faults = handles.iter().filter_map(|file| check_file(file).err());
                    let faults: Vec<_> = faults.map(|fault| place.error(fault.code, fault.message)).collect();
                    readable &= faults.is_empty();
                    found.extend(faults);
                    files.extend(handles.into_iter().map(|file| (field, file)));
                }
                Err((fault, help)) => {
                    let error = place.error(fault.code, fault.message);
                    found.push(help.map_or(error.clone(), |help| error.help(help)));
                    readable = false;
                }
            }
        }
        if readable && !files.is_empty() {
            let checked = self.file_checks.of(&node.kind_name, built, &files).iter();
            found.extend(checked.map(|problem| match problem.code {
                Code::Advice => locate(problem).as_warning(),
                _ => locate(problem),
            }));
        }
        let outside = files.iter().map(|(_, file)| file.path()).filter(|path| imports::within(path).is_none());
        self.looked_at.extend(outside.map(Path::to_owned));
        self.flats[flat].files = files;
        self.flats[flat].good &= found.iter().all(|diagnostic| diagnostic.warning);
        found.into_iter().for_each(|diagnostic| self.report.push(diagnostic));
    }
}

/// The text of a parameter without type suffixes of numbers, `3f32`: the field determines the type. Byte positions stay
/// the same.
fn untyped(part: &SyntaxValue) -> Cow<'_, str> {
    let mut text = Cow::Borrowed(part.str());
    for (kind, word) in part.words() {
        let Some(suffix) = (kind == Kind::Number).then(|| suffix(word.str())).flatten() else { continue };
        let start = part.offset(&word.tokens()[0]);
        let types = start + suffix..start + word.str().len();
        let blanks = " ".repeat(types.len());
        text.to_mut().replace_range(types, &blanks);
    }
    text
}

/// A problem at `place`, or within the text there.
pub(super) fn at(place: &SyntaxValue, problem: &Problem) -> Diagnostic {
    let mut diagnostic = place.error(problem.code, problem.message.clone());
    diagnostic.help.clone_from(&problem.help);
    // In a plain literal, byte positions of the text are shifted by the opening quote.
    let plain = matches!(place.shape(), Shape::Text(text) if place.str().len() == text.len() + 2);
    if let Some(range) = problem.within.as_ref().filter(|_| plain) {
        diagnostic.span = place.sub_span(1 + range.start, 1 + range.end.max(range.start + 1));
    }
    diagnostic
}

impl Linker<'_> {
    /// The file at a path, which may belong to the library, or the files of all UDIM tiles. An error may have a help.
    fn files_of(&self, path: &Path, takes_udim: bool) -> Result<Vec<FileHandle>, (Fault, Option<&'static str>)> {
        let plain = |fault| (fault, None);
        if let (Some(inside), Some(library)) = (imports::within(path), self.registry.library()) {
            let missing = || format!("there is no file `{inside}` in the library");
            let content = library.file(&inside).ok_or_else(|| Fault::new(Code::FileNotFound, missing()));
            return Ok(vec![FileHandle::in_memory(imports::library_path(&inside), content.map_err(plain)?)]);
        }
        if !is_udim(path) {
            return Ok(vec![self.gate.pass(path).map_err(plain)?]);
        }
        let set = self.gate.pass_set(path).map_err(plain)?;
        let found = if takes_udim { udim_files(self.gate.files(), &set).unwrap_or_default() } else { Vec::new() };
        if takes_udim && found.is_empty() {
            let fault = Fault::new(Code::FileNotFound, format!("there is no file of a tile for `{}`", set.display()));
            let help =
                "`<UDIM>` stands for the numbers of tiles, from 1001 on, in the names of files that lie side by side";
            return Err((fault, Some(help)));
        }
        let paths = if takes_udim { found.into_iter().map(|file| file.path).collect() } else { vec![set] };
        paths.into_iter().map(|path| self.gate.pass_in_set(path).map_err(plain)).collect()
    }
}

fn out_of_range(name: &str, bounds: &Bounds, word: &SyntaxValue, value: f64) -> Option<Diagnostic> {
    if bounds.admit(value) {
        return None;
    }
    let message = format!("{name} is `{}`; it must be {bounds}", shorten(word.str()));
    Some(word.error(Code::OutOfRange, message))
}
