//! Warnings about values that exceed the range of a picture.
use super::plan::{OutputPart, Planned};
use super::render::Render;
use crate::diagnostics::{Code, Diagnostic};
use crate::eval::Event;
use crate::picture::WriteStats;
use crate::value::Channel;

/// The advice where the values may have any meaning.
const STATE: &str = "state the values with `File(from: …, range: (lowest, highest))`, or render to EXR";

impl Render<'_, '_> {
    /// Warns if values of a file were clipped when it was written, now or in an earlier run.
    pub(super) fn warn_clipped(&self, planned: &Planned<'_>, written: &WriteStats) {
        let Some(message) = written.loss(&planned.path, planned.range) else { return };
        let help = self.help_for_clipped(planned);
        let warning = Diagnostic::new(Code::OutOfRange, planned.output.span, message).help(help);
        self.observer.event(Event::Warning(warning.as_warning()));
    }

    /// Advice about clipped values: state a range for heights, or correct the graph for masks and roughness.
    fn help_for_clipped(&self, planned: &Planned<'_>) -> String {
        if matches!(planned.part, OutputPart::Export(_)) {
            return "these textures hold values from 0 to 1: limit the channels, for example with `Remap(…, clamp: true)`".to_owned();
        }
        let output = planned.output;
        let from = &self.planner.graph.nodes[output.node].node;
        let has_unit = from.outputs().get(output.output).is_some_and(|output| from.unit(output).is_some());
        match planned.part {
            OutputPart::Channel(Channel::Height | Channel::AnisotropyAngle | Channel::Ior | Channel::Emission) => {
                STATE.to_owned()
            }
            OutputPart::Channel(channel) => {
                format!(
                    "`{}` ranges from 0 to 1: correct its nodes, for example with `Remap(…, clamp: true)`",
                    channel.name()
                )
            }
            _ if has_unit || output.range.is_some() => STATE.to_owned(),
            _ => format!(
                "masks and colours range from 0 to 1: correct their nodes, for example with `Remap(…, clamp: true)`. For other values, {STATE}"
            ),
        }
    }
}
