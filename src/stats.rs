//! `--stats`: time, memory and work of a run, for programs and for people.
use crate::terminal::{Style, Text};
use cpu_time::ProcessTime;
use serde::Serialize;
use shibo_engine::eval::{NodeState, NodeStats};
use shibo_graph::{Graph, GraphUse};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

/// Rows below this share of the time are only counted.
const SHOWN: f64 = 0.001;

/// Statistics of a run.
#[derive(Debug, Serialize)]
pub(crate) struct Stats {
    #[serde(skip_serializing_if = "Option::is_none")]
    preset: Option<String>,
    wall_s: f64,
    cpu_s: f64,
    /// Absent if the system does not report it.
    peak_rss_mib: Option<f64>,
    resolution: [u32; 2],
    nodes: Vec<NodeStats>,
    /// Sub-graphs in use, including nested ones, with the sums of their nodes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    uses: Vec<UseStats>,
    files: Vec<String>,
}

/// Statistics of a sub-graph.
#[derive(Debug, PartialEq, Serialize)]
pub(crate) struct UseStats {
    name: String,
    kind: String,
    /// First state that one of its nodes has, in the order computed, disk, memory, folded, unused.
    state: NodeState,
    seconds: f64,
    tiles: u64,
    nodes: usize,
}

/// Sub-graphs in use with the sums of their nodes.
pub(crate) fn uses(nodes: &[NodeStats], uses: &[GraphUse]) -> Vec<UseStats> {
    let rank = |state: NodeState| match state {
        NodeState::Computed => 0,
        NodeState::Disk => 1,
        NodeState::Memory => 2,
        NodeState::Folded => 3,
        NodeState::Unused => 4,
    };
    let sum = |found: &GraphUse| {
        let is_in = |name: &str| name.strip_prefix(&found.name).is_some_and(|rest| rest.starts_with(['/', '.']));
        let inside = nodes.iter().filter(|node| is_in(&node.name));
        let mut sum = UseStats {
            name: found.name.clone(),
            kind: kind(found),
            state: NodeState::Unused,
            seconds: 0.0,
            tiles: 0,
            nodes: 0,
        };
        for node in inside {
            sum.seconds += node.seconds;
            sum.tiles += node.tiles;
            sum.nodes += 1;
            if rank(node.state) < rank(sum.state) {
                sum.state = node.state;
            }
        }
        sum
    };
    uses.iter().map(sum).collect()
}

fn kind(found: &GraphUse) -> String {
    let stem = found.path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
    format!("Use {stem}")
}

/// A row of the table: a node, or a sub-graph with its content.
#[derive(Debug, Default, PartialEq)]
struct Row {
    name: String,
    kind: String,
    seconds: f64,
    tiles: u64,
    /// Number of nodes, and how many of them were cached or not needed.
    nodes: usize,
    spared: usize,
}

impl Stats {
    /// Statistics of the process so far.
    pub(crate) fn new(
        start: Instant,
        graph: &Graph,
        nodes: Vec<NodeStats>,
        files: &[PathBuf],
        preset: Option<&str>,
    ) -> Self {
        Self {
            preset: preset.map(str::to_owned),
            wall_s: start.elapsed().as_secs_f64(),
            cpu_s: ProcessTime::try_now().map_or(0.0, |time| time.as_duration().as_secs_f64()),
            peak_rss_mib: peak_rss_mib(),
            resolution: graph.canvas.resolution.to_array(),
            uses: uses(&nodes, &graph.uses),
            nodes,
            files: files.iter().map(|path| path.to_string_lossy().into_owned()).collect(),
        }
    }

