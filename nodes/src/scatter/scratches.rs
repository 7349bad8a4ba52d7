//! [`Scratches`]: fine grooves.
//!
//! Strands of [`kernel::strand`](shibo_kernel::scatter::strand), drawn as strokes. Control fields are read first, at
//! the places of the strands. Cost: O(strands + pixels under them), by tiles.
use super::strands::{StrandPlan, whole};
use shibo_kernel::scatter::strand::Ends;
use shibo_node::{CanvasFacts, Context, Direction, Fact, Gray, In, Node, Output, Outputs, Range, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Stop, Tiling, Type};

/// Scratches: thin grooves of random length, width and depth, straight or curled, in one direction or in all.
///
/// Scratches thinner than a pixel are drawn as wide as one, and fade. On a canvas that tiles in both directions,
/// scratches cross its border.
///
/// ```ron
/// "scratches": Scratches(density: 9, length: (4, 25), width: (0.08, 0.4), depth: (0.05, 0.3), angle: (-25, 25), curl: 2),
/// "example": Relief(height: "scratches", strength: 2),
/// ```
///
/// Elsewhere: Substance Designer *Scratches Generator*; Material Maker *Scratches*.
#[node]
pub struct Scratches {
    /// The share of scratches that are drawn, 0..1, read at the middle of each scratch.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub mask: Option<In<Gray>>,
    /// The direction that scratches follow: degrees from +x towards +y, or vectors; `angle` is added.
    pub direction: Option<In<Direction>>,
    /// Number of scratches per square centimetre, before the mask.
    #[schemars(range(min = 0, max = 1e6), extend("unit" = "1/cm²"))]
    #[default(20.0)]
    pub density: f64,
    /// Smallest and largest length; each scratch draws one at random.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(Range::new(3.0, 15.0))]
    pub length: Range,
    /// Smallest and largest width in the middle; each scratch draws one at random.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    #[default(Range::new(0.05, 0.15))]
    pub width: Range,
    /// Smallest and largest depth in the middle; each scratch draws one at random.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    #[default(Range::new(0.01, 0.05))]
    pub depth: Range,
    /// Smallest and largest angle from +x towards +y; each scratch draws one at random.
    #[schemars(extend("minimum" = -360.0, "maximum" = 360.0, "unit" = "°"))]
    #[default(Range::new(0.0, 180.0))]
    pub angle: Range,
    /// Largest random bend of a scratch, either way, in degrees per millimetre.
    #[schemars(range(min = 0, max = 360), extend("unit" = "°/mm"))]
    pub curl: f64,
    /// Another seed gives other scratches.
    pub seed: u64,
}

impl Scratches {
    fn plan(&self) -> StrandPlan<'_> {
        StrandPlan {
            density: self.density,
            length: self.length,
            width: self.width,
            depth: self.depth,
            angle: self.angle,
            curl: self.curl,
            ends: Ends { width: 0.9, depth: 1.0 },
            mask: &self.mask,
            direction: &self.direction,
        }
    }
}

impl Node for Scratches {
    const OUTPUTS: &'static [Output] = &[
        Output::new("height", Type::Gray, "Minus the depth; 0 between scratches.").in_unit("mm"),
        Output::new("mask", Type::Gray, "The cross-section of the scratches, 0..1, whatever their depth."),
        Output::new("ids", Type::Ids, "The number of the deepest scratch, from 1; 0 where there is none."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        self.plan().check(canvas)
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        whole(canvas.tile())
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        self.plan().outputs(cx, self.seed, -1.0)
    }
}

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "small numbers of a test")]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, part};
    use crate::testing::{OnCanvas as _, canvas, port};
    use shibo_value::{Field, Value};

    #[test]
    fn scratches_conform() {
        conforms(&Scratches { width: Range::new(0.5, 1.0), ..Scratches::default() }, &[]);
        let steered = Scratches { mask: Some(port(0)), direction: Some(port(1)), curl: 5.0, ..Scratches::default() };
        let angle = Field::constant(Type::Gray, &[30.0]);
        conforms(&steered, &[gray().into(), angle.into()]);
    }

    #[test]
    fn scratches_have_the_given_number_and_depth() {
        let node = Scratches {
            density: 4.0,
            length: Range::new(3.0, 3.0),
            width: Range::new(1.0, 1.0),
            depth: Range::new(0.5, 0.5),
            ..Scratches::default()
        };
        let ids = part(&field(&node, &[], "ids"), &canvas(), 0, 0, 64, 64);
        let all: std::collections::BTreeSet<u32> = ids.data().iter().map(|v| *v as u32).filter(|v| *v > 0).collect();
        // 4 per cm² on 10.24 cm² are 41 scratches, some of which lie under others.
        assert!((36..=41).contains(&all.len()) && all.last() <= Some(&41), "{}", all.len());
        let height = part(&field(&node, &[], "height"), &canvas(), 0, 0, 64, 64);
        let deepest = height.data().iter().copied().fold(0.0, f32::min);
        assert!((-0.5..-0.4).contains(&deepest), "{deepest}");
        let none: Value = Field::constant(Type::Gray, &[0.0]).into();
        let masked = Scratches { mask: Some(port(0)), ..node };
        assert!(part(&field(&masked, &[none], "height"), &canvas(), 0, 0, 64, 64).data().iter().all(|v| *v == 0.0));
    }

    #[test]
    fn too_many_are_refused() {
        let refused = |node: Scratches| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        assert_eq!(refused(Scratches::default()), None);
        assert_eq!(refused(Scratches { density: 1e6, ..Scratches::default() }).as_deref(), Some("density"));
        assert_eq!(
            refused(Scratches { length: Range::new(1.0, 200.0), ..Scratches::default() }).as_deref(),
            Some("length")
        );
        let thick = Scratches {
            density: 1e4,
            length: Range::new(100.0, 100.0),
            width: Range::new(1.0, 30.0),
            ..Scratches::default()
        };
        assert_eq!(refused(thick).as_deref(), Some("width"));
    }
}
