//! Paths after the output of a node: a channel of a material, and components of a value.
//!
//! A path is read from the left: the name of a node, one of its outputs, a channel if the output is a material, and
//! components. A channel or components are values of a node that the graph adds.
use super::formula_text::{Formula, FormulaText};
use super::formulas;
use super::linker::{Flat, Linker, Port, Slot, Target};
use super::part::SyntaxValue;
use super::read::shorten;
use crate::diagnostics::Code;
use crate::node::Arg;
use crate::registry::Internal;
use crate::syntax::is_name;
use crate::value::{Accepts, Channel, Type};
use std::borrow::Cow;

/// The kind of nodes that take a channel, in lists of nodes.
const KIND: &str = "Channel";
const PORT: &str = "material";

/// The part of a path after an output.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Rest {
    channel: Option<String>,
    pub(super) components: Option<String>,
}

impl Rest {
    /// Reads `channel`, `channel.components` or `components`; `None` if it is spelled like neither.
    pub(super) fn of(text: &str) -> Option<Self> {
        let (first, then) = text.split_once('.').map_or((text, None), |(first, then)| (first, Some(then)));
        let rest = match (Channel::from_name(first), then) {
            (Some(_), then) => Self { channel: Some(first.to_owned()), components: then.map(str::to_owned) },
            (None, None) => Self { channel: None, components: Some(first.to_owned()) },
            (None, Some(_)) => return None,
        };
        rest.components.as_deref().is_none_or(are_components).then_some(rest)
    }
}

/// Returns true for one to four letters that name components. Letters that do not go together are reported with the
/// type of the value.
fn are_components(text: &str) -> bool {
    (1..=4).contains(&text.len()) && text.chars().all(|c| "rgbaxyzw".contains(c))
}

impl Linker<'_> {
    /// The value of a channel of `target`, written at `part` as `path`.
    pub(super) fn channel_of(&mut self, scope: usize, target: Target, part: &SyntaxValue, rest: &Rest) -> Target {
        let Some(channel) = rest.channel.as_deref().and_then(Channel::from_name) else { return target };
        self.selected(scope, target, part, channel.name(), |_, flat| {
            flat.kind_name = KIND.to_owned();
            flat.channel = Some(channel);
            (PORT, Accepts::AnyMaterial)
        })
    }

    /// The components of `target`, written at `part`.
    pub(super) fn components_of(&mut self, scope: usize, target: Target, part: &SyntaxValue, rest: &Rest) -> Target {
        let Some(components) = &rest.components else { return target };
        self.selected(scope, target, part, components, |path, flat| {
            flat.kind_name = formulas::KIND.to_owned();
            let name = path.rsplit('/').next().filter(|name| is_name(name)).unwrap_or("value");
            flat.formula = Some(Formula::of_components(FormulaText::made(part, name, components), name));
            (formulas::PORT, Accepts::EveryField)
        })
    }

    /// The node that selects a part of `target`; created on first use.
    fn selected(
        &mut self,
        scope: usize,
        target: Target,
        part: &SyntaxValue,
        what: &str,
        fill: impl FnOnce(&str, &mut Flat<'_>) -> (&'static str, Accepts),
    ) -> Target {
        let path = match &target {
            Target::Broken => return Target::Broken,
            Target::Constant(..) => "value".to_owned(),
            Target::Out { flat, output } => {
                if let Some(known) = self.selected.get(&(*flat, *output, what.to_owned())) {
                    return Target::Out { flat: *known, output: 0 };
                }
                let node = &self.flats[*flat];
                match node.info.and_then(|info| info.outputs.get(*output)).filter(|_| *output > 0) {
                    Some(output) => format!("{}.{}", node.name, output.name),
                    None => node.name.clone(),
                }
            }
        };
        let name = format!("{path}:{what}");
        let mut flat = Flat::new(scope, name, part.clone(), String::new(), None, Cow::Borrowed(&[]));
        let (port, wants) = fill(&path, &mut flat);
        let mut slot = Slot::unresolved(Port::Node(port.to_owned()), wants, part.clone());
        slot.target = target.clone();
        flat.slots.push(slot);
        flat.resolved = true;
        let made = self.add_flat(flat);
        if let Target::Out { flat, output } = target {
            self.selected.insert((flat, output, what.to_owned()), made);
        }
        Target::Out { flat: made, output: 0 }
    }

    /// Finds the type of a channel; the type of its material is known.
    pub(super) fn type_channel(&mut self, flat: usize, channel: Channel) {
        let node = &self.flats[flat];
        let slot = &node.slots[0];
        let ty = self.type_of(&slot.target);
        if let Some(ty) = ty.filter(|ty| !ty.is_material()) {
            let local = self.local_name(flat);
            let path = local.rsplit_once(':').map_or(local.as_str(), |(path, _)| path);
            let message = format!("`{}` is {ty}; only a material has the channel `{}`", shorten(path), channel.name());
            let error = slot.part.error(Code::TypeMismatch, message);
            self.enter(node.scope);
            self.flats[flat].good = false;
            self.flats[flat].slots[0].wants = Accepts::One(ty);
            self.report.push(error);
        }
        let in_space = ty == Some(Type::SolidMaterial);
        self.flats[flat].outputs = vec![Some(if in_space { channel.solid_type() } else { channel.ty() })];
    }

    /// Builds the node that takes a channel.
    pub(super) fn build_channel(&mut self, flat: usize, channel: Channel) {
        if !self.flats[flat].good {
            return;
        }
        let text = format!("{channel:?}");
        let built = self.registry.internal(Internal::Channel, &[(PORT, Arg::Slot(0)), ("channel", Arg::Ron(&text))]);
        let node = &mut self.flats[flat];
        match built {
            Some((kind, Ok(built))) => (node.kind_name, node.node) = (kind.to_owned(), Some(built)),
            Some((_, Err(error))) => self.report.push(node.kind.error(Code::BadValue, error.message)),
            None => self.report.push(node.kind.error(Code::BadValue, "there is no node that takes channels")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_channels_and_components() {
        let rest = |text: &str| Rest::of(text).map(|rest| (rest.channel, rest.components));
        let some = |text: &str| Some(text.to_owned());
        assert_eq!(rest("height"), Some((some("height"), None)));
        assert_eq!(rest("base_color.bgr"), Some((some("base_color"), some("bgr"))));
        assert_eq!(rest("xy"), Some((None, some("xy"))));
        assert_eq!(rest("rx"), Some((None, some("rx"))));
        for wrong in ["heights", "r.r", "height.rgbar", "x.height", "", "height."] {
            assert_eq!(rest(wrong), None, "{wrong}");
        }
    }
}
