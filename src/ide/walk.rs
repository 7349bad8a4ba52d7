//! Goes through a file, and finds what is at a place of it.
use super::expect::Expect;
use super::file::Section;
use super::view::{Body, Item, Value};
use super::world::Cx;

/// Takes what a walk comes by.
pub(crate) trait Visit<'a> {
    /// The key of an item of brackets in which `inside` is expected.
    fn key(&mut self, inside: Expect<'a>, item: &'a Item);

    /// A value, and what is expected of it.
    fn value(&mut self, expect: Expect<'a>, value: &'a Value);
}

/// Goes through all keys and values of a file, in the order of the text.
pub(crate) fn walk<'a>(cx: Cx<'a>, visit: &mut dyn Visit<'a>) {
    if let Some(root) = &cx.file.root {
        value(cx, Expect::Root, root, visit);
    }
}

fn value<'a>(cx: Cx<'a>, expect: Expect<'a>, value: &'a Value, visit: &mut dyn Visit<'a>) {
    visit.value(expect, value);
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

/// One pair of brackets around a place.
#[derive(Clone, Copy)]
pub(crate) struct Level<'a> {
    /// What is expected in the brackets.
    pub(crate) inside: Expect<'a>,
    /// The value that has the brackets.
    pub(crate) value: &'a Value,
    /// The brackets.
    pub(crate) body: &'a Body,
    /// The item at the place.
    pub(crate) item: Option<&'a Item>,
}

/// What is at a place.
#[derive(Clone, Copy)]
pub(crate) enum Spot<'a> {
    /// On a key.
    Key(&'a Item),
    /// On a value.
    Value(Expect<'a>, &'a Value),
    /// After a colon, where a value is missing.
    Missing(Expect<'a>),
    /// Between items.
    Between,
}

/// The brackets around a place, the outermost first, and what is there.
pub(crate) struct Trail<'a> {
    /// The brackets.
    pub(crate) levels: Vec<Level<'a>>,
    /// What is there.
    pub(crate) spot: Spot<'a>,
}

impl<'a> Trail<'a> {
    /// The innermost brackets.
    pub(crate) fn last(&self) -> Option<Level<'a>> {
        self.levels.last().copied()
    }

    /// The entry of a section that the place is in.
    pub(crate) fn entry(&self) -> Option<(Section, &'a Item)> {
        self.levels.iter().find_map(|level| match level.inside {
            Expect::Section(section) => Some((section, level.item?)),
            _ => None,
        })
    }

    /// The innermost node around the place: what is expected inside of it, and its brackets.
    pub(crate) fn node(&self) -> Option<Level<'a>> {
        self.levels.iter().rev().find(|l| matches!(l.inside, Expect::Kind(_) | Expect::Use(_, _, None))).copied()
    }
}

/// What is at a place of a file.
pub(crate) fn trail<'a>(cx: Cx<'a>, at: usize) -> Trail<'a> {
    let mut trail = Trail { levels: Vec::new(), spot: Spot::Between };
    let Some(root) = &cx.file.root else { return trail };
    let (mut expect, mut value) = (Expect::Root, root);
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

/// The item whose value is missing, if the place is after its colon and blanks.
fn after_colon<'a>(cx: Cx<'a>, body: &'a Body, at: usize) -> Option<&'a Item> {
    let item = &body.items[body.items.partition_point(|item| item.range.start <= at).checked_sub(1)?];
    let blank = || cx.file.text.get(item.range.end..at).is_some_and(|text| text.chars().all(char::is_whitespace));
    (item.key.is_some() && item.value.is_none() && blank()).then_some(item)
}
