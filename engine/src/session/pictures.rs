//! Finds the pictures of a named output as fields, for programs that evaluate them into their own memory.
use super::plan::wanted;
use super::{Failure, Session};
use crate::eval::{CancelToken, Observer};
use crate::graph::{Graph, GraphOutput};
use crate::value::{Channel, Field, Type, Value};

impl Session {
    /// The pictures of `name`, with their names: the one field of an output or of `NAME.CHANNEL`, all channels of a
    /// material, or, if `name` is a channel and not an output, that channel of the only material that has it. The
    /// fields are not evaluated yet.
    ///
    /// # Errors
    /// An unknown name, or an output that is not a picture; errors of the graph, at their places.
    pub fn pictures(
        &self,
        graph: &Graph,
        name: &str,
        cancel: &CancelToken,
        observer: &dyn Observer,
    ) -> Result<Vec<(String, Field)>, Failure> {
        let (output, channel) = match wanted(graph, &[name.to_owned()]) {
            Ok(found) => found[0],
            Err(unknown) => match Channel::from_name(name) {
                Some(channel) => self.only_material(graph, channel, unknown, cancel, observer)?,
                None => return Err(unknown),
            },
        };
        match (self.value(graph, (output.node, output.output), cancel, observer)?, channel) {
            (Value::Material(material), None) => Ok(material
                .channels()
                .iter()
                .map(|(channel, field)| (channel.name().to_owned(), field.clone()))
                .collect()),
            (Value::Material(material), Some(channel)) => {
                let found = material.channels().iter().find(|(known, _)| *known == channel);
                let field = found.map_or_else(|| channel.default_field(), |(_, field)| field.clone());
                Ok(vec![(channel.name().to_owned(), field)])
            }
            (value, _) => match value.rendered() {
                Some((field, _)) => Ok(vec![(output.name.clone(), field)]),
                None => {
                    Err(Failure::Usage(format!("the output `{}` is {}, which is no picture", output.name, output.ty)))
                }
            },
        }
    }

    /// The output with the only material that has a channel.
    fn only_material<'g>(
        &self,
        graph: &'g Graph,
        channel: Channel,
        unknown: Failure,
        cancel: &CancelToken,
        observer: &dyn Observer,
    ) -> Result<(&'g GraphOutput, Option<Channel>), Failure> {
        let mut found: Vec<&GraphOutput> = Vec::new();
        for output in graph.outputs.iter().filter(|output| output.ty == Type::Material) {
            // Several outputs may share one material.
            if found.iter().any(|known| (known.node, known.output) == (output.node, output.output)) {
                continue;
            }
            let value = self.value(graph, (output.node, output.output), cancel, observer)?;
            if matches!(value, Value::Material(material) if material.channels().iter().any(|(c, _)| *c == channel)) {
                found.push(output);
            }
        }
        match found[..] {
            [] => Err(unknown),
            [output] => Ok((output, Some(channel))),
            [first, second, ..] => {
                let (name, first, second) = (channel.name(), &first.name, &second.name);
                let message =
                    format!("several outputs have a channel `{name}`: write `{first}.{name}` or `{second}.{name}`");
                Err(Failure::Usage(message))
            }
        }
    }
}
