//! [`Fracture`]: cracks of a layer that shrinks on a substrate.
//!
//! Sources: P. Meakin, "A simple model for elastic fracture in thin films" (1987); J. Bolander, S. Saito (1998);
//! E. Paquette, P. Poulin, G. Drettakis, "The simulation of paint cracking and peeling" (2002); see
//! [`kernel::fracture`](shibo_kernel::fracture). The layer is broken once, when the node is evaluated, on a net in mm
//! that does not depend on the resolution. Where the canvas does not tile, the net is larger than the canvas. Cost:
//! about 0.25 ms a point of the net at the default pitch (20,000 points in 5 CPU s, 100,000 in 25); then 0.4 to 0.7 µs a
//! pixel for `cracks`, `width` and `age` together, as much for `edge`, and as much for the other three together.
use crate::planes::plane;
use crate::samples::Samples;
use glam::DVec2;
use shibo_kernel::fracture::draw::Drawing;
use shibo_kernel::fracture::net::count;
use shibo_kernel::fracture::springs::{Law, Local};
use shibo_kernel::fracture::{Layer, MOST};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_node::{CanvasFacts, Context, Direction, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Stop, Tiling, Type};
use std::sync::Arc;

/// Margin beyond the edges of a canvas that does not tile, as a multiple of `spacing`.
const MARGIN: f64 = 3.0;

/// Points of the net for a `spacing`.
const POINTS: f64 = 7.0;

/// A layer that shrinks and cracks: dried mud, glaze, old varnish, flaking paint, asphalt, ice.
///
/// Springs tie a net of points together and to the ground, shrink, and break one after the other. Later cracks end on
/// older ones at right angles, and the plates between them become smaller as `shrink` grows. The net does not depend on
/// the resolution. A crack shows where `cracks` is less than half of `width`. On a canvas that tiles, the plates do
/// too.
///
/// ```ron
/// "mud": Fracture(spacing: 3.4, shrink: 1.7, strain: 0.09),
/// "gap": "= smoothstep(-0.05, 0.05, mud.width * 0.5 - mud.cracks)",
/// "height": "= mud.curl * 0.5 - gap * 1.2",
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Substance Designer *Cells 4*, *Cracks*; Substance Painter *Cracks*; Blender *Cell Fracture*; Houdini
/// *Voronoi Fracture*, *RBD Material Fracture*; Material Maker *Craquelure*; craquelure, crackle, crazing.
#[node]
pub struct Fracture {
    /// Scale of the cracks: the square root of the stiffness of the layer over that of its bond to the ground. Plates
    /// are about 1.8 times as wide.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(3.0)]
    pub spacing: f64,
    /// The shrinkage of the layer, as a multiple of that at which the first cracks appear: no cracks below 0.9,
    /// whole plates at 1.5, a second generation of finer cracks from 2 on.
    #[schemars(range(min = 0, max = 6))]
    #[default(1.6)]
    pub shrink: f64,
    /// The strain at which the layer breaks. It scales the widths of cracks alone.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.05)]
    pub strain: f64,
    /// Differences of strength from place to place; with 0.3 and more, short cracks appear within plates.
    #[schemars(range(min = 0, max = 0.9))]
    #[default(0.1)]
    pub noise: f64,
    /// The share by which the layer is stretched less along `direction`: with 0.5 most cracks run along it. Paint
    /// on wood cracks along the grain.
    #[schemars(range(min = 0, max = 1))]
    pub anisotropy: f64,
    /// Direction in which most cracks run, in degrees from +x towards +y or as vectors; `angle` is added. Has an effect
    /// only if `anisotropy` is not 0.
    pub direction: Option<In<Direction>>,
    /// Direction in which most cracks run, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Thickness of the layer, as a multiple of the usual one. A layer four times as thick has cracks twice as far
    /// apart. Values below 0.05 count as 0.05, those above 20 as 20.
    #[schemars(extend("minimum" = 0.0, "maximum" = 20.0))]
    #[default(In::constant(1.0))]
    pub thickness: In<Gray>,
    /// Strength of the layer, as a multiple of the usual one. Cracks start where it is low. Values below 0.01 count as
    /// 0.01.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e5))]
    #[default(In::constant(1.0))]
    pub strength: In<Gray>,
    /// How well the layer sticks, in units of `shrink`: it comes off, from cracks inwards, where it pulls harder at the
    /// ground. With `shrink` at 1.5, some edges come off at 1.4, half of the layer at 1 and most of it at 0.6.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e5))]
    #[default(In::constant(1.0))]
    pub adhesion: In<Gray>,
    /// Distance of the points of the net; a seventh of `spacing` by default. A finer net gives smoother cracks; half
    /// the pitch takes about nine times as long.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub pitch: Option<f64>,
    /// Another seed gives other cracks.
    pub seed: u64,
}

impl Fracture {
    fn net_pitch(&self) -> f64 {
        self.pitch.unwrap_or(self.spacing / POINTS)
    }

