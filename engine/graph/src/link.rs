//! Links scopes into a graph: wires, cycles, types and nodes.
use super::linker::{Flat, Linker, Port, Target};
use super::part::Shape;
use super::ports::Literal;
use super::{args, convert, each, instance};
use crate::diagnostics::{Code, Diagnostic, Problem, Span};
use crate::node::OutputType;
use crate::value::{Accepts, Canvas, Type};
use crate::{GraphNode, Input};
use petgraph::algo::kosaraju_scc;
use petgraph::graph::{DiGraph, NodeIndex};

/// The most nodes of a cycle that are named in an error.
const SHOWN: usize = 8;

impl Linker<'_> {
    /// Checks all declarations and builds the nodes; some of them after a cancellation.
    pub(super) fn link(&mut self) {
        self.check_functions();
        let read = self.read_from(0);
        if self.cancel.is_cancelled() {
            return;
        }
        // The content of a picture file decides the types of its readers, and some nodes determine their own output
        // types, so these nodes are built first.
        for flat in (0..self.flats.len()).filter(|flat| self.is_built_first(*flat)).collect::<Vec<_>>() {
            self.enter(self.flats[flat].scope);
            self.build(flat);
            let built = &self.flats[flat];
            let gray = built.node.as_ref().filter(|_| built.good).map(|node| node.makes_gray(&built.files));
            self.flats[flat].gray = gray;
        }
        self.resolve_checks();
        self.resolve_outputs();
        self.read_from(read);
        let order = self.order();
        for &flat in &order {
            if self.cancel.is_cancelled() {
                return;
            }
            self.find_types(flat);
        }
        self.choose_vectors();
        self.find_inner_formulas();
        self.check_types();
        for flat in 0..self.flats.len() {
            if self.cancel.is_cancelled() {
                return;
            }
            self.enter(self.flats[flat].scope);
            match self.flats[flat].info {
                Some(_) if self.is_built_first(flat) => {}
                Some(_) => self.build(flat),
                None => self.build_pass(flat),
            }
        }
        self.check_channels(&order);
        self.check_distances();
    }

    /// Reads the fields of all nodes from index `flat` on, including nodes added on the way; returns the number of
    /// nodes.
    fn read_from(&mut self, mut flat: usize) -> usize {
        while flat < self.flats.len() && !self.cancel.is_cancelled() {
            self.enter(self.flats[flat].scope);
            if self.flats[flat].info.is_some() {
                self.read_fields(flat);
            } else {
                self.resolve_pass(flat);
            }
            flat += 1;
        }
        flat
    }

    /// Returns true if a node makes a picture, or determines its own output types.
    fn is_built_first(&self, flat: usize) -> bool {
        let outputs = self.flats[flat].info.map_or(&[][..], |info| info.outputs);
        outputs.iter().any(|output| matches!(output.ty, OutputType::Fixed(Type::Picture) | OutputType::Told))
    }

    /// The output type that a node determines; `None` after an error.
    fn told_type(&mut self, flat: usize) -> Option<Type> {
        let node = &self.flats[flat];
        let built = node.node.clone().filter(|_| node.good)?;
        let types: Vec<_> = node
            .slots
            .iter()
            .map(|slot| Some((slot.port.name(), self.field_type(&slot.target)?)))
            .collect::<Option<_>>()?;
        let problems = match built.type_of_output(&types) {
            Ok(ty) => return Some(ty),
            Err(problems) => problems,
        };
        let place =
            |problem: &Problem| problem.field.as_deref().and_then(|field| node.field(field)).unwrap_or(&node.kind);
        let errors: Vec<_> = problems.iter().map(|problem| args::at(place(problem), problem)).collect();
        self.enter(self.flats[flat].scope);
        self.flats[flat].good = false;
        errors.into_iter().for_each(|error| self.report.push(error));
        None
    }

    /// The type of the value at a port that takes any field; `None` if an error hides it.
    pub(super) fn field_type(&self, target: &Target) -> Option<Type> {
        match (self.type_of(target)?, target) {
            (Type::Picture, Target::Out { flat, .. }) => {
                self.flats[*flat].gray.map(|gray| if gray { Type::Gray } else { Type::Rgb })
            }
            (ty, _) => Some(ty),
        }
    }

    /// Resolves the value of a sub-graph's input with a conversion.
    fn resolve_pass(&mut self, flat: usize) {
        if self.flats[flat].resolved {
            return;
        }
        if self.flats[flat].formula.is_some() {
            return self.resolve_formula(flat);
        }
        if let Some((chooser, output)) = self.flats[flat].chooses.clone() {
            return self.resolve_chosen(flat, chooser, &output);
        }
        let node = &self.flats[flat];
        let Some(slot) = node.slots.first() else { return };
        let (scope, part) = (node.scope, slot.part.clone());
        if let Ok(Literal::Reference(name)) = self.written(scope, &part, slot.wants, &slot.port) {
            let meaning = self.resolve(scope, &part, &name);
            let node = &mut self.flats[flat];
            node.slots[0].target = meaning.target;
            // A laid-out value keeps its own type.
            node.slots[0].declared = meaning.declared.filter(|_| node.layout.is_none());
        }
    }

    /// Resolves the outputs of the graph, so that instances are laid out for them too.
    fn resolve_outputs(&mut self) {
        let docs = self.docs;
        self.enter(0);
        for output in &docs[self.scopes[0].doc].document.outputs {
            if let Some((from, Shape::Text(name))) = output.from.as_ref().map(|from| (from, from.shape()))
                && let Target::Out { flat, .. } = self.resolve(0, from, &name).target
            {
                self.flats[flat].shown = true;
            }
        }
    }

    fn resolve_checks(&mut self) {
        let mut checks = std::mem::take(&mut self.checks);
        for (scope, slot) in &mut checks {
            self.enter(*scope);
            if let Ok(Literal::Reference(name)) = self.written(*scope, &slot.part, slot.wants, &slot.port) {
                let meaning = self.resolve(*scope, &slot.part, &name);
                slot.target = meaning.target;
                slot.declared = meaning.declared;
            }
        }
        self.checks = checks;
    }

    /// The nodes, each after its inputs; reports cycles.
    fn order(&mut self) -> Vec<usize> {
        let mut graph: DiGraph<(), Span> = DiGraph::with_capacity(self.flats.len(), self.flats.len() * 2);
        for _ in &self.flats {
            graph.add_node(());
        }
        for (reader, node) in self.flats.iter().enumerate() {
            for slot in &node.slots {
                if let Target::Out { flat, .. } = slot.target {
                    graph.add_edge(NodeIndex::new(flat), NodeIndex::new(reader), slot.part.span());
                }
            }
        }
        // Not Tarjan's algorithm, which is recursive in this library: a chain may contain a hundred thousand nodes.
        let components = kosaraju_scc(&graph);
        let mut component_of = vec![0; self.flats.len()];
        for (number, component) in components.iter().enumerate() {
            component.iter().for_each(|node| component_of[node.index()] = number);
        }
        let mut wires: Vec<Vec<(Span, usize)>> = vec![Vec::new(); components.len()];
        for edge in graph.edge_indices() {
            if let (Some((from, to)), Some(span)) = (graph.edge_endpoints(edge), graph.edge_weight(edge)) {
                let number = component_of[from.index()];
                if number == component_of[to.index()] {
                    wires[number].push((*span, to.index()));
                }
            }
        }
        for wires in &mut wires {
            wires.sort_unstable();
            wires.dedup();
            self.report_cycle(wires);
        }
        components.into_iter().rev().flatten().map(NodeIndex::index).collect()
    }

    fn report_cycle(&mut self, wires: &[(Span, usize)]) {
        let Some((first, reader)) = wires.first() else { return };
        self.enter(self.flats[*reader].scope);
        let mut names: Vec<_> = wires.iter().map(|(_, node)| format!("`{}`", self.flats[*node].name)).collect();
        names.dedup();
        let message = match &names[..] {
            [name] => format!("{name} needs itself"),
            _ if names.len() <= SHOWN => format!("these nodes need each other: {}", names.join(", ")),
            _ => format!("{} nodes need each other: {}, …", names.len(), names[..SHOWN].join(", ")),
        };
        let mut error = Diagnostic::new(Code::Cycle, *first, message).help("remove one of these references");
        for (span, _) in wires[1..].iter().take(SHOWN) {
            error = error.related(*span, "the cycle goes on here");
        }
        self.report.push(error);
        for (_, node) in wires {
            self.flats[*node].good = false;
        }
    }

    fn is_told(&self, flat: usize) -> bool {
        self.flats[flat].info.is_some_and(|info| info.outputs.iter().any(|output| output.ty == OutputType::Told))
    }

    fn find_types(&mut self, flat: usize) {
        let told = self.is_told(flat).then(|| self.told_type(flat)).flatten();
        let node = &self.flats[flat];
        let Some(info) = node.info else {
            if node.chooses.is_some() {
                return self.find_chosen_type(flat);
            }
            if node.formula.is_some() {
                return self.type_formula(flat);
            }
            if let Some(channel) = node.channel {
                return self.type_channel(flat, channel);
            }
            let slot = node.slots.first();
            let ty = match (&node.layout, slot) {
                (Some(_), Some(slot)) => self.field_type(&slot.target),
                (_, Some(slot)) => slot.wants.only(),
                (_, None) => Some(Type::Material),
            };
            if let (Some(ty), Some(_)) = (ty, &node.layout) {
                self.flats[flat].slots[0].wants = Accepts::One(ty);
            }
            self.flats[flat].outputs = vec![ty];
            return;
        };
        let outputs = info.outputs.iter().map(|output| match output.ty {
            OutputType::Fixed(ty) => Some(ty),
            OutputType::Told => told,
            OutputType::ColorOf(ports) => {
                Some(if self.reads_space(flat, ports) { Type::SolidColor } else { Type::Rgb })
            }
            OutputType::NumberOf(ports) => Some(if self.reads_space(flat, ports) { Type::Solid } else { Type::Gray }),
            OutputType::MaterialOf(ports) => {
                Some(if self.reads_space(flat, ports) { Type::SolidMaterial } else { Type::Material })
            }
            OutputType::ValueOf(ports) if self.makes_solid(flat, ports) => self.widest_solid(flat, ports),
            OutputType::ValueOf(ports) | OutputType::Like(ports) => self.widest_field(flat, ports),
        });
        self.flats[flat].outputs = outputs.collect();
    }

    /// The type of the values that `Each` selects from, equal for all instances.
    fn find_chosen_type(&mut self, flat: usize) {
        let slots = self.flats[flat].slots.iter().skip(1);
        let types: Vec<_> = slots.map(|slot| self.field_type(&slot.target)).collect();
        let ty = types.first().copied().flatten();
        if let Some(ty) = ty {
            self.flats[flat].slots.iter_mut().skip(1).for_each(|slot| slot.wants = Accepts::One(ty));
        }
        self.flats[flat].outputs = vec![ty];
    }

    fn check_types(&mut self) {
        for flat in 0..self.flats.len() {
            let scope = self.flats[flat].scope;
            let kind = self.flats[flat].info.map(|info| info.kind.as_str());
            let check =
                |slot| self.check_type(scope, slot, kind).or_else(|| self.check_movable(&slot.part, &slot.target));
            // The types of a formula's values were checked when it was compiled.
            let slots = self.flats[flat].slots.iter().filter(|_| self.flats[flat].formula.is_none());
            let mut errors: Vec<_> = slots.filter_map(check).collect();
            if errors.is_empty() {
                errors = self.mixed_types(flat);
            }
            if errors.is_empty() {
                errors = self.mixed_spaces(flat);
            }
            if !errors.is_empty() {
                self.enter(self.flats[flat].scope);
                self.flats[flat].good = false;
                errors.into_iter().for_each(|error| self.report.push(error));
            }
            self.check_bounds(flat);
        }
        let checks = std::mem::take(&mut self.checks);
        for (scope, slot) in &checks {
            self.enter(*scope);
            let error = self.check_type(*scope, slot, None).or_else(|| self.check_movable(&slot.part, &slot.target));
            if let Some(error) = error {
                self.report.push(error);
            }
        }
    }

    fn build_pass(&mut self, flat: usize) {
        let node = &self.flats[flat];
        if node.formula.is_some() {
            return self.build_formula(flat);
        }
        if let Some(channel) = node.channel {
            return self.build_channel(flat, channel);
        }
        let Some(slot) = node.slots.first() else {
            self.flats[flat].node = convert::no_material();
            return;
        };
        if node.chooses.is_some() {
            let ty = node.outputs.first().copied().flatten().filter(|ty| instance::can_choose(*ty));
            if let Some((kind, made)) = ty.and_then(|ty| each::node(self.registry, ty, node.slots.len())) {
                (self.flats[flat].kind_name, self.flats[flat].node) = (kind, Some(made));
            } else if let Some(ty) = ty {
                let message = format!("there is no node that chooses among {ty}");
                self.report.push(node.kind.error(Code::BadValue, message));
            }
            return;
        }
        if let Some(layout) = &node.layout {
            let ty = slot.wants.only().filter(|ty| instance::can_move(*ty));
            if let Some((kind, made)) = ty.and_then(|ty| layout.node(self.registry, ty)) {
                (self.flats[flat].kind_name, self.flats[flat].node) = (kind, Some(made));
            } else if let Some(ty) = ty {
                let message = format!("there is no node that lays out {ty}");
                self.report.push(node.kind.error(Code::BadValue, message));
            }
            return;
        }
        let same = self.type_of(&slot.target).map(Accepts::One) == Some(slot.wants);
        self.flats[flat].node = convert::node(slot.wants, same);
    }

    /// The nodes for evaluation; only without errors.
    pub(super) fn into_nodes(self) -> Option<DiGraph<GraphNode, ()>> {
        let mut graph = DiGraph::with_capacity(self.flats.len(), self.flats.len() * 2);
        let mut edges = Vec::new();
        for (reader, flat) in self.flats.into_iter().enumerate() {
            for slot in &flat.slots {
                if let Target::Out { flat, .. } = slot.target {
                    edges.push((flat, reader));
                }
            }
            let canvas = flat.layout.as_ref().map_or(self.scopes[flat.scope].canvas, |layout| layout.canvas);
            graph.add_node(graph_node(flat, canvas)?);
        }
        edges.sort_unstable();
        edges.dedup();
        for (from, to) in edges {
            graph.add_edge(NodeIndex::new(from), NodeIndex::new(to), ());
        }
        Some(graph)
    }
}

