//! Advice about values that exceed the range of a picture.
use super::job::Job;
use super::plan::OutputPart;
use super::render::Render;
use crate::value::Channel;

/// The advice where the values may have any meaning.
const STATE: &str = "state the values with `File(from: …, range: (lowest, highest))`, or render to EXR";

impl Render<'_, '_> {
    /// Advice about clipped values: state a range for heights, or correct the graph for masks and roughness.
    pub(super) fn help_for_clipped(&self, job: &Job<'_>) -> String {
        if job.files.is_some() {
            return "these textures hold values from 0 to 1: limit the channels, for example with `Remap(…, clamp: true)`".to_owned();
        }
        let output = job.planned.output;
        let from = &self.planner.graph.nodes[output.node].node;
        let has_unit = from.outputs().get(output.output).is_some_and(|output| from.unit(output).is_some());
        match job.planned.part {
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
