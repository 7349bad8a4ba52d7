//! Remedies for refused values that need more than the nearest name.
use super::imports;
use super::linker::{Entity, Linker, Slot, Target};
use super::part::{Shape, SyntaxValue};
use super::read::shorten;
use crate::diagnostics::{Code, Diagnostic};
use crate::node::OutputType;
use crate::registry::Registry;
use crate::value::{Accepts, Type};

/// Begins the paragraph of a node's documentation with its names in other programs.
const ELSEWHERE: &str = "Elsewhere:";
/// The most kinds that a message lists.
const LISTED: usize = 3;

/// The longest successor of a node that a message shows.
const SHOWN: usize = 200;
/// The longest node whose successor is computed for a message.
const READ: usize = 10_000;

/// The help for converting a colour to luminance, with the weights that convert pictures to `Gray`.
pub(super) fn write_luminance(path: &str) -> String {
    format!("for its luminance (Rec. 709) write `\"= luminance({path})\"`")
}

/// The error for a kind of earlier versions. `may_read` allows work for its help.
pub(super) fn retired(registry: &Registry, kind: &SyntaxValue, may_read: bool) -> Diagnostic {
    let call = kind.call();
    let successor = if may_read && call.len() <= READ { registry.successor(call) } else { None };
    let help = match successor.filter(|new| new.len() <= SHOWN && !new.contains('\n')) {
        Some(new) => format!("write `{new}` instead, or run: shibo migrate FILE"),
        None => "to replace it, run: shibo migrate FILE".to_owned(),
    };
    kind.error(Code::UnknownKind, format!("`{}` is no longer a kind of node", kind.str())).help(help)
}

/// The kind that `word` means: its name in another program, or its words in another order.
pub(super) fn kind_elsewhere<'r>(registry: &'r Registry, word: &str) -> Option<&'r str> {
    let (squashed, words) = (squash(word), words(word));
    let is_meant = |kind: &&str| {
        let called = |info: &crate::node::KindInfo| names_elsewhere(&info.doc).any(|name| squash(name) == squashed);
        (words.len() > 1 && self::words(kind) == words) || registry.info(kind).is_some_and(called)
    };
    registry.kinds().find(is_meant)
}

/// The names between asterisks in the paragraph about other programs.
fn names_elsewhere(doc: &str) -> impl Iterator<Item = &str> {
    let paragraph = doc.split("\n\n").map(str::trim).find_map(|paragraph| paragraph.strip_prefix(ELSEWHERE));
    paragraph.unwrap_or_default().split('*').skip(1).step_by(2)
}

