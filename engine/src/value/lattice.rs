//! Points with links, and springs on them.
use super::Points;
use glam::{UVec2, Vec2};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How the links of a regular lattice were chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum GridLinks {
    /// To the 4 nearest neighbours.
    Four,
    /// To the 8 nearest neighbours.
    Eight,
    /// Along the edges of hexagons.
    HexEdges,
}

/// Points and links between them. A link outlives the motion of its ends and the breaking of its spring.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lattice {
    /// The points.
    pub points: Arc<Points>,
    /// Pairs of point indices.
    pub links: Arc<Vec<[u32; 2]>>,
    /// By how many canvases the second end of each link is shifted; empty if none is.
    pub offsets: Arc<Vec<[i8; 2]>>,
    /// Present when the links are those of a regular layout, or of the part of it that is left.
    pub grid: Option<GridLinks>,
    /// After a simulation: the velocity of each point in mm per unit of time.
    pub velocities: Option<Vec<Vec2>>,
    /// After a simulation: links whose springs broke, and the step at which they did, by step.
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

    /// For each link, whether its spring is intact.
    pub fn alive(&self) -> Vec<bool> {
        let mut alive = vec![true; self.links.len()];
        for &(link, _) in &self.broken {
            if let Some(a) = alive.get_mut(link as usize) {
                *a = false;
            }
        }
        alive
    }

    /// The memory it takes, its points included.
    pub fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.points.bytes()
            + self.links.len() * 8
            + self.offsets.len() * 2
            + self.velocities.as_ref().map_or(0, |v| v.len() * 8)
            + self.broken.len() * 8
    }
}

/// A lattice whose links are springs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SpringNet {
    /// The points and links.
    pub lattice: Arc<Lattice>,
    /// Stiffness of each link's spring.
    pub stiffness: Vec<f32>,
    /// Length at rest of each link's spring in mm; may be negative.
    pub rest_length: Vec<f32>,
    /// Mass of each point; empty if all are 1.
    pub mass: Vec<f32>,
    /// Damping of each spring: a force against the speed at which it grows, times that speed; empty if there is none.
    pub damping: Vec<f32>,
    /// Present when masses follow the points' places during the motion; `mass` then holds those at the start.
    pub live_mass: Option<Arc<LiveMass>>,
}

/// Masses that are read anew at the points' places in every step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LiveMass {
    /// Columns and rows of samples over the canvas.
    pub size: UVec2,
    /// The scalar by rows.
    pub values: Vec<f32>,
    /// Masses where the scalar is 0 and where it is 1.
    pub mass: [f32; 2],
    /// Whether the scalars of all samples within `near` are summed up rather than averaged.
    pub sum: bool,
    /// Radius in mm around a point whose samples count; the sample at the point alone, if it is `None`.
    pub near: Option<f32>,
}

impl SpringNet {
    /// The memory it takes, its lattice included.
    pub fn bytes(&self) -> usize {
        let live = self.live_mass.as_ref().map_or(0, |live| live.values.len());
        let numbers = self.stiffness.len() + self.rest_length.len() + self.mass.len() + self.damping.len() + live;
        size_of::<Self>() + self.lattice.bytes() + 4 * numbers
    }
}
