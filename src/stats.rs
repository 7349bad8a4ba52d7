//! `--stats json`: what a run took and did.
use cpu_time::ProcessTime;
use serde::Serialize;
use shibo_engine::eval::NodeStats;
use std::path::PathBuf;
use std::time::Instant;

/// What a run took and did.
#[derive(Debug, Serialize)]
pub(crate) struct Stats {
    wall_s: f64,
    cpu_s: f64,
    /// Absent where the system does not tell.
    peak_rss_mib: Option<f64>,
    resolution: [u32; 2],
    nodes: Vec<NodeStats>,
    files: Vec<String>,
}

impl Stats {
    /// Of the process so far.
    pub(crate) fn new(start: Instant, resolution: [u32; 2], nodes: Vec<NodeStats>, files: &[PathBuf]) -> Self {
        Self {
            wall_s: start.elapsed().as_secs_f64(),
            cpu_s: ProcessTime::try_now().map_or(0.0, |time| time.as_duration().as_secs_f64()),
            peak_rss_mib: peak_rss_mib(),
            resolution,
            nodes,
            files: files.iter().map(|path| path.to_string_lossy().into_owned()).collect(),
        }
    }
}

/// The most memory that the process ever held.
fn peak_rss_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib / 1024.0)
}
