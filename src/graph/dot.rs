//! Draws a graph for Graphviz.
use super::{Drawing, Shape};
use std::fmt::Write;

/// The graph in DOT.
pub(super) fn dot(drawing: &Drawing) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "digraph {} {{", quoted(&drawing.title));
    out.push_str("  rankdir=LR;\n  node [shape=box, style=\"rounded,filled\", fillcolor=\"#f6f4f0\", fontname=\"sans-serif\"];\n");
    out.push_str("  edge [fontname=\"sans-serif\", fontsize=9];\n");
    for (i, item) in drawing.items.iter().enumerate() {
        let shape = match item.shape {
            Shape::Node => "",
            Shape::Use => ", shape=box3d, fillcolor=\"#efe6d2\"",
            Shape::Output => ", shape=cds, fillcolor=\"#e4ecf6\"",
        };
        let label = quoted(&format!("{}\n{}", item.kind, item.name));
        let _ = writeln!(out, "  n{i} [label={label}{shape}];");
    }
    for wire in &drawing.wires {
        let tail = wire.output.as_ref().map_or(String::new(), |name| format!(", taillabel={}", quoted(name)));
        let head = if wire.port.is_empty() { String::new() } else { format!(", headlabel={}", quoted(&wire.port)) };
        let (from, to, ty, color) = (wire.from, wire.to, wire.ty, wire.ty.color());
        let _ = writeln!(out, "  n{from} -> n{to} [color=\"{color}\", tooltip=\"{ty}\"{tail}{head}];");
    }
    out.push_str("}\n");
    out
}

/// Puts a text in quotes.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out + "\""
}
