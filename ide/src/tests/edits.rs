//! Fuzzing: requests all answers after each of many random edits of the shipped graphs. Nothing may panic, and all
//! ranges must lie in the text.
use super::super::hover::{Evaluated, Pictures, hover};
use super::super::{
    Cx, File, Workspace, actions, colors, complete, diagnose, inlay, lens, navigate, rename, signature,
};
use super::super::{structure, tokens};
use super::graphs;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// Number of edits.
const EDITS: usize = 10_000;
/// Number of edits after which a graph is restored or another one is taken.
const ROW: usize = 40;

pub(super) struct NoPictures;

impl Pictures for NoPictures {
    fn kind(&self, _kind: &str) -> Option<String> {
        None
    }

    fn node(&self, _path: &Path, _node: &str) -> Option<Evaluated> {
        None
    }

    fn node_in(&self, _path: &Path, _text: &str, _node: &str) -> Option<Evaluated> {
        None
    }

    fn file(&self, _path: &Path) -> Option<String> {
        None
    }
}

/// Pseudo-random numbers, the same in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, most: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 % most.max(1) as u64).unwrap_or_default()
    }
}

fn edit(text: &mut String, random: &mut Random) -> usize {
    const PIECES: [&str; 30] = [
        "\"",
        "(",
        ")",
        "{",
        "}",
        "[",
        "]",
        ",",
        ":",
        ".",
        "$",
        "= ",
        "\n",
        "//",
        "/*",
        "x",
        "😀",
        "Blur(",
        "input: \"",
        "\"a\": ",
        "\\",
        "Use(graph: \"wrinkles\", with: { ",
        "\"= ",
        "r#\"= let a = ",
        "\"#",
        "; ",
        "clamp(",
        "graphs: { \"g\": (nodes: { ",
        "functions: { \"f(a, b)\": \"",
        ".height",
    ];
    let mut at = random.below(text.len() + 1);
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    let mut end = (at + [0, 0, 1, 3, 12][random.below(5)]).min(text.len());
    while !text.is_char_boundary(end) {
        end += 1;
    }
    let piece = PIECES[random.below(PIECES.len())];
    text.replace_range(at..end, piece);
    at + piece.len()
}

fn inside(file: &File, range: &Range<usize>, what: &str) {
    assert!(file.text.get(range.clone()).is_some(), "{what} at {range:?} of a text of {} bytes", file.text.len());
}

/// Requests all answers at a position.
fn ask(workspace: &Workspace, file: &Arc<File>, at: usize, all: bool) {
    let cx = Cx { world: workspace, file };
    for offer in complete(cx, at) {
        inside(file, &offer.replace, "completion");
    }
    if let Some(found) = hover(cx, at, &NoPictures) {
        inside(file, &found.range, "hover");
    }
    if !all {
        return;
    }
    signature(cx, at);
    navigate::definition(cx, file, at);
    navigate::highlight(cx, at).iter().for_each(|(range, _)| inside(file, range, "highlight"));
    structure::selections(cx, at).iter().for_each(|range| inside(file, range, "selection"));
    structure::folds(cx).iter().for_each(|(range, _)| inside(file, range, "fold"));
    structure::outline(cx).iter().for_each(|entry| inside(file, &entry.range, "outline"));
    structure::links(cx);
    colors::swatches(cx).iter().for_each(|(range, _)| inside(file, range, "colour"));
    inlay::inlays(cx, &(0..file.text.len()), inlay::InlayKinds::default());
    lens::lenses(cx).iter().for_each(|lens| inside(file, &lens.range, "lens"));
    let tokens = tokens::tokens(cx);
    tokens.iter().for_each(|(range, _)| inside(file, range, "token"));
    assert!(tokens.windows(2).all(|pair| pair[0].0.end <= pair[1].0.start), "tokens lie one behind the other");
    let hints = diagnose::hints(cx);
    hints.iter().for_each(|hint| inside(file, &hint.range, "hint"));
    for action in actions::actions(cx, &(at..file.text.len()), &hints) {
        let edits = action.edits.values().flatten();
        edits.for_each(|edit| inside(file, &edit.range, &action.title));
    }
    if let Ok(edits) = rename::rename(cx, file, at, "another_name") {
        edits.get(&file.path).into_iter().flatten().for_each(|edit| inside(file, &edit.range, "rename"));
    }
}

#[test]
fn survives_random_edits() {
    let mut random = Random(0x5eed_0bad_cafe);
    let shipped = shibo_library::graphs();
    let mut workspace = Workspace::new(Arc::new(super::registry()), Vec::new());
    let mut text = String::new();
    let mut path = graphs();
    for round in 0..EDITS {
        if round % ROW == 0 {
            let graph = shipped[random.below(shipped.len())];
            text = graph.text.to_owned();
            path = graphs().join(graph.path);
        }
        let at = edit(&mut text, &mut random);
        let file = workspace.open(&path, text.as_str());
        ask(&workspace, &file, at, round % 10 == 0);
    }
}
