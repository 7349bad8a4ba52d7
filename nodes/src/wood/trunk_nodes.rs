//! [`TrunkNodes`]: the points through which a trunk grows.
//!
//! Source: Momoi & Takatera 2014, §2.2 and §3 (rows B1, B5): skeleton data of the earlier method can be used unchanged.
//! Beyond the source: nodes from a file, and nodes generated with the wander measured on a spruce log: over half the
//! length its standard deviation is half as large. Cost: O(nodes).
use super::trees::{Triple, problem, vector};
use crate::csv_points;
use glam::DVec3;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::noise::noise3::{DEVIATION, Noise3};
use shibo_kernel::wood::fit;
use shibo_node::{CanvasFacts, Context, Fact, FilePath, Node, Output, Outputs, Range, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Curve, Stop, Type};

/// The pith of a trunk, from the ground up: nodes from a list or a file, or generated nodes.
///
/// Without a list or a file, `count` nodes between the heights of `height` lean by `lean` and wander by `wander`.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-200, 400), count: 9, wander: 6),
/// "tree": FitSkeleton(curve: "nodes"),
/// "time": TrunkTime(tree: "tree"),
/// "example": CutPlane(solid: "time", preset: FlatSawn, distance: 5, height: 60),
/// ```
///
/// Elsewhere: Houdini *Labs Tree Trunk Generator*; Blender *Curve Line*.
#[node]
pub struct TrunkNodes {
    /// Positions `(x, y, z)`, each higher than the one before; x and y are horizontal. At most 10000.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub nodes: Vec<Triple>,
    /// A CSV file of nodes, one `x,y,z` in mm per line, no header.
    pub file: Option<FilePath>,
    /// Heights of the lowest and of the highest generated node.
    #[schemars(extend("minimum" = -1e5, "maximum" = 1e6, "unit" = "mm"))]
    #[default(Range::new(0.0, 4000.0))]
    pub height: Range,
    /// Number of generated nodes.
    #[schemars(range(min = 2, max = 10000))]
    #[default(21)]
    pub count: u32,
    /// Lean of the trunk from the vertical.
    #[schemars(range(min = 0, max = 45), extend("unit" = "°"))]
    pub lean: f64,
    /// Direction of the lean, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub lean_direction: f64,
    /// Wander of the pith about a straight line: the standard deviation over 4 m.
    #[schemars(range(min = 0, max = 1000), extend("unit" = "mm"))]
    #[default(4.0)]
    pub wander: f64,
    /// Another seed gives another tree of the same kind.
    pub seed: u64,
}

/// Lean in degrees above which rings become much too thin.
const STEEP: f64 = 45.5;

/// Maximum number of nodes.
const MOST: usize = 10_000;

impl TrunkNodes {
    fn generate(&self, hash: Hash) -> Vec<DVec3> {
        let (sin, cos) = libm::sincos(self.lean_direction.to_radians());
        let lean = libm::tan(self.lean.to_radians());
        // Waves of 4 m and shorter; each has half the length and half the strength of the one before, so long waves
        // make most of the deviation.
        let stray = |axis: u64, z: f64| {
            let wave = |k: i32| {
                let (length, share) = (4000.0 * 0.5_f64.powi(k), 0.87 * 0.5_f64.powi(k));
                let noise = Noise3::new(hash, axis * 16 + u64::from(k.unsigned_abs()));
                share * f64::from(noise.at(narrow(z / length), 0.37, 0.61) / DEVIATION)
            };
            (0..7).map(wave).sum::<f64>()
        };
        let node = |i: u32| {
            let z = self.height.at(f64::from(i) / f64::from(self.count - 1));
            let along = (z - self.height.lo) * lean;
            DVec3::new(along * cos + self.wander * stray(0, z), along * sin + self.wander * stray(1, z), z)
        };
        (0..self.count).map(node).collect()
    }
}

impl Node for TrunkNodes {
    const OUTPUTS: &'static [Output] = &[Output::new("curve", Type::Curve, "The nodes, from the ground up.")];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.nodes.len() > MOST {
            let message = format!("nodes has {} entries; at most {MOST} are allowed", self.nodes.len());
            return vec![Problem::new(Code::TooLarge, message).at("nodes")];
        }
        let nodes: Vec<DVec3> = self.nodes.iter().map(|n| vector(*n)).collect();
        if !nodes.is_empty() && self.file.is_none() {
            return fit::check_nodes(&nodes).err().map(|e| problem(e, &nodes).at("nodes")).into_iter().collect();
        }
        if self.height.hi <= self.height.lo && nodes.is_empty() && self.file.is_none() {
            let message = format!("height ends at `{}`; it must end above `{}`", self.height.hi, self.height.lo);
            return vec![Problem::new(Code::BadValue, message).at("height")];
        }
        Vec::new()
    }

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        self.file.iter().map(|file| ("file", file)).collect()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let mut points: Vec<DVec3> = self.nodes.iter().map(|n| vector(*n)).collect();
        if let Some(path) = cx.file("file") {
            points.extend(csv_points::read(path, ("file", "x,y,z"), MOST)?.into_iter().map(DVec3::from_array));
            fit::check_nodes(&points).map_err(|e| {
                let mut problem = problem(e, &points).at("file");
                problem.message = format!("`{}`: {}", path.display(), problem.message);
                problem
            })?;
        }
        if points.is_empty() {
            points = self.generate(Hash::new(cx.seed(self.seed)));
        }
        if let Some(problem) = leaning(&points) {
            cx.evaluator.warn(problem.at(if cx.file("file").is_some() { "file" } else { "nodes" }));
        }
        Ok(Outputs::one(Curve { points }))
    }
}

/// The warning about a trunk that leans too far.
fn leaning(points: &[DVec3]) -> Option<Problem> {
    let lean = |pair: &[DVec3]| {
        let way = (pair[1] - pair[0]).normalize_or(DVec3::Z);
        libm::acos(way.z.clamp(-1.0, 1.0)).to_degrees()
    };
    let (i, lean) = points.windows(2).map(lean).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let message = format!("the trunk leans by {lean:.0}° between nodes {i} and {}", i + 1);
    let help =
        "growth is measured at a level: the more a trunk leans, the thinner are its rings across; up to 45° is meant";
    (lean > STEEP).then(|| Problem::new(Code::Advice, message).help(help))
}
