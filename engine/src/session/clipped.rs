//! Advice about values that a picture could not hold.
use super::job::Job;
use super::plan::Part;
use super::render::Render;
use crate::value::Channel;

/// The advice where any values may be meant.
const STATE: &str = "state the values with `File(from: …, range: (lowest, highest))`, or render to EXR";

impl Render<'_, '_> {
    /// Advice about values of a picture that were clipped: a height is stated, a mask or a roughness is mended.
    pub(super) fn help_for_clipped(&self, job: &Job<'_>) -> String {
        if job.files.is_some() {
            return "these textures hold 0 to 1: limit the channels, with `Remap(…, clamp: true)` say".to_owned();
        }
        let output = job.planned.output;
        let from = &self.planner.graph.nodes[output.node].node;
        let has_unit = from.outputs().get(output.output).is_some_and(|output| from.unit(output).is_some());
        match job.planned.part {
            Part::Channel(Channel::Height | Channel::AnisotropyAngle | Channel::Ior | Channel::Emission) => {
                STATE.to_owned()
            }
            Part::Channel(channel) => {
                format!("`{}` goes from 0 to 1: mend what makes it, with `Remap(…, clamp: true)` say", channel.name())
            }
            _ if has_unit || output.range.is_some() => STATE.to_owned(),
            _ => format!(
                "masks and colours go from 0 to 1: mend what makes them, with `Remap(…, clamp: true)` say. For other values, {STATE}"
            ),
        }
    }
}
