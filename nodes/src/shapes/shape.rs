//! [`Shape`]: one geometric figure.
//!
//! Signed distances in closed form, see [`kernel::figure`](shibo_kernel::shape::figure); on a canvas that tiles, the
//! distance of the nearest copy. Cost: O(pixels · copies nearby).
use super::masked;
use crate::degrees::sin_cos;
use glam::DVec2;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::shape::figure::{Figure, PlacedFigure};
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, Xy, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Stop, Tiling, Type};

/// Geometric figures.
#[choice]
pub enum Form {
    /// A disc; its diameter is the smaller number of `size`.
    #[default]
    Circle,
    /// An ellipse as wide and as high as `size`.
    Ellipse,
    /// A rectangle of `size`, its corners rounded by `radius`.
    Box,
    /// A regular polygon, or with `inner` a star, with `sides` corners on the circle of `Circle`, one of them at the
    /// top.
    Polygon,
    /// A ring with the outer edge of `Circle`, `width` wide.
    Ring,
    /// A rectangle of `size` with half circles at its short sides.
    Capsule,
    /// A straight bar, `size.x` long and `width` wide, its corners rounded by `radius`.
    Line,
    /// A heart that fits into `size`, tip down.
    Heart,
    /// Two bars, `width` wide, as long as `size.x` and `size.y`, that cross in the middle; outer corners rounded by
    /// `radius`.
    Cross,
}

/// A circle, a rectangle, a polygon, a star, a heart … as a mask and as the distance from its edge in mm.
///
/// On a canvas that tiles, the shape repeats with it: a part that leaves on one side enters on the other. Combine
/// distances with `ShapeMath`. The mask is sharp at any resolution.
///
/// ```ron
/// "star": Shape(form: Polygon, size: 34, sides: 5, inner: 0.5, radius: 1),
/// "hole": Shape(form: Heart, size: 10),
/// "badge": ShapeMath(operation: Difference, a: "star.distance", b: "hole.distance"),
/// "slope": Remap(input: "badge", from: (-2.5, 0), to: (2.5, 0), clamp: true),
/// "example": Relief(height: "slope"),
/// ```
///
/// Elsewhere: Substance Designer *Shape*, *Polygon*; Material Maker *Shape*, *Circle*, *Box*.
#[node]
#[derive(PartialEq)]
pub struct Shape {
    /// The figure.
    #[default(Form::Circle)]
    pub form: Form,
    /// Centre of the shape; the canvas' centre by default.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub center: Option<Xy>,
    /// Width and height before the rotation; one number sets both. On a canvas that tiles, at most twice the canvas.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e6, "unit" = "mm"))]
    #[default(Xy::new(10.0, 10.0))]
    pub size: Xy,
    /// Rotation of the shape, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Radius of the corners of `Box`, `Polygon`, `Line` and `Cross`; straight sides stay where they are.
    #[schemars(range(min = 0, max = 1e6), extend("unit" = "mm"))]
    pub radius: f64,
    /// Width of the bars of `Ring`, `Line` and `Cross`.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(2.0)]
    pub width: f64,
    /// Corners of a `Polygon`.
    #[schemars(range(min = 3, max = 1000))]
    #[default(6)]
    pub sides: u32,
    /// Makes a `Polygon` a star: distance of the inner corners from the middle, as a share of that of the outer ones.
    /// Without it the sides are straight.
    #[schemars(range(min = 0.01, max = 1))]
    pub inner: Option<f64>,
    /// Width over which the edge of the mask fades, half of it inside; at least one pixel.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    pub softness: f64,
}

impl Shape {
    /// Half the width and height.
    fn half(&self) -> DVec2 {
        DVec2::new(self.size.x, self.size.y) * 0.5
    }

    fn figure(&self) -> Figure {
        let half = self.half();
        let small = half.min_element();
        match self.form {
            Form::Circle => Figure::Circle { radius: narrow(small) },
            Form::Ellipse => Figure::Ellipse { half: half.as_vec2() },
            Form::Box => Figure::Box { half: half.as_vec2(), radius: narrow(self.radius) },
            Form::Polygon => Figure::star(self.sides, small, self.inner, self.radius),
            Form::Ring => {
                Figure::Ring { radius: narrow(small - 0.5 * self.width), half_width: narrow(0.5 * self.width) }
            }
            Form::Capsule => Figure::Capsule {
                half_length: narrow(half.max_element() - small),
                radius: narrow(small),
                upright: half.y > half.x,
            },
            Form::Line => {
                Figure::Box { half: DVec2::new(half.x, 0.5 * self.width).as_vec2(), radius: narrow(self.radius) }
            }
            Form::Heart => Figure::heart(2.0 * half),
            Form::Cross => Figure::Cross {
                half: half.as_vec2(),
                half_width: narrow(0.5 * self.width),
                radius: narrow(self.radius),
            },
        }
    }

    /// The largest possible `radius`, for figures with corners.
    fn room(&self) -> Option<f64> {
        let half = self.half();
        match self.form {
            Form::Box => Some(half.min_element()),
            Form::Polygon => Some(0.999 * Figure::star_room(self.sides, half.min_element(), self.inner)),
            Form::Line => Some(half.x.min(0.5 * self.width)),
            Form::Cross => Some(0.5 * self.width),
            _ => None,
        }
    }
}

