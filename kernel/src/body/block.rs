//! The triangles of a block of samples.
use super::patch::Spot;

/// The triangles of a block.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Mesh {
    /// The samples that are vertices.
    pub(super) spots: Vec<Spot>,
    /// The heights of these samples.
    pub(super) heights: Vec<f32>,
    /// Numbers of vertices, in the order in which x turns to y: clockwise in the picture.
    pub(super) triangles: Vec<[u16; 3]>,
    /// Number of intervals between samples in each direction.
    pub(super) size: [u8; 2],
}

impl Mesh {
    /// The vertices between the ends of each side, rising: top, bottom, left, right.
    pub(super) fn on_sides(&self) -> [Vec<u8>; 4] {
        let mut sides = [const { Vec::new() }; 4];
        let [width, height] = self.size;
        for [column, row] in &self.spots {
            let inner = (0..width).contains(column) && *column > 0;
            if inner && *row == 0 {
                sides[0].push(*column);
            } else if inner && *row == height {
                sides[1].push(*column);
            } else if *row > 0 && *row < height && *column == 0 {
                sides[2].push(*row);
            } else if *row > 0 && *row < height && *column == width {
                sides[3].push(*row);
            }
        }
        sides.iter_mut().for_each(|side| side.sort_unstable());
        sides
    }
}
