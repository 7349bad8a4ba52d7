//! Completion: deletes each reference, kind, field and choice of the shipped graphs and checks that it is offered.
use super::super::expect::Expect;
use super::super::file::Section;
use super::super::formula::FormulaText;
use super::super::names::{Symbol, occurrences};
use super::super::view::{Item, Shape, Value};
use super::super::walk::{Visit, walk};
use super::super::{Cx, File, Workspace, complete};
use super::{graphs, habits_without, offered};
use shibo_graph::syntax::formula::{PartKind, WordKind};
use shibo_node::ParamType;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::ops::Range;
use std::sync::Arc;

/// A deleted piece of text.
struct Hole {
    /// Its class.
    class: &'static str,
    /// The deleted range.
    cut: Range<usize>,
    /// The text that must be offered.
    wanted: String,
}

/// Collects the pieces to delete.
struct Holes<'a> {
    cx: Cx<'a>,
    found: Vec<Hole>,
}

impl Holes<'_> {
    fn push(&mut self, class: &'static str, cut: Range<usize>, wanted: &str) {
        self.found.push(Hole { class, cut, wanted: wanted.to_owned() });
    }

    /// Adds the names of a formula that the formula does not define.
    fn formula(&mut self, text: &FormulaText<'_>) {
        let formula = text.parse();
        for (index, word) in formula.words().iter().enumerate() {
            let says = formula.word(index);
            let part = formula.part_of(index).map(|part| formula.parts()[part].kind);
            let local = formula.local(says.split('.').next().unwrap_or_default(), word.range.start).is_some();
            let named = match word.kind {
                WordKind::Name => part != Some(PartKind::Let) && !local && says.matches('.').count() < 2,
                WordKind::Param => !says.contains('.'),
                _ => false,
            };
            if let Some(cut) = text.in_file(&word.range).filter(|_| named) {
                self.push("name in a formula", cut, says);
            }
        }
    }
}

impl<'a> Visit<'a> for Holes<'a> {
    fn key(&mut self, inside: Expect<'a>, item: &'a Item) {
        let key = item.key.as_ref().expect("it has a key");
        let quoted = self.cx.file.at(&key.range).starts_with('"');
        let fields = matches!(
            inside,
            Expect::Kind(_)
                | Expect::Use(_, _, None)
                | Expect::With(_, None)
                | Expect::Struct(_)
                | Expect::Canvas(None)
                | Expect::Layout(None)
                | Expect::Param(_, None)
                | Expect::Input(_, None)
                | Expect::File(_, None)
                | Expect::Entry(Section::Presets, _)
        );
        if fields {
            // The field with its value, but inside the quotes of a quoted name.
            let cut = if quoted { key.range.start + 1..item.range.end } else { item.range.clone() };
            self.push("field", cut, &key.name);
        }
    }

    fn value(&mut self, expect: Expect<'a>, value: &'a Value) {
        match &value.shape {
            Shape::Call { word, .. } if expect.takes_nodes() => {
                let kind = self.cx.file.at(word).to_owned();
                self.push("kind", word.clone(), &kind);
            }
            Shape::Word if !self.cx.file.at(&value.range).starts_with(|c: char| c.is_ascii_lowercase()) => {
                let word = self.cx.file.at(&value.range).to_owned();
                self.push("choice", value.range.clone(), &word);
            }
            Shape::Text(_) if FormulaText::of(self.cx, expect, value).is_some() => {
                self.formula(&FormulaText::of(self.cx, expect, value).expect("a formula"));
            }
            Shape::Text(text) => {
                let inside = value.range.start + 1..value.range.end - 1;
                let path = matches!(expect, Expect::Value(_, param) if param.ty == ParamType::Path);
                let named = matches!(expect, Expect::Use(_, _, Some("graph" | "preset")));
                let param = text.starts_with('$') && !matches!(expect, Expect::Note);
                let node = expect.reference(self.cx).is_some() && !text.starts_with(['#', '=']);
                if path || matches!(expect, Expect::Entry(Section::Imports, _)) {
                    let start = text.rfind('/').map_or(0, |i| i + 1);
                    self.push("path", inside.start + start..inside.end, &text[start..]);
                } else if named || param || node {
                    self.push("reference", inside, text);
                }
            }
            _ => {}
        }
    }
}

/// Number of holes tried, of correct offers, and of offers among the first three.
#[derive(Default, Clone, Copy)]
struct Share {
    asked: usize,
    offered: usize,
    first: usize,
}

/// Rank of the wanted text among the offers after `typed` letters; channels and components are offered behind their dot.
fn place(workspace: &mut Workspace, file: &File, hole: &Hole, typed: usize) -> Option<usize> {
    let dot = hole.wanted.rfind('.').filter(|_| matches!(hole.class, "reference" | "name in a formula"));
    let letters = |count: usize| hole.wanted.chars().take(count).collect::<String>();
    let found = place_after(workspace, file, hole, &letters(typed));
    found.or_else(|| place_after(workspace, file, hole, &hole.wanted[..=dot?]))
}

/// Rank of the wanted text among the offers behind these letters.
fn place_after(workspace: &mut Workspace, file: &File, hole: &Hole, letters: &str) -> Option<usize> {
    let mut text = file.text.to_string();
    text.replace_range(hole.cut.clone(), letters);
    // A field is deleted with its value, but the quote before its name stays.
    let quote = hole.class == "field" && file.text[..hole.cut.start].ends_with('"');
    let at = hole.cut.start + letters.len();
    if quote {
        text.insert(at, '"');
    }
    let file = workspace.open(&file.path, text);
    let offers = complete(Cx { world: workspace, file: &file }, at);
    offers.iter().position(|one| one.label == hole.wanted)
}