fn graph_node(flat: Flat<'_>, canvas: Canvas) -> Option<GraphNode> {
    let mut inputs = Vec::with_capacity(flat.slots.len());
    let mut slots = Vec::with_capacity(flat.slots.len());
    let mut fields: Vec<_> = flat.args.iter().map(|arg| (arg.name.clone(), arg.value.span())).collect();
    for (name, part, _) in &flat.params {
        if let Some(field) = fields.iter_mut().find(|(field, _)| field == name) {
            field.1 = part.span();
        }
    }
    for slot in flat.slots {
        inputs.push(match slot.target {
            Target::Out { flat, output } => Input::Wire { node: NodeIndex::new(flat), output },
            Target::Constant(field, _) => Input::Constant(field),
            Target::Broken => return None,
        });
        slots.push(match slot.port {
            Port::Node(port) => port,
            Port::Input(_) => convert::PORT.to_owned(),
        });
    }
    Some(GraphNode {
        name: flat.name,
        kind: flat.kind_name,
        node: flat.node?,
        canvas,
        inputs,
        slots,
        outputs: flat.outputs.into_iter().collect::<Option<Vec<_>>>()?,
        files: flat.files,
        channels: flat.channels.unwrap_or_default(),
        span: flat.kind.span(),
        fields,
    })
}
