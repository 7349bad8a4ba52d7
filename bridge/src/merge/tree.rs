//! Merges three trees.
use super::bracket::{Bracket, Item, merged};
use super::write::{Form, Piece, write};
use crate::shape::{Field, Fields, canonical, elements};
use crate::three::{Take, three};
use shibo_graph::syntax::Node;
use std::collections::BTreeSet;

/// Names from the root to a thing.
pub(super) type Path = Vec<String>;

/// The merge of three trees.
pub(super) struct Merger<'a> {
    pub(super) form: &'a Form,
    /// Things that are marked as conflicts although each change alone could be taken.
    pub(super) forced: &'a BTreeSet<Path>,
    /// Things that conflict.
    pub(super) conflicts: Vec<Path>,
    path: Path,
}

/// Things with names, and their text.
struct Level<'t> {
    fields: Fields<'t>,
    bracket: Bracket<'t>,
}

impl<'t> Level<'t> {
    fn of(value: Node<'t>) -> Option<Self> {
        Some(Self { fields: Fields::of(value)?, bracket: Bracket::of(value)? })
    }

    fn get(&'t self, name: &str) -> Thing<'t> {
        let place = self.fields.place(name)?;
        Some((self.fields.entries.get(place)?, self.bracket.items.get(place)?))
    }
}

/// A thing of one version, if that has it.
type Thing<'t> = Option<(&'t Field<'t>, &'t Item<'t>)>;

/// The comments in a value.
fn comments<'t>(value: Node<'t>) -> Vec<&'t str> {
    let tree = value.tree();
    tree.comments_in(value.range()).map(|range| tree.text()[range].trim_end()).collect()
}

/// The comments of a text after a comma, if each ends on its line.
fn trailing(trail: &str) -> Vec<&str> {
    let trail = trail.trim();
    if trail.is_empty() { Vec::new() } else { vec![trail] }
}

impl<'a> Merger<'a> {
    pub(super) fn new(form: &'a Form, forced: &'a BTreeSet<Path>) -> Self {
        Self { form, forced, conflicts: Vec::new(), path: Path::new() }
    }

    /// The merged text of a value; `None` for a conflict of the whole value.
    pub(super) fn value(&mut self, base: Option<Node<'_>>, ours: Node<'_>, theirs: Node<'_>) -> Option<String> {
        let kept = || Some(ours.text().to_owned());
        let Some(base) = base else { return (canonical(ours) == canonical(theirs)).then(kept)? };
        let inner = !self.forced.iter().any(|forced| forced.starts_with(&self.path));
        if inner && (theirs.text() == base.text() || ours.text() == theirs.text()) {
            return kept();
        }
        if let Some(text) = self.fields(base, ours, theirs) {
            return Some(text);
        }
        let (was, our, their) = (canonical(base), canonical(ours), canonical(theirs));
        if their == was || our == their {
            return kept();
        }
        if our == was && comments(ours) == comments(base) {
            return Some(theirs.text().to_owned());
        }
        self.list(base, ours, theirs)
    }