fn shares(typed: usize) -> (BTreeMap<&'static str, Share>, Vec<String>) {
    let mut shares: BTreeMap<&'static str, Share> = BTreeMap::new();
    let mut missed = Vec::new();
    let registry = Arc::new(super::registry());
    for graph in shibo_library::graphs() {
        let habits = habits_without(graph.path);
        let mut workspace = Workspace::new(registry.clone(), vec![graphs()]).with_habits(habits);
        let path = graphs().join(graph.path);
        let file = workspace.open(&path, graph.text);
        let mut holes = Holes { cx: Cx { world: &workspace, file: &file }, found: Vec::new() };
        walk(holes.cx, &mut holes);
        let found = holes.found;
        // Half of the holes are tested without typed letters, the other half with one letter.
        for hole in found.iter().skip(typed).step_by(2) {
            let share = shares.entry(hole.class).or_default();
            share.asked += 1;
            match place(&mut workspace, &file, hole, typed) {
                Some(place) => {
                    share.offered += 1;
                    share.first += usize::from(place < 3);
                    if place >= 3 && std::env::var_os("SHOW_LATE").is_some() {
                        missed.push(format!("{} {}: {place}: {}", graph.path, hole.class, hole.wanted));
                    }
                }
                None => missed.push(format!("{} {}: not offered: {}", graph.path, hole.class, hole.wanted)),
            }
        }
    }
    (shares, missed)
}

fn percent(part: usize, of: usize) -> f64 {
    100.0 * part as f64 / of.max(1) as f64
}

#[test]
fn offers_deleted_text() {
    let mut table = String::from("| deleted | how many | letters typed | offered | among the first three |\n");
    for (typed, least) in [(0, 92.0), (1, 97.0)] {
        let (shares, missed) = shares(typed);
        for line in &missed {
            println!("{line}");
        }
        let sum = |names: &[&str]| {
            names.iter().filter_map(|name| shares.get(name)).fold(Share::default(), |a, b| Share {
                asked: a.asked + b.asked,
                offered: a.offered + b.offered,
                first: a.first + b.first,
            })
        };
        let main = sum(&["kind", "field", "reference"]);
        let all = sum(&["kind", "field", "reference", "choice"]);
        let every = sum(&["kind", "field", "reference", "choice", "name in a formula"]);
        let rows = shares.iter().map(|(name, share)| (*name, *share));
        for (name, share) in
            rows.chain([("kinds, fields, references", main), ("all but paths", all), ("with formulas", every)])
        {
            let (offered, first) = (percent(share.offered, share.asked), percent(share.first, share.asked));
            let _ = writeln!(table, "| {name} | {} | {typed} | {offered:.1} % | {first:.1} % |", share.asked);
        }
        println!("{table}");
        assert!(all.asked > 2000, "{}", all.asked);
        let lost: Vec<_> = missed.iter().filter(|line| line.contains("not offered")).collect();
        assert!(percent(every.offered, every.asked) >= 99.9, "{lost:?}");
        assert!(lost.iter().all(|line| line.contains("name in a formula")), "{lost:?}");
        // Among all names that may stand in a formula, three are few. So without a letter the share of all falls as graphs have
        // more formulas, and formulas have a bound of their own.
        let formulas = sum(&["name in a formula"]);
        assert!(percent(formulas.first, formulas.asked) >= if typed == 0 { 68.0 } else { 92.0 }, "{table}");
        assert!(percent(every.first, every.asked) >= if typed == 0 { 85.0 } else { 97.0 }, "{table}");
        assert!(percent(all.first, all.asked) >= least, "{table}");
        assert!(typed > 0 || percent(main.first, main.asked) >= 92.0, "{table}");
    }
}

#[test]
fn offers_fitting_completions() {
    let head = "(nodes: { \"noise\": Perlin(size: 3), \"dots\": PoissonPoints(pitch: 1), ";
    let first = |rest: &str| offered(&format!("{head}{rest}")).into_iter().next();
    let has = |rest: &str, label: &str| offered(&format!("{head}{rest}")).iter().any(|one| one == label);
    assert_eq!(first("\"b\": Blur(input: \"|\") })"), Some("noise".into()));
    assert_eq!(first("\"b\": Dots(points: \"|\") })"), Some("dots".into()));
    assert_eq!(first("\"b\": Dots(points: |"), Some("dots".into()));
    assert_eq!(first("\"b\": Dots(poi|"), Some("points".into()));
    assert_eq!(first("\"b\": Dot|"), Some("Dots".into()));
    assert!(has("\"b\": Blend(mode: |) })", "Multiply"));
    assert!(has("\"b\": Worley(size: 2), \"c\": Blur(input: \"b.|\") })", "b.f2"));
    assert!(has("\"b\": Perlin(size: \"= sm|\") })", "smoothstep"));
    assert!(!has("\"b\": Perlin(size: 2), // Per|\n })", "Perlin"));
    assert!(has("\"b\": Text(text: \"// x\", size: 2, |) })", "font"));
    let params = "(params: { \"pitch\": Number(default: 1) }, nodes: { \"a\": Perlin(size: \"$|\") })";
    assert_eq!(offered(params), ["$pitch"]);
    let names = occurrences_of(params);
    assert_eq!(names, [Symbol::Param("pitch".into()), Symbol::Node("a".into())]);
}

/// Names of a text without its cursor.
fn occurrences_of(text: &str) -> Vec<Symbol> {
    let mut workspace = super::shipped();
    let file = workspace.open(std::path::Path::new("/nowhere/a.ron"), text.replacen('|', "", 1));
    occurrences(Cx { world: &workspace, file: &file }).into_iter().map(|one| one.symbol).collect()
}
