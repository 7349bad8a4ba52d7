//! [`Brick`]: rectangles and other pieces laid side by side.
//!
//! See [`kernel::layout`](shibo_kernel::pattern::layout). Each output is computed separately. Cost: O(pixels).
use super::pieces;
use crate::bounds::{exceeds, told};
use crate::degrees::sin_cos;
use crate::fitted;
use glam::DVec2;
use shibo_kernel::pattern::finish::{BevelProfile, Finish, degrees};
use shibo_kernel::pattern::layout::{Grid, Layout, PieceSpec};
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, Xy, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Stop, Tiling};

/// Bricks, tiles, boards: pieces with gaps and bevels between them, in seven layouts.
///
/// The main output is a height: 0 on the pieces, `depth` lower in the gaps, with a slope of width `bevel` between. Pieces
/// partition the plane: in a gap, `gap` is 1, and `ids`, `local` and `angle` are the values of the nearest piece. On a
/// canvas that tiles, the size of pieces is changed to the nearest one that fits, gaps stay the same, and a warning
/// gives the change.
///
/// `ids` makes pieces differ: the formula `"= random(floor.ids)"` is another grey for each, `RegionRandom` does the
/// same within a range, and `RegionGradient` tilts each piece. `local` is the place in mm from the middle of the piece;
/// its x runs along the long side and is never mirrored. Use it to draw something on every piece, or to lay wood along
/// each board: together with `ids`, formulas such as `"= floor.local + 50 * random(floor.ids)"` show another part of a
/// pattern on every piece.
///
/// ```ron
/// "floor": Brick(layout: Herringbone, size: (9.6, 4.6), gap: 0.4, bevel: 0.5, angle: 0),
/// "tone": "= mix(#7d4a2b, #b98a5a, random(floor.ids))",
/// "color": Blend(base: "tone", top: "#2a2320", mask: "floor.gap"),
/// "example": Relief(height: "floor", base_color: "color"),
/// ```
///
/// Elsewhere: Substance Designer *Brick Generator*, *Tile Generator*; Material Maker *Bricks*; Blender *Brick Texture*.
#[node]
#[derive(PartialEq)]
pub struct Brick {
    /// Layout of the pieces.
    #[default(Layout::Running)]
    pub layout: Layout,
    /// Length and width of a piece, without the gap; for `Versailles` of the largest piece.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(Xy::new(7.5, 3.5))]
    pub size: Xy,
    /// Width of the gap between pieces.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    #[default(0.5)]
    pub gap: f64,
    /// Width of the slope at the edge of a piece; 0 is a sharp edge.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    #[default(0.3)]
    pub bevel: f64,
    /// The cross-section of the slope.
    #[default(BevelProfile::Chamfer)]
    pub profile: BevelProfile,
    /// Depth of the gap below the pieces.
    #[schemars(range(min = -1e4, max = 1e4), extend("unit" = "mm"))]
    #[default(0.5)]
    pub depth: f64,
    /// Radius of the corners of rectangles; at most half a piece's width. Other pieces keep sharp corners.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    pub radius: f64,
    /// With `Running`: shift of every second row, as a share of a piece and a gap.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.5)]
    pub stagger: f64,
    /// With `Chevron`: the slant of the pieces.
    #[schemars(range(min = 5, max = 80), extend("unit" = "°"))]
    #[default(45.0)]
    pub slant: f64,
    /// Rotation of the whole pattern, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
}

impl Brick {
    fn size(&self) -> DVec2 {
        DVec2::new(self.size.x, self.size.y)
    }

    fn pieces(&self) -> PieceSpec {
        let (sin, cos) = sin_cos(self.slant);
        PieceSpec { layout: self.layout, size: self.size(), gap: self.gap, stagger: self.stagger, slant: sin / cos }
    }

    fn lay(&self, canvas: &CanvasFacts) -> Option<Grid> {
        self.pieces().lay(sin_cos(self.angle), (canvas.size_mm(), canvas.tile()))
    }
}

