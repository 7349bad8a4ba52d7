//! The value of an expression.
use super::parse::{Binary, NodeKind, Tree, parse};
use super::{ExprError, Lookup, MOST_ERRORS};
use crate::diagnostics::Code;

/// The value of `text`; an empty list of errors if it is unknown because of errors reported before.
pub(in crate::graph) fn evaluate(text: &str, lookup: impl FnMut(&str) -> Lookup) -> Result<f64, Vec<ExprError>> {
    let tree = parse(text)?;
    let params = look_up(&tree, lookup)?;
    let value = compute(&tree, params);
    if value.is_finite() {
        return Ok(value);
    }
    let what = if value.is_nan() { "not a number" } else { "infinite" };
    let message = format!("`{}` is {what}", super::shorten(text.trim()));
    Err(vec![ExprError { code: Code::NotFinite, range: 0..text.len(), message, help: None }])
}

/// The values of the parameters, in the order of the tree; all that are wrong are reported.
fn look_up(tree: &Tree<'_>, mut lookup: impl FnMut(&str) -> Lookup) -> Result<Vec<f64>, Vec<ExprError>> {
    let mut values = Vec::new();
    let (mut errors, mut broken) = (Vec::new(), false);
    for node in &tree.nodes {
        let NodeKind::Param(name) = node.kind else { continue };
        match lookup(name) {
            Lookup::Number(value) => values.push(value),
            Lookup::Wrong(code, message, help) => {
                errors.push(ExprError { code, range: node.range.clone(), message, help });
            }
            Lookup::Broken => broken = true,
        }
        if errors.len() == MOST_ERRORS {
            break;
        }
    }
    if broken || !errors.is_empty() { Err(errors) } else { Ok(values) }
}

/// Computes the parts of the tree in order; each comes after those that it is made of.
fn compute(tree: &Tree<'_>, params: Vec<f64>) -> f64 {
    let mut params = params.into_iter();
    let mut values: Vec<f64> = Vec::new();
    for node in &tree.nodes {
        let taken = match node.kind {
            NodeKind::Number(_) | NodeKind::Param(_) => 0,
            NodeKind::Negate => 1,
            NodeKind::Binary(_) => 2,
            NodeKind::Call(_, args) => args,
        };
        let parts = values.split_off(values.len().saturating_sub(taken));
        values.push(match (node.kind, &parts[..]) {
            (NodeKind::Number(value), _) => value,
            (NodeKind::Param(_), _) => params.next().unwrap_or(f64::NAN),
            (NodeKind::Negate, [value]) => -value,
            (NodeKind::Binary(operator), [left, right]) => binary(operator, *left, *right),
            (NodeKind::Call(function, _), args) => (function.value)(args),
            _ => f64::NAN,
        });
    }
    values.pop().unwrap_or(f64::NAN)
}

fn binary(operator: Binary, left: f64, right: f64) -> f64 {
    match operator {
        Binary::Add => left + right,
        Binary::Subtract => left - right,
        Binary::Multiply => left * right,
        Binary::Divide => left / right,
        Binary::Remainder => left % right,
        Binary::Power => libm::pow(left, right),
    }
}
