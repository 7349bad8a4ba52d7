//! Completion of nodes and their outputs.
use super::super::expect::Expect;
use super::super::file::Section;
use super::super::formula::Inferred;
use super::super::names::{Symbol, occurrences};
use super::super::types::Port;
use super::super::world::is_use;
use super::kinds::source_of;
use super::{Ask, Completion, Sort, Topic};
use shibo_value::{Accepts, Type};
use std::collections::{HashMap, HashSet};

/// Least penalty for a value of a type that cannot be used.
const MISFIT: f64 = 20.0;

/// Penalty for a value of a type.
pub(super) type Fits<'f> = &'f dyn Fn(Option<Accepts>) -> f64;

/// References between the nodes of a file.
struct Wires {
    /// Number of references to each node and output.
    nodes: HashMap<String, usize>,
    ports: HashMap<(String, String), usize>,
    /// Direct and indirect readers of the node at the cursor.
    after: HashSet<String>,
    /// References that the node at the cursor has already.
    own: HashSet<String>,
    /// References in fields of the same name in other nodes, with counts.
    alike: HashMap<String, usize>,
    /// Index of the entry of `nodes` at the cursor.
    me: Option<usize>,
}

impl<'a> Ask<'a> {
    /// Nodes and outputs that can be referenced here; those of a fitting type come first.
    pub(super) fn references(&self, expect: Expect<'a>, fits: Fits<'_>) -> Vec<Completion> {
        let port_name = self.port_name(expect);
        let wires = self.wires(port_name);
        let file = self.cx.file;
        let owner = self.owner(expect);
        let mut found = Vec::new();
        let inputs = file.names(Section::Inputs).map(|name| (name, None));
        let nodes = file.entries(Section::Nodes).iter().enumerate().filter_map(|(i, n)| Some((n.name()?, Some(i))));
        let siblings = self.siblings();
        let me = wires.me.and_then(|me| file.entries(Section::Nodes).get(me)?.name());
        for (name, index) in inputs.chain(nodes) {
            if Some(name) == me || wires.after.contains(name) {
                continue;
            }
            let kind = index.and_then(|i| file.head(&file.entries(Section::Nodes)[i])).unwrap_or("input");
            let base = near(wires.me, index, file.entries(Section::Nodes).len())
                + likeness(name, port_name, me)
                + if wires.own.contains(name) { 0.6 } else { 0.0 };
            for (i, port) in self.types.ports(name).iter().enumerate() {
                let forms = forms(name, port, i, self.types.ports(name).len());
                let usage = Usage { wires: &wires, fits, owner, kind, port_name, me, siblings: &siblings };
                let fitness = base + self.fitness(name, port, i, &usage);
                let last = forms.len() - 1;
                for (at, (plain, label)) in forms.into_iter().enumerate() {
                    // References usually name the output of a sub-graph, but not the output of a node.
                    let score = fitness + if i == 0 && plain == is_use(kind) { 0.7 } else { 0.0 };
                    let unit = port.unit.map_or(String::new(), |unit| format!(" {unit}"));
                    let ty = port.ty.map_or("?", Accepts::name);
                    let topic = Topic::Node(name.to_owned());
                    if at == if is_use(kind) { last } else { 0 } {
                        found.extend(self.parts(&label, port.ty, base, &usage));
                    }
                    found.push(self.offer_text(&label, Sort::Node, &format!("{ty}{unit}, {kind}"), topic, score));
                }
            }
            if self.types.ports(name).is_empty() {
                let topic = Topic::Node(name.to_owned());
                found.push(self.offer_text(name, Sort::Node, kind, topic, base + 2.0));
            }
        }
        found
    }

