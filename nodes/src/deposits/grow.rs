//! [`Grow`]: colonies that spread over a surface.
//!
//! The front is computed once, when the node is evaluated, on a grid in mm that does not depend on the resolution; see
//! [`kernel::growth`](shibo_kernel::deposits::growth). Cost: 0.7 µs a cell, at most 1.2 s with long run-off; then
//! 0.2 µs a pixel for `mask`, `edge` and `id` together, and 0.1 µs for the other outputs together.
use crate::degrees::sin_cos;
use crate::planes::plane;
use glam::DVec2;
use shibo_kernel::deposits::growth::read::Drawing;
use shibo_kernel::deposits::growth::{Ground, Law, MOST, Plan};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Halo, Stop, Tiling, Type, Window};
use std::sync::Arc;

/// Colonies that spread over a surface and meet: rust, patina, lichen, moss, mould, frost.
///
/// A front starts at seeds, and each grain of the surface holds it up for a random time. So borders are rough at all
/// sizes, and islands stay free for a while. Units of time are mm: at an `amount` of 5 a colony has a radius of about
/// 5 mm. A larger `amount` contains the growth of a smaller one, so presets can show one piece that ages. `time` is
/// known beyond the front too: `amount - time` is below 0 there. The grid of the growth does not depend on the
/// resolution. On a canvas that tiles, colonies do too.
///
/// ```ron
/// "rust": Grow(size: 0.5, spacing: 10, amount: 5, stagger: 7, roughness: 0.6, drip: 24),
/// "height": "= rust.thickness * 0.7",
/// "color": "= mix(mix((0.3, 0.32, 0.34), (0.3, 0.12, 0.04), min(1.6 * rust.runs, 1)), (0.2, 0.07, 0.03), rust)",
/// "example": Relief(height: "height", base_color: "color"),
/// ```
///
/// Elsewhere: Houdini *Infection* solvers; Blender *Dynamic Paint* spread; Substance Painter *Rust* and *Moss*
/// generators; Eden growth, first-passage percolation.
#[node]
pub struct Grow {
    /// Size of a grain of the surface: of the smallest bays and islands of a border.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.5)]
    pub size: f64,
    /// Mean distance of the seeds of colonies; 0 for none.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    #[default(12.0)]
    pub spacing: f64,
    /// Duration of the growth: about the radius of the oldest colonies.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    #[default(4.0)]
    pub amount: f64,
    /// Time from the start of the first colony to that of the last one, so that colonies have different sizes.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    #[default(4.0)]
    pub stagger: f64,
    /// Spread of the delays: 0 for round colonies, 0.5 for lobes and a few islands, 1 for ragged colonies.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.5)]
    pub roughness: f64,
    /// Speed of the growth, as a multiple of the usual one; below 1 it is also the share of seeds that start there.
    /// Nothing grows where it is below 0.02.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1000.0))]
    #[default(In::constant(1.0))]
    pub exposure: In<Gray>,
    /// Hollows of the surface, 0..1, such as a `Cavity`, in which the growth is faster.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub cavity: Option<In<Gray>>,
    /// Gain of the speed in hollows: it is multiplied by 1 + `hollows` × `cavity`.
    #[schemars(range(min = 0, max = 100))]
    #[default(2.0)]
    pub hollows: f64,
    /// Mask of places that are grown over at time 0, besides the seeds: those with ½ or more. They are one colony.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub start: Option<In<Gray>>,
    /// Length of the longest stains that run down from the growth; 0 for none.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    pub drip: f64,
    /// Direction in which stains run, from +x towards +y; 90 is down.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    #[default(90.0)]
    pub direction: f64,
    /// Time after which a place has its whole thickness.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(1.5)]
    pub rise: f64,
    /// Another seed gives other colonies.
    pub seed: u64,
}

impl Grow {
    fn law(&self) -> Law {
        let (sin, cos) = sin_cos(self.direction);
        Law {
            grain: self.size,
            roughness: self.roughness,
            spacing: self.spacing,
            stagger: self.stagger,
            amount: self.amount,
            drip: self.drip,
            down: DVec2::new(cos, sin),
        }
    }

    /// A field at the cells.
    fn read(cx: &Context<'_>, plan: &Plan, field: &Field, port: &str) -> Result<Vec<f32>, Stop> {
        if let Some(values) = field.as_constant() {
            return Ok(vec![values.first().copied().unwrap_or(0.0); plan.len()]);
        }
        let tile = cx.evaluator.raster(field, &cx.canvas.grid(plan.counts), Window::full(plan.counts))?;
        match tile.plane(0).iter().find(|v| !v.is_finite()) {
            None => Ok(tile.plane(0).to_vec()),
            Some(bad) => {
                let message = format!("{port} has the value `{bad}` somewhere; it must be finite everywhere");
                Err(Problem::new(Code::NotFinite, message).at(port).into())
            }
        }
    }