impl Node for Brick {
    const OUTPUTS: &'static [Output] = pieces::OUTPUTS;
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let mut problems = Vec::new();
        let mut refuse = |field: &'static str, message: String, help: &str| {
            problems.push(Problem::new(Code::OutOfRange, message).at(field).help(help));
        };
        let size = self.size();
        if self.layout != Layout::Chevron
            && size.y > size.x
            && self.layout != Layout::Stack
            && self.layout != Layout::Running
        {
            let message = format!("size is `({}, {})` mm; the length must not be less than the width", size.x, size.y);
            refuse("size", message, "write the longer side first, and turn the pattern with `angle`");
        }
        let most = size.y * 2.0 / 3f64.sqrt();
        if self.layout == Layout::Hexagonal && size.x < 0.5 * most * (1.0 + 1e-9) {
            let message = format!(
                "size is `({}, {})` mm; hexagons of that width are at least {:.4} mm long",
                size.x,
                size.y,
                0.5 * most
            );
            refuse("size", message, "regular ones are 1.1547 times as long as wide");
        }
        let room = 0.5 * if self.layout == Layout::Versailles { (size.y - self.gap) * 0.5 } else { size.min_element() };
        if self.layout == Layout::Versailles && room <= 0.0 {
            let message = format!("gap is `{}` mm; it must be less than the width, {} mm", self.gap, size.y);
            refuse("gap", message, "the smallest pieces are half as wide as the largest, less half a gap");
        } else if exceeds(self.radius, room) {
            let (radius, room) = (self.radius, told(room));
            let message = format!("radius is `{radius}` mm; corners of these pieces have room for {room} mm");
            refuse("radius", message, "that is half the width of the smallest piece");
        }
        if !problems.is_empty() {
            return problems;
        }
        match self.lay(canvas) {
            None => vec![fitted::too_many("size")],
            Some(grid) if self.pieces().laid(&grid).min_element() <= 0.0 => {
                let message = format!("gap is `{}` mm; nothing is left of pieces that fit the canvas", self.gap);
                vec![Problem::new(Code::OutOfRange, message).at("gap").help("make it smaller")]
            }
            Some(_) => Vec::new(),
        }
    }

    fn advice(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let Some(grid) = self.lay(canvas) else { return Vec::new() };
        let laid = self.pieces().laid(&grid);
        let lean = if self.layout == Layout::Chevron { self.slant } else { 0.0 };
        let why = match self.layout {
            Layout::Herringbone | Layout::BasketWeave if canvas.tile() == Tiling::NONE => {
                ", so that a whole number of widths and gaps makes a length and a gap"
            }
            _ => fitted::FITS,
        };
        fitted::advice(("size", "pieces"), [self.size(), laid], [self.angle + lean, degrees(grid.directions[0])], why)
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let grid = self.lay(cx.canvas).ok_or_else(|| fitted::too_many("size"))?;
        let rectangles = !matches!(self.layout, Layout::Chevron | Layout::Hexagonal);
        let radius = if rectangles { self.radius } else { 0.0 };
        let finish = Finish { gap: self.gap, bevel: self.bevel, profile: self.profile, radius };
        Ok(pieces::outputs(grid, finish, self.depth, cx.tiling()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::conforms;
    use crate::testing::{OnCanvas as _, canvas};

    const ALL: [Layout; 7] = [
        Layout::Running,
        Layout::Stack,
        Layout::Herringbone,
        Layout::BasketWeave,
        Layout::Chevron,
        Layout::Hexagonal,
        Layout::Versailles,
    ];

    #[test]
    fn every_layout_conforms() {
        for layout in ALL {
            for (angle, gap, radius) in [(0.0, 0.5, 0.0), (45.0, 0.0, 0.4), (-70.0, 1.0, 0.2)] {
                conforms(&Brick { layout, angle, gap, radius, ..Brick::default() }, &[]);
            }
        }
    }

    #[test]
    fn advises_about_sizes_that_do_not_fit() {
        let advice = |layout, x, y, angle| {
            let node = Brick { layout, size: Xy::new(x, y), gap: 0.5, angle, ..Brick::default() };
            node.advice_on(&canvas()).first().map(|p| p.message.clone())
        };
        assert_eq!(advice(Layout::Running, 7.5, 3.5, 0.0), None);
        assert_eq!(advice(Layout::Stack, 3.5, 7.5, 90.0), None);
        assert_eq!(advice(Layout::Herringbone, 7.5, 3.5, 0.0), None);
        let told = advice(Layout::Running, 7.9, 3.5, 0.0).unwrap();
        assert!(told.starts_with("pieces are 7.5000 × 3.5000 mm instead of 7.9 × 3.5 mm, so that"), "{told}");
        assert!(advice(Layout::Stack, 7.5, 3.5, 10.0).unwrap().contains("° instead of 10°"));
    }

    #[test]
    fn refuses_invalid_sizes() {
        let refused = |node: Brick| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        let base = Brick::default();
        assert_eq!(refused(base.clone()), None);
        assert_eq!(refused(Brick { radius: 1.8, ..base.clone() }).as_deref(), Some("radius"));
        assert_eq!(refused(Brick { size: Xy::new(1e-3, 1e-3), gap: 0.0, ..base.clone() }).as_deref(), Some("size"));
        assert_eq!(refused(Brick { gap: 40.0, ..base.clone() }).as_deref(), Some("gap"));
        let tall = Brick { layout: Layout::Herringbone, size: Xy::new(2.0, 3.0), ..base };
        assert_eq!(refused(tall).as_deref(), Some("size"));
    }
}
