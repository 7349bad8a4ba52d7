//! Resolves references: `"node"`, `"node.output"`, `"material.channel"` and `"color.r"`, through uses and inputs.
use super::linker::{Bound, Entity, Linker, Target};
use super::part::{Shape, SyntaxValue};
use super::paths::Rest;
use super::read::shorten;
use crate::diagnostics::{Code, Diagnostic};
use crate::node::{Output, OutputType};
use crate::value::{Accepts, Channel, Type};
use std::collections::BTreeSet;

/// The resolved meaning of a reference.
pub(super) struct Meaning {
    pub(super) target: Target,
    pub(super) declared: Option<Accepts>,
}

impl Linker<'_> {
    /// Resolves `name`, written at `part` in `scope`. Errors of the name itself are reported here, others at their own
    /// places.
    pub(super) fn resolve(&mut self, scope: usize, part: &SyntaxValue, name: &str) -> Meaning {
        let (meaning, rest) = self.resolve_value(scope, part, name);
        match rest {
            Some(rest) => {
                let target = self.components_of(scope, meaning.target, part, &rest);
                Meaning { target, declared: None }
            }
            None => meaning,
        }
    }

    /// Resolves a path up to its components, which are returned.
    pub(super) fn resolve_value(&mut self, scope: usize, part: &SyntaxValue, name: &str) -> (Meaning, Option<Rest>) {
        let (target, rest) = self.follow(scope, part, name);
        let declared = match self.scopes[scope].names.get(name) {
            Some(Entity::Input(index)) => self.docs[self.scopes[scope].doc].document.inputs[*index].ty,
            _ => None,
        };
        (Meaning { declared: declared.filter(|_| !matches!(target, Target::Broken)), target }, rest)
    }

    /// Follows names until it reaches a node or a literal. Channels and components that other scopes take are applied;
    /// of the path itself only the channel.
    fn follow(&mut self, scope: usize, part: &SyntaxValue, name: &str) -> (Target, Option<Rest>) {
        let mut at = (scope, part.clone(), name.to_owned());
        let mut seen = BTreeSet::new();
        // The channels and components that the paths so far take, with their scope and place.
        let mut pending: Vec<(usize, SyntaxValue, Rest)> = Vec::new();
        // The inputs on the way, and the number of items of `pending` that follow the input.
        let mut passed: Vec<(usize, usize, usize)> = Vec::new();
        let mut target = loop {
            let (scope, part, name) = at.clone();
            let first = seen.is_empty();
            let inline = self.inlines.get(&(scope, part.span())).copied();
            let (node, after) = match name.split_once('.').filter(|_| inline.is_none()) {
                Some((node, after)) => (node, Some(after)),
                None => (name.as_str(), None),
            };
            let named = self.scopes[scope].names.get(node).copied();
            let entity = inline.or(named);
            if !seen.insert((scope, name.clone())) {
                let message = format!("`{}` leads back to itself", shorten(&name));
                self.report.push(part.error(Code::Cycle, message));
                break Target::Broken;
            }
            let (port, rest) = match self.split(entity, after) {
                Ok(split) => split,
                Err(names) => {
                    if first {
                        let error = self.unknown_rest(&part, entity, (node, after.unwrap_or_default()), &names);
                        self.report.push(*error);
                    }
                    break Target::Broken;
                }
            };
            pending.extend(rest.map(|rest| (scope, part.clone(), rest)));
            let found = match entity {
                None => Err(self.unknown_node(scope, &part, node)),
                Some(Entity::Broken) => break Target::Broken,
                Some(Entity::Node(flat)) => self.output_of(flat, &part, node, port).map(|output| {
                    let renamed =
                        port.filter(|_| first).and_then(|port| self.renamed(flat, output, &part, (node, port)));
                    renamed.into_iter().for_each(|warning| self.report.push(warning));
                    Next::Found(Target::Out { flat, output })
                }),
                Some(Entity::Use(child)) => match self.output_of_use(child, &part, node, port) {
                    Ok(Next::Go((inner, from, name))) => Ok(match self.laid_out(child, port, &from) {
                        Some(flat) => Next::Found(Target::Out { flat, output: 0 }),
                        None => Next::Go((inner, from, name)),
                    }),
                    other => other,
                },
                Some(Entity::Each(chooser)) => match self.choosers[chooser].children.first().copied() {
                    // All instances have the same output names.
                    Some(child) => {
                        self.output_of_use(child, &part, node, port).map(|_| match self.chosen(chooser, port) {
                            Some(flat) => Next::Found(Target::Out { flat, output: 0 }),
                            None => Next::Found(Target::Broken),
                        })
                    }
                    None => break Target::Broken,
                },
                Some(Entity::Input(index)) => {
                    passed.push((scope, index, pending.len()));
                    Ok(self.input_of(scope, index))
                }
            };
            match found {
                Ok(Next::Found(target)) => break target,
                Ok(Next::Go(next)) => at = next,
                Err(error) => {
                    if first {
                        self.report.push(*error);
                    }
                    break Target::Broken;
                }
            }
        };
        let outer = pending.first().is_some_and(|(of, at, _)| *of == scope && at.span() == part.span());
        let mut rest = None;
        loop {
            // Keep the targets of inputs, since many references may lead through the same inputs.
            while let Some((scope, input, _)) = passed.pop_if(|(.., depth)| *depth == pending.len()) {
                self.scopes[scope].resolved[input] = Some(target.clone());
            }
            let Some((scope, part, of)) = pending.pop() else { break };
            target = self.channel_of(scope, target, &part, &of);
            if pending.is_empty() && outer {
                rest = of.components.is_some().then_some(of);
            } else {
                target = self.components_of(scope, target, &part, &of);
            }
        }
        (target, rest)
    }

    /// Splits the part of a path after a name into the name of an output, and channel and components. An error has the
    /// names that may follow.
    fn split<'p>(
        &self,
        entity: Option<Entity>,
        after: Option<&'p str>,
    ) -> Result<(Option<&'p str>, Option<Rest>), Vec<String>> {
        let Some(after) = after else { return Ok((None, None)) };
        let (first, then) = after.split_once('.').map_or((after, None), |(first, then)| (first, Some(then)));
        let names: Vec<String> = match entity {
            Some(Entity::Node(flat)) => {
                let outputs = self.flats[flat].info.map_or(&[][..], |info| info.outputs);
                if Output::position(outputs, first).is_some() {
                    return self.rest_of(first, then, Vec::new());
                }
                outputs.iter().map(|output| output.name.to_owned()).collect()
            }
            Some(Entity::Use(child)) => self.output_names(child),
            Some(Entity::Each(chooser)) => {
                self.choosers[chooser].children.first().map(|child| self.output_names(*child)).unwrap_or_default()
            }
            Some(Entity::Input(_)) => Vec::new(),
            Some(Entity::Broken) | None => return Ok((None, None)),
        };
        if names.iter().any(|name| name == first) {
            return self.rest_of(first, then, names);
        }
        Rest::of(after).map(|rest| (None, Some(rest))).ok_or(names)
    }

    fn rest_of<'p>(
        &self,
        output: &'p str,
        after: Option<&str>,
        names: Vec<String>,
    ) -> Result<(Option<&'p str>, Option<Rest>), Vec<String>> {
        match after.map(Rest::of) {
            None => Ok((Some(output), None)),
            Some(Some(rest)) => Ok((Some(output), Some(rest))),
            Some(None) => Err(names),
        }
    }

    /// The error for the part of a path after a name that is neither an output nor a channel nor components.
    fn unknown_rest(
        &self,
        part: &SyntaxValue,
        entity: Option<Entity>,
        (node, after): (&str, &str),
        names: &[String],
    ) -> Box<Diagnostic> {
        let (first, then) = after.split_once('.').map_or((after, None), |(first, then)| (first, Some(then)));
        let is_output = match entity {
            Some(Entity::Node(flat)) => {
                Output::position(self.flats[flat].info.map_or(&[][..], |info| info.outputs), first).is_some()
            }
            _ => names.iter().any(|name| name == first),
        };
        if let Some(then) = then.filter(|_| is_output) {
            let message = format!("`{}.{first}` has no channel and no components `{}`", shorten(node), shorten(then));
            let channels = Channel::ALL.iter().map(|channel| channel.name());
            return Box::new(self.report.with_suggestion(
                part.error(Code::UnknownPort, message),
                then,
                "channel",
                channels,
            ));
        }
        let material = match entity {
            Some(Entity::Input(_)) => {
                let message = format!("`{node}` is an input of the graph; it has no output `{}`", shorten(after));
                return Box::new(part.error(Code::UnknownPort, message).help(format!("write \"{node}\"")));
            }
            Some(Entity::Node(flat)) => {
                let main = self.flats[flat].info.and_then(|info| info.outputs.first());
                main.is_some_and(|output| output.ty == OutputType::Fixed(Type::Material))
            }
            _ => false,
        };
        let channels = if material { Channel::ALL } else { &[] };
        let names = names.iter().map(String::as_str).chain(channels.iter().map(|channel| channel.name()));
        self.unknown_port(part, node, first, names)
    }

    fn output_names(&self, child: usize) -> Vec<String> {
        let document = &self.docs[self.scopes[child].doc].document;
        document.outputs.iter().map(|output| output.name.clone()).collect()
    }

    fn unknown_node(&self, scope: usize, part: &SyntaxValue, node: &str) -> Box<Diagnostic> {
        let names = self.scopes[scope].names.keys().map(String::as_str);
        let error = part.error(Code::UnknownNode, format!("there is no node `{}`", shorten(node)));
        Box::new(self.report.with_suggestion(error, node, "node", names))
    }

    fn output_of(
        &self,
        flat: usize,
        part: &SyntaxValue,
        node: &str,
        port: Option<&str>,
    ) -> Result<usize, Box<Diagnostic>> {
        let outputs = self.flats[flat].info.map_or(&[][..], |info| info.outputs);
        let Some(port) = port else { return Ok(0) };
        Output::position(outputs, port).ok_or_else(|| {
            let names = outputs.iter().map(|output| output.name);
            self.unknown_port(part, node, port, names)
        })
    }

    /// The warning for a reference to an old name of an output.
    fn renamed(
        &self,
        flat: usize,
        output: usize,
        part: &SyntaxValue,
        (node, port): (&str, &str),
    ) -> Option<Diagnostic> {
        let info = self.flats[flat].info?;
        let now = info.outputs.get(output).map(|output| output.name).filter(|now| *now != port)?;
        let message = format!("the output `{port}` of `{}` is called `{now}` now", info.kind);
        let written = format!("write `\"{node}.{now}\"`");
        Some(part.error(Code::Advice, message).help(written).as_warning())
    }

    fn output_of_use(
        &self,
        child: usize,
        part: &SyntaxValue,
        node: &str,
        port: Option<&str>,
    ) -> Result<Next, Box<Diagnostic>> {
        let document = &self.docs[self.scopes[child].doc].document;
        let found = match port {
            Some(port) => document.output(port),
            None => document.outputs.first(),
        };
        let output = found.ok_or_else(|| {
            let names = document.outputs.iter().map(|output| output.name.as_str());
            self.unknown_port(part, node, port.unwrap_or("…"), names)
        })?;
        Ok(match output.from.as_ref().map(|from| (from, from.shape())) {
            Some((from, Shape::Text(name))) => Next::Go((child, from.clone(), name)),
            _ => Next::Found(Target::Broken),
        })
    }

    fn unknown_port<'n>(
        &self,
        part: &SyntaxValue,
        node: &str,
        port: &str,
        names: impl IntoIterator<Item = &'n str>,
    ) -> Box<Diagnostic> {
        let message = format!("`{}` has no output `{}`", shorten(node), shorten(port));
        Box::new(self.report.with_suggestion(part.error(Code::UnknownPort, message), port, "output", names))
    }

    fn input_of(&self, scope: usize, index: usize) -> Next {
        if let Some(known) = &self.scopes[scope].resolved[index] {
            return Next::Found(known.clone());
        }
        match &self.scopes[scope].inputs[index] {
            Bound::Constant(field, part) => Next::Found(Target::Constant(field.clone(), part.clone())),
            Bound::Pass(flat) => Next::Found(Target::Out { flat: *flat, output: 0 }),
            Bound::Wire { scope, part, name } => Next::Go((*scope, part.clone(), name.clone())),
            Bound::Broken => Next::Found(Target::Broken),
        }
    }
}

enum Next {
    Found(Target),
    Go((usize, SyntaxValue, String)),
}