    fn grow(&self, cx: &Context<'_>) -> Result<Drawing, Stop> {
        let plan = Plan::new(cx.size_mm(), self.size, cx.tiling());
        let mut speeds = Self::read(cx, &plan, &cx.get(&self.exposure)?, "exposure")?;
        let fertile = speeds.clone();
        if let Some(cavity) = cx.get_opt(&self.cavity)? {
            let cavity = Self::read(cx, &plan, &cavity, "cavity")?;
            let gain = narrow(self.hollows);
            speeds.iter_mut().zip(cavity).for_each(|(speed, hollow)| *speed *= 1.0 + gain * hollow.clamp(0.0, 1.0));
        }
        let started = match cx.get_opt(&self.start)? {
            Some(start) => Self::read(cx, &plan, &start, "start")?.iter().map(|v| *v >= 0.5).collect(),
            None => vec![false; plan.len()],
        };
        let ground = Ground { speeds: &speeds, fertile: &fertile, started: &started };
        let hash = Hash::new(cx.seed(self.seed));
        self.law().grow(&plan, &ground, hash, &|| cx.check().is_err()).ok_or(Stop::Cancelled)
    }
}

impl Node for Grow {
    const OUTPUTS: &'static [Output] = &[
        Output::new("mask", Type::Gray, "How much of the place is grown over, 0..1."),
        Output::new("time", Type::Gray, "The moment at which the growth comes, also beyond the front.").in_unit("mm"),
        Output::new("age", Type::Gray, "How long the place has been grown over, as a share of `amount`, 0..1."),
        Output::new("thickness", Type::Gray, "Thickness of the growth, 0..1: it rises from the front inwards."),
        Output::new(
            "edge",
            Type::Gray,
            "Distance from the margin of the colony: from the front or from another colony.",
        )
        .in_unit("mm"),
        Output::new("runs", Type::Gray, "Strength of the stains that run down, 0..1."),
        Output::new(
            "id",
            Type::Ids,
            "The number of the colony, 0 where there is none. The growth from `start` is number 1.",
        ),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let size = canvas.size_mm();
        let mut problems = Vec::new();
        let cells = Plan::counts(size, self.size).element_product();
        if cells > MOST as f64 {
            let message = format!(
                "size is `{}` mm; the grid would have {cells:.0} cells on {} × {} mm, and {MOST} are allowed",
                self.size, size.x, size.y
            );
            let least = 1.01 * self.size * (cells / MOST as f64).sqrt();
            let problem = Problem::new(Code::TooLarge, message).at("size");
            problems.push(problem.help(format!("write `size: {least:.3}` or more, or make the canvas smaller")));
        }
        if self.spacing > 0.0 && self.spacing < self.size {
            let message = format!("spacing is `{}` mm; it must be at least `size`, {} mm", self.spacing, self.size);
            problems.push(Problem::new(Code::OutOfRange, message).at("spacing").help("write 0 for no seeds"));
        }
        if self.spacing <= 0.0 && self.start.is_none() {
            let problem = Problem::new(Code::BadValue, "nothing grows: there are no seeds and no `start`");
            problems.push(problem.at("spacing").help("give `spacing`, or connect `start`"));
        }
        let most = size.max_element();
        if self.drip > most {
            let message = format!("drip is `{}` mm; it must be at most {most} mm, as long as the canvas", self.drip);
            problems.push(Problem::new(Code::OutOfRange, message).at("drip"));
        }
        problems
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (drawing, tiling) = (Arc::new(self.grow(cx)?), cx.tiling());
        let field = |ty: Type, fill: fn(&Drawing, DVec2, f64) -> [f32; 4]| {
            let drawing = drawing.clone();
            Field::generate(ty, tiling, move |out, given| {
                let (grid, window) = (out.grid, out.window);
                let (width, pixel) = (window.width as usize, grid.step.max_element());
                let mut planes = out.planes_mut();
                for (row, y) in (window.y..window.bottom()).enumerate() {
                    given.check()?;
                    for (column, x) in (window.x..window.right()).enumerate() {
                        let values = fill(&drawing, grid.center(x, y), pixel);
                        planes.iter_mut().zip(values).for_each(|(plane, v)| plane[row * width + column] = v);
                    }
                }
                Ok(())
            })
        };
        let front = field(Type::Rgb, |drawing, p, pixel| {
            let spot = drawing.front(p, pixel);
            #[expect(clippy::cast_precision_loss, reason = "fewer than 2^24 colonies")]
            let owner = spot.owner as f32;
            [spot.mask, spot.edge, owner, 0.0]
        });
        let history = field(Type::Vec2, |drawing, p, _| {
            let [time, run] = drawing.history(p);
            [time, run, 0.0, 0.0]
        });
        let (front, history) = (cx.shared_field("front", front), cx.shared_field("history", history));
        let since = |span: f64, curve: fn(f32) -> f32| {
            let (amount, span) = (narrow(self.amount), narrow(span.max(1e-6)));
            Field::map(Type::Gray, [history.clone()], Halo::NONE, move |out, [history]| {
                for (out, time) in out.plane_mut(0).iter_mut().zip(history.plane(0)) {
                    *out = curve(((amount - time) / span).clamp(0.0, 1.0));
                }
                Ok(())
            })
        };
        Ok(Outputs::one(plane(&front, Type::Gray, 0))
            .with("time", plane(&history, Type::Gray, 0))
            .with("age", since(self.amount, |t| t))
            .with("thickness", since(self.rise, |t| t * (2.0 - t)))
            .with("edge", plane(&front, Type::Gray, 1))
            .with("runs", plane(&history, Type::Gray, 1))
            .with("id", plane(&front, Type::Ids, 2)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::testing::{OnCanvas as _, by_x, canvas, outputs, port};
    use glam::UVec2;
    use shibo_value::Canvas;

    fn node() -> Grow {
        Grow { size: 0.6, spacing: 9.0, drip: 8.0, ..Grow::default() }
    }

    #[test]
    fn conforms_with_all_inputs() {
        conforms(&node(), &[]);
        let half = || by_x(|x| if x < 16.0 { 1.0 } else { 0.0 });
        let fed = Grow { exposure: port(0), cavity: Some(port(1)), start: Some(port(2)), ..node() };
        conforms(&fed, &[half(), half(), by_x(|x| if x < 2.0 { 1.0 } else { 0.0 })]);
        conforms(&Grow { size: 1e5, spacing: 1e5, amount: 0.0, roughness: 1.0, ..node() }, &[]);
        conforms(&Grow { exposure: port(0), stagger: 0.0, ..node() }, &[by_x(|_| 0.0)]);
    }

    #[test]
    fn the_resolution_changes_nothing_but_the_width_of_borders() {
        for output in ["time", "age", "thickness", "edge", "runs", "id"] {
            let found = field(&node(), &[], output);
            let small = part(&found, &canvas(), 0, 0, 64, 64);
            // Every third pixel of three times the resolution has the same centre.
            let fine = Canvas { resolution: UVec2::splat(192), ..canvas() };
            let large = part(&found, &fine, 0, 0, 192, 192);
            for (x, y) in (0..64).flat_map(|y| (0..64).map(move |x| (x, y))) {
                let (a, b) = (small.row(0, y)[x], large.row(0, 3 * y + 1)[3 * x + 1]);
                assert!((a - b).abs() < 1e-3, "{output} at {x}, {y}: {a} and {b}");
            }
        }
        let found = field(&node(), &[], "mask");
        let share = |n: u32| {
            let canvas = Canvas { resolution: UVec2::splat(n), ..canvas() };
            let tile = part(&found, &canvas, 0, 0, n, n);
            tile.data().iter().map(|v| f64::from(*v)).sum::<f64>() / f64::from(n * n)
        };
        let shares = [64, 256, 1024].map(share);
        assert!(shares.iter().all(|s| (s / shares[2] - 1.0).abs() < 0.02) && shares[2] > 0.05, "{shares:?}");
    }

    #[test]
    fn hollows_are_grown_over_first() {
        let fed = Grow { cavity: Some(port(0)), stagger: 0.0, amount: 2.0, hollows: 3.0, ..node() };
        let found = field(&fed, &[by_x(|x| if x < 16.0 { 1.0 } else { 0.0 })], "mask");
        let sum = |x: i32| part(&found, &canvas(), x, 0, 24, 64).data().iter().sum::<f32>();
        assert!(sum(4) > 1.5 * sum(36), "{} {}", sum(4), sum(36));
    }

    #[test]
    fn growth_starts_at_a_mask() {
        let fed = Grow { start: Some(port(0)), spacing: 0.0, roughness: 0.2, ..node() };
        let started = || by_x(|x| if x < 4.0 { 1.0 } else { 0.0 });
        let ids = part(&field(&fed, &[started()], "id"), &canvas(), 0, 0, 64, 64);
        assert!(ids.data().iter().all(|id| *id == 0.0 || *id == 1.0));
        assert_eq!((ids.row(0, 30)[4], ids.row(0, 30)[62], ids.row(0, 30)[32]), (1.0, 1.0, 0.0));
    }

    #[test]
    fn refuses_invalid_growth() {
        let refused = |node: Grow| node.check_on(&canvas()).first().map(|p| (p.code, p.field.clone()));
        assert_eq!(refused(node()), None);
        assert_eq!(refused(Grow { size: 1e-300, ..node() }), Some((Code::TooLarge, Some("size".into()))));
        assert_eq!(refused(Grow { spacing: 0.1, ..node() }), Some((Code::OutOfRange, Some("spacing".into()))));
        assert_eq!(refused(Grow { spacing: 0.0, ..node() }), Some((Code::BadValue, Some("spacing".into()))));
        assert_eq!(refused(Grow { drip: 33.0, ..node() }), Some((Code::OutOfRange, Some("drip".into()))));
        let fed = Grow { exposure: port(0), ..node() };
        assert!(outputs(&fed, &[by_x(|x| if x < 3.0 { f64::NAN } else { 1.0 })], &canvas()).is_err());
    }
}
