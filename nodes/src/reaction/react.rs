//! [`React`]: patterns of reaction and diffusion.
//!
//! Sources: P. Gray, S. Scott (1984); J. Pearson, "Complex patterns in a simple system" (1993); A. Sanderson et al.,
//! "Advanced reaction-diffusion models for texture synthesis" (2006); see [`kernel::reaction`](shibo_kernel::reaction).
//! The pattern is grown once, when the node is evaluated, on a grid in mm that does not depend on the resolution. Where
//! the canvas does not tile, the grid is larger than the canvas. Cost: 2 ns a point and step, 3 if the law differs from
//! place to place; a canvas of 32 × 32 waves with `growth: 1` has 147,000 points and 2667 steps and takes 0.8 CPU s.
//! Then about 20 ns a pixel.
use crate::samples::Samples;
use glam::DVec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::reaction::regime::{self, Regime};
use shibo_kernel::reaction::spline::{Spline, Taps};
use shibo_kernel::reaction::{Local, MOST, Reaction, SETTLED, points};
use shibo_node::{CanvasFacts, Context, Direction, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Stop, Tiling, Type};
use std::sync::Arc;

/// Margin beyond the edges of a canvas that does not tile, in waves.
const MARGIN: f64 = 3.0;

/// A pattern that grows by reaction and diffusion: spots, worms, mazes, nets of holes. Brain coral, hides, fingertips
/// and etched metal grow like this.
///
/// Two substances diffuse and react (Gray and Scott). The pattern grows from small spots until it fills the canvas;
/// `growth` tells for how long. It does not depend on the resolution. On a canvas that tiles it repeats, also if the
/// sides are no multiples of `size`.
///
/// ```ron
/// "flow": Fractal(size: 30, octaves: 2),
/// "example": React(size: 2.4, anisotropy: 0.5, direction: "= 300 * flow"),
/// ```
///
/// Elsewhere: Houdini *Reaction Diffusion* (solver); Substance Designer *Reaction Diffusion* (community graphs); Turing
/// pattern, Gray-Scott, labyrinth.
#[node]
pub struct React {
    /// Distance from a ridge to the next one.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(3.0)]
    pub size: f64,
    /// The kind of pattern. `feed` and `kill` override it.
    #[default(Regime::Maze)]
    pub pattern: Regime,
    /// How long the pattern grows: it fills the canvas at about 0.3, and has settled at 1.
    #[schemars(range(min = 0, max = 10))]
    #[default(1.0)]
    pub growth: f64,
    /// How closely stripes follow `direction`; at 0.3 they lean towards it.
    #[schemars(range(min = 0, max = 1))]
    pub anisotropy: f64,
    /// Direction in which stripes run, in degrees from +x towards +y or as vectors; `angle` is added. Has an effect
    /// only if `anisotropy` is not 0.
    pub direction: Option<In<Direction>>,
    /// Direction in which stripes run, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Length of waves, as a multiple of `size`. Values below 0.5 count as 0.5, those above 1 as 1.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    #[default(In::constant(1.0))]
    pub scale: In<Gray>,
    /// Feed of the reaction instead of that of `pattern`, a number or a picture; 0.02 to 0.08 make patterns.
    #[schemars(extend("minimum" = 0.0, "maximum" = 0.12))]
    pub feed: Option<In<Gray>>,
    /// Kill of the reaction instead of that of `pattern`, a number or a picture. With a feed of 0.042 it leads from
    /// holes (0.059) through mazes (0.061) to worms (0.063) and spots (0.0645).
    #[schemars(extend("minimum" = 0.0, "maximum" = 0.12))]
    pub kill: Option<In<Gray>>,
    /// The pattern grows only where this is 1; values between fade it out.
    pub mask: Option<In<Gray>>,
    /// The pattern starts only where this is above 0.5, and spreads from there. By default it starts everywhere.
    pub start: Option<In<Gray>>,
    /// Another seed gives another pattern of the same kind.
    pub seed: u64,
}

/// The inputs of the reaction.
struct Inputs {
    feed: Samples,
    kill: Samples,
    scale: Samples,
    mask: Samples,
    start: Samples,
    direction: Samples,
}

impl Inputs {
    /// True if the reaction differs from place to place.
    fn vary(&self) -> bool {
        let all = [&self.feed, &self.kill, &self.scale, &self.mask, &self.direction];
        all.iter().any(|samples| !samples.is_constant())
    }
}

