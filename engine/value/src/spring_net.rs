//! Springs.
use super::lattice::LatticeData;
use super::{Lattice, Number, Object, ScalarMap, Sketch, data};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

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
    /// Damping coefficient of each spring: the force that opposes a change of its length, per unit of speed; empty if
    /// there is none.
    pub damping: Vec<f32>,
    /// Present if masses belong to positions on the canvas rather than to points: the mass everywhere. `mass` then
    /// holds the values at the points.
    pub mass_map: Option<Arc<ScalarMap>>,
}

#[derive(Serialize)]
struct SpringNetData<'l> {
    #[serde(flatten)]
    lattice: LatticeData<'l>,
    stiffness: Vec<Number>,
    damping: Vec<Number>,
    rest_length: Vec<Number>,
    mass: Vec<Number>,
}

impl Object for SpringNet {
    fn bytes(&self) -> usize {
        let map = self.mass_map.as_ref().map_or(0, |map| map.bytes());
        let numbers = self.stiffness.len() + self.rest_length.len() + self.mass.len() + self.damping.len();
        size_of::<Self>() + self.lattice.bytes() + 4 * numbers + map
    }

    fn data(&self) -> impl Serialize {
        let one = |_| Number(1.0);
        let none = |_| Number(0.0);
        SpringNetData {
            lattice: LatticeData::of(&self.lattice),
            stiffness: data::numbers(&self.stiffness),
            damping: match self.damping.is_empty() {
                true => self.lattice.links.iter().map(none).collect(),
                false => data::numbers(&self.damping),
            },
            rest_length: data::numbers(&self.rest_length),
            mass: match self.mass.is_empty() {
                true => self.lattice.points.positions.iter().map(one).collect(),
                false => data::numbers(&self.mass),
            },
        }
    }

    /// Its links.
    fn sketch(&self) -> Option<Sketch> {
        self.lattice.sketch()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::tests::{json, link};
    use serde_json::json;

    #[test]
    fn prints_equal_masses_and_dampers() {
        let springs = SpringNet {
            lattice: Arc::new(link()),
            stiffness: vec![2.0],
            rest_length: vec![-0.5],
            ..SpringNet::default()
        };
        let springs = json(springs);
        assert_eq!((&springs["type"], &springs["mass"]), (&json!("SpringNet"), &json!([1.0, 1.0])));
        assert_eq!((&springs["links"], &springs["rest_length"]), (&json!([[0, 1]]), &json!([-0.5])));
        assert_eq!(springs["damping"], json!([0.0]));
    }
}