    /// Formats the statistics as a table, the most costly rows first.
    pub(crate) fn table(&self, page: &mut Text, graph: &Graph) {
        let kinds = graph.uses.iter().map(|found| (found.name.as_str(), kind(found)));
        let rows = rows(&self.nodes, &kinds.collect());
        let total: f64 = rows.iter().map(|row| row.seconds).sum();
        let shown: Vec<&Row> = rows.iter().filter(|row| row.seconds > SHOWN * total).collect();
        let widest = shown.iter().map(|row| row.name.chars().count()).max().unwrap_or(0);
        if let Some(preset) = &self.preset {
            page.push("preset ").styled(Style::Bold, preset).end();
        }
        page.styled(Style::Dim, "    CPU s   share   tiles  node").end();
        for row in &shown {
            let share = 100.0 * row.seconds / total.max(f64::MIN_POSITIVE);
            page.push(&format!("{:9.3} {share:6.1}% {:7}  ", row.seconds, row.tiles));
            page.styled(Style::Bold, &format!("{:widest$}", row.name)).push(&format!("  {}", row.kind));
            if row.nodes > 1 {
                page.styled(Style::Dim, &format!(", {} nodes", row.nodes));
            }
            page.end();
        }
        let (nodes, spared) = rows.iter().fold((0, 0), |(n, s), row| (n + row.nodes, s + row.spared));
        page.push(&format!("{total:9.3} CPU s in {nodes} nodes, {spared} of them cached or not needed; "));
        page.push(&format!("{:.3} CPU s and {:.3} s in all", self.cpu_s, self.wall_s));
        if let Some(peak) = self.peak_rss_mib {
            page.push(&format!(", {peak:.0} MiB"));
        }
        page.end();
    }
}

/// Rows by cost; the nodes of a sub-graph are one row.
fn rows(nodes: &[NodeStats], uses: &BTreeMap<&str, String>) -> Vec<Row> {
    let mut rows: BTreeMap<&str, Row> = BTreeMap::new();
    for node in nodes {
        let outer = node.name.split(['/', '.']).next().unwrap_or_default();
        let of_use = uses.get(outer).filter(|_| outer.len() < node.name.len());
        let name = if of_use.is_some() { outer } else { node.name.as_str() };
        let row = rows.entry(name).or_default();
        name.clone_into(&mut row.name);
        row.kind.clone_from(of_use.unwrap_or(&node.kind));
        row.seconds += node.seconds;
        row.tiles += node.tiles;
        row.nodes += 1;
        row.spared += usize::from(node.state != NodeState::Computed);
    }
    let mut rows: Vec<Row> = rows.into_values().collect();
    rows.sort_by(|a, b| b.seconds.total_cmp(&a.seconds).then_with(|| a.name.cmp(&b.name)));
    rows
}

/// Peak memory of the process.
fn peak_rss_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib / 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_nodes_of_sub_graphs() {
        let node = |name: &str, state, seconds| NodeStats {
            name: name.into(),
            kind: "K".into(),
            state,
            seconds,
            tiles: 2,
            pixels: 9,
        };
        let nodes = [
            node("a", NodeState::Computed, 0.5),
            node("u/x", NodeState::Computed, 0.25),
            node("u/v/y", NodeState::Disk, 0.5),
            node("u.out", NodeState::Computed, 0.25),
        ];
        let uses = BTreeMap::from([("u", "Use part".to_owned()), ("u/v", "Use inner".to_owned())]);
        let rows = rows(&nodes, &uses);
        let sum = Row { name: "u".into(), kind: "Use part".into(), seconds: 1.0, tiles: 6, nodes: 3, spared: 1 };
        assert_eq!(rows[0], sum);
        assert_eq!((rows[1].name.as_str(), rows[1].kind.as_str(), rows.len()), ("a", "K", 2));
        let part = |name: &str| GraphUse { name: name.into(), path: "part.ron".into(), outputs: Vec::new() };
        let sums = super::uses(&nodes, &[part("u"), part("u/v"), part("none")]);
        assert_eq!((sums[0].state, sums[0].seconds, sums[0].nodes), (NodeState::Computed, 1.0, 3));
        assert_eq!((sums[1].state, sums[1].seconds, sums[1].nodes), (NodeState::Disk, 0.5, 1));
        assert_eq!((sums[2].state, sums[2].nodes, sums[2].kind.as_str()), (NodeState::Unused, 0, "Use part"));
    }
}
