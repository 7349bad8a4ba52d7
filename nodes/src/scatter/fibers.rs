//! [`Fibers`]: hairs and fibres that lie on a surface.
//!
//! Strands of [`kernel::strand`](shibo_kernel::scatter::strand), drawn as strokes; where they cross, the highest one
//! shows. Cost: O(strands + pixels under them), by tiles.
use super::strands::{StrandPlan, whole};
use shibo_kernel::scatter::strand::Ends;
use shibo_node::{CanvasFacts, Context, Direction, Fact, Gray, In, Node, Output, Outputs, Range, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Stop, Tiling, Type};

/// Fibres and hairs along a field of directions: fur, suede, felt, paper, carpets.
///
/// Without `direction` they lie along x, or, with a wide `angle`, in all directions. Fibres thinner than a pixel are
/// drawn as wide as one, and fade.
///
/// ```ron
/// "noise": Perlin(size: 20),
/// "combed": Remap(input: "noise", to: (-90, 90)),
/// "fibers": Fibers(direction: "combed", density: 1500, length: (3, 6), width: 0.35, thickness: (0.1, 0.5), angle: (-15, 15)),
/// "example": Relief(height: "fibers"),
/// ```
///
/// Elsewhere: Substance Designer *Fibers 1*, *Fur 1*; Blender *Hair Curves*; Houdini *Hair Generate*.
#[node]
pub struct Fibers {
    /// The direction that fibres follow: degrees from +x towards +y, or vectors.
    pub direction: Option<In<Direction>>,
    /// The share of fibres that are drawn, 0..1, read at the middle of each fibre.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub mask: Option<In<Gray>>,
    /// Number of fibres per square centimetre, before the mask.
    #[schemars(range(min = 0, max = 1e6), extend("unit" = "1/cm²"))]
    #[default(200.0)]
    pub density: f64,
    /// Smallest and largest length; each fibre draws one at random.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(Range::new(3.0, 6.0))]
    pub length: Range,
    /// Smallest and largest width in the middle; each fibre draws one at random.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    #[default(Range::new(0.1, 0.2))]
    pub width: Range,
    /// Height of the lowest and of the highest fibre in its middle; each fibre draws one at random.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    #[default(Range::new(0.05, 0.2))]
    pub thickness: Range,
    /// Smallest and largest angle to the direction; each fibre draws one at random.
    #[schemars(extend("minimum" = -360.0, "maximum" = 360.0, "unit" = "°"))]
    #[default(Range::new(-10.0, 10.0))]
    pub angle: Range,
    /// Largest random bend of a fibre, either way, in degrees per millimetre.
    #[schemars(range(min = 0, max = 360), extend("unit" = "°/mm"))]
    pub curl: f64,
    /// Narrowing of the ends: 0 none, 1 pointed.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.7)]
    pub taper: f64,
    /// Another seed gives other fibres.
    pub seed: u64,
}

impl Fibers {
    fn plan(&self) -> StrandPlan<'_> {
        let taper = shibo_kernel::ground::number::narrow(self.taper);
        StrandPlan {
            density: self.density,
            length: self.length,
            width: self.width,
            depth: self.thickness,
            angle: self.angle,
            curl: self.curl,
            ends: Ends { width: taper, depth: 0.5 * taper },
            mask: &self.mask,
            direction: &self.direction,
        }
    }
}

impl Node for Fibers {
    const OUTPUTS: &'static [Output] = &[
        Output::new("height", Type::Gray, "Height of the fibres; 0 between them.").in_unit("mm"),
        Output::new("mask", Type::Gray, "The cross-section of the fibres, 0..1, whatever their height."),
        Output::new("ids", Type::Ids, "The number of the highest fibre, from 1; 0 where there is none."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        self.plan().check(canvas)
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        whole(canvas.tile())
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        self.plan().outputs(cx, self.seed, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, part};
    use crate::testing::{canvas, port};
    use shibo_value::Field;

    #[test]
    fn fibers_conform() {
        conforms(&Fibers { width: Range::new(0.5, 1.0), density: 20.0, ..Fibers::default() }, &[]);
        let steered = Fibers { direction: Some(port(0)), curl: 30.0, density: 30.0, ..Fibers::default() };
        conforms(&steered, &[gray().into()]);
    }

    #[test]
    fn fibers_lie_along_the_field() {
        let node = Fibers {
            direction: Some(port(0)),
            density: 10.0,
            length: Range::new(8.0, 8.0),
            width: Range::new(0.6, 0.6),
            angle: Range::new(0.0, 0.0),
            ..Fibers::default()
        };
        // Differences along the fibres are smaller than across them.
        for (angle, upright) in [(0.0, false), (90.0, true), (180.0, false), (-90.0, true)] {
            let input = Field::constant(Type::Gray, &[angle]);
            let tile = part(&field(&node, &[input.into()], "mask"), &canvas(), 0, 0, 64, 64);
            let at = |x: usize, y: usize| tile.row(0, y)[x];
            let (mut right, mut down) = (0.0, 0.0);
            for k in 0..63 * 63 {
                let (x, y) = (k % 63, k / 63);
                right += (at(x + 1, y) - at(x, y)).abs();
                down += (at(x, y + 1) - at(x, y)).abs();
            }
            assert_eq!(upright, down < right, "{angle}: {right} {down}");
        }
    }
}
