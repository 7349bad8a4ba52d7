//! Reads outputs for other programs.
use super::output_decl::{ExportDecl, MeshDecl, OutputDecl};
use super::part::{Shape, SyntaxValue};
use super::read::{self, choice, mismatch};
use super::report::Report;
use crate::diagnostics::{Code, Diagnostic};
use crate::export::{
    Chosen, Colors, ExportTarget, FieldDecl, NumberForm, Numbers, OptionValue, Options, SimpleShape, Takes,
};

/// Reads an export such as `Gltf(material: "node", mesh: "atlas")`.
pub(super) fn read(
    decl: &mut OutputDecl,
    word: &SyntaxValue,
    target: &'static dyn ExportTarget,
    body: &SyntaxValue,
    report: &mut Report,
) {
    let (kind, declared) = (target.info().name, target.info().fields);
    let Some(fields) = read::fields(body, &format!("`{kind}`"), declared, report) else { return };
    let (mut options, mut sources, mut places, mut good) = (Vec::new(), Vec::new(), Vec::new(), true);
    decl.mesh = target.info().has_mesh().then_some(MeshDecl::Simple(SimpleShape::Plane));
    for FieldDecl { name, takes, .. } in declared {
        let part = read::get(&fields, name);
        places.extend(part.map(|part| (*name, part.span())));
        match (takes, part) {
            (Takes::Material | Takes::Gray | Takes::Height | Takes::Body, Some(part)) => {
                let Some(_) = read::text(part, name, report) else { continue };
                decl.from.get_or_insert_with(|| part.clone());
                if let Takes::Gray = takes {
                    sources.push((*name, part.clone()));
                }
            }
            (Takes::Mesh, Some(part)) => decl.mesh = mesh(part, report),
            (Takes::Material | Takes::Height | Takes::Body, None) => {
                missing(word, name, &format!("write `{name}: \"node\"`"), report);
            }
            (Takes::Word(words), None) => {
                let (first, all) = (words().first().copied().unwrap_or_default(), words().join(", "));
                missing(word, name, &format!("write `{name}: {first}`; the choices are {all}"), report);
                good = false;
            }
            (_, Some(part)) => match option(part, name, *takes, report) {
                Some(value) => options.push((*name, value)),
                None => good = false,
            },
            (_, None) => {}
        }
    }
    if fields.is_empty() && declared.iter().all(|field| matches!(field.takes, Takes::Gray)) {
        let known: Vec<&str> = declared.iter().map(|field| field.name).collect();
        let help = format!("write `{}: \"node\"`; fields are {}", known[0], known.join(", "));
        report.push(word.error(Code::MissingInput, format!("`{kind}` has no field")).help(help));
    }
    let options = Options::new(declared, &options);
    if let (Some(part), Colors::Png) = (read::get(&fields, "quality"), options.colors()) {
        let error = part.error(Code::BadValue, "`quality` is that of JPEG, and `colors` are PNG");
        report.push(error.help("write `colors: Jpeg`, or leave `quality` out"));
    }
    if let Some(problem) = target.check(&options).filter(|_| good) {
        let span = problem.field.as_deref().and_then(|field| read::get(&fields, field)).unwrap_or(word).span();
        report.push(Diagnostic::from_problem(problem, span));
        good = false;
    }
    decl.export = Some(ExportDecl { target: Chosen { target, options }, good, fields: sources, places });
}

/// Reports that a field of `word` is not written.
fn missing(word: &SyntaxValue, field: &str, help: &str, report: &mut Report) {
    report.push(word.error(Code::MissingInput, format!("`{}` has no `{field}`", word.str())).help(help));
}

