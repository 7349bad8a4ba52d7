//! Random edits of graphs, for tests.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::renames::symbol;
use crate::side::{NewNames, Side};
use crate::{GraphText, Tools};
use shibo_graph::syntax::{Node, NodeKind, Tree, format};
use shibo_ide::Section;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// The shipped nodes, without import folders.
pub(crate) fn tools() -> Tools {
    Tools {
        registry: Arc::new(shibo_library::registry()),
        import_paths: Vec::new(),
        gate: shibo_graph::Gate::default(),
        cancel: shibo_engine::eval::CancelToken::default(),
    }
}

/// The shipped graphs: paths and texts.
pub(crate) fn graphs() -> Vec<(PathBuf, String)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../graphs");
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "ron"));
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), std::fs::read_to_string(path).unwrap())).collect()
}

/// Random numbers from a seed.
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    pub(crate) fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        usize::try_from((z ^ (z >> 31)) % count.max(1) as u64).unwrap()
    }
}

/// An edit of a text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Edit {
    /// Replaces a number of a thing, counted within its value.
    Number(Vec<String>, usize, String),
    /// Adds a node behind another one, with a text.
    Add(String, String),
    /// Removes a thing.
    Remove(Vec<String>),
    /// Renames a node.
    Rename(String, String),
    /// Writes a comment above a node.
    Comment(String, String),
    /// Lays out the text.
    Format,
    /// Moves a node to the end of the section.
    Move(String),
}

fn find<'t>(tree: &'t Tree, path: &[String]) -> Option<Node<'t>> {
    let (last, above) = path.split_last()?;
    above.iter().try_fold(tree.value()?, |value, name| body(value.entry(name)?.value()?))?.entry(last)
}

fn body(value: Node<'_>) -> Option<Node<'_>> {
    value.body().or(Some(value))
}

fn node(name: &str) -> Vec<String> {
    vec!["nodes".to_owned(), name.to_owned()]
}

/// The bytes of a thing with its comma and the blanks above it.
fn whole(tree: &Tree, entry: Node<'_>) -> Range<usize> {
    let comma = tree.tokens().get(entry.token_range().end).filter(|token| &tree.text()[token.range()] == ",");
    let end = comma.map_or(entry.range().end, |comma| comma.end());
    let before = tree.text()[..entry.range().start].trim_end().len();
    before..end
}

impl Edit {
    /// A random edit of a graph. `who` keeps names of two sides apart.
    pub(crate) fn random(text: &str, who: &str, dice: &mut Dice) -> Self {
        let tree = Tree::parse(text);
        let names: Vec<String> = tree
            .value()
            .unwrap()
            .entry("nodes")
            .unwrap()
            .value()
            .unwrap()
            .entries()
            .filter_map(Node::key_text)
            .collect();
        let name = names[dice.below(names.len())].clone();
        let fresh = |dice: &mut Dice| format!("{who}_{}", dice.below(100_000));
        match dice.below(16) {
            0 => Self::Add(name, format!("\"{}\": Perlin(size: {})", fresh(dice), dice.below(9) + 1)),
            1 => Self::Rename(name, fresh(dice)),
            2 => Self::Comment(name, format!("// {}", fresh(dice))),
            3 => Self::Format,
            4 => Self::Move(name),
            5 => Self::Remove(node(&name)),
            6 | 7 => {
                let fields: Vec<Node<'_>> =
                    tree.nodes().filter(|node| named(node).is_some_and(|path| path.len() > 2)).collect();
                Self::Remove(named(&fields[dice.below(fields.len())]).unwrap())
            }
            _ => {
                let numbers: Vec<Node<'_>> = tree.nodes().filter(|node| node.kind() == NodeKind::Number).collect();
                let number = numbers[dice.below(numbers.len())];
                let entry = number.ancestors().find(|node| named(node).is_some()).unwrap();
                let place = self::numbers(entry).iter().position(|other| *other == number).unwrap();
                Self::Number(named(&entry).unwrap(), place, format!("{}.{}", dice.below(40), dice.below(8) + 1))
            }
        }
    }

    /// The text after the edit; `None` if the thing is not there.
    pub(crate) fn apply(&self, tools: &Tools, path: &std::path::Path, text: &str) -> Option<String> {
        let tree = Tree::parse(text);
        let mut new = text.to_owned();
        match self {
            Self::Number(path, place, value) => {
                let number = *numbers(find(&tree, path)?).get(*place)?;
                new.replace_range(number.range(), value);
            }
            Self::Add(after, what) => {
                let range = whole(&tree, find(&tree, &node(after))?);
                let comma = if text[..range.end].ends_with(',') { "" } else { "," };
                new.insert_str(range.end, &format!("{comma}\n    {what},"));
            }
            Self::Remove(path) => new.replace_range(whole(&tree, find(&tree, path)?), ""),
            Self::Rename(before, after) => {
                find(&tree, &node(before))?;
                let side = Side::new(tools, &GraphText { path: path.to_owned(), text: text.to_owned() });
                let names = [(symbol(Section::Nodes, before.clone()), after.clone())].into();
                new = side.renamed(&NewNames::from([(None, names)]))?;
            }
            Self::Comment(name, comment) => {
                let start = find(&tree, &node(name))?.range().start;
                new.insert_str(start, &format!("{comment}\n    "));
            }
            Self::Format => new = format(text).ok()?,
            Self::Move(name) => {
                let entry = find(&tree, &node(name))?;
                let range = whole(&tree, entry);
                let (all, moved) = (entry.parent()?.range().end - 1, entry.text().to_owned());
                let comma = if text[..all].trim_end().ends_with(',') { "" } else { "," };
                new.insert_str(all, &format!("{comma}\n    {moved},\n  "));
                new.replace_range(range, "");
            }
        }
        Tree::parse(new.as_str()).errors().is_empty().then_some(new)
    }

    /// The things that the edit changes.
    pub(crate) fn touches(&self) -> Option<Vec<String>> {
        match self {
            Self::Number(path, ..) | Self::Remove(path) => Some(path.clone()),
            Self::Rename(name, _) => Some(node(name)),
            _ => None,
        }
    }
}

/// The path of a named thing that is in no list.
fn named(entry: &Node<'_>) -> Option<Vec<String>> {
    let known = |node: &Node<'_>| node.kind() != NodeKind::List;
    if entry.kind() != NodeKind::Entry || !entry.ancestors().all(|node| known(&node)) {
        return None;
    }
    let mut path: Vec<String> = entry.ancestors().filter_map(Node::key_text).collect();
    path.reverse();
    Some(path)
}

fn numbers(entry: Node<'_>) -> Vec<Node<'_>> {
    entry.descendants().filter(|node| node.kind() == NodeKind::Number).collect()
}