    /// The area that the net covers, and the place of the canvas in it.
    fn area(&self, size: DVec2, tiling: Tiling) -> (DVec2, DVec2) {
        let margin = |tiles: bool| if tiles { 0.0 } else { MARGIN * self.spacing };
        let offset = DVec2::new(margin(tiling.x), margin(tiling.y));
        (size + 2.0 * offset, offset)
    }

    fn crack(&self, cx: &Context<'_>) -> Result<(Drawing, DVec2), Stop> {
        let (size, offset) = self.area(cx.size_mm(), cx.tiling());
        let sample = |port: &In<Gray>, name: &str| Samples::new(cx, &cx.get(port)?, name);
        let [thickness, strength] = [sample(&self.thickness, "thickness")?, sample(&self.strength, "strength")?];
        let adhesion = sample(&self.adhesion, "adhesion")?;
        let direction = match cx.get_opt(&self.direction)? {
            Some(field) if self.anisotropy > 0.0 => Samples::new(cx, &field, "direction")?,
            _ => Samples::Constant(0.0),
        };
        let local = |at: DVec2| {
            let p = at - offset;
            let angle = (direction.at(p) + self.angle).to_radians();
            Local {
                thickness: thickness.at(p).clamp(0.05, 20.0),
                strength: strength.at(p).clamp(0.01, 1e5),
                adhesion: adhesion.at(p).max(0.0),
                along: DVec2::new(libm::cos(angle), libm::sin(angle)),
            }
        };
        let law = Law { scale: self.spacing, shrink: self.shrink, noise: self.noise, anisotropy: self.anisotropy };
        let layer = Layer { size, pitch: self.net_pitch(), law, strain: self.strain };
        let drawing = layer.crack(local, Hash::new(cx.seed(self.seed)), &|| cx.check().is_err());
        drawing.map(|drawing| (drawing, offset)).ok_or(Stop::Cancelled)
    }
}

