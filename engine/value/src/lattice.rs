//! Points with links.
use super::{Number, Object, Points, Shapes, Sketch, data};
use glam::Vec2;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A lattice whose points form a grid, row by row, and whose links connect points only to the next point of the row and
/// to the one below.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GridLinks {
    /// Points in a row.
    pub columns: u32,
    /// Rows.
    pub rows: u32,
    /// True if there are diagonal links too.
    pub diagonals: bool,
}

/// Points and links between them. A link remains when its ends move and when its spring breaks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lattice {
    /// The points.
    pub points: Arc<Points>,
    /// Pairs of point indices.
    pub links: Arc<Vec<[u32; 2]>>,
    /// The shift of the second end of each link in canvases; empty if no end is shifted.
    pub offsets: Arc<Vec<[i8; 2]>>,
    /// True if the links are those of a regular layout, or of a part of one.
    pub regular: bool,
    /// Present if the lattice is a complete grid.
    pub grid: Option<GridLinks>,
    /// After a simulation: the velocity of each point in mm per unit of time.
    pub velocities: Option<Vec<Vec2>>,
    /// After a simulation: links whose springs broke, with the step of the break, sorted by step.
    pub broken: Vec<(u32, u32)>,
}

impl Lattice {
    /// The vector from the first to the second end of `link`, for ends at `positions`.
    pub fn span(&self, positions: &[Vec2], link: usize) -> Vec2 {
        let [i, j] = self.links[link];
        let shift = self
            .offsets
            .get(link)
            .map_or(Vec2::ZERO, |o| Vec2::new(f32::from(o[0]), f32::from(o[1])) * self.points.size_mm.as_vec2());
        positions[j as usize] + shift - positions[i as usize]
    }

    /// For each link, true if its spring is intact.
    pub fn alive(&self) -> Vec<bool> {
        let mut alive = vec![true; self.links.len()];
        for &(link, _) in &self.broken {
            if let Some(a) = alive.get_mut(link as usize) {
                *a = false;
            }
        }
        alive
    }
}

/// The printed data of a lattice.
#[derive(Serialize)]
pub(super) struct LatticeData<'l> {
    points: Vec<[Number; 2]>,
    links: &'l [[u32; 2]],
    alive: Vec<bool>,
    /// The shift of the second end of each link in canvases, on canvases that tile.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    offsets: &'l [[i8; 2]],
    /// After a simulation only.
    #[serde(skip_serializing_if = "Option::is_none")]
    velocities: Option<Vec<[Number; 2]>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    broken: Option<&'l [(u32, u32)]>,
}

impl<'l> LatticeData<'l> {
    pub(super) fn of(lattice: &'l Lattice) -> Self {
        Self {
            points: data::pairs(&lattice.points.positions),
            links: &lattice.links,
            alive: lattice.alive(),
            offsets: &lattice.offsets,
            velocities: lattice.velocities.as_deref().map(data::pairs),
            broken: lattice.velocities.is_some().then_some(&lattice.broken[..]),
        }
    }
}

impl Object for Lattice {
    fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.points.bytes()
            + self.links.len() * 8
            + self.offsets.len() * 2
            + self.velocities.as_ref().map_or(0, |v| v.len() * 8)
            + self.broken.len() * 8
    }

    fn data(&self) -> impl Serialize {
        LatticeData::of(self)
    }

    /// Its links.
    fn sketch(&self) -> Option<Sketch> {
        let (alive, positions) = (self.alive(), &self.points.positions);
        let links = Shapes::<Vec2>::thinned(self.links.len());
        let line = |link: usize| {
            let a = positions[self.links[link][0] as usize];
            [a, a + self.span(positions, link)]
        };
        Some(Sketch::Canvas(Shapes {
            lines: links.clone().map(line).collect(),
            broken: links.map(|link| !alive[link]).collect(),
            counts: vec![(self.links.len(), "links")],
            ..Shapes::default()
        }))
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::Value;
    use glam::DVec2;
    use serde_json::{Value as Json, json};

    pub(crate) fn json(value: impl Into<Value>) -> Json {
        serde_json::to_value(value.into().data()).unwrap()
    }

    /// Two points and a link.
    pub(crate) fn link() -> Lattice {
        let points = Points {
            positions: vec![Vec2::ZERO, Vec2::new(0.5, f32::INFINITY)],
            size_mm: DVec2::ONE,
            pitch: 1.0,
            ..Points::default()
        };
        Lattice { points: Arc::new(points), links: Arc::new(vec![[0, 1]]), ..Lattice::default() }
    }

    #[test]
    fn prints_velocities_and_breaks_only_after_a_simulation() {
        let mut lattice = link();
        let plain =
            json!({ "type": "Lattice", "points": [[0.0, 0.0], [0.5, "inf"]], "links": [[0, 1]], "alive": [true] });
        assert_eq!(json(lattice.clone()), plain);
        lattice.velocities = Some(vec![Vec2::ONE; 2]);
        lattice.broken = vec![(0, 7)];
        let simulated = json(lattice);
        assert_eq!(simulated["velocities"], json!([[1.0, 1.0], [1.0, 1.0]]));
        assert_eq!((&simulated["broken"], &simulated["alive"]), (&json!([[0, 7]]), &json!([false])));
    }

    #[test]
    fn links_are_drawn_across_the_edge() {
        let points = Points {
            positions: vec![Vec2::new(0.9, 0.5), Vec2::new(0.1, 0.5)],
            size_mm: DVec2::ONE,
            ..Points::default()
        };
        let lattice = Lattice {
            points: Arc::new(points),
            links: Arc::new(vec![[0, 1], [1, 0]]),
            offsets: Arc::new(vec![[1, 0], [0, 0]]),
            broken: vec![(1, 3)],
            ..Lattice::default()
        };
        let Some(Sketch::Canvas(shapes)) = lattice.sketch() else { panic!("no lines") };
        assert_eq!(shapes.lines[0], [Vec2::new(0.9, 0.5), Vec2::new(1.1, 0.5)]);
        assert_eq!((shapes.broken, shapes.counts), (vec![false, true], vec![(2, "links")]));
    }
}
