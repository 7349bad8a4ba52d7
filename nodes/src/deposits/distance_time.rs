//! [`DistanceTime`]: the time of a front that starts at walls or seeds.
//!
//! With a constant speed the time is exact at every point: the distance to the nearest seed, found in a tree
//! ([`kernel::seeds`](shibo_kernel::deposits::seeds)). With a speed that differs from place to place it is solved on a
//! grid in mm that does not depend on the resolution ([`kernel::sweep`](shibo_kernel::deposits::sweep)). Cost: about
//! 0.3 µs a point; with such a speed 0.3 s in addition.
use super::parts::{self, Triple, planes, points, put, vector};
use glam::{DVec2, DVec3, UVec2};
use shibo_kernel::deposits::seeds::{Seed, Seeds};
use shibo_kernel::deposits::sweep::{Factor, Front};
use shibo_kernel::path::contour::Mask;
use shibo_kernel::wood::solids::Code;
use shibo_node::{CanvasFacts, Context, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code as ErrorCode, Problem};
use shibo_value::{Field, Path, Points, Solid, Stop, Tile, Type, Window};
use std::sync::Arc;

/// Samples along the longer side of the canvas, for walls and for the speed.
const SAMPLES: f64 = 512.0;

/// Maximum number of seeds and straight pieces.
const MOST: usize = 1_000_000;

/// Distance, in mm, of a point if there are no seeds.
const NOWHERE: f64 = 1e6;

/// The least speed of a front.
const SLOWEST: f64 = 1e-3;

/// The time at which a front that starts at walls or seeds reaches each point: agate, malachite, onyx, glaze, nacre.
///
/// All seeds that are given start at time 0, and the first front counts. `BlendTimes` joins several fronts smoothly.
/// The plane of the canvas is z = 0 in space, with x to the right and y down: `CutPlane(solid: …, origin: (0, 0, 0))`
/// shows it. On a canvas that tiles, the fronts repeat with it.
///
/// ```ron
/// "noise": Fractal(size: 26, octaves: 4),
/// "hollow": "= step(noise, 0.47)",
/// "time": DistanceTime(walls: "hollow", speed: 0.8),
/// "bands": ColorPattern(stops: [(0, "#d8c0a0"), (0.5, "#a85a30"), (0.8, "#6a2a18"), (1, "#e0d0bc")]),
/// "agate": RingColor(time: "time", pattern: "bands", late_variation: 0.8, phase_variation: 0.4),
/// "example": CutPlane(solid: "agate", origin: (0, 0, 0), u: (32, 0, 0), v: (0, 32, 0)),
/// ```
#[node]
pub struct DistanceTime {
    /// Points in space at which fronts start, in mm. At most 10000.
    pub seeds: Vec<Triple>,
    /// Points of the canvas at which fronts start.
    pub points: Option<In<Points>>,
    /// Lines on the canvas at which fronts start.
    pub paths: Option<In<Path>>,
    /// Walls as a mask: the front starts where it is ½, and the time is 0 where it is higher. It is read on a grid of 512
    /// samples along the longer side of the canvas.
    pub walls: Option<In<Gray>>,
    /// Speed of the front. A picture gives each place of the canvas its speed, at all heights z; speeds below 0.001
    /// count as 0.001.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm/layer"))]
    #[default(In::constant(1.0))]
    pub speed: In<Gray>,
    /// True if points, lines and walls of the canvas are the same at all heights z. False if they lie in the plane z = 0
    /// alone, so that fronts are round in space.
    #[default(true)]
    pub upright: bool,
}

/// Where fronts start, and how fast they are.
struct Fronts {
    seeds: Seeds,
    mask: Option<Mask>,
    upright: bool,
    pace: Pace,
}

/// Time for a mm.
enum Pace {
    Even(f64),
    Uneven(Factor),
}

impl Fronts {
    /// Time, distance and number of the nearest seed of a point; `start` is the seed where the search starts,
    /// and then the one that was found.
    fn at(&self, p: DVec3, start: &mut usize) -> DVec3 {
        let p = self.seeds.wrap(p);
        let Some(nearest) = self.seeds.nearest(p, *start) else {
            let distance = if self.is_inside(p) { 0.0 } else { NOWHERE };
            return DVec3::new(distance * self.pace(p), distance, 0.0);
        };
        *start = nearest.seed;
        let mut distance = nearest.to.length();
        if self.is_inside(p) {
            distance = if self.upright { 0.0 } else { distance.min(p.z.abs()) };
        }
        DVec3::new(distance * self.pace(p), distance, f64::from(nearest.number))
    }

