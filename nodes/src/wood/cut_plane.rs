//! [`CutPlane`]: a plane through a solid.
//!
//! Source: Momoi & Takatera 2014, §4.1, §4.2, §5.1 (rows B26–B28, B30). Cost: about 1 ns a pixel besides the solid.
use super::trees::{Triple, vector};
use glam::{DQuat, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::{AnySolid, CanvasFacts, Context, Fact, In, Node, Output, Outputs};
use shibo_engine::value::{Cut, Field, Key, Stop, Tile, Tiling, Type};
use shibo_kernel::ground::simd::dispatch;

/// How a board is cut from a trunk that stands on the z axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Sawing {
    /// By `origin`, `u` and `v`.
    #[default]
    Given,
    /// Tangential (板目): at `distance` from the pith, with the length along the trunk to the right. Rings form cathedrals.
    FlatSawn,
    /// Radial (柾目): from `distance` on away from the pith, with the length along the trunk to the right. Rings form stripes.
    QuarterSawn,
    /// Across the trunk, with the middle at `distance` from the pith. Rings show as circles.
    EndGrain,
}

/// Cuts a solid with a plane: the canvas shows P = origin + (x / width) · u + (y / height) · v.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "time": TrunkTime(skeleton: "tree"),
/// "rings": ColorPattern(),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "example": CutPlane(solid: "wood", preset: QuarterSawn, distance: 2, yaw: 12),
/// ```
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CutPlane {
    /// What to cut.
    pub solid: In<AnySolid>,
    /// How the board is cut from the trunk.
    pub preset: Sawing,
    /// For `Given`: the point at the canvas' upper left corner.
    #[schemars(extend("minimum" = -1e7, "maximum" = 1e7, "unit" = "mm"))]
    pub origin: Triple,
    /// For `Given`: the way from there to the upper right corner; (width of the canvas, 0, 0) if not given.
    #[schemars(extend("minimum" = -1e7, "maximum" = 1e7, "unit" = "mm"))]
    pub u: Option<Triple>,
    /// For `Given`: the way from there to the lower left corner; (0, 0, height of the canvas) if not given.
    #[schemars(extend("minimum" = -1e7, "maximum" = 1e7, "unit" = "mm"))]
    pub v: Option<Triple>,
    /// For the others: the distance from the pith.
    #[schemars(range(min = -1e5, max = 1e5), extend("unit" = "mm"))]
    pub distance: f64,
    /// For the others: how far the board is moved in the other horizontal direction.
    #[schemars(range(min = -1e5, max = 1e5), extend("unit" = "mm"))]
    pub offset: f64,
    /// For the others: the height in the trunk at which the board starts.
    #[schemars(range(min = -1e5, max = 1e6), extend("unit" = "mm"))]
    pub height: f64,
    /// For the others: how far the board is turned about the vertical through its middle; a few degrees
    /// away from a quarter cut change much.
    #[schemars(range(min = -180, max = 180), extend("unit" = "°"))]
    pub yaw: f64,
    /// For the others: the angle between the board's length and that of the trunk.
    #[schemars(range(min = -90, max = 90), extend("unit" = "°"))]
    pub pitch: f64,
    /// For the others: whether the length runs down the canvas instead of to the right.
    pub upright: bool,
}

impl Default for CutPlane {
    fn default() -> Self {
        Self {
            solid: In::default(),
            preset: Sawing::Given,
            origin: (0.0, 0.0, 0.0),
            u: None,
            v: None,
            distance: 40.0,
            offset: 0.0,
            height: 0.0,
            yaw: 0.0,
            pitch: 0.0,
            upright: false,
        }
    }
}

/// A plane: the points of the canvas' upper left corner, and the ways to the other two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    pub(super) origin: DVec3,
    pub(super) u: DVec3,
    pub(super) v: DVec3,
}

impl Plane {
    /// The cut that shows it on a canvas of `size` mm.
    pub(super) fn cut(self, size: glam::DVec2) -> Cut {
        let Self { origin, u, v } = self;
        let numbers = [origin, u, v].map(|p| p.to_array()).concat();
        let bytes: Vec<u8> =
            numbers.iter().chain(&size.to_array()).flat_map(|n| (n + 0.0).to_bits().to_le_bytes()).collect();
        let (right, down) = (u / size.x, v / size.y);
        let place = Field::generate(Type::Rgb, Tiling::NONE, move |out: &mut Tile, _| {
            let (grid, window) = (out.grid, out.window);
            let width = out.width();
            // From the numbers of pixels, so that any window gives the same bits.
            let columns = (0..width).map(|i| grid.origin.x + (f64::from(window.x) + i as f64 + 0.5) * grid.step.x);
            let columns: Vec<f64> = columns.collect();
            dispatch(
                #[inline(always)]
                || {
                    for (axis, plane) in out.planes_mut().into_iter().enumerate() {
                        for (row, line) in plane.chunks_exact_mut(width.max(1)).enumerate() {
                            let y = grid.center(0, window.y.saturating_add_unsigned(count(row))).y;
                            let (from, right) = (origin[axis] + down[axis] * y, right[axis]);
                            line.iter_mut().zip(&columns).for_each(|(value, x)| *value = single(from + right * x));
                        }
                    }
                },
            );
            Ok(())
        });
        let place = place.overwriting();
        let spacing =
            move |grid: &shibo_engine::value::Grid| (right.length() * grid.step.x).max(down.length() * grid.step.y);
        let unit = |v: DVec3| v.normalize().to_array().map(single);
        Cut::new(Key::of("plane", &[&bytes]), place, spacing).with_level_rows(u.z == 0.0).with_flat(unit(u), unit(v))
    }
}

