//! [`WorkArea`]: the points within a shape.
//!
//! Source: JP4905282B2 §3, "a work area of any shape" (row A4; with it A42 and A48 for that shape). Cost: O(points),
//! and the distances from the contour at four samples per pitch.
use crate::values::each;
use glam::{DVec2, UVec2};
use shibo_kernel::filter::fields;
use shibo_kernel::leather::area;
use shibo_node::{Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Area, Field, Points, Stop, Type, Window};
use std::sync::Arc;

/// Keeps the points within a shape, which becomes the work area of all later stages.
///
/// Links join only points of the area, `boundary: Fixed(…)` holds the points near its contour, and wrinkles are cut at
/// the contour. Points of a grid keep their neighbours. The shape is read at four samples per pitch.
///
/// ```ron
/// "all": PoissonPoints(pitch: 2.5),
/// "noise": Perlin(size: 25),
/// "points": WorkArea(points: "all", area: "noise", threshold: 0.45),
/// "links": ConnectNeighbors(points: "points"),
/// "wrinkles": PlaceWrinkles(lattice: "links"),
/// "height": DrawWrinkles(segments: "wrinkles", width: (0.4, 0.9), depth: 0.5),
/// "example": Relief(height: "height"),
/// ```
#[node]
pub struct WorkArea {
    /// The points.
    pub points: In<Points>,
    /// The shape: inside where it is above `threshold`.
    pub area: In<Gray>,
    /// The value at the contour.
    #[default(0.5)]
    pub threshold: f64,
}

/// Maximum number of columns or rows of samples of the shape.
const MOST_SAMPLES: f64 = 1024.0;
/// Distances are computed up to this share of the canvas' shorter side.
const REACH: f64 = 0.25;

impl Node for WorkArea {
    const OUTPUTS: &'static [Output] =
        &[Output::new("points", Type::Points, "The points inside, in the same order as before.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let points = cx.get(&self.points)?;
        let shape = cx.get(&self.area)?;
        let area = self.area(cx, &points, &shape)?;
        let kept = area::inside(&points.positions, &area);
        if kept.is_empty() {
            let message =
                format!("no point lies where area is above {}; a work area needs at least one", self.threshold);
            let problem = Problem::new(Code::BadValue, message).at("area");
            return Err(problem.help("lower threshold, or make the shape larger").into());
        }
        let select = |list: &[glam::Vec2]| kept.iter().map(|&i| list[i as usize]).collect::<Vec<_>>();
        let sites =
            points.sites.as_ref().map_or_else(|| kept.clone(), |old| kept.iter().map(|&i| old[i as usize]).collect());
        let layout = points.grid.is_some() || points.edges.is_some();
        let positions = select(&points.positions);
        let regular = points.regular.as_deref().map(select);
        let area = Some(Arc::new(area));
        let sites = layout.then_some(sites);
        Ok(Outputs::one(Points { positions, regular, sites, area, ..Points::clone(&points) }))
    }
}

impl WorkArea {
    /// The distances from the contour, combined with those of the area that the points already had.
    fn area(&self, cx: &Context<'_>, points: &Points, shape: &Field) -> Result<Area, Stop> {
        let pitch = f64::from(points.pitch.max(f32::MIN_POSITIVE));
        let size = (cx.size_mm() / pitch * 4.0).ceil().clamp(DVec2::splat(16.0), DVec2::splat(MOST_SAMPLES)).as_uvec2();
        let threshold = shibo_kernel::ground::number::narrow(self.threshold);
        let radius = REACH * cx.size_mm().min_element();
        let negative = each(shape, |v| -v);
        let read = |field: &Field| cx.evaluator.raster(field, &cx.canvas.grid(size), Window::full(size));
        let inside = read(&fields::distances(&negative, -threshold, radius))?;
        let outside = read(&fields::distances(shape, threshold, radius))?;
        let mut distance: Vec<f32> = inside.data().iter().zip(outside.data()).map(|(i, o)| i - o).collect();
        if let Some(bad) = distance.iter().find(|d| !d.is_finite()) {
            let message =
                format!("the distance from the contour of area becomes `{bad}`; area must be finite everywhere");
            return Err(Problem::new(Code::NotFinite, message).at("area").into());
        }
        if let Some(old) = &points.area {
            let step = (cx.size_mm() / size.as_dvec2()).as_vec2();
            let at = |i: u32| (UVec2::new(i % size.x, i / size.x).as_vec2() + 0.5) * step;
            (0..).zip(&mut distance).for_each(|(i, d)| *d = d.min(old.distance_at(at(i))));
        }
        Ok(Area { size, distance, size_mm: cx.size_mm(), periodic: shape.tiling().and(points.periodic) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leather::{ConnectNeighbors, GridPoints, HexPoints};
    use crate::testing::{canvas, outputs, port};
    use shibo_node::Xy;
    use shibo_value::{Lattice, Tiling, Value};

    /// 1 within 10 mm of the middle of the canvas, falling by 1 every mm.
    fn disc() -> Field {
        Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.width());
            for (i, v) in out.plane_mut(0).iter_mut().enumerate() {
                let x = DVec2::new(f64::from(window.x) + (i % width) as f64, f64::from(window.y) + (i / width) as f64);
                let at = grid.origin + (x + 0.5) * grid.step;
                *v = shibo_kernel::ground::number::narrow(10.5 - (at - 16.0).length());
            }
            Ok(())
        })
    }