/// The value of an option; reports errors.
fn option(part: &SyntaxValue, name: &str, takes: Takes, report: &mut Report) -> Option<OptionValue> {
    match takes {
        Takes::Quality => {
            let given = if let Shape::Number(given) = part.shape() { given } else { f64::NAN };
            let near = |whole: &u8| (given - f64::from(*whole)).abs() <= 0.5 && (1.0..=100.0).contains(&given);
            let whole = (1..=100).find(near);
            if whole.is_none() {
                report.push(mismatch(part, &format!("`{name}`"), "a number from 1 to 100"));
            }
            whole.map(OptionValue::Quality)
        }
        Takes::Numbers(wanted) if !matches!(part.shape(), Shape::Word(_)) || (wanted.words)().is_empty() => {
            numbers(part, name, &wanted, report).map(|numbers| OptionValue::Numbers(numbers.into()))
        }
        Takes::Truth(_) => choice(part, name, &[("true", true), ("false", false)], report).map(OptionValue::Truth),
        _ => {
            let words: Vec<_> = takes.words().into_iter().map(|word| (word, word)).collect();
            choice(part, name, &words, report).map(OptionValue::Word)
        }
    }
}

/// Numbers of a form; reports errors.
fn numbers(part: &SyntaxValue, name: &str, wanted: &Numbers, report: &mut Report) -> Option<Vec<f64>> {
    let items = |part: &SyntaxValue| match part.shape() {
        Shape::List(items) | Shape::Tuple(items) => Some(items),
        _ => None,
    };
    let (one, whole) = ("a number", matches!(wanted.form, NumberForm::Whole | NumberForm::Counts));
    let (parts, columns, form) = match wanted.form {
        NumberForm::One | NumberForm::Whole => (Some(vec![part.clone()]), 1, one),
        NumberForm::Counts => (items(part).filter(|items| items.len() == 2), 1, "two whole numbers, `(1, 1)`"),
        NumberForm::Rising => (items(part), 1, "a list of numbers, `[0.1, 0.2]`"),
        NumberForm::Pairs => {
            let pairs = items(part).and_then(|all| {
                all.iter().map(|pair| items(pair).filter(|pair| pair.len() == 2)).collect::<Option<Vec<_>>>()
            });
            (pairs.map(|pairs| pairs.concat()), 2, "a list of pairs, `[(0, 0), (1, 1)]`")
        }
    };
    let Some(parts) = parts.filter(|parts| !parts.is_empty()) else {
        let words: String = (wanted.words)().iter().map(|word| format!("`{word}` or ")).collect();
        report.push(mismatch(part, &format!("`{name}`"), &format!("{words}{form}")));
        return None;
    };
    let [least, most] = wanted.range;
    let mut numbers = Vec::with_capacity(parts.len());
    for item in &parts {
        let value = read::number(item, name, report)?;
        if !(least..=most).contains(&value) || (whole && value.fract() != 0.0) {
            let kind = if whole { "a whole number" } else { one };
            let message = format!("{name} is `{}`; it must be {kind} from {least} to {most}", item.str());
            report.push(item.error(Code::OutOfRange, message));
            return None;
        }
        let before = numbers.len().checked_sub(columns).map(|k| numbers[k]);
        if let Some(before) =
            before.filter(|before| matches!(wanted.form, NumberForm::Rising | NumberForm::Pairs) && *before >= value)
        {
            let message = format!("{name} has `{}` after {before}; its numbers must rise", item.str());
            report.push(item.error(Code::BadValue, message).help("sort them, and write each number once"));
            return None;
        }
        numbers.push(value);
    }
    Some(numbers)
}

/// The mesh of an export; `None` after an error.
fn mesh(part: &SyntaxValue, report: &mut Report) -> Option<MeshDecl> {
    match part.shape() {
        Shape::Text(_) => Some(MeshDecl::Node(part.clone())),
        Shape::Word(_) => choice(part, "mesh", &SimpleShape::ALL, report).map(MeshDecl::Simple),
        _ => {
            let wanted = "`Plane`, `Sphere`, `Cylinder`, `Cube` or an atlas: `mesh: \"atlas\"`";
            report.push(mismatch(part, "`mesh`", wanted));
            None
        }
    }
}