impl React {
    /// The area of the grid, and the place of the canvas in it.
    fn area(&self, size: DVec2, tiling: Tiling) -> (DVec2, DVec2) {
        let margin = |tiles: bool| if tiles { 0.0 } else { MARGIN * self.size };
        let offset = DVec2::new(margin(tiling.x), margin(tiling.y));
        (size + 2.0 * offset, offset)
    }

    fn inputs(&self, cx: &Context<'_>) -> Result<Inputs, Stop> {
        let (feed, kill) = self.pattern.rates();
        let sample = |port: &Option<In<Gray>>, name: &str, instead: f64| match cx.get_opt(port)? {
            Some(field) => Samples::new(cx, &field, name),
            None => Ok(Samples::Constant(instead)),
        };
        let direction = match cx.get_opt(&self.direction)? {
            Some(field) if self.anisotropy > 0.0 => Samples::new(cx, &field, "direction")?,
            _ => Samples::Constant(0.0),
        };
        Ok(Inputs {
            feed: sample(&self.feed, "feed", feed)?,
            kill: sample(&self.kill, "kill", kill)?,
            scale: Samples::new(cx, &cx.get(&self.scale)?, "scale")?,
            mask: sample(&self.mask, "mask", 1.0)?,
            start: sample(&self.start, "start", 1.0)?,
            direction,
        })
    }

    fn grow(&self, cx: &Context<'_>) -> Result<(Spline, DVec2), Stop> {
        let (size, offset) = self.area(cx.size_mm(), cx.tiling());
        let inputs = self.inputs(cx)?;
        let natural = if self.feed.is_none() && self.kill.is_none() {
            self.pattern.directed(self.anisotropy)
        } else {
            regime::natural(inputs.feed.mean(), inputs.kill.mean())
        };
        let local = |at: DVec2| {
            let p = at - offset;
            let angle = (inputs.direction.at(p) + self.angle).to_radians();
            Local {
                feed: inputs.feed.at(p).clamp(0.0, 0.12),
                kill: inputs.kill.at(p).clamp(0.0, 0.12),
                scale: inputs.scale.at(p).clamp(0.5, 1.0),
                along: DVec2::new(libm::cos(angle), libm::sin(angle)),
                open: inputs.mask.at(p).clamp(0.0, 1.0),
                starts: inputs.start.at(p) > 0.5,
            }
        };
        let reaction =
            Reaction { size, wave: self.size, natural, anisotropy: self.anisotropy, time: self.growth * SETTLED };
        let hash = Hash::new(cx.seed(self.seed));
        let grown = reaction.grow(inputs.vary(), local, hash, &|| cx.check().is_err());
        grown.map(|grown| (grown, offset)).ok_or(Stop::Cancelled)
    }
}

