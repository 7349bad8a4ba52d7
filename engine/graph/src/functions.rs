//! Functions that a graph defines: `functions: { "ridge(x, w)": "1 - smoothstep(0, w, abs(x))" }`.
use super::formula_text::FormulaText;
use super::part::{Entry, Shape, SyntaxValue};
use super::read::{mismatch, shorten};
use super::report::Report;
use super::subst::located;
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::{self, Fault, UserFunction};
use crate::syntax::is_name;
use std::sync::Arc;

/// The most functions of a file.
pub(super) const MOST_OF_FILE: usize = 256;
/// The most parameters of a function.
const MOST: usize = 16;

/// A function as declared.
#[derive(Clone, Debug)]
pub(super) struct FunctionDecl {
    pub(super) function: Arc<UserFunction>,
    pub(super) key: SyntaxValue,
    body: SyntaxValue,
    /// The offset of the formula in the literal of the body; `None` for a literal with escapes.
    offset: Option<usize>,
}

impl FunctionDecl {
    /// The formula of the body.
    pub(super) fn text(&self) -> FormulaText {
        FormulaText { part: self.body.clone(), text: self.function.body.clone(), offset: self.offset }
    }

    /// The diagnostic for a fault in the body.
    pub(super) fn fault(&self, fault: &Fault) -> Diagnostic {
        located(&self.body, fault, self.offset.map(|offset| (offset, &fault.range)))
    }
}

/// A call of a function that another file defines, a shipped graph.
#[derive(Clone, Debug)]
pub(super) struct Call {
    /// The formula that makes the call, directly or by way of other functions.
    pub(super) from: Span,
    /// The place of the call; for a call in a shipped graph, that of the user's call before it.
    pub(super) place: Span,
    /// The index of the shipped graph.
    pub(super) doc: usize,
    /// The file with the function that makes the call, if it has pins of its own.
    pub(super) pinned_by: Option<usize>,
}

/// Reads a declaration; `None` after an error.
pub(super) fn declare(entry: &Entry, report: &mut Report) -> Option<FunctionDecl> {
    let Some((name, params)) = head(&entry.name) else {
        let message = format!("`{}` is not the head of a function", shorten(&entry.name));
        let help = "write the name and its values, `\"ridge(x, w)\"`; each is a word of letters, digits and `_`";
        report.push(entry.key.error(Code::BadName, message).help(help));
        return None;
    };
    if expression::described().iter().any(|described| described.name == name) {
        let message = format!("`{name}` is a function of the language");
        report.push(entry.key.error(Code::BadName, message).help("give the function another name"));
        return None;
    }
    let twice = params.iter().enumerate().find(|(index, param)| params[..*index].contains(param));
    if let Some((_, param)) = twice {
        report.push(entry.key.error(Code::DuplicateKey, format!("the value `{param}` is named twice")));
        return None;
    }
    let Shape::Text(text) = entry.value.shape() else {
        report.push(mismatch(&entry.value, &format!("function `{name}`"), "a formula in quotes"));
        return None;
    };
    // An equals sign may stand before the formula, as it does elsewhere.
    let (body, offset) = match FormulaText::of(&entry.value) {
        Some(formula) => (formula.text, formula.offset),
        None => (text, FormulaText::offset(&entry.value)),
    };
    let function = Arc::new(UserFunction { name, params, body });
    Some(FunctionDecl { function, key: entry.key.clone(), body: entry.value.clone(), offset })
}

/// The name and the names of the values in `name(a, b)`.
fn head(text: &str) -> Option<(String, Vec<String>)> {
    let (name, rest) = text.split_once('(')?;
    let inside = rest.trim_end().strip_suffix(')')?;
    let params: Vec<String> = inside.split(',').map(|param| param.trim().to_owned()).collect();
    let good = is_name(name.trim()) && params.len() <= MOST && params.iter().all(|param| is_name(param));
    good.then(|| (name.trim().to_owned(), params))
}

#[cfg(test)]
mod tests {
    use super::head;

    #[test]
    fn reads_heads_of_functions() {
        let read = |text: &str| head(text).map(|(name, params)| format!("{name}/{}", params.join("/")));
        assert_eq!(read("ridge(x, w)").as_deref(), Some("ridge/x/w"));
        assert_eq!(read("one( t )").as_deref(), Some("one/t"));
        for wrong in ["ridge", "ridge(", "ridge()", "ridge(x,)", "(x)", "a b(x)", "ridge(x) y", "ridge(x+1)"] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
    }
}