fn count(row: usize) -> u32 {
    u32::try_from(row).unwrap_or(u32::MAX)
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
const fn single(v: f64) -> f32 {
    v as f32
}

impl CutPlane {
    fn plane(&self, size: glam::DVec2) -> Plane {
        let (w, h) = (size.x, size.y);
        let (long, wide) = if self.upright { (h, w) } else { (w, h) };
        // The middle of the board, its length and its breadth.
        let (middle, length, breadth) = match self.preset {
            Sawing::Given => {
                let u = self.u.map_or(DVec3::new(w, 0.0, 0.0), vector);
                let v = self.v.map_or(DVec3::new(0.0, 0.0, h), vector);
                return Plane { origin: vector(self.origin), u, v };
            }
            Sawing::FlatSawn => {
                (DVec3::new(self.offset, self.distance, self.height + 0.5 * long), DVec3::Z * long, DVec3::X * wide)
            }
            Sawing::QuarterSawn => {
                let middle = DVec3::new(self.distance + 0.5 * wide, self.offset, self.height + 0.5 * long);
                (middle, DVec3::Z * long, DVec3::X * wide)
            }
            Sawing::EndGrain => (DVec3::new(self.offset, self.distance, self.height), DVec3::X * long, DVec3::Y * wide),
        };
        let turn = DQuat::from_rotation_z(self.yaw.to_radians())
            * DQuat::from_axis_angle(breadth.normalize(), self.pitch.to_radians());
        let straight = self.yaw == 0.0 && self.pitch == 0.0;
        let [length, breadth] = if straight { [length, breadth] } else { [turn * length, turn * breadth] };
        let (u, v) = if self.upright { (breadth, length) } else { (length, breadth) };
        Plane { origin: middle - 0.5 * u - 0.5 * v, u, v }
    }
}

impl Node for CutPlane {
    const OUTPUTS: &'static [Output] = &[Output::like("value", &["solid"], "What the plane shows of the solid.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let plane = self.plane(canvas.size_mm());
        if plane.u.cross(plane.v).length() <= 1e-12 * plane.u.length() * plane.v.length() {
            let message = "u and v point the same way; they must span a plane";
            return vec![Problem::new(Code::BadValue, message).at("v")];
        }
        Vec::new()
    }

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let size = cx.size_mm();
        Ok(Outputs::one(cx.cut(&cx.get(&self.solid)?, &self.plane(size).cut(size))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn plane(cut: &CutPlane) -> (DVec3, DVec3, DVec3) {
        let Plane { origin, u, v } = cut.plane(DVec2::new(200.0, 80.0));
        (origin, u, v)
    }

    fn close(a: DVec3, b: DVec3) {
        assert!(a.distance(b) < 1e-9, "{a} is not {b}");
    }

    #[test]
    fn presets_are_the_cuts_of_sawyers() {
        let cut = |preset| CutPlane { preset, distance: 30.0, offset: 5.0, height: 700.0, ..CutPlane::default() };
        // Tangential: all of it 30 mm in front of the pith, the trunk's length to the right.
        let (origin, u, v) = plane(&cut(Sawing::FlatSawn));
        close(origin, DVec3::new(5.0 - 40.0, 30.0, 700.0));
        close(u, DVec3::Z * 200.0);
        close(v, DVec3::X * 80.0);
        // Radial: away from the pith.
        let (origin, u, v) = plane(&cut(Sawing::QuarterSawn));
        close(origin, DVec3::new(30.0, 5.0, 700.0));
        close(u, DVec3::Z * 200.0);
        close(v, DVec3::X * 80.0);
        // Across: level.
        let (origin, u, v) = plane(&cut(Sawing::EndGrain));
        close(origin, DVec3::new(5.0 - 100.0, 30.0 - 40.0, 700.0));
        close(u, DVec3::X * 200.0);
        close(v, DVec3::Y * 80.0);
        // Upright: the length down the canvas.
        let (_, u, v) = plane(&CutPlane { upright: true, ..cut(Sawing::FlatSawn) });
        close(u, DVec3::X * 200.0);
        close(v, DVec3::Z * 80.0);
    }

    #[test]
    fn boards_turn_about_their_middles() {
        for preset in [Sawing::FlatSawn, Sawing::QuarterSawn] {
            let cut = |yaw, pitch| CutPlane { preset, distance: 30.0, yaw, pitch, ..CutPlane::default() };
            let middle = |(origin, u, v): (DVec3, DVec3, DVec3)| origin + 0.5 * (u + v);
            let straight = plane(&cut(0.0, 0.0));
            let turned = plane(&cut(90.0, 0.0));
            close(middle(turned), middle(straight));
            // About the vertical: the length stays, the breadth goes from x to y.
            close(turned.1, straight.1);
            close(turned.2, DVec3::Y * 80.0);
            let tilted = plane(&cut(0.0, 10.0));
            close(middle(tilted), middle(straight));
            close(tilted.2, straight.2);
            let lean = tilted.1.angle_between(DVec3::Z).to_degrees();
            assert!((lean - 10.0).abs() < 1e-9 && (tilted.1.length() - 200.0).abs() < 1e-9, "{lean}");
        }
    }
}