impl Node for React {
    const OUTPUTS: &'static [Output] =
        &[Output::new("value", Type::Gray, "The pattern: 0 between ridges, 1 on the densest ones.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let (size, _) = self.area(canvas.size_mm(), canvas.tile());
        let count = points(size, self.size);
        if count <= MOST as f64 {
            return Vec::new();
        }
        let message = format!(
            "size is `{}`; the grid would have {count:.0} points on {} × {} mm, and {MOST} are allowed",
            self.size, size.x, size.y
        );
        let least = self.size * (count / MOST as f64).sqrt();
        let problem = Problem::new(Code::TooLarge, message).at("size");
        vec![problem.help(format!("write `size: {:.3}` or more, or make the canvas smaller", least * 1.01))]
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
        let (grown, offset) = self.grow(cx)?;
        let grown = Arc::new(grown);
        Ok(Outputs::one(Field::generate(Type::Gray, cx.tiling(), move |out, given| {
            let (grid, window, width) = (out.grid, out.window, out.width());
            let column = |x: i32| grown.column(grid.center(x, 0).x + offset.x);
            let columns: Vec<Taps> = (window.x..window.right()).map(column).collect();
            for (y, line) in (window.y..window.bottom()).zip(out.plane_mut(0).chunks_mut(width.max(1))) {
                given.check()?;
                let row = grown.row(grid.center(0, y).y + offset.y);
                line.iter_mut().zip(&columns).for_each(|(out, column)| *out = grown.value(column, &row));
            }
            Ok(())
        })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, part};
    use crate::testing::{OnCanvas as _, canvas, lumps, outputs, port, render};
    use shibo_value::{Canvas, Value};

    fn node() -> React {
        React { size: 4.0, growth: 0.3, ..React::default() }
    }

    #[test]
    fn patterns_conform() {
        use Regime::{Coral, Holes, Maze, Net, Spots, Worms};
        for pattern in [Holes, Net, Maze, Coral, Worms, Spots] {
            conforms(&React { pattern, growth: 0.1, ..node() }, &[]);
        }
        for (size, anisotropy, growth) in [(1e5, 1.0, 0.1), (0.7, 0.5, 0.02), (5.3, 0.0, 0.0), (40.0, 0.3, 0.1)] {
            conforms(&React { size, anisotropy, growth, ..node() }, &[]);
        }
        let with = React { scale: port(0), feed: Some(port(1)), kill: Some(port(1)), mask: Some(port(0)), ..node() };
        conforms(&React { start: Some(port(0)), ..with }, &[lumps().into(), gray().into()]);
        let along = React { direction: Some(port(0)), anisotropy: 1.0, growth: 0.1, ..node() };
        conforms(&along, &[gray().into()]);
    }

    #[test]
    fn the_pattern_is_the_same_at_any_resolution() {
        for tile in [Tiling::BOTH, Tiling { x: true, y: false }, Tiling::NONE] {
            let canvas = Canvas { tile, ..canvas() };
            let fine = Canvas { resolution: glam::UVec2::splat(192), ..canvas };
            let made = outputs(&node(), &[], &canvas).unwrap();
            let Some(Value::Field(made)) = made.take("", true) else { panic!("no field") };
            assert_eq!(made.tiling(), tile);
            let (small, large) = (part(made, &canvas, 0, 0, 64, 64), part(made, &fine, 0, 0, 192, 192));
            let off =
                |k: usize| (small.row(0, k / 64)[k % 64] - large.row(0, 3 * (k / 64) + 1)[3 * (k % 64) + 1]).abs();
            assert!((0..64 * 64).all(|k| off(k) < 1e-3), "{tile:?}");
            // Where the canvas does not tile, the pattern goes on beyond the edge, and the other edge is another one.
            let change =
                |a: usize, b: usize| (0..64).map(|y| (small.row(0, y)[a] - small.row(0, y)[b]).abs()).sum::<f32>();
            assert_eq!(change(0, 63) < 2.0 * change(31, 32), tile.x, "{tile:?} {} {}", change(0, 63), change(31, 32));
        }
    }

    #[test]
    fn seeds_differ() {
        let of = |seed| render(&React { seed, ..node() }, &[]);
        assert_eq!(of(3), of(3));
        assert_ne!(of(3), of(4));
    }

    #[test]
    fn masks_and_starts_bound_the_pattern() {
        let half = Field::generate(Type::Gray, Tiling::BOTH, |out, _| {
            let (window, width) = (out.window, out.window.width.cast_signed());
            let grid = out.grid;
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                *v = if grid.center(window.x + k % width, 0).x.rem_euclid(32.0) < 16.0 { 1.0 } else { 0.0 };
            }
            Ok(())
        });
        let most = |node: &React, from: i32| {
            let made = field(node, &[half.clone().into()], "value");
            part(&made, &canvas(), from, 0, 12, 64).data().iter().copied().fold(0.0, f32::max)
        };
        let masked = React { mask: Some(port(0)), ..node() };
        assert!(most(&masked, 10) > 0.5 && most(&masked, 42) < 0.02);
        let started = React { start: Some(port(0)), growth: 0.05, ..node() };
        assert!(most(&started, 10) > 0.5 && most(&started, 42) < 0.02);
        // It spreads.
        assert!(most(&React { growth: 1.0, ..started }, 42) > 0.5);
    }

    #[test]
    fn too_many_points_are_refused() {
        for node in [React { size: 0.1, ..node() }, React { size: 1e-300, ..node() }] {
            let problems = node.check_on(&canvas());
            assert_eq!((problems[0].code, problems[0].field.as_deref()), (Code::TooLarge, Some("size")));
        }
        assert!(React { size: 0.3, ..node() }.check_on(&canvas()).is_empty());
    }

    #[test]
    fn a_value_that_is_not_finite_is_reported() {
        let bad = Field::generate(Type::Gray, Tiling::BOTH, |out, _| {
            out.plane_mut(0).fill(f32::NAN);
            Ok(())
        });
        let node = React { kill: Some(port(0)), ..node() };
        assert!(outputs(&node, &[bad.into()], &canvas()).is_err());
    }

    #[test]
    fn a_direction_needs_anisotropy() {
        let directed = React { direction: Some(port(0)), ..node() };
        assert_eq!(directed.advice_on(&canvas()).len(), 1);
        assert!(React { anisotropy: 0.5, ..directed }.advice_on(&canvas()).is_empty());
    }
}