    fn value(node: &impl Node, inputs: &[Value]) -> Value {
        outputs(node, inputs, &canvas()).unwrap().take("", true).cloned().unwrap()
    }

    fn cut(points: Value) -> Value {
        let node = WorkArea { points: port(0), area: port(1), ..WorkArea::default() };
        value(&node, &[points, Value::Field(disc())])
    }

    fn links(points: Value, neighbors: crate::leather::Neighbors) -> std::sync::Arc<Lattice> {
        match value(&ConnectNeighbors { points: port(0), neighbors }, &[points]) {
            Value::Lattice(lattice) => lattice,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn grids_and_hexagons_keep_their_neighbours() {
        let grid = GridPoints { pitch: Xy::new(1.0, 1.0), jitter: 0.0, ..GridPoints::default() };
        let lattice = links(cut(value(&grid, &[])), crate::leather::Neighbors::Eight);
        assert!((290..330).contains(&lattice.points.len()), "{}", lattice.points.len());
        let longest = (0..lattice.links.len()).map(|l| lattice.span(&lattice.points.positions, l).length());
        assert!(longest.fold(0.0, f32::max) < 1.42);
        let mut degree = vec![0; lattice.points.len()];
        lattice.links.iter().flatten().for_each(|&p| degree[p as usize] += 1);
        assert_eq!(degree.iter().max(), Some(&8));
        let hexes = links(cut(value(&HexPoints::default(), &[])), crate::leather::Neighbors::HexEdges);
        let longest = (0..hexes.links.len()).map(|l| hexes.span(&hexes.points.positions, l).length());
        assert!(longest.fold(0.0, f32::max) < 1.1 && hexes.links.len() > hexes.points.len());
    }

    #[test]
    fn all_points_lie_inside() {
        let Value::Points(points) = cut(value(&GridPoints::default(), &[])) else { panic!() };
        assert!(points.positions.iter().all(|p| (*p - 16.0).length() < 10.2));
        let area = points.area.as_ref().unwrap();
        assert!((area.distance_at(glam::Vec2::new(16.0, 12.0)) - 6.0).abs() < 0.1);
        assert!((area.distance_at(glam::Vec2::new(16.0, 3.0)) + 3.0).abs() < 0.1);
        let nothing = WorkArea { points: port(0), area: port(1), threshold: 99.0 };
        let inputs = [value(&GridPoints::default(), &[]), Value::Field(disc())];
        assert!(matches!(outputs(&nothing, &inputs, &canvas()), Err(Stop::Failed(p)) if p.code == Code::BadValue));
    }
}