    fn is_inside(&self, p: DVec3) -> bool {
        self.mask.as_ref().is_some_and(|mask| mask.at(p.truncate()) > 0.5)
    }

    fn pace(&self, p: DVec3) -> f64 {
        match &self.pace {
            Pace::Even(pace) => *pace,
            Pace::Uneven(factor) => factor.at(p.truncate()),
        }
    }

    fn bytes(&self) -> usize {
        let factor = if let Pace::Uneven(factor) = &self.pace { factor.bytes() } else { 0 };
        self.seeds.bytes() + factor + self.mask.as_ref().map_or(0, |_| 4 << 18)
    }
}

/// Samples of fields over the canvas.
struct Samples {
    size: UVec2,
    pixel: DVec2,
}

impl Samples {
    fn new(size: DVec2) -> Self {
        let pixels = (size / size.max_element() * SAMPLES).round().max(DVec2::splat(4.0));
        Self { size: pixels.as_uvec2(), pixel: size / pixels }
    }

    fn read(&self, cx: &Context<'_>, field: &Field, port: &str) -> Result<Tile, Stop> {
        let tile = cx.evaluator.raster(field, &cx.canvas.grid(self.size), Window::full(self.size))?;
        match tile.data().iter().find(|v| !v.is_finite()) {
            None => Ok(tile),
            Some(bad) => {
                let message = format!("{port} has the value `{bad}` somewhere; it must be finite everywhere");
                Err(Problem::new(ErrorCode::NotFinite, message).at(port).into())
            }
        }
    }

    fn centres(&self) -> impl Iterator<Item = DVec2> + '_ {
        let (columns, rows) = (self.size.x, self.size.y);
        (0..rows)
            .flat_map(move |y| (0..columns).map(move |x| DVec2::new(f64::from(x), f64::from(y)) + 0.5))
            .map(|centre| centre * self.pixel)
    }
}

impl DistanceTime {
    /// The seeds, and the mask of walls.
    fn seeds(&self, cx: &Context<'_>, samples: &Samples) -> Result<(Vec<Seed>, Option<Mask>), Stop> {
        let mut seeds: Vec<Seed> = self.seeds.iter().map(|v| Seed::point(vector(*v))).collect();
        let too_many = |count: usize, port: &str| -> Result<(), Stop> {
            let message = format!("{port} has {count} points or pieces; fronts can start at {MOST} at most");
            if count > MOST { Err(Problem::new(ErrorCode::BadValue, message).at(port).into()) } else { Ok(()) }
        };
        if let Some(points) = cx.get_opt(&self.points)? {
            too_many(points.len(), "points")?;
            seeds.extend(points.positions.iter().map(|p| Seed::wall([p.as_dvec2(); 2], self.upright)));
        }
        if let Some(path) = cx.get_opt(&self.paths)? {
            too_many(path.len(), "paths")?;
            seeds.extend(path.pieces().map(|piece| Seed::wall(piece, self.upright)));
        }
        let Some(walls) = cx.get_opt(&self.walls)? else { return Ok((seeds, None)) };
        let tile = samples.read(cx, &walls, "walls")?;
        let mask = Mask::new(tile.data().to_vec(), samples.size, samples.pixel, cx.tiling());
        seeds.extend(mask.border().into_iter().map(|piece| Seed::wall(piece, self.upright)));
        Ok((seeds, Some(mask)))
    }

    /// Solves for the pace on the grid.
    fn uneven(
        cx: &Context<'_>,
        samples: &Samples,
        speed: &Field,
        (seeds, mask): (&Seeds, Option<&Mask>),
    ) -> Result<Factor, Stop> {
        let speeds = samples.read(cx, speed, "speed")?;
        let slowness: Vec<f64> = speeds.data().iter().map(|v| 1.0 / f64::from(*v).max(SLOWEST)).collect();
        let mut start = 0;
        let to: Vec<DVec2> = samples
            .centres()
            .map(|p| {
                if mask.is_some_and(|mask| mask.at(p) > 0.5) {
                    return DVec2::ZERO;
                }
                let nearest = seeds.nearest(p.extend(0.0), start);
                nearest.map_or(DVec2::ZERO, |nearest| {
                    start = nearest.seed;
                    nearest.to.truncate()
                })
            })
            .collect();
        cx.check()?;
        let (size, pixel) = (samples.size, samples.pixel);
        let front = Front { size, pixel, tiling: cx.tiling(), slowness: &slowness, to: &to };
        let factor = front.solve(&|| cx.check().is_err());
        cx.check()?;
        Ok(factor)
    }
}

