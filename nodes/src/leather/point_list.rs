//! [`PointList`]: given points.
//!
//! Source: JP4905282B2 §3, "any algorithm" (row A9): points made elsewhere. Cost: O(points).
use super::grid_points::MAX_POINTS;
use crate::csv_points;
use glam::Vec2;
use shibo_node::{CanvasFacts, Context, FilePath, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Points, Stop, Tiling, Type};

/// Given points, as a list or in a CSV file with one `x,y` per line and no header.
///
/// ```ron
/// "points": PointList(points: [(6, 8), (30, 6), (20, 19), (8, 30), (33, 28), (19, 36)]),
/// "links": ConnectNeighbors(points: "points"),
/// "wrinkles": PlaceWrinkles(lattice: "links"),
/// "height": DrawWrinkles(segments: "wrinkles", width: 1.5, depth: 0.6),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Blender *Import CSV*; Houdini *Add*, *Table Import*.
#[node]
#[derive(PartialEq)]
pub struct PointList {
    /// Positions `(x, y)` from the canvas' upper left corner.
    #[schemars(extend("unit" = "mm"))]
    pub points: Vec<(f64, f64)>,
    /// A CSV file of more points.
    pub file: Option<FilePath>,
    /// The mean distance between neighbours, which later stages use as the pitch; by default computed from the number
    /// of points.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub pitch: Option<f64>,
}

impl Node for PointList {
    const OUTPUTS: &'static [Output] = &[Output::new("points", Type::Points, "The points, in the order given.")];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.points.len() > MAX_POINTS {
            let message = format!("points has {} entries; at most {MAX_POINTS} are allowed", self.points.len());
            return vec![Problem::new(Code::TooLarge, message).at("points")];
        }
        if self.points.is_empty() && self.file.is_none() {
            let message = "there are no points; give `points: [(x, y), …]` or `file: \"….csv\"`";
            return vec![Problem::new(Code::MissingInput, message)];
        }
        Vec::new()
    }

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        self.file.iter().map(|file| ("file", file)).collect()
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        if canvas.tile() == Tiling::BOTH { Tiling::BOTH } else { Tiling::NONE }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let mut positions: Vec<Vec2> = self.points.iter().map(|&(x, y)| glam::DVec2::new(x, y).as_vec2()).collect();
        if let Some(path) = cx.file("file") {
            positions.extend(csv_points::read(path, ("file", "x,y"), MAX_POINTS)?.into_iter().map(Vec2::from_array));
        }
        let count = positions.len().max(1) as f64;
        let pitch = self.pitch.unwrap_or_else(|| (cx.size_mm().element_product() / count).sqrt());
        Ok(Outputs::one(Points {
            positions,
            size_mm: cx.size_mm(),
            periodic: Node::tiling(self, cx.canvas),
            pitch: shibo_kernel::ground::number::narrow(pitch),
            ..Points::default()
        }))
    }
}
