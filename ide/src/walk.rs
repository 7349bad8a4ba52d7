//! Visits the keys and values of a file, and locates a position in it.
use super::expect::Expect;
use super::file::Section;
use super::view::{Body, Item, Value};
use super::world::Cx;

/// Visitor of a walk.
pub(crate) trait Visit<'a> {
    /// Visits the key of an item; `inside` is the expectation of the brackets.
    fn key(&mut self, inside: Expect<'a>, item: &'a Item);

    /// Visits a value.
    fn value(&mut self, expect: Expect<'a>, value: &'a Value);
}

/// Visits all keys and values of a graph, in the order of the text. A file does not include its local graphs.
pub(crate) fn walk<'a>(cx: Cx<'a>, visit: &mut dyn Visit<'a>) {
    let Some(root) = cx.file.value() else { return };
    if cx.file.local_name().is_none() {
        visit.value(Expect::Root, root);
    }
    inner(cx, start(cx), root, visit);
}

/// Expectation for the value of a graph.
fn start<'a>(cx: Cx<'a>) -> Expect<'a> {
    cx.file.local_name().map_or(Expect::Root, |name| Expect::Entry(Section::Graphs, name))
}

fn value<'a>(cx: Cx<'a>, expect: Expect<'a>, value: &'a Value, visit: &mut dyn Visit<'a>) {
    visit.value(expect, value);
    if !matches!(expect, Expect::Entry(Section::Graphs, _)) {
        inner(cx, expect, value, visit);
    }
}

fn inner<'a>(cx: Cx<'a>, expect: Expect<'a>, value: &'a Value, visit: &mut dyn Visit<'a>) {
    let Some(body) = value.body() else { return };
    let inside = expect.inside(value, cx);
    for item in &body.items {
        if item.key.is_some() {
            visit.key(inside, item);
        }
        if let Some(inner) = &item.value {
            self::value(cx, inside.item(item), inner, visit);
        }
    }
}

/// One pair of brackets around a position.
#[derive(Clone, Copy)]
pub(crate) struct Level<'a> {
    /// Expectation of the brackets.
    pub inside: Expect<'a>,
    /// The value with the brackets.
    pub value: &'a Value,
    /// The brackets.
    pub body: &'a Body,
    /// The item at the position.
    pub item: Option<&'a Item>,
}

/// Element at a position.
#[derive(Clone, Copy)]
pub(crate) enum Spot<'a> {
    /// On a key.
    Key(&'a Item),
    /// On a value.
    Value(Expect<'a>, &'a Value),
    /// After a colon without a value.
    Missing(Expect<'a>),
    /// Between items.
    Between,
}

/// Brackets around a position, the outermost first, and the element there.
pub(crate) struct Trail<'a> {
    /// The brackets.
    pub levels: Vec<Level<'a>>,
    /// The element there.
    pub spot: Spot<'a>,
}

impl<'a> Trail<'a> {
    /// The innermost brackets.
    pub(crate) fn last(&self) -> Option<Level<'a>> {
        self.levels.last().copied()
    }

    /// The section entry at the position.
    pub(crate) fn entry(&self) -> Option<(Section, &'a Item)> {
        self.levels.iter().find_map(|level| match level.inside {
            Expect::Section(section) => Some((section, level.item?)),
            _ => None,
        })
    }

    /// The innermost node around the position.
    pub(crate) fn node(&self) -> Option<Level<'a>> {
        self.levels.iter().rev().find(|l| matches!(l.inside, Expect::Kind(_) | Expect::Use(_, _, None))).copied()
    }
}

/// Locates a position of a graph.
pub(crate) fn trail<'a>(cx: Cx<'a>, at: usize) -> Trail<'a> {
    let mut trail = Trail { levels: Vec::new(), spot: Spot::Between };
    let Some(root) = cx.file.value() else { return trail };
    let (mut expect, mut value) = (start(cx), root);
    loop {
        let within = value.body().filter(|body| {
            let inside = body.inside();
            inside.start <= at && at <= inside.end
        });
        let Some(body) = within else {
            trail.spot = Spot::Value(expect, value);
            return trail;
        };
        let inside = expect.inside(value, cx);
        let item = body.item_at(at).map(|index| &body.items[index]).or_else(|| after_colon(cx, body, at));
        trail.levels.push(Level { inside, value, body, item });
        let Some(item) = item else {
            trail.spot = Spot::Between;
            return trail;
        };
        let inner = inside.item(item);
        match (&item.key, &item.value) {
            (Some(key), _) if at <= key.range.end => {
                trail.spot = Spot::Key(item);
                return trail;
            }
            (_, Some(next)) if next.range.start <= at => (expect, value) = (inner, next),
            (Some(_), _) => {
                trail.spot = Spot::Missing(inner);
                return trail;
            }
            (None, _) => return trail,
        }
    }
}

/// The item without a value, if the position is after its colon and blanks.
fn after_colon<'a>(cx: Cx<'a>, body: &'a Body, at: usize) -> Option<&'a Item> {
    let item = &body.items[body.items.partition_point(|item| item.range.start <= at).checked_sub(1)?];
    let blank = || cx.file.text.get(item.range.end..at).is_some_and(|text| text.chars().all(char::is_whitespace));
    (item.key.is_some() && item.value.is_none() && blank()).then_some(item)
}