impl Node for Shape {
    const OUTPUTS: &'static [Output] = &[
        Output::new("mask", Type::Gray, "1 inside and 0 outside."),
        Output::new("distance", Type::Gray, "Distance from the edge; negative inside.").in_unit("mm"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let mut problems = Vec::new();
        let (size, half) = (canvas.size_mm(), self.half());
        let most = 2.0 * size.min_element();
        if canvas.tile() != Tiling::NONE && 2.0 * half.max_element() > most {
            let message = format!(
                "size is `{}` mm; on a canvas that tiles it must be at most {most} mm",
                2.0 * half.max_element()
            );
            problems.push(Problem::new(Code::OutOfRange, message).at("size").help("that is twice the canvas"));
        }
        if let Some(room) = self.room().filter(|room| self.radius > room * (1.0 + 1e-9)) {
            let message =
                format!("radius is `{}` mm; the corners of this shape have room for {room:.4} mm", self.radius);
            problems.push(Problem::new(Code::OutOfRange, message).at("radius"));
        }
        let bar = match self.form {
            Form::Ring => Some(half.min_element()),
            Form::Cross => Some(2.0 * half.min_element()),
            _ => None,
        };
        if let Some(most) = bar.filter(|most| self.width > *most) {
            let message = format!("width is `{}` mm; with this size it must be at most {most} mm", self.width);
            problems.push(Problem::new(Code::OutOfRange, message).at("width"));
        }
        problems
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let center = self.center.map_or(cx.size_mm() * 0.5, |c| DVec2::new(c.x, c.y));
        let placed = PlacedFigure::new(self.figure(), center, sin_cos(self.angle), (cx.size_mm(), cx.tiling()));
        let distance = Field::generate(Type::Gray, cx.tiling(), move |out, _| {
            placed.fill(&tile::frame(out), out.plane_mut(0));
            Ok(())
        });
        Ok(Outputs::one(masked::mask(&distance, self.softness)).with("distance", distance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::testing::{OnCanvas as _, canvas};

    const FORMS: [Form; 9] = [
        Form::Circle,
        Form::Ellipse,
        Form::Box,
        Form::Polygon,
        Form::Ring,
        Form::Capsule,
        Form::Line,
        Form::Heart,
        Form::Cross,
    ];

    #[test]
    fn every_form_conforms() {
        for form in FORMS {
            let node = Shape { form, size: Xy::new(13.0, 7.0), angle: 25.0, radius: 0.5, ..Shape::default() };
            conforms(&node, &[]);
            // A shape across the border.
            conforms(&Shape { center: Some(Xy::new(1.0, 31.0)), softness: 2.0, ..node.clone() }, &[]);
            conforms(&Shape { size: Xy::new(60.0, 60.0), ..node }, &[]);
        }
    }

    #[test]
    fn areas_are_those_of_the_figures() {
        let area = |form, size: Xy, width| {
            let node = Shape { form, size, width, ..Shape::default() };
            let mask = part(&field(&node, &[], "mask"), &canvas(), 0, 0, 64, 64);
            mask.data().iter().map(|v| f64::from(*v)).sum::<f64>() * 0.25
        };
        let pi = std::f64::consts::PI;
        let square = Xy::new(10.0, 10.0);
        for (got, want) in [
            (area(Form::Circle, square, 1.0), 25.0 * pi),
            (area(Form::Ellipse, Xy::new(12.0, 6.0), 1.0), 18.0 * pi),
            (area(Form::Box, Xy::new(12.0, 6.0), 1.0), 72.0),
            (area(Form::Polygon, square, 1.0), 25.0 * 1.5 * 3f64.sqrt()),
            (area(Form::Ring, square, 2.0), (25.0 - 9.0) * pi),
            (area(Form::Capsule, Xy::new(6.0, 12.0), 1.0), 9.0 * pi + 36.0),
            (area(Form::Line, Xy::new(12.0, 1.0), 2.0), 24.0),
            (area(Form::Cross, Xy::new(12.0, 8.0), 2.0), 24.0 + 16.0 - 4.0),
        ] {
            assert!((got - want).abs() < 0.02 * want, "{got} {want}");
        }
    }

    #[test]
    fn refuses_impossible_sizes() {
        let refused = |node: Shape| node.check_on(&canvas()).first().map(|p| p.field.clone().unwrap_or_default());
        let base = Shape { size: Xy::new(10.0, 6.0), ..Shape::default() };
        assert_eq!(refused(base.clone()), None);
        assert_eq!(refused(Shape { size: Xy::new(70.0, 6.0), ..base.clone() }).as_deref(), Some("size"));
        assert_eq!(refused(Shape { form: Form::Box, radius: 3.1, ..base.clone() }).as_deref(), Some("radius"));
        assert_eq!(refused(Shape { form: Form::Ring, width: 3.1, ..base.clone() }).as_deref(), Some("width"));
        assert_eq!(refused(Shape { form: Form::Polygon, radius: 3.0, ..base }).as_deref(), Some("radius"));
    }
}
