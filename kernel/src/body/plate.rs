//! A plate: the relief above, a flat bottom, and side walls.
use super::builder::{Builder, Figures, Lay, Receiver, Vertex, surface};
use super::heights::{Heights, single};
use super::tiles::Tiles;
use std::io;

/// A plate with a relief.
#[derive(Debug)]
pub struct Plate<'a> {
    /// The heights.
    pub heights: &'a Heights<'a>,
    /// The triangles of the relief.
    pub tiles: &'a Tiles,
    /// The distance from the bottom to height 0, in mm.
    pub thickness: f64,
    /// The number of repeats in each direction. More than one is possible only where the field repeats.
    pub repeats: [usize; 2],
    /// The slope in degrees above which facets count as too steep.
    pub steepest: f64,
}

impl Plate<'_> {
    /// Number of triangles of a plate with this relief.
    pub fn triangles(tiles: &Tiles, [across, down]: [usize; 2]) -> u64 {
        let [across, down] = [across as u64, down as u64];
        let [top, bottom, left, right] = tiles.rims();
        across * down * tiles.triangles() + 3 * (across * (top + bottom) + down * (left + right))
    }

    /// The place of a sample with a height, counted through all repeats.
    fn place(&self, column: usize, row: usize, height_mm: f32) -> [f32; 3] {
        let size = self.heights.size();
        let of = |at: usize, axis: usize| {
            let tile = (at / (size[axis] - 1)).min(self.repeats[axis] - 1);
            (tile, at - tile * (size[axis] - 1))
        };
        let ((tile_x, x), (tile_y, y)) = (of(column, 0), of(row, 1));
        let ([left, top], [width, height]) = (self.heights.place(x, y), self.heights.size_mm());
        let all = self.repeats[1] as f64 * height;
        let z = self.thickness + f64::from(height_mm);
        [single(tile_x as f64 * width + left), single(all - (tile_y as f64 * height + top)), single(z)]
    }

    /// Hands the plate out. It lies on z = 0, over x ≥ 0 and y ≥ 0, and looks like the picture from above.
    ///
    /// # Errors
    /// Those of the receiver.
    pub fn build(&self, receiver: &mut dyn Receiver) -> io::Result<Figures> {
        let mut builder = Builder::new(receiver, self.steepest);
        let lay = Lay {
            repeats: self.repeats,
            closed: false,
            place: &|column, row, height| self.place(column, row, height),
            up: &|_| [0.0, 0.0, 1.0],
        };
        let rims = surface(self.tiles, &lay, &mut builder)?;
        // Counter-clockwise from above, each corner once.
        let open = |rim: &[(usize, Vertex)], reverse: bool| {
            let mut rim: Vec<Vertex> = rim.iter().map(|(_, vertex)| *vertex).collect();
            if reverse {
                rim.reverse();
            }
            rim.pop();
            rim
        };
        let rim = [open(&rims.bottom, false), open(&rims.right, true), open(&rims.top, true), open(&rims.left, false)];
        let rim = rim.concat();
        let mut feet = Vec::with_capacity(rim.len());
        for vertex in &rim {
            feet.push(builder.vertex([vertex.at[0], vertex.at[1], 0.0])?);
        }
        let [width, height] = self.heights.size_mm();
        let middle = [0.5 * self.repeats[0] as f64 * width, 0.5 * self.repeats[1] as f64 * height].map(single);
        let middle = builder.vertex([middle[0], middle[1], 0.0])?;
        for (at, (top, foot)) in rim.iter().zip(&feet).enumerate() {
            let beside = (at + 1) % rim.len();
            builder.triangle([*foot, feet[beside], rim[beside]])?;
            builder.triangle([*foot, rim[beside], *top])?;
        }
        for (at, foot) in feet.iter().enumerate() {
            builder.triangle([middle, feet[(at + 1) % feet.len()], *foot])?;
        }
        Ok(builder.finish())
    }
}
