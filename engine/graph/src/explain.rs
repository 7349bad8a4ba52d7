//! Rewrites errors of `serde` and `ron` about a parameter for users, and places them at the faulty part.
use super::color_names::color_meant;
use super::part::{Shape, SyntaxValue};
use super::read::{lower_first, offset, shorten, without_b};
use crate::diagnostics::{Code, Diagnostic, suggest};
use crate::node::{BuildError, KindInfo, ParamForm, ParamInfo, ParamType};

/// Numbers of at least this size are whole, and too large for a count in any notation.
const WHOLE: f64 = 1.84e19;

/// An error of `serde` or `ron` about a parameter, at its place.
pub(super) fn explain(info: &KindInfo, name: &str, part: &SyntaxValue, error: &BuildError) -> Diagnostic {
    let Some(ron) = &error.ron else { return part.error(Code::TypeMismatch, format!("{name}: {}", error.message)) };
    let param = info.params().find(|(field, _)| field.name == name).map(|(_, param)| param);
    let at = offset(part.str(), ron.span.end);
    let word_before = |accept: &dyn Fn(&SyntaxValue) -> bool| {
        let before = part.words().filter(|(_, word)| part.offset(&word.tokens()[0]) <= at);
        before.map(|(_, word)| word).filter(|word| accept(word)).last()
    };
    let single = part.tokens().len() == 1;
    match &ron.code {
        ron::Error::NoSuchEnumVariant { expected, found, .. } => {
            let place = word_before(&|word| word.str() == found).unwrap_or_else(|| part.clone());
            let message = format!("{name} has no choice `{}`", shorten(found));
            place.error(Code::UnknownVariant, message).help(suggest(found, "choice", expected))
        }
        ron::Error::NoSuchStructField { expected, found, .. } => {
            let place = word_before(&|word| word.str() == found).unwrap_or_else(|| part.clone());
            let message = format!("{name} has no field `{}`", shorten(found));
            place.error(Code::UnknownField, message).help(suggest(found, "field", expected))
        }
        ron::Error::DuplicateStructField { field, .. } => {
            let place = word_before(&|word| word.str() == *field).unwrap_or_else(|| part.clone());
            place.error(Code::DuplicateKey, format!("field `{field}` is given twice"))
        }
        ron::Error::IntegerOutOfBounds => {
            let place = word_before(&|word| matches!(word.shape(), Shape::Number(_))).unwrap_or_else(|| part.clone());
            let message = format!("{name} is `{}`; that number is out of range", shorten(place.str()));
            place.error(Code::OutOfRange, message)
        }
        _ => {
            let any = ParamForm::Any;
            let form = param.map_or(&any, |param| &param.form);
            let (place, form) = if single { (part.clone(), form) } else { element(part, form, at) };
            if place.tokens().len() == part.tokens().len() {
                return wrong_type(name, param, &place, &error.message);
            }
            wrong_part(name, form, &place, &error.message)
        }
    }
}

/// The element of a list or tuple that byte `at` lies in, with its form; the whole value if there is none.
fn element<'w>(part: &SyntaxValue, form: &'w ParamForm, at: usize) -> (SyntaxValue, &'w ParamForm) {
    let items: Vec<(Option<String>, SyntaxValue)> = match (part.shape(), form) {
        // The wrong kind of brackets is the mistake itself.
        (Shape::Tuple(_), ParamForm::List(_)) => Vec::new(),
        (Shape::List(items) | Shape::Tuple(items), _) => items.into_iter().map(|item| (None, item)).collect(),
        (Shape::Named(entries), _) => entries.into_iter().map(|entry| (Some(entry.name), entry.value)).collect(),
        (Shape::Call, _) => part.head().and_then(|(_, body)| body).into_iter().map(|body| (None, body)).collect(),
        _ => Vec::new(),
    };
    let holds = |item: &SyntaxValue| {
        let start = item.tokens().first().map_or(0, |first| part.offset(first));
        start <= at && at <= start + item.str().len()
    };
    match items.iter().enumerate().find(|(_, (_, item))| holds(item)) {
        Some((index, (name, item))) => {
            let form = form.part(index, name.as_deref());
            match item.tokens().len() {
                0 | 1 => (item.clone(), form),
                _ => element(item, form, at - part.offset(&item.tokens()[0])),
            }
        }
        None => (part.clone(), form),
    }
}

