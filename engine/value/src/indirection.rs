//! Indirection maps: the neighbours on the surface of the pixels of an atlas.
use super::{Atlas, Number, Object, Pixels, Sketch, Type};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A reference to a pixel that stands for a position on the surface, with the offset of that position from the pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Jump {
    /// Index of the pixel, row by row; see [`NONE`](Self::NONE).
    pub to: u32,
    /// Offset of the position from the pixel's centre, in 1/4096 of a pixel.
    pub residue: [i16; 2],
}

/// A pixel's neighbours in the order of `OCTANTS`: +x, then in eighths of a turn towards +y.
pub type Jump8 = [Jump; 8];

impl Jump {
    /// No pixel: the surface ends there.
    pub const NONE: Self = Self { to: u32::MAX, residue: [0; 2] };

    /// Number of steps of a residue per pixel.
    pub const STEPS: f32 = 4096.0;

    /// True if there is a pixel.
    pub const fn is_some(self) -> bool {
        self.to != u32::MAX
    }

    /// The residue in pixels.
    #[inline(always)]
    pub fn offset(self) -> [f32; 2] {
        self.residue.map(|v| f32::from(v) / Self::STEPS)
    }
}

/// The starting point for the coordinates of a pixel, if it is not the pixel around it in the next coarser level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Parent {
    /// The pixel.
    pub pixel: u32,
    /// Position of its parent in the coarser level or, if `still`, the position of the pixel itself there.
    pub jump: Jump,
    /// True if `jump` is the position of the pixel itself.
    pub still: bool,
}

/// A level of an [`IndirectionMap`]: the pixels of an atlas at one spacing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct IndirectionLevel {
    /// Spacing in finest pixels.
    pub h: u32,
    /// Columns and rows.
    pub size: [u32; 2],
    /// For each pixel the index of the triangle at its centre, plus one; 0 if there is none. [`BORDER`](Self::BORDER)
    /// is set for pixels that have an entry in `jumps`.
    pub owner: Vec<u32>,
    /// Pixels near borders of charts, in ascending order.
    pub border: Vec<u32>,
    /// Neighbours of each of these pixels.
    pub jumps: Vec<Jump8>,
    /// For each row the number of border pixels before it; one more entry holds the total.
    pub rows: Vec<u32>,
    /// Pixels whose parent is not the pixel around them, in ascending order.
    pub parents: Vec<Parent>,
    /// Pixels without an owner next to a pixel with one, and the reference used for each.
    pub ring: Vec<(u32, Jump)>,
}

impl IndirectionLevel {
    /// The bit in `owner` that marks pixels near borders.
    pub const BORDER: u32 = 1 << 31;

    /// The triangle at a pixel's centre.
    #[inline(always)]
    pub fn triangle(&self, pixel: usize) -> Option<usize> {
        (self.owner[pixel] & !Self::BORDER).checked_sub(1).map(|triangle| triangle as usize)
    }

    /// A pixel's neighbours, if it is near a border.
    pub fn jumps(&self, pixel: usize) -> Option<&Jump8> {
        if self.owner[pixel] & Self::BORDER == 0 {
            return None;
        }
        let row = pixel / self.size[0] as usize;
        let (first, last) = (self.rows[row] as usize, self.rows[row + 1] as usize);
        let at = self.border[first..last].binary_search(&u32::try_from(pixel).ok()?).ok()?;
        Some(&self.jumps[first + at])
    }

    /// Number of pixels with an owner.
    pub fn owned(&self) -> usize {
        self.owner.iter().filter(|owner| **owner != 0).count()
    }

    /// The memory it takes.
    pub fn bytes(&self) -> usize {
        size_of::<Self>()
            + size_of_val(&*self.owner)
            + size_of_val(&*self.border)
            + size_of_val(&*self.jumps)
            + size_of_val(&*self.rows)
            + size_of_val(&*self.parents)
            + size_of_val(&*self.ring)
    }
}

