//! The channels of materials: the channels of each node's material, and the nodes that use a missing channel.
use super::linker::{Bound, Entity, Linker, Slot, Target};
use super::part::{Shape, SyntaxValue};
use super::read::shorten;
use crate::diagnostics::{Code, Diagnostic};
use crate::node::{MaterialInputs, TakenChannel};
use crate::value::{Accepts, Channel, ChannelSet, Type};

impl Linker<'_> {
    /// Finds the channels of all materials, in the given order, and warns about nodes that use a missing channel.
    pub(super) fn check_channels(&mut self, order: &[usize]) {
        // In a graph rendered alone, inputs without a value have no channels yet: do not warn about them.
        let mut open = vec![false; self.flats.len()];
        for &flat in order {
            self.flats[flat].channels = self.channels_of(flat);
            open[flat] = self.is_open(flat, &open);
        }
        for flat in (0..self.flats.len()).filter(|flat| !open[*flat]).collect::<Vec<_>>() {
            for taken in self.flats[flat].node.iter().flat_map(|node| node.takes()).collect::<Vec<_>>() {
                self.check_taken(flat, &taken);
            }
        }
    }

    /// The channels of a node's material; `None` if its inputs, or the node, are in error.
    fn channels_of(&self, flat: usize) -> Option<ChannelSet> {
        let node = &self.flats[flat];
        let mut inputs = Vec::new();
        for slot in node.slots.iter().filter(|slot| takes_materials(slot.wants)) {
            inputs.push((slot.port.name(), self.channels_at(slot)?));
        }
        let channels = node.node.as_ref()?.channels(&MaterialInputs::new(&inputs));
        // Nodes make normals from heights on the canvas only.
        let normal: ChannelSet = [Channel::Normal].into_iter().collect();
        let had = inputs.iter().any(|(_, channels)| channels.has(Channel::Normal));
        let in_space = node.outputs.first() == Some(&Some(Type::SolidMaterial));
        Some(if in_space && !had { channels.without(normal) } else { channels })
    }

    /// Returns true if a node makes or reads a material that is not given.
    fn is_open(&self, flat: usize, open: &[bool]) -> bool {
        let node = &self.flats[flat];
        let reads = |slot: &Slot| matches!(slot.target, Target::Out { flat, .. } if open[flat]);
        let mut materials = node.slots.iter().filter(|slot| takes_materials(slot.wants));
        (node.info.is_none() && node.slots.is_empty()) || materials.any(reads)
    }

    fn channels_at(&self, slot: &Slot) -> Option<ChannelSet> {
        match slot.target {
            Target::Out { flat, .. } => self.flats[flat].channels,
            // A number or a colour in place of a material in space.
            Target::Constant(..) => Some(ChannelSet::NONE),
            Target::Broken => None,
        }
    }

    fn check_taken(&mut self, flat: usize, taken: &TakenChannel) {
        let node = &self.flats[flat];
        let asked = node.field(taken.field).unwrap_or(&node.kind);
        let mut warnings = Vec::new();
        for slot in node.slots.iter().filter(|slot| slot.port.is(taken.port)) {
            let Some(channels) = self.channels_at(slot).filter(|channels| !channels.has(taken.channel)) else {
                continue;
            };
            let (name, default) = (taken.channel.name(), taken.channel.default_text());
            let warning = match self.given_by_use(node.scope, &slot.part) {
                Some((scope, given)) => {
                    let taker = if node.info.is_some() { format!("`{}`", node.name) } else { "a path".to_owned() };
                    let message = format!("this material has no channel `{name}`, which {taker} takes");
                    let warning = given.error(Code::Advice, message).related(asked.span(), "it is taken here");
                    (scope, warning)
                }
                None => {
                    let path = match (slot.part.within(), slot.part.shape()) {
                        (Some(path), _) => Some(path.to_owned()),
                        (None, Shape::Text(path)) => Some(path),
                        _ => None,
                    };
                    let message = match path {
                        Some(path) => format!("`{}` has no channel `{name}`", shorten(of_material(&path, name))),
                        None => format!("the material at `{}` has no channel `{name}`", taken.port),
                    };
                    (node.scope, asked.error(Code::Advice, message))
                }
            };
            warnings.push((warning.0, explain(warning.1, &format!("its default, {default}, is used"), channels)));
        }
        for (scope, warning) in warnings {
            self.enter(scope);
            self.report.push(warning);
        }
    }

    /// The `Use` value that `part`, written in `scope`, refers to; the outermost one if several pass it on.
    fn given_by_use(&self, scope: usize, part: &SyntaxValue) -> Option<(usize, SyntaxValue)> {
        let (mut scope, mut part, mut given) = (scope, part.clone(), None);
        loop {
            // A path may stand in a formula.
            let path = match (part.within(), part.shape()) {
                (Some(path), _) => path.to_owned(),
                (None, Shape::Text(path)) => path,
                _ => return given,
            };
            let name = path.split('.').next().unwrap_or_default();
            let Some(Entity::Input(index)) = self.scopes[scope].names.get(name) else { return given };
            match &self.scopes[scope].inputs[*index] {
                Bound::Wire { scope: outer, part: wire, .. } if *outer != scope => {
                    (scope, part) = (*outer, wire.clone());
                    given = Some((scope, part.clone()));
                }
                _ => return given,
            }
        }
    }
}

/// Returns true if a port takes materials.
fn takes_materials(port: Accepts) -> bool {
    Type::Material.fits(port) || Type::SolidMaterial.fits(port)
}

/// The part of a path that names the material: the part before the channel, if the path has one.
fn of_material<'p>(path: &'p str, channel: &str) -> &'p str {
    let mut places = path.match_indices('.').map(|(at, _)| at);
    let before = places.find(|at| path[at + 1..].split('.').next() == Some(channel));
    before.map_or(path, |at| &path[..at])
}

fn explain(mut warning: Diagnostic, default: &str, channels: ChannelSet) -> Diagnostic {
    warning.message = format!("{}; {default}", warning.message);
    let names: Vec<String> = channels.iter().map(|channel| format!("`{}`", channel.name())).collect();
    let help = match names.len() {
        0 => "connect that channel of the material".to_owned(),
        _ => format!("connect that channel of the material; it has {}", names.join(", ")),
    };
    warning.help(help).as_warning()
}