    /// Channels of a material that does not fit itself, or components of a value; these last if the value fits.
    fn parts(&self, label: &str, ty: Option<Accepts>, base: f64, usage: &Usage<'_>) -> Vec<Completion> {
        let Some(ty) = ty else { return Vec::new() };
        let fits = (usage.fits)(Some(ty)) < MISFIT;
        let found = match ty {
            Accepts::One(Type::Material) if !fits => self.channels(label, usage.fits),
            ty if (usage.fits)(Inferred::of(ty).components("x").ty()) < MISFIT => {
                self.components(label, ty.into(), if fits { 12.0 } else { 2.0 })
            }
            _ => Vec::new(),
        };
        let like = |one: &Completion| if one.label.rsplit('.').next() == Some(usage.port_name) { 5.0 } else { 0.0 };
        let found = found.into_iter().map(|one| Completion { score: one.score + base + 3.0 - like(&one), ..one });
        found.filter(|one| one.score < MISFIT + base.abs()).collect()
    }

    /// Name of the port, input or output that gets a value here.
    pub(super) fn port_name(&self, expect: Expect<'a>) -> &'a str {
        match expect {
            Expect::Port(field, ..) | Expect::Value(field, _) => &field.name,
            Expect::With(_, Some(name)) | Expect::Entry(_, name) | Expect::Preset(name) => name,
            Expect::File(..) => self.trail.entry().and_then(|(_, item)| item.name()).unwrap_or_default(),
            _ => "",
        }
    }

    fn fitness(&self, name: &str, port: &Port, index: usize, usage: &Usage<'_>) -> f64 {
        let mut score = (usage.fits)(port.ty);
        let key = (name.to_owned(), port.name.clone());
        let of_port = usage.wires.ports.get(&key).copied().unwrap_or_default();
        let of_node = usage.wires.nodes.get(name).copied().unwrap_or_default();
        let used = if index == 0 { of_node.max(of_port) } else { of_port };
        score += if used > 0 { 2.2 + 0.1 * used.min(5) as f64 } else { 0.0 };
        if index > 0 {
            score += if of_node == 0 { 1.0 } else { 0.4 };
        }
        if !port.name.is_empty() && port.name == usage.port_name {
            score -= 5.0;
        }
        if usage.me.is_some_and(|me| !port.name.is_empty() && shares(&port.name, me)) {
            score -= 1.5;
        }
        if index > 0 && usage.siblings.contains(&port.name.as_str()) {
            score -= 1.5;
        }
        let label = if index == 0 { name.to_owned() } else { format!("{name}.{}", port.name) };
        score -= 1.2 * (1.0 + usage.wires.alike.get(&label).copied().unwrap_or_default() as f64).ln();
        if let Some((kind, field)) = usage.owner {
            let habits = self.cx.world.habits();
            let from = source_of(usage.kind, if index == 0 { "" } else { &port.name });
            score -= 0.5 * (1.0 + habits.source(kind, field, &from)).ln();
        }
        score
    }

    /// Returns whether a position follows the name of a field and a colon.
    fn is_field(&self, at: usize, field: &str) -> bool {
        let before = self.cx.file.text[..at].trim_end();
        let key = before.strip_suffix(':').map(|before| before.trim_end().trim_end_matches('"'));
        key.is_some_and(|key| key.strip_suffix(field).is_some_and(|rest| rest.ends_with([' ', '(', '"', '\n', ','])))
    }

    /// Output names of the references that the node at the cursor has already.
    fn siblings(&self) -> Vec<&'a str> {
        let items = self.trail.node().map_or(&[][..], |level| &level.body.items[..]);
        let text = |item: &'a super::super::view::Item| {
            let text = item.value.as_ref()?.text().filter(|text| !text.starts_with('='))?;
            text.split_once('.').map(|(_, port)| port)
        };
        items.iter().filter(|item| self.at < item.range.start || item.range.end < self.at).filter_map(text).collect()
    }

    /// Collects the references of the file, except the one at the cursor.
    fn wires(&self, field: &str) -> Wires {
        let file = self.cx.file;
        let nodes = file.entries(Section::Nodes);
        let entry_at = |at: usize| {
            let index = nodes.partition_point(|item| item.range.start <= at).checked_sub(1)?;
            (at <= nodes[index].range.end).then_some(index)
        };
        let me = entry_at(self.at);
        let mut wires = Wires {
            nodes: HashMap::new(),
            ports: HashMap::new(),
            after: HashSet::new(),
            own: HashSet::new(),
            alike: HashMap::new(),
            me,
        };
        let mut readers: HashMap<String, Vec<usize>> = HashMap::new();
        for found in occurrences(self.cx).into_iter().filter(|o| !o.declares) {
            // Of a formula, other names count.
            let here = if found.literal.1.starts_with('=') { &found.range } else { &found.literal.0 };
            if here.start <= self.at && self.at <= here.end {
                continue;
            }
            match found.symbol {
                Symbol::Node(name) => {
                    let reader = entry_at(found.range.start);
                    // A formula, which may be long, is no label.
                    if !found.literal.1.starts_with('=') && self.is_field(found.literal.0.start, field) {
                        *wires.alike.entry(found.literal.1.to_string()).or_default() += 1;
                    }
                    if reader.is_some() && reader == me {
                        wires.own.insert(name.clone());
                    }
                    readers.entry(name.clone()).or_default().extend(reader);
                    *wires.nodes.entry(name).or_default() += 1;
                }
                Symbol::Port(name, port) => *wires.ports.entry((name, port)).or_default() += 1,
                _ => {}
            }
        }
        let mut queue: Vec<usize> = me.into_iter().collect();
        while let Some(node) = queue.pop() {
            let Some(name) = nodes[node].name() else { continue };
            for reader in readers.get(name).into_iter().flatten() {
                if nodes[*reader].name().is_some_and(|name| wires.after.insert(name.to_owned())) {
                    queue.push(*reader);
                }
            }
        }
        wires
    }
}

