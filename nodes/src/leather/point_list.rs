//! [`PointList`]: points that are given.
//!
//! Source: JP4905282B2 §3, "any algorithm" (row A9v): the open input. Cost: O(points).
use super::grid_points::MAX_POINTS;
use glam::Vec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::{Context, FilePath, Node, Output, Outputs};
use shibo_engine::value::{Canvas, Points, Stop, Tiling, Type};
use std::path::Path;

/// Points that are given, as a list or in a CSV file with one `x,y` per line and no header.
///
/// ```ron
/// "points": PointList(points: [(6, 8), (30, 6), (20, 19), (8, 30), (33, 28), (19, 36)]),
/// "links": ConnectNeighbors(points: "points"),
/// "wrinkles": PlaceWrinkles(lattice: "links"),
/// "height": DrawWrinkles(segments: "wrinkles", width: 1.5, depth: 0.6),
/// "example": Relief(height: "height"),
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PointList {
    /// Positions `(x, y)` from the canvas' upper left corner.
    #[schemars(extend("unit" = "mm"))]
    pub points: Vec<(f64, f64)>,
    /// A CSV file of more points.
    pub file: Option<FilePath>,
    /// The mean distance of neighbours, which later stages refer to; worked out from the number of points if not given.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub pitch: Option<f64>,
}

impl Node for PointList {
    const OUTPUTS: &'static [Output] = &[Output::new("points", Type::Points, "The points, in the order given.")];

    fn check(&self, _canvas: &Canvas) -> Vec<Problem> {
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

    fn tiling(&self, canvas: &Canvas) -> Tiling {
        if canvas.tile == Tiling::BOTH { Tiling::BOTH } else { Tiling::NONE }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let mut positions: Vec<Vec2> = self.points.iter().map(|&(x, y)| glam::DVec2::new(x, y).as_vec2()).collect();
        if let Some(path) = cx.file("file") {
            positions.extend(read(path)?);
        }
        let count = positions.len().max(1) as f64;
        let pitch = self.pitch.unwrap_or_else(|| (cx.size_mm().element_product() / count).sqrt());
        Ok(Outputs::one(Points {
            positions,
            size_mm: cx.size_mm(),
            periodic: Node::tiling(self, cx.canvas),
            pitch: crate::kernel::tile::narrow(pitch),
            ..Points::default()
        }))
    }
}

/// The points of a CSV file.
fn read(path: &Path) -> Result<Vec<Vec2>, Problem> {
    let bad = |line: u64, what: &str| {
        let message = format!("`{}`, line {line}: {what}; it must be `x,y` in mm", path.display());
        Problem::new(Code::BadFile, message).at("file")
    };
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(|e| bad(0, &e.to_string()))?;
    let mut points = Vec::new();
    for record in reader.records() {
        let line = |e: &csv::Error| e.position().map_or(0, csv::Position::line);
        let record = record.map_err(|e| bad(line(&e), "it is not readable as CSV"))?;
        let at = record.position().map_or(0, csv::Position::line);
        let number = |i: usize| record.get(i).and_then(|text| text.parse::<f32>().ok()).filter(|v| v.is_finite());
        match (number(0), number(1), record.len()) {
            (Some(x), Some(y), 2) => points.push(Vec2::new(x, y)),
            _ => return Err(bad(at, "it is not two finite numbers")),
        }
        if points.len() > MAX_POINTS {
            return Err(bad(at, &format!("there are more than {MAX_POINTS} points")));
        }
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_csv_and_says_where_it_is_wrong() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("points.csv");
        std::fs::write(&path, "1, 2\n3.5,4e0\n").unwrap();
        assert_eq!(read(&path).unwrap(), [Vec2::new(1.0, 2.0), Vec2::new(3.5, 4.0)]);
        std::fs::write(&path, "1,2\n3,inf\n").unwrap();
        assert!(read(&path).unwrap_err().message.contains("line 2"));
        std::fs::write(&path, "1,2\n3\n").unwrap();
        assert_eq!(read(&path).unwrap_err().code, Code::BadFile);
        std::fs::write(&path, [0xff, 0xfe, 0x00]).unwrap();
        assert_eq!(read(&path).unwrap_err().code, Code::BadFile);
    }
}