/// Neighbours on the surface of the pixels of an atlas, level by level.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IndirectionMap {
    /// The surface.
    pub atlas: Arc<Atlas>,
    /// Columns and rows of the finest level.
    pub size: [u32; 2],
    /// The levels from the finest; each has twice the spacing of the one before.
    pub levels: Vec<IndirectionLevel>,
}

#[derive(Serialize)]
struct JumpData {
    at: [u32; 2],
    to: [u32; 2],
    residue: [Number; 2],
}

#[derive(Serialize)]
struct LevelData {
    h: u32,
    size: [u32; 2],
    owned: usize,
    /// The references of pixels next to a chart but outside of all charts.
    jumps: Vec<JumpData>,
}

#[derive(Serialize)]
struct IndirectionData {
    levels: Vec<LevelData>,
}

impl Object for IndirectionMap {
    fn bytes(&self) -> usize {
        size_of::<Self>() + self.levels.iter().map(IndirectionLevel::bytes).sum::<usize>()
    }

    fn data(&self) -> impl Serialize {
        let level = |level: &IndirectionLevel| {
            let place = |pixel: u32| [pixel % level.size[0], pixel / level.size[0]];
            let found = level.ring.iter().filter(|(_, jump)| jump.is_some());
            let data = |(at, jump): &(u32, Jump)| JumpData {
                at: place(*at),
                to: place(jump.to),
                residue: jump.offset().map(Number),
            };
            LevelData { h: level.h, size: level.size, owned: level.owned(), jumps: found.map(data).collect() }
        };
        IndirectionData { levels: self.levels.iter().map(level).collect() }
    }

    /// The finest level: charts are grey, lighter near their borders; in the ring around them, the colour shows the
    /// target of the reference.
    fn sketch(&self) -> Option<Sketch> {
        let level = self.levels.first()?;
        let [w, h] = level.size.map(|n| n as usize);
        let mut planes = vec![0.0f32; 3 * w * h];
        for (pixel, owner) in level.owner.iter().enumerate() {
            let value = if *owner == 0 {
                0.0
            } else {
                0.35 + 0.25 * f32::from(u8::from(owner & IndirectionLevel::BORDER != 0))
            };
            (0..3).for_each(|c| planes[c * w * h + pixel] = value);
        }
        for (at, jump) in level.ring.iter().filter(|(_, jump)| jump.is_some()) {
            let to = jump.to as usize;
            planes[*at as usize] = (to % w) as f32 / w as f32;
            planes[w * h + *at as usize] = (to / w) as f32 / h as f32;
        }
        Pixels::new(Type::Rgb, [w, h], planes).map(Sketch::Pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn border_pixels_are_found_by_their_row() {
        let jump = |to: u32| [Jump { to, residue: [2048, -4096] }; 8];
        let level = IndirectionLevel {
            h: 1,
            size: [3, 2],
            owner: vec![
                0,
                5 | IndirectionLevel::BORDER,
                5,
                1 | IndirectionLevel::BORDER,
                0,
                7 | IndirectionLevel::BORDER,
            ],
            border: vec![1, 3, 5],
            jumps: [10, 11, 12].map(jump).to_vec(),
            rows: vec![0, 1, 3],
            ring: vec![(4, Jump { to: 2, residue: [0; 2] }), (0, Jump::NONE)],
            ..IndirectionLevel::default()
        };
        assert_eq!([0, 1, 2].map(|p| level.triangle(p)), [None, Some(4), Some(4)]);
        assert_eq!([1, 2, 3, 5].map(|p| level.jumps(p).map(|j| j[0].to)), [Some(10), None, Some(11), Some(12)]);
        assert_eq!((level.owned(), jump(0)[0].offset()), (4, [0.5, -1.0]));
        let map = IndirectionMap { atlas: Arc::new(Atlas::default()), size: [3, 2], levels: vec![level] };
        let data = serde_json::to_value(map.data()).expect("JSON");
        assert_eq!(
            data["levels"][0]["jumps"],
            serde_json::json!([{ "at": [1, 1], "to": [2, 0], "residue": [0.0, 0.0] }])
        );
        assert!(map.sketch().is_some());
    }
}
