//! Trees: a skeleton, and how fast it grew.
use super::{Number, Object, Skeleton, Sketch};
use serde::{Deserialize, Serialize};

/// A tree: its trunk and branches, and the speeds of its growth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tree {
    /// The trunk and its branches.
    pub skeleton: Skeleton,
    /// Growth in height in mm per year; above 0.
    pub elongation_speed: f64,
    /// Growth in radius in mm per year; above 0.
    pub thickening_speed: f64,
    /// The height in mm at which the tree starts to grow.
    pub ground: f64,
}

impl Tree {
    /// Growth in height, in mm per year, of a tree that is given by its skeleton only.
    pub const ELONGATION: f64 = 230.0;
    /// Growth in radius, in mm per year, of a tree that is given by its skeleton only.
    pub const THICKENING: f64 = 2.6;
}

impl From<Skeleton> for Tree {
    /// The tree with this skeleton and the usual speeds, which starts to grow at height 0.
    fn from(skeleton: Skeleton) -> Self {
        Self { skeleton, elongation_speed: Self::ELONGATION, thickening_speed: Self::THICKENING, ground: 0.0 }
    }
}

#[derive(Serialize)]
struct TreeData<T> {
    elongation_speed: Number<f64>,
    thickening_speed: Number<f64>,
    ground: Number<f64>,
    skeleton: T,
}

impl Object for Tree {
    fn bytes(&self) -> usize {
        self.skeleton.bytes() + size_of::<Self>() - size_of::<Skeleton>()
    }

    fn data(&self) -> impl Serialize {
        TreeData {
            elongation_speed: Number(self.elongation_speed),
            thickening_speed: Number(self.thickening_speed),
            ground: Number(self.ground),
            skeleton: self.skeleton.data(),
        }
    }

    fn sketch(&self) -> Option<Sketch> {
        self.skeleton.sketch()
    }
}