/// The error for a part of a value.
fn wrong_part(name: &str, form: &ParamForm, place: &SyntaxValue, said: &str) -> Diagnostic {
    if let ParamForm::Plain(ty) = form {
        return wrong_type(name, Some(&ParamInfo { ty: *ty, ..ParamInfo::default() }), place, said);
    }
    let (found, written) = (place.shape().describe(), shorten(place.str()));
    match form {
        ParamForm::Any => wrong_type(name, None, place, said),
        _ => place.error(Code::TypeMismatch, format!("each value of {name} must be {form}; found {found} `{written}`")),
    }
}

fn wrong_type(name: &str, param: Option<&ParamInfo>, place: &SyntaxValue, said: &str) -> Diagnostic {
    let shape = place.shape();
    if let Some(param) = param.filter(|param| !param.choices.is_empty()) {
        // For choices with arguments, serde does not always report an unknown word as unknown.
        if let Some((head, _)) = place.head() {
            let names: Vec<_> = param.choices.iter().map(|choice| choice.name.as_str()).collect();
            if !names.contains(&head.str()) {
                let message = format!("{name} has no choice `{}`", shorten(head.str()));
                return head.error(Code::UnknownVariant, message).help(suggest(head.str(), "choice", &names));
            }
        }
        let list = param.choices.iter().map(|choice| format!("`{choice}`")).collect::<Vec<_>>().join(", ");
        let message = format!("{name} must be a choice; found {} `{}`", shape.describe(), shorten(place.str()));
        let meant = match &shape {
            Shape::Text(text) if param.choices.iter().any(|choice| choice.name == *text) => {
                format!("write `{text}` without quotes; ")
            }
            _ => String::new(),
        };
        return place.error(Code::TypeMismatch, message).help(format!("{meant}choices: {list}"));
    }
    let ty = param.map_or(ParamType::Value, |param| param.ty);
    let wanted = match (ty, &shape, param) {
        (ParamType::List, Shape::List(_), _) => "a list of another kind of values".to_owned(),
        (ParamType::Value, _, Some(param)) => param.form.to_string(),
        _ => ty.expected().to_owned(),
    };
    if let (Shape::Number(value), ParamType::Integer | ParamType::Number) = (&shape, ty)
        && (place.is_given() || value.abs() >= WHOLE)
    {
        let what = if value.abs() >= WHOLE {
            "that number is out of range".to_owned()
        } else {
            format!("it must be {wanted}")
        };
        return place.error(Code::OutOfRange, format!("{name} is `{}`; {what}", shorten(place.str())));
    }
    let message = format!("{name} must be {wanted}; found {} `{}`", shape.describe(), shorten(place.str()));
    let error = place.error(Code::TypeMismatch, message);
    if let Some(help) = without_b(place) {
        return error.help(help);
    }
    if let (Shape::Text(text), ParamType::Color) = (&shape, ty)
        && let Some(meant) = color_meant(text)
    {
        return error.help(format!("write `\"{meant}\"`"));
    }
    let takes_numbers = !matches!(ty, ParamType::Text | ParamType::Path | ParamType::Color);
    if let (Shape::Text(text), true) = (&shape, takes_numbers)
        && let Some(number) = leading_number(text)
    {
        return error.help(format!("write `{number}`, without quotes and unit"));
    }
    // The parser's message helps only for values with several parts.
    match ty {
        ParamType::Number | ParamType::Integer | ParamType::Bool | ParamType::Text | ParamType::Path => error,
        _ => error.help(lower_first(said)),
    }
}

/// The number at the beginning of `76mm`.
fn leading_number(text: &str) -> Option<&str> {
    let text = text.trim();
    let end = text.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '-' | '+'))).unwrap_or(text.len());
    // A unit has no digits; `0xff` has no unit.
    if text[end..].contains(|c: char| c.is_ascii_digit()) || text[end..].starts_with('x') {
        return None;
    }
    text[..end].parse::<f64>().ok().map(|_| &text[..end])
}
