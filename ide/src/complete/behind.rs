//! Completion behind a dot: outputs of a node, channels of a material, components of a value.
use super::super::file::Section;
use super::super::formula::Inferred;
use super::super::paths::Path;
use super::references::Fits;
use super::{Ask, Completion, Sort, Topic};
use shibo_value::{Accepts, Channel, Type};

impl Ask<'_> {
    /// Names that may follow a path and a dot. Labels have the whole path.
    pub(super) fn behind(&self, base: &str, fits: Fits<'_>) -> Vec<Completion> {
        let path = Path::of(self.cx, base);
        let node = &base[path.node.clone()];
        let file = self.cx.file;
        let known = [Section::Nodes, Section::Inputs].into_iter().any(|section| file.entry(section, node).is_some());
        if !known || path.components.is_some() {
            return Vec::new();
        }
        let mut found = Vec::new();
        let ports = self.types.ports(node);
        if node == base && (ports.len() > 1 || ports.first().is_some_and(|port| !port.name.is_empty())) {
            for (index, port) in ports.iter().enumerate() {
                let ty = port.ty.map_or("?", Accepts::name);
                let topic = Topic::Text(port.doc.clone());
                let score = fits(port.ty) + 0.05 * index as f64;
                found.push(self.offer_text(&format!("{base}.{}", port.name), Sort::Node, ty, topic, score));
            }
        }
        match self.types.of(base) {
            Some(Accepts::One(Type::Material | Type::SolidMaterial) | Accepts::AnyMaterial) => {
                found.extend(self.channels(base, fits))
            }
            Some(ty) => found.extend(self.components(base, ty.into(), 1.0)),
            None => {}
        }
        found
    }

    /// Channels of a material.
    pub(super) fn channels(&self, base: &str, fits: Fits<'_>) -> Vec<Completion> {
        let offer = |(index, channel): (usize, &Channel)| {
            let doc = format!("The channel; {} where the material has none.", channel.default_text());
            let score = fits(Some(channel.ty().into())) + 0.5 + 0.05 * index as f64;
            let label = format!("{base}.{}", channel.name());
            self.offer_text(&label, Sort::Node, channel.ty().name(), Topic::Text(doc), score)
        };
        Channel::ALL.iter().enumerate().map(offer).collect()
    }

    /// Components of a value.
    pub(super) fn components(&self, base: &str, of: Components, score: f64) -> Vec<Completion> {
        let offer = |(index, letters): (usize, &&str)| {
            let label = if base.is_empty() { (*letters).to_owned() } else { format!("{base}.{letters}") };
            let score = score + 0.05 * index as f64;
            self.offer_text(&label, Sort::Value, "a component", Topic::Text(String::new()), score)
        };
        of.0.iter().enumerate().map(offer).collect()
    }
}

/// Letters of the components of a value.
pub(super) struct Components(&'static [&'static str]);

impl From<Accepts> for Components {
    fn from(ty: Accepts) -> Self {
        match ty {
            Accepts::One(Type::Normal | Type::SolidVector) => Self(&["x", "y", "z", "xy"]),
            Accepts::AnyVector => Self(&["x", "y"]),
            ty => Self::from(Inferred::of(ty)),
        }
    }
}

impl From<Inferred> for Components {
    fn from(of: Inferred) -> Self {
        match of.count() {
            Some(2) => Self(&["x", "y", "yx"]),
            Some(3) => Self(&["r", "g", "b", "rg", "bgr"]),
            Some(4) => Self(&["xx", "xy", "yx", "yy"]),
            _ => Self(&[]),
        }
    }
}