    /// Merges named things; `None` if the values are not such things of one kind.
    fn fields(&mut self, base: Node<'_>, ours: Node<'_>, theirs: Node<'_>) -> Option<String> {
        let (base, ours, theirs) = (Level::of(base)?, Level::of(ours)?, Level::of(theirs)?);
        if !base.fields.is_like(&ours.fields) || !ours.fields.is_like(&theirs.fields) {
            return None;
        }
        let mut pieces: Vec<(&str, Piece<'_>)> = Vec::new();
        for field in &ours.fields.entries {
            let piece = self.entry(&field.name, &base, &ours, &theirs);
            pieces.extend(piece.map(|piece| (field.name.as_str(), piece)));
        }
        // Things of theirs follow the thing that they follow there, and the new things of ours behind it.
        let mut after = 0;
        for field in &theirs.fields.entries {
            let name = field.name.as_str();
            if ours.fields.place(name).is_some() {
                after = pieces.iter().position(|(other, _)| *other == name).map_or(after, |place| place + 1);
                continue;
            }
            let Some(piece) = self.entry(name, &base, &ours, &theirs) else { continue };
            let new = |(_, piece): &(&str, Piece<'_>)| matches!(piece, Piece::Keep { new: true, .. });
            after += pieces[after..].iter().take_while(|piece| new(piece)).count();
            pieces.insert(after, (name, piece));
            after += 1;
        }
        let tails = [&base, &ours, &theirs].map(|level| level.bracket.tail_comments.as_slice());
        let tail = merged(tails[0], tails[1], tails[2]);
        let pieces = pieces.into_iter().map(|(_, piece)| piece).collect();
        Some(write(&ours.bracket, pieces, tail, self.form))
    }

    /// Merges a named thing; `None` if the result does not have it.
    fn entry<'t>(
        &mut self,
        name: &str,
        base: &'t Level<'t>,
        ours: &'t Level<'t>,
        theirs: &'t Level<'t>,
    ) -> Option<Piece<'t>> {
        self.path.push(name.to_owned());
        let (was, our, their) = (base.get(name), ours.get(name), theirs.get(name));
        let text = |side: Thing<'t>| side.map(|(field, _)| canonical(field.value));
        let piece = match (was, our, their) {
            _ if self.forced.contains(&self.path) => Err(()),
            (_, Some((our, item)), Some((their, their_item))) => {
                let value = self.value(was.map(|(field, _)| field.value), our.value, their.value);
                value.ok_or(()).map(|value| {
                    let (whole, inner) = (our.entry.range(), our.value.range());
                    let (before, after) = (inner.start - whole.start, inner.end - whole.start);
                    let core = format!("{}{value}{}", &item.core[..before], &item.core[after..]);
                    let old = was.map_or(item, |(_, item)| item);
                    let comments = merged(&old.comments, &item.comments, &their_item.comments);
                    let trails = [old, item, their_item].map(|item| trailing(item.trail));
                    let trail = merged(&trails[0], &trails[1], &trails[2]);
                    Some(Piece::Keep { item, core, comments, trail, new: false })
                })
            }
            (None, Some((_, item)), None) => {
                let (core, comments, trail) = (item.core.to_owned(), None, None);
                Ok(Some(Piece::Keep { item, core, comments, trail, new: true }))
            }
            (None, None, Some((_, item))) => Ok(Some(Piece::Insert(item))),
            // One side removed it: the other one must not have changed it.
            (Some(_), ..) if text(our).or_else(|| text(their)).is_none_or(|left| Some(left) == text(was)) => Ok(None),
            _ => Err(()),
        };
        let piece = piece.unwrap_or_else(|()| {
            self.conflicts.push(self.path.clone());
            let item = |side: Thing<'t>| side.map(|(_, item)| item);
            Some(Piece::Conflict { ours: item(our), base: item(was), theirs: item(their) })
        });
        self.path.pop();
        piece
    }

    /// Merges lists whose elements are all different; `None` for a conflict.
    fn list(&mut self, base: Node<'_>, ours: Node<'_>, theirs: Node<'_>) -> Option<String> {
        let (was, our, their) = (elements(base)?, elements(ours)?, elements(theirs)?);
        let texts = |list: &[Node<'_>]| {
            let texts: Vec<String> = list.iter().map(|node| canonical(*node)).collect();
            let distinct = texts.iter().collect::<BTreeSet<_>>().len() == texts.len();
            distinct.then_some(texts)
        };
        let parts = three(&texts(&was)?, &texts(&our)?, &texts(&their)?);
        let (ours, theirs) = (Bracket::of(ours)?, Bracket::of(theirs)?);
        let mut pieces = Vec::new();
        for part in parts {
            match part.take {
                Take::Ours => pieces.extend(ours.items.get(part.ours)?.iter().map(|item| Piece::kept(item, item.core))),
                Take::Theirs => pieces.extend(theirs.items.get(part.theirs)?.iter().map(Piece::Insert)),
                // Structs in the same places merge by their fields.
                Take::Conflict if part.base.len() == part.ours.len() && part.ours.len() == part.theirs.len() => {
                    for ((base, place), index) in part.base.zip(part.ours).zip(part.theirs) {
                        let item = ours.items.get(place)?;
                        let core = self.fields(*was.get(base)?, *our.get(place)?, *their.get(index)?)?;
                        pieces.push(Piece::kept(item, core));
                    }
                }
                Take::Conflict => return None,
            }
        }
        Some(write(&ours, pieces, None, self.form))
    }
}