/// The letters and digits of a text, in lower case.
fn squash(text: &str) -> String {
    text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The words of a kind such as `BlendMaterials`, in singular, sorted alphabetically.
fn words(kind: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    for c in kind.chars().take(64) {
        if c.is_uppercase() || words.is_empty() {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut() {
            word.extend(c.to_lowercase());
        }
    }
    words.iter_mut().for_each(|word| word.truncate(word.trim_end_matches('s').len()));
    words.sort();
    words
}

/// The help for importing a file that was written where an import name belongs; `None` if it cannot be imported.
pub(super) fn import_first(registry: &Registry, written: &str, taken: &[&str]) -> Option<String> {
    let inside = written.strip_prefix(imports::LIBRARY).unwrap_or(written);
    let of_library = imports::in_library(inside, registry.library()).is_some();
    if !of_library && !written.ends_with(".ron") {
        return None;
    }
    let path = if of_library { format!("{}{inside}", imports::LIBRARY) } else { written.to_owned() };
    let stem = inside.rsplit('/').next().unwrap_or(inside).trim_end_matches(".ron");
    let name = if taken.contains(&stem) { format!("{stem}_2") } else { stem.to_owned() };
    let (name, path) = (shorten(&name), shorten(&path));
    Some(format!("write `imports: {{ \"{name}\": \"{path}\" }}` above, and `graph: \"{name}\"` here"))
}

impl Linker<'_> {
    /// The help for a wire in `scope` that does not fit a port of a node of this kind. In order of preference: another
    /// output of its node; a kind that does the same with this type; a formula or a kind that converts it; kinds that
    /// make the wanted type.
    pub(super) fn remedy(&self, scope: usize, slot: &Slot, ty: Accepts, kind: Option<&str>) -> Option<String> {
        if let Some(help) = if slot.declared.is_none() { self.other_output(scope, slot) } else { None } {
            return Some(help);
        }
        if ty == Accepts::One(Type::SolidMaterial) && Type::Material.fits(slot.wants) {
            let cut = "cut it with `CutPlane`, `CutSurface` or `Board`";
            return Some(match slot.part.shape() {
                Shape::Text(_) => format!("{cut}: write `CutPlane(solid: {})` here", shorten(slot.part.str())),
                _ => cut.to_owned(),
            });
        }
        let same = kind.and_then(|kind| self.same_for(kind, ty));
        let conversion =
            || self.luminance(slot, ty).or_else(|| self.channel(slot, ty)).or_else(|| self.converters(slot, ty));
        match (same, conversion()) {
            (Some(same), Some(help)) => Some(format!("{same}; {help}")),
            (same, help) => same.or(help).or_else(|| self.makers(slot.wants)),
        }
    }

    /// The help for converting a colour to a number: by its luminance, as for pictures.
    fn luminance(&self, slot: &Slot, ty: Accepts) -> Option<String> {
        let number = matches!(slot.wants, Accepts::One(Type::Gray) | Accepts::Number);
        let asked = number && ty == Accepts::One(Type::Rgb);
        asked.then(|| match slot.part.shape() {
            Shape::Text(path) => format!("{} here", write_luminance(&shorten(&path))),
            _ => format!("give it a name; {}", write_luminance("name")),
        })
    }

    /// The help for taking a channel of a material.
    fn channel(&self, slot: &Slot, ty: Accepts) -> Option<String> {
        let Shape::Text(path) = slot.part.shape() else { return None };
        let channel = match slot.wants {
            Accepts::One(Type::Rgb) | Accepts::Color => "base_color",
            Accepts::One(Type::Normal) | Accepts::AnyNormal => "normal",
            wants if Type::Gray.fits(wants) => "height",
            _ => return None,
        };
        let asked = ty == Accepts::One(Type::Material);
        asked.then(|| format!("write `\"{}.{channel}\"` for one of its channels", shorten(&path)))
    }

    /// The kind that does the same with values of this type: `BlendMaterials` for a material connected to `Blend`.
    fn same_for(&self, kind: &str, ty: Accepts) -> Option<String> {
        let (own, wanted) = (words(kind), ty.only().map(Accepts::One)?);
        let does = |other: &&str| {
            let Some(info) = self.registry.info(other) else { return false };
            let named = *other != kind && own.iter().all(|word| words(other).contains(word));
            let makes = info.outputs.iter().any(|output| makes(output.ty, wanted));
            let material = wanted == Accepts::One(Type::Material);
            let takes = |port: Accepts| port == wanted || (material && port == Accepts::AnyMaterial);
            named && makes && info.ports().any(|(_, port)| takes(port.ty))
        };
        let other = self.registry.kinds().find(does)?;
        Some(format!("`{other}` does that with {ty}"))
    }

    fn other_output(&self, scope: usize, slot: &Slot) -> Option<String> {
        let Shape::Text(written) = slot.part.shape() else {
            let Target::Out { flat, .. } = &slot.target else { return None };
            let (output, ty) = self.output_that_fits(*flat, slot.wants)?;
            let help = format!("its output `{output}` is {ty}; give the node a name to take that, \"name.{output}\"");
            return Some(help);
        };
        let node = written.split('.').next()?;
        let (output, ty) = match self.scopes[scope].names.get(node)? {
            Entity::Node(flat) => self.output_that_fits(*flat, slot.wants),
            Entity::Use(child) => self.output_of_graph(*child, slot.wants),
            Entity::Each(chooser) => self.output_of_graph(*self.choosers[*chooser].children.first()?, slot.wants),
            Entity::Input(_) | Entity::Broken => None,
        }?;
        Some(format!("`{}.{}` is {ty}", shorten(node), shorten(output)))
    }

    fn output_that_fits(&self, flat: usize, wants: Accepts) -> Option<(&str, Type)> {
        let flat = &self.flats[flat];
        let mut outputs = flat.info?.outputs.iter().zip(&flat.outputs);
        outputs.find_map(|(output, ty)| Some((output.name, ty.filter(|ty| ty.fits(wants))?)))
    }

    /// An output of the graph `scope`. Only outputs made by the graph's own nodes are considered.
    fn output_of_graph(&self, scope: usize, wants: Accepts) -> Option<(&str, Type)> {
        let document = &self.docs[self.scopes[scope].doc].document;
        document.outputs.iter().find_map(|output| {
            let Shape::Text(from) = output.from.as_ref()?.shape() else { return None };
            let (node, port) = from.split_once('.').map_or((from.as_str(), None), |(node, port)| (node, Some(port)));
            let Some(Entity::Node(flat)) = self.scopes[scope].names.get(node) else { return None };
            let flat = &self.flats[*flat];
            let index = match port {
                Some(port) => flat.info?.outputs.iter().position(|output| output.name == port)?,
                None => 0,
            };
            let ty = flat.outputs.get(index).copied().flatten()?;
            ty.fits(wants).then_some((output.name.as_str(), ty))
        })
    }

    /// The kinds that convert the value; the first one with its notation in place of the wire.
    fn converters(&self, slot: &Slot, ty: Accepts) -> Option<String> {
        let converter = |kind: &'_ str| {
            let info = self.registry.info(kind)?;
            let mut required = info.ports().filter(|(_, port)| port.required);
            let (field, port) = required.next()?;
            let made = info.outputs.first().map(|output| output.ty);
            let makes = matches!(made, Some(OutputType::Fixed(made)) if Accepts::One(made).fits(slot.wants));
            let fits = makes && ty.fits(port.ty) && required.next().is_none();
            fits.then(|| field.name.clone())
        };
        let kinds: Vec<_> =
            self.registry.kinds().filter_map(|kind| Some((kind, converter(kind)?))).take(LISTED).collect();
        let names: Vec<_> = kinds.iter().map(|(kind, _)| format!("`{kind}`")).collect();
        let (kind, port) = kinds.first()?;
        let help = format!("{} makes {} of {ty}", names.join(" or "), slot.wants);
        Some(match slot.part.shape() {
            Shape::Text(_) => format!("{help}: write `{kind}({port}: {})` here", shorten(slot.part.str())),
            _ => help,
        })
    }

    fn makers(&self, wants: Accepts) -> Option<String> {
        let kinds = self.registry.kinds().filter(|kind| self.makes(kind, wants)).take(LISTED);
        let kinds: Vec<_> = kinds.map(|kind| format!("`{kind}`")).collect();
        (!kinds.is_empty()).then(|| format!("{wants} comes from {}", kinds.join(", ")))
    }

    fn makes(&self, kind: &str, wants: Accepts) -> bool {
        let main = self.registry.info(kind).and_then(|info| info.outputs.first());
        main.is_some_and(|output| makes(output.ty, wants))
    }
}

/// Returns true if an output of this type can be connected to a port that takes one type, or any material.
fn makes(output: OutputType, wants: Accepts) -> bool {
    match output {
        OutputType::Fixed(ty) => wants == Accepts::One(ty),
        OutputType::MaterialOf(_) => {
            matches!(wants, Accepts::One(Type::Material | Type::SolidMaterial) | Accepts::AnyMaterial)
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_other_programs_are_between_asterisks() {
        let doc = "A node.\n\nElsewhere: Substance Designer *Tile Sampler*, Blender *Mix*.\n\nMore *words*.";
        assert_eq!(names_elsewhere(doc).collect::<Vec<_>>(), ["Tile Sampler", "Mix"]);
        assert_eq!(names_elsewhere("A *node*.").count(), 0);
    }

    #[test]
    fn words_in_another_order_are_the_same() {
        assert_eq!(words("MaterialBlend"), words("BlendMaterials"));
        assert_ne!(words("Blend"), words("BlendMaterials"));
    }
}