/// Data for scoring an output.
struct Usage<'u> {
    wires: &'u Wires,
    fits: Fits<'u>,
    owner: Option<(&'u str, &'u str)>,
    kind: &'u str,
    port_name: &'u str,
    /// The node at the cursor.
    me: Option<&'u str>,
    /// Output names of its other references.
    siblings: &'u [&'u str],
}

/// Ways to write a reference to an output, each with whether it is the node's name alone.
fn forms(name: &str, port: &Port, index: usize, ports: usize) -> Vec<(bool, String)> {
    let full = || (false, format!("{name}.{}", port.name));
    match index {
        0 if ports > 1 && !port.name.is_empty() => vec![(true, name.to_owned()), full()],
        0 => vec![(true, name.to_owned())],
        _ => vec![full()],
    }
}

/// Distance of a node; nodes just before the cursor are near.
fn near(me: Option<usize>, index: Option<usize>, count: usize) -> f64 {
    match (me, index) {
        (_, None) => 1.0,
        (Some(me), Some(i)) if i < me => 0.12 * ((me - i).min(30) as f64),
        (Some(me), Some(i)) => 5.0 + 0.1 * (i - me).min(30) as f64,
        // Outputs usually show the nodes made last.
        (None, Some(i)) => 0.12 * (count - i).min(30) as f64,
    }
}

/// Similarity of a node's name to the port and to the node that reads it.
fn likeness(name: &str, port: &str, me: Option<&str>) -> f64 {
    let mut score = 0.0;
    if name == port {
        score -= 6.0;
    } else if shares(name, port) {
        score -= 1.5;
    }
    if me.is_some_and(|me| shares(name, me)) {
        score -= 1.8;
    }
    score
}

/// Returns whether two names share a word.
pub(super) fn shares(a: &str, b: &str) -> bool {
    let word = |w: &&str| w.len() > 2;
    a.split('_')
        .filter(word)
        .any(|x| b.split('_').any(|y| x == y || (y.len() > 3 && (x.starts_with(y) || y.starts_with(x)))))
}
