//! Names of nodes in other programs, from the paragraph *Elsewhere* of their manuals.
use super::words::WORDS;
use shibo_node::registry::Registry;

/// Begins the paragraph of a manual with the names of a node in other programs.
const ELSEWHERE: &str = "Elsewhere:";

/// The paragraph of a manual with the names in other programs, without its first word; empty if there is none.
pub fn paragraph(doc: &str) -> &str {
    doc.split("\n\n").find_map(|paragraph| paragraph.trim().strip_prefix(ELSEWHERE)).unwrap_or_default()
}

/// The names in other programs: the words between asterisks of that paragraph.
pub fn names(doc: &str) -> impl Iterator<Item = &str> {
    paragraph(doc).split('*').skip(1).step_by(2)
}

/// The kinds and words of graph files, each with a name that it has in another program and that begins with these letters.
pub(crate) fn begin_with<'r>(registry: &'r Registry, letters: &str) -> Vec<(&'r str, &'r str)> {
    let letters = squash(letters);
    let kinds = registry.kinds().filter_map(|kind| registry.info(kind)).map(|info| (&*info.kind, &*info.doc));
    let words = WORDS.iter().map(|word| (word.name, &*word.doc));
    let called = |(kind, doc): (&'r str, &'r str)| {
        let name = names(doc).filter(|name| squash(name).starts_with(&letters)).min_by_key(|name| name.len())?;
        Some((kind, name))
    };
    kinds.chain(words).filter_map(called).collect()
}

/// The kinds that a manual says to have this name in another program, or that have its words in another order.
pub(crate) fn kinds<'r>(registry: &'r Registry, word: &str) -> Vec<&'r str> {
    let (squashed, own) = (squash(word), parts(word));
    let called =
        |kind: &str| registry.info(kind).is_some_and(|info| names(&info.doc).any(|name| squash(name) == squashed));
    let is_meant = |kind: &&str| (own.len() > 1 && parts(kind) == own) || called(kind);
    registry.kinds().filter(is_meant).collect()
}

/// The letters and digits of a text, in lower case.
pub fn squash(text: &str) -> String {
    text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The words of a name such as `BlendMaterials`, in singular, sorted.
fn parts(name: &str) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    for c in name.chars().take(64).filter(|c| c.is_alphanumeric()) {
        if c.is_uppercase() || parts.is_empty() {
            parts.push(String::new());
        }
        if let Some(part) = parts.last_mut() {
            part.extend(c.to_lowercase());
        }
    }
    parts.iter_mut().for_each(|part| part.truncate(part.trim_end_matches('s').len()));
    parts.sort();
    parts
}
