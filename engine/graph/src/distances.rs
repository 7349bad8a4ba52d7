//! Checks the values connected to ports that take distances.
use super::linker::{Linker, Slot, Target};
use super::read::shorten;
use crate::diagnostics::Code;
use crate::node::Output;

impl Linker<'_> {
    /// Warns if a port for a distance in mm reads another output (such as a mask) of a node that also has a distance
    /// output.
    pub(super) fn check_distances(&mut self) {
        let mut warnings = Vec::new();
        for node in &self.flats {
            let ports = node.node.as_ref().map_or(&[][..], |node| node.distances());
            for slot in node.slots.iter().filter(|slot| ports.iter().any(|port| slot.port.is(port))) {
                let Some((read, meant)) = self.other_than_distance(slot) else { continue };
                let message = format!(
                    "`{}` takes a distance in mm; {} is the output `{}`",
                    slot.port.name(),
                    shorten(slot.part.str()),
                    read.name
                );
                let help = format!("connect the output `{}` of that node", meant.name);
                warnings.push((node.scope, slot.part.error(Code::Advice, message).help(help).as_warning()));
            }
        }
        for (scope, warning) in warnings {
            self.enter(scope);
            self.report.push(warning);
        }
    }

    /// The output that is read, and the node's distance output in mm, if the former has no unit.
    fn other_than_distance(&self, slot: &Slot) -> Option<(&'static Output, &'static Output)> {
        let Target::Out { flat, output } = slot.target else { return None };
        let node = self.flats[flat].node.as_ref()?;
        let read = node.outputs().get(output).filter(|read| node.unit(read).is_none())?;
        let meant = node.outputs().iter().find(|other| node.unit(other) == Some("mm") && other.name == "distance")?;
        Some((read, meant))
    }
}