impl Node for DistanceTime {
    const OUTPUTS: &'static [Output] = &[
        Output::new("time", Type::Solid, "Time at which the front reached the point.").in_unit("layers"),
        Output::new("distance", Type::Solid, "Distance from the nearest seed or wall.").in_unit("mm"),
        Output::new(
            "seed",
            Type::Solid,
            "Number of the nearest seed, from 0: those of `seeds`, then `points`, pieces of `paths` and of `walls`. \
             `random(time.seed)` gives each cell its own number.",
        ),
    ];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.seeds.is_empty() && self.points.is_none() && self.paths.is_none() && self.walls.is_none() {
            let problem = Problem::new(ErrorCode::BadValue, "no front starts anywhere");
            return vec![problem.help("give `seeds`, or connect `points`, `paths` or `walls`")];
        }
        if self.seeds.len() > 10_000 {
            let message = format!("seeds has {} points; at most 10000 are allowed", self.seeds.len());
            return vec![Problem::new(ErrorCode::BadValue, message).at("seeds").help("connect `points` instead")];
        }
        (0..).zip(&self.seeds).filter_map(|(n, seed)| parts::place(*seed, &format!("seeds.{n}"))).collect()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let samples = Samples::new(cx.size_mm());
        let (mut list, mask) = self.seeds(cx, &samples)?;
        (0..).zip(&mut list).for_each(|(n, seed)| seed.number = n);
        let seeds = Seeds::new(&list, cx.size_mm(), cx.tiling());
        let speed = cx.get(&self.speed)?;
        let pace = match speed.as_constant() {
            Some(values) => Pace::Even(1.0 / values.first().map_or(1.0, |v| f64::from(*v)).max(SLOWEST)),
            None if seeds.is_empty() => Pace::Even(1.0),
            None => {
                if let Some(n) = self.seeds.iter().position(|seed| seed.2 != 0.0) {
                    let message =
                        format!("seed {n} lies at z = `{}`; with a picture as speed it must be 0", self.seeds[n].2);
                    let problem = Problem::new(ErrorCode::BadValue, message).at("seeds");
                    return Err(problem.help("give `speed` as a number, or seeds in the plane of the canvas").into());
                }
                Pace::Uneven(Self::uneven(cx, &samples, &speed, (&seeds, mask.as_ref()))?)
            }
        };
        let fronts = Arc::new(Fronts { seeds, mask, upright: self.upright, pace });
        let bytes = fronts.bytes();
        let exact = fronts.clone();
        let code = Code::of_place(move |patch, _, out| {
            let mut start = 0;
            for (i, p) in points(patch).enumerate() {
                put(out, i, fronts.at(p, &mut start));
            }
        })
        .with_exact(move |at, _| {
            let mut start = 0;
            planes(&at.iter().map(|p| exact.at(*p, &mut start)).collect::<Vec<_>>())
        })
        .holding(bytes);
        let all = cx.shared("all", Solid::bundle(3, Vec::new(), code));
        Ok(Outputs::one(all.channel(0)).with("distance", all.channel(1)).with("seed", all.channel(2)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, outputs, port};
    use shibo_kernel::ground::number::narrow;
    use shibo_value::{Canvas, Tiling, Value};

    fn flat() -> Canvas {
        Canvas { tile: Tiling::NONE, ..canvas() }
    }

    fn time(node: &DistanceTime, inputs: &[Value], canvas: &Canvas) -> Solid {
        let outputs = outputs(node, inputs, canvas).unwrap();
        let Some(Value::Solid(solid)) = outputs.take("time", true) else { panic!("no time") };
        solid.clone()
    }

    fn field(value: impl Fn(f64, f64) -> f64 + Send + Sync + 'static) -> Field {
        Field::generate(Type::Gray, Tiling::NONE, move |out, _| {
            let (grid, window) = (out.grid, out.window);
            let width = window.width.cast_signed();
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let p = grid.center(window.x + k % width, window.y + k / width);
                *v = narrow(value(p.x, p.y));
            }
            Ok(())
        })
    }

    fn places(count: u32) -> Vec<DVec3> {
        (0..count)
            .map(|n| DVec3::new(f64::from(n % 37) * 0.85, f64::from(n / 37) * 1.1, f64::from(n % 5) - 2.0))
            .collect()
    }

    #[test]
    fn times_from_points_in_space_are_exact() {
        let seeds = vec![(3.0, 4.0, 1.0), (20.0, 25.0, -2.0)];
        let node = DistanceTime { seeds, speed: In::constant(2.0), ..DistanceTime::default() };
        let at = places(500);
        for (p, time) in at.iter().zip(time(&node, &[], &flat()).at(&at)) {
            let want = p.distance(DVec3::new(3.0, 4.0, 1.0)).min(p.distance(DVec3::new(20.0, 25.0, -2.0))) / 2.0;
            assert!((time - want).abs() < 1e-9, "{p}");
        }
    }

    #[test]
    fn walls_have_the_distance_to_their_border() {
        let disc = field(|x, y| (0.5 + 8.0 - (x - 14.0).hypot(y - 17.0)).clamp(0.0, 1.0));
        let at = places(900);
        for upright in [true, false] {
            let node = DistanceTime { walls: Some(port(0)), upright, ..DistanceTime::default() };
            for (p, time) in at.iter().zip(time(&node, &[disc.clone().into()], &flat()).at(&at)) {
                let flat = (p.truncate().distance(DVec2::new(14.0, 17.0)) - 8.0).max(0.0);
                let want = if upright { flat } else { flat.hypot(p.z) };
                assert!((time - want).abs() < 0.02, "{p}: {time} instead of {want}");
            }
        }
    }

    #[test]
    fn fronts_repeat_with_the_canvas() {
        let node = DistanceTime { seeds: vec![(1.0, 2.0, 0.0)], ..DistanceTime::default() };
        let solid = time(&node, &[], &canvas());
        let at = places(300);
        let shifted: Vec<DVec3> = at.iter().map(|p| *p + DVec3::new(32.0, -64.0, 0.0)).collect();
        for (a, b) in solid.at(&at).iter().zip(solid.at(&shifted)) {
            assert!((a - b).abs() < 1e-9);
        }
        assert!((solid.at(&[DVec3::new(31.0, 31.0, 0.0)])[0] - 2f64.hypot(3.0)).abs() < 1e-9);
    }

    #[test]
    fn a_picture_of_a_constant_speed_changes_nothing() {
        let seeds = vec![(11.0, 14.0, 0.0)];
        let node = DistanceTime { seeds, speed: port(0), ..DistanceTime::default() };
        let at: Vec<DVec3> = places(500).iter().map(|p| DVec3::new(p.x, p.y, 0.0)).collect();
        for (p, time) in at.iter().zip(time(&node, &[field(|_, _| 2.0).into()], &flat()).at(&at)) {
            let want = 0.5 * p.distance(DVec3::new(11.0, 14.0, 0.0));
            assert!((time - want).abs() < 1e-3, "{p}: {time} instead of {want}");
        }
        let lifted = DistanceTime { seeds: vec![(0.0, 0.0, 1.0)], ..node };
        assert!(outputs(&lifted, &[field(|_, _| 2.0).into()], &flat()).is_err());
    }

    #[test]
    fn cells_have_the_number_of_their_seed() {
        let node = DistanceTime { seeds: vec![(3.0, 4.0, 0.0), (20.0, 25.0, 0.0)], ..DistanceTime::default() };
        let outputs = outputs(&node, &[], &flat()).unwrap();
        let Some(Value::Solid(seed)) = outputs.take("seed", false) else { panic!("no seed") };
        assert_eq!(seed.at(&[DVec3::new(4.0, 4.0, 9.0), DVec3::new(30.0, 20.0, 0.0)]), [0.0, 1.0]);
    }

    #[test]
    fn empty_and_full_walls_have_finite_times() {
        for (value, want) in [(0.0, NOWHERE), (1.0, 0.0)] {
            let node = DistanceTime { walls: Some(port(0)), ..DistanceTime::default() };
            let times = time(&node, &[Field::constant(Type::Gray, &[value]).into()], &flat()).at(&places(3));
            assert_eq!(times, [want; 3]);
        }
    }
}