impl Node for Fracture {
    const OUTPUTS: &'static [Output] = &[
        Output::new("cracks", Type::Gray, "Distance from the middle of the nearest crack.").in_unit("mm"),
        Output::new("width", Type::Gray, "Width of that crack.").in_unit("mm"),
        Output::new("age", Type::Gray, "Age of that crack, 0..1; the first crack has 1."),
        Output::new("plates", Type::Ids, "The number of the plate, from 1 on."),
        Output::new("edge", Type::Gray, "Distance from the edge of the plate; cracks that end within it do not count.")
            .in_unit("mm"),
        Output::new(
            "curl",
            Type::Gray,
            "Height of a plate that curls up at its free edges, 0..1. Small plates curl less.",
        ),
        Output::new("peel", Type::Gray, "1 where the layer has come off the ground, 0 where it sticks."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let (size, _) = self.area(canvas.size_mm(), canvas.tile());
        let points = count(size, self.net_pitch());
        if points <= MOST as f64 {
            return Vec::new();
        }
        let field = if self.pitch.is_some() { "pitch" } else { "spacing" };
        let message = format!(
            "{field} is `{}`; the net would have {points:.0} points on {} × {} mm, and {MOST} are allowed",
            self.pitch.unwrap_or(self.spacing),
            size.x,
            size.y
        );
        let least = self.pitch.unwrap_or(self.spacing) * (points / MOST as f64).sqrt();
        let problem = Problem::new(Code::TooLarge, message).at(field);
        vec![problem.help(format!("write `{field}: {:.3}` or more, or make the canvas smaller", least * 1.01))]
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.direction.is_none() || self.anisotropy > 0.0 {
            return Vec::new();
        }
        let message = "`direction` has no effect while `anisotropy` is 0";
        vec![Problem::new(Code::Advice, message).at("direction").help("write `anisotropy: 0.5`, say")]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (drawing, offset) = self.crack(cx)?;
        let (drawing, tiling) = (Arc::new(drawing), cx.tiling());
        let field = |ty: Type, fill: fn(&Drawing, DVec2, &mut usize) -> [f32; 3]| {
            let drawing = drawing.clone();
            Field::generate(ty, tiling, move |out, given| {
                let (grid, window, mut start) = (out.grid, out.window, 0);
                let width = window.width as usize;
                let mut planes = out.planes_mut();
                for (row, y) in (window.y..window.bottom()).enumerate() {
                    given.check()?;
                    for (column, x) in (window.x..window.right()).enumerate() {
                        let values = fill(&drawing, grid.center(x, y) + offset, &mut start);
                        planes.iter_mut().zip(values).for_each(|(plane, v)| plane[row * width + column] = v);
                    }
                }
                Ok(())
            })
        };
        let crack = field(Type::Rgb, |drawing, p, start| {
            let crack = drawing.crack(p, start);
            [crack.distance, crack.width, crack.age].map(narrow)
        });
        let plate = field(Type::Rgb, |drawing, p, _| {
            let plate = drawing.plate(p);
            [f64::from(plate.number), plate.curl, plate.peel].map(narrow)
        });
        let edge = field(Type::Gray, |drawing, p, start| [narrow(drawing.edge(p, start)), 0.0, 0.0]);
        let (crack, plate) = (cx.shared_field("cracks", crack), cx.shared_field("plates", plate));
        Ok(Outputs::one(plane(&crack, Type::Gray, 0))
            .with("width", plane(&crack, Type::Gray, 1))
            .with("age", plane(&crack, Type::Gray, 2))
            .with("plates", plane(&plate, Type::Ids, 0))
            .with("edge", edge)
            .with("curl", plane(&plate, Type::Gray, 1))
            .with("peel", plane(&plate, Type::Gray, 2)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::testing::{OnCanvas as _, by_x, canvas, crop, outputs, port};
    use glam::UVec2;
    use shibo_value::{Value, Window};

    fn node() -> Fracture {
        Fracture { spacing: 4.0, pitch: Some(0.8), ..Fracture::default() }
    }

    #[test]
    fn conforms_with_and_without_cracks() {
        for shrink in [0.0, 1.6] {
            conforms(&Fracture { shrink, ..node() }, &[]);
        }
        conforms(&Fracture { spacing: 1e5, pitch: None, ..node() }, &[]);
        conforms(
            &Fracture { spacing: 60.0, pitch: Some(20.0), anisotropy: 1.0, noise: 0.9, shrink: 6.0, ..node() },
            &[],
        );
    }

    #[test]
    fn a_canvas_without_tiling_has_other_edges() {
        let flat = shibo_value::Canvas { tile: Tiling::NONE, ..canvas() };
        let made = outputs(&node(), &[], &flat).unwrap();
        let Some(Value::Field(field)) = made.take("cracks", true) else { panic!("no cracks") };
        let whole = crop(field, &flat, Window::full(flat.resolution));
        assert!(whole.data().iter().all(|v| v.is_finite() && *v < 8.0));
        let differ = (0..64).filter(|y| (whole.row(0, *y)[0] - whole.row(0, *y)[63]).abs() > 1.0).count();
        assert!(differ > 10, "{differ}");
    }

    #[test]
    fn the_resolution_changes_nothing() {
        for output in ["cracks", "width", "age", "plates", "edge", "curl", "peel"] {
            let found = field(&node(), &[], output);
            let small = part(&found, &canvas(), 0, 0, 64, 64);
            // Every third pixel of three times the resolution has the same centre.
            let fine = shibo_value::Canvas { resolution: UVec2::splat(192), ..canvas() };
            let large = part(&found, &fine, 0, 0, 192, 192);
            for (x, y) in (0..64).flat_map(|y| (0..64).map(move |x| (x, y))) {
                let (a, b) = (small.row(0, y)[x], large.row(0, 3 * y + 1)[3 * x + 1]);
                assert!((a - b).abs() < 1e-4, "{output} at {x}, {y}: {a} and {b}");
            }
        }
    }

    #[test]
    fn thin_layers_have_finer_cracks() {
        let node = Fracture { thickness: port(0), spacing: 5.0, ..node() };
        let cracks = node_field(&node, by_x(|x| if x < 16.0 { 0.25 } else { 1.0 }));
        let mean = |x: i32| part(&cracks, &canvas(), x, 0, 24, 64).data().iter().sum::<f32>();
        assert!(mean(4) < 0.75 * mean(36), "{} {}", mean(4), mean(36));
    }

    #[test]
    fn weak_places_break_first() {
        let node = Fracture { strength: port(0), shrink: 0.8, ..node() };
        let cracks = node_field(&node, by_x(|x| if x < 16.0 { 0.5 } else { 1.0 }));
        let mean = |x: i32| part(&cracks, &canvas(), x, 0, 16, 64).data().iter().sum::<f32>();
        assert!(mean(8) < 0.6 * mean(40), "{} {}", mean(8), mean(40));
    }

    fn node_field(node: &Fracture, input: Value) -> Field {
        field(node, &[input], "cracks")
    }

    #[test]
    fn too_many_points_are_refused() {
        assert_eq!(Fracture { spacing: 0.1, ..Fracture::default() }.check_on(&canvas())[0].code, Code::TooLarge);
        let problems = Fracture { pitch: Some(1e-300), ..Fracture::default() }.check_on(&canvas());
        assert_eq!(problems[0].code, Code::TooLarge);
        assert!(Fracture::default().check_on(&canvas()).is_empty());
    }

    #[test]
    fn a_value_that_is_not_finite_is_reported() {
        let node = Fracture { strength: port(0), ..node() };
        assert!(outputs(&node, &[by_x(|x| if x < 3.0 { f64::NAN } else { 1.0 })], &canvas()).is_err());
    }

    #[test]
    fn a_direction_needs_anisotropy() {
        let directed = Fracture { direction: Some(port(0)), ..node() };
        assert_eq!(directed.advice_on(&canvas()).len(), 1);
        assert!(Fracture { anisotropy: 0.5, ..directed }.advice_on(&canvas()).is_empty());
    }
}
