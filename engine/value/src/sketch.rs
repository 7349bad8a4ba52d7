//! Sketches of objects: simple shapes for display.
use super::Type;
use glam::{DVec3, Vec2};

/// The sketch of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum Sketch {
    /// Points and lines on the canvas, in mm.
    Canvas(Shapes<Vec2>),
    /// Points and lines in space, in mm; z points up.
    Space(Shapes<DVec3>),
    /// A picture with its own pixels, without a position on the canvas.
    Pixels(Pixels),
}

/// Points and lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shapes<P> {
    /// Points, thinned out if there are too many.
    pub points: Vec<P>,
    /// Lines, thinned out in the same way.
    pub lines: Vec<[P; 2]>,
    /// For each line, true if the thing that it shows is broken; empty if things cannot break.
    pub broken: Vec<bool>,
    /// Counts with their nouns, such as 12 and `links`.
    pub counts: Vec<(usize, &'static str)>,
}

impl<P> Shapes<P> {
    /// Maximum number of points or lines of a sketch.
    pub const MOST: usize = 40_000;

    /// Evenly spaced indices below `count`, at most [`MOST`](Self::MOST).
    pub fn thinned(count: usize) -> impl ExactSizeIterator<Item = usize> + Clone {
        (0..count).step_by(count.div_ceil(Self::MOST).max(1))
    }
}

impl Shapes<DVec3> {
    /// The bounding box of all finite points.
    pub fn extent(&self) -> Option<(DVec3, DVec3)> {
        let ends = self.lines.iter().flatten().chain(&self.points).filter(|p| p.is_finite());
        ends.map(|p| (*p, *p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }
}

/// A picture with its own pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Pixels {
    ty: Type,
    size: [usize; 2],
    planes: Vec<f32>,
}

impl Pixels {
    /// A picture of `size` pixels, one plane after another, with the channels of a field of type `ty`. `None` without
    /// pixels, or if the planes are incomplete.
    pub fn new(ty: Type, size: [usize; 2], planes: Vec<f32>) -> Option<Self> {
        let pixels = size[0] * size[1];
        let whole = pixels > 0 && planes.len() >= pixels && planes.len().is_multiple_of(pixels);
        whole.then_some(Self { ty, size, planes })
    }

    /// Type of the values.
    pub const fn ty(&self) -> Type {
        self.ty
    }

    /// Columns and rows.
    pub const fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The planes, row by row.
    pub fn planes(&self) -> impl ExactSizeIterator<Item = &[f32]> {
        self.planes.chunks_exact(self.size[0] * self.size[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thins_out_many_points() {
        assert_eq!(Shapes::<Vec2>::thinned(5).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        let many = Shapes::<Vec2>::thinned(100_000);
        assert_eq!((many.len(), many.clone().nth(1)), (33_334, Some(3)));
        assert_eq!(Shapes::<Vec2>::thinned(0).len(), 0);
    }

    #[test]
    fn pixels_are_whole_planes() {
        assert!(Pixels::new(Type::Gray, [0, 0], Vec::new()).is_none());
        assert!(Pixels::new(Type::Rgb, [2, 2], vec![0.0; 11]).is_none());
        assert_eq!(Pixels::new(Type::Rgb, [2, 2], vec![0.0; 12]).unwrap().planes().len(), 3);
    }
}
