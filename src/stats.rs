//! `--stats`: what a run took and did, for programs and for people.
use crate::terminal::{Style, Text};
use cpu_time::ProcessTime;
use serde::Serialize;
use shibo_engine::eval::{NodeState, NodeStats};
use shibo_engine::graph::Graph;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

/// Rows that took less than this share of the time are counted only.
const SHOWN: f64 = 0.001;

/// What a run took and did.
#[derive(Debug, Serialize)]
pub(crate) struct Stats {
    #[serde(skip_serializing_if = "Option::is_none")]
    preset: Option<String>,
    wall_s: f64,
    cpu_s: f64,
    /// Absent where the system does not tell.
    peak_rss_mib: Option<f64>,
    resolution: [u32; 2],
    nodes: Vec<NodeStats>,
    files: Vec<String>,
}

/// A line of the table: a node, or a sub-graph with all that is in it.
#[derive(Debug, Default, PartialEq)]
struct Row {
    name: String,
    kind: String,
    seconds: f64,
    tiles: u64,
    /// How many nodes, and how many of them were taken out of a cache or not needed.
    nodes: usize,
    spared: usize,
}

impl Stats {
    /// Of the process so far.
    pub(crate) fn new(
        start: Instant,
        resolution: [u32; 2],
        nodes: Vec<NodeStats>,
        files: &[PathBuf],
        preset: Option<&str>,
    ) -> Self {
        Self {
            preset: preset.map(str::to_owned),
            wall_s: start.elapsed().as_secs_f64(),
            cpu_s: ProcessTime::try_now().map_or(0.0, |time| time.as_duration().as_secs_f64()),
            peak_rss_mib: peak_rss_mib(),
            resolution,
            nodes,
            files: files.iter().map(|path| path.to_string_lossy().into_owned()).collect(),
        }
    }

    /// The same as a table, the most costly first.
    pub(crate) fn table(&self, page: &mut Text, graph: &Graph) {
        let kinds = graph.uses.iter().map(|found| {
            let stem = found.path.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
            (found.name.as_str(), format!("Use {stem}"))
        });
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

/// The nodes by cost, those of a sub-graph as one row.
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

/// The most memory that the process ever held.
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
    fn sub_graphs_are_summed() {
        let node =
            |name: &str, state, seconds| NodeStats { name: name.into(), kind: "K".into(), state, seconds, tiles: 2 };
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
    }
}
