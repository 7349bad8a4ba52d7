//! Means of scattered values on a surface, as a function of a position and its normal, so that both sides of a border
//! between charts get the same values.
//!
//! Each value has the smooth weight `(1 - d²/r²)²` out to the radius r, as in the plane
//! ([`leather::scatter`](crate::leather::scatter)), so constants stay constant and nothing overshoots.
use super::cubes::Cubes;
use glam::Vec3;

/// A value at a point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Position in mm.
    pub place: Vec3,
    /// Normal, of length 1.
    pub normal: Vec3,
    /// Value.
    pub value: f32,
}

/// Values, indexed by their positions.
#[derive(Clone, Debug)]
pub struct Means {
    samples: Vec<Sample>,
    radius: f32,
    cubes: Cubes,
}

impl Means {
    /// Builds the index; values have a reach of `radius` > 0 mm.
    pub fn new(samples: Vec<Sample>, radius: f32) -> Self {
        let cubes = Cubes::new(samples.iter().map(|sample| (sample.place, radius)), 2.0 * radius);
        Self { samples, radius, cubes }
    }

    /// Fills `out` with the means around positions with these normals; `empty` if no value is in reach.
    pub fn fill(&self, places: [&[f32]; 3], normals: [&[f32]; 3], empty: f32, out: &mut [f32]) {
        self.cubes.around(places, |n, place, list| {
            let normal = Vec3::from_array(normals.map(|plane| plane[n]));
            out[n] = self.mean(list, place, normal).unwrap_or(empty);
        });
    }

    fn mean(&self, list: &[u32], place: Vec3, normal: Vec3) -> Option<f32> {
        let (mut sum, mut weights) = (0.0, 0.0);
        for sample in list.iter().map(|n| &self.samples[*n as usize]) {
            let left = 1.0 - place.distance_squared(sample.place) / (self.radius * self.radius);
            // The other side of a thin wall does not count.
            if left > 0.0 && sample.normal.dot(normal) > 0.0 {
                sum += left * left * sample.value;
                weights += left * left;
            }
        }
        (weights > 0.0).then(|| sum / weights)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(means: &Means, place: Vec3, normal: Vec3) -> f32 {
        let (p, n) = (place.to_array().map(|v| [v]), normal.to_array().map(|v| [v]));
        let mut out = [0.0];
        means.fill([&p[0], &p[1], &p[2]], [&n[0], &n[1], &n[2]], -1.0, &mut out);
        out[0]
    }

    #[test]
    fn means_are_weighted_by_distance() {
        let sample = |x: f32, value: f32| Sample { place: Vec3::new(x, 0.0, 4.0), normal: Vec3::Z, value };
        let means = Means::new(vec![sample(0.0, 1.0), sample(1.0, 3.0)], 2.0);
        let at = |x: f32| mean(&means, Vec3::new(x, 0.0, 4.0), Vec3::Z);
        assert!((at(0.5) - 2.0).abs() < 1e-6);
        // At 0.2 the weights are (1 - 0.01)² and (1 - 0.16)².
        let (near, far) = (0.99_f32 * 0.99, 0.84_f32 * 0.84);
        assert!((at(0.2) - (near + 3.0 * far) / (near + far)).abs() < 1e-5);
        assert_eq!((at(-1.5), at(2.5), at(3.1)), (1.0, 3.0, -1.0));
        assert_eq!(mean(&means, Vec3::new(0.5, 0.0, 4.0), -Vec3::Z), -1.0);
    }
}
