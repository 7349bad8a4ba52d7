//! Parts of the canvas, of any shape.
use super::Tiling;
use glam::{DVec2, IVec2, UVec2, Vec2};
use serde::{Deserialize, Serialize};

/// A part of the canvas, stored as distances to its contour.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Area {
    /// Columns and rows of samples over the canvas.
    pub size: UVec2,
    /// Distances to the contour in mm at the centres of equal cells, row by row; positive inside, negative outside.
    pub distance: Vec<f32>,
    /// The canvas in mm.
    pub size_mm: DVec2,
    /// The directions in which the shape repeats with the canvas.
    pub periodic: Tiling,
}

impl Area {
    /// Distance in mm from a point to the contour, interpolated linearly; positive inside, negative outside.
    pub fn distance_at(&self, place: Vec2) -> f32 {
        let at = (place.as_dvec2() / self.size_mm * self.size.as_dvec2()).as_vec2() - 0.5;
        let (cell, t) = (at.floor().as_ivec2(), at - at.floor());
        let row = |y: i32| {
            let (a, b) = (self.sample(cell + IVec2::new(0, y)), self.sample(cell + IVec2::new(1, y)));
            a + (b - a) * t.x
        };
        let (top, bottom) = (row(0), row(1));
        top + (bottom - top) * t.y
    }

    /// The size of a sample in mm.
    pub fn step(&self) -> Vec2 {
        (self.size_mm / self.size.as_dvec2()).as_vec2()
    }

    fn sample(&self, at: IVec2) -> f32 {
        let fit = |at: i32, count: u32, periodic: bool| {
            let count = i64::from(count.max(1));
            let at = i64::from(at);
            usize::try_from(if periodic { at.rem_euclid(count) } else { at.clamp(0, count - 1) }).unwrap_or(0)
        };
        let x = fit(at.x, self.size.x, self.periodic.x);
        let y = fit(at.y, self.size.y, self.periodic.y);
        self.distance.get(y * self.size.x as usize + x).copied().unwrap_or(0.0)
    }

    /// The memory it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + 4 * self.distance.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_linear_between_samples() {
        let distance = (0..16).map(|i| (i % 4) as f32 - 1.0).collect();
        let size_mm = DVec2::splat(8.0);
        let area = Area { size: UVec2::splat(4), distance, size_mm, periodic: Tiling::NONE };
        assert_eq!(area.distance_at(Vec2::new(3.0, 5.0)), 0.0);
        assert_eq!(area.distance_at(Vec2::new(4.0, 1.0)), 0.5);
        assert_eq!(area.distance_at(Vec2::new(-9.0, 99.0)), -1.0);
        let area = Area { periodic: Tiling::BOTH, ..area };
        assert_eq!(area.distance_at(Vec2::new(11.0, 5.0)), 0.0);
    }
}
