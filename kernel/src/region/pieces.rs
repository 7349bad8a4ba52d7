//! Measurements of numbered pieces: area, bounding box, means.
use std::collections::HashMap;

/// The sorted ids of pieces, and their numbers of pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pieces {
    /// Ids, ascending.
    pub ids: Vec<f32>,
    /// Pixels of each.
    pub area: Vec<u64>,
}

/// Narrows an integer below 2^32.
pub(super) fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}

/// Calls `body(from, to)` for runs of pixels with the same id.
pub fn runs(ids: &[f32], mut body: impl FnMut(usize, usize)) {
    let mut from = 0;
    for run in ids.chunk_by(|a, b| a == b) {
        body(from, from + run.len());
        from += run.len();
    }
}

/// Ids below this are counted in a table.
const SMALL: usize = 1 << 18;

impl Pieces {
    /// Finds the pieces of a picture.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to small whole numbers")]
    pub fn of(ids: &[f32]) -> Self {
        // Small integers, which nearly all ids are, are counted in a table; others in a map.
        let mut small: Vec<u64> = Vec::new();
        let mut found: HashMap<u32, u64> = HashMap::new();
        runs(ids, |from, to| {
            let (id, area) = (ids[from], (to - from) as u64);
            let at = id.clamp(0.0, SMALL as f32) as usize;
            if at < SMALL && at as f32 == id {
                if at >= small.len() {
                    small.resize((2 * at + 1).min(SMALL), 0);
                }
                small[at] += area;
            } else {
                *found.entry(id.to_bits()).or_default() += area;
            }
        });
        let mut list: Vec<(f32, u64)> = found.into_iter().map(|(bits, area)| (f32::from_bits(bits), area)).collect();
        list.extend(small.iter().enumerate().filter(|(_, area)| **area > 0).map(|(id, area)| (id as f32, *area)));
        list.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (ids, area) = list.into_iter().unzip();
        Self { ids, area }
    }

    /// Calls `body(piece, y, from, to)` for runs of pixels of a picture with rows of `width`; `piece` is the index in
    /// the list.
    pub fn each(&self, ids: &[f32], width: usize, mut body: impl FnMut(usize, usize, usize, usize)) {
        for (y, row) in ids.chunks_exact(width.max(1)).enumerate() {
            runs(row, |from, to| body(find(&self.ids, row[from]), y, from, to));
        }
    }
}

/// Lower bound of `id` in sorted `ids`.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a float cast saturates")]
pub fn find(ids: &[f32], id: f32) -> usize {
    // For consecutive ids the index follows directly.
    let likely = (id - ids.first().copied().unwrap_or(0.0)) as usize;
    if ids.get(likely) == Some(&id) {
        return likely;
    }
    ids.partition_point(|known| *known < id).min(ids.len().saturating_sub(1))
}

/// Extent of a piece in one direction of a picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reach {
    /// The first pixel.
    pub start: usize,
    /// Number of pixels.
    pub length: usize,
}

/// Extents of pieces in x and in y; in a direction that wraps, the shortest extent, which may cross the border.
pub fn reaches(pieces: &Pieces, ids: &[f32], width: usize, wrap: [bool; 2]) -> [Vec<Reach>; 2] {
    let height = ids.len() / width.max(1);
    let mut ends = [vec![[usize::MAX, 0]; pieces.ids.len()], vec![[usize::MAX, 0]; pieces.ids.len()]];
    pieces.each(ids, width, |piece, y, from, to| {
        let [x_ends, y_ends] = &mut ends;
        x_ends[piece] = [x_ends[piece][0].min(from), x_ends[piece][1].max(to)];
        y_ends[piece] = [y_ends[piece][0].min(y), y_ends[piece][1].max(y + 1)];
    });
    let sides = [width, height];
    std::array::from_fn(|axis| {
        let side = sides[axis];
        // Only a piece that touches both borders may cross: for such pieces the lines of pixels without any of them are
        // found.
        let mut taken: HashMap<usize, Vec<bool>> = HashMap::new();
        for (piece, [start, end]) in ends[axis].iter().enumerate() {
            if wrap[axis] && *start == 0 && *end == side {
                taken.insert(piece, vec![false; side]);
            }
        }
        if !taken.is_empty() {
            pieces.each(ids, width, |piece, y, from, to| {
                if let Some(taken) = taken.get_mut(&piece) {
                    let lines = if axis == 0 { from..to } else { y..y + 1 };
                    taken[lines].fill(true);
                }
            });
        }
        let reach = |(piece, [start, end]): (usize, &[usize; 2])| match taken.get(&piece) {
            Some(taken) => around(taken),
            None => Reach { start: *start, length: end.saturating_sub(*start) },
        };
        ends[axis].iter().enumerate().map(reach).collect()
    })
}

/// The shortest cyclic range that contains all `taken` lines: it begins after the longest gap.
fn around(taken: &[bool]) -> Reach {
    let n = taken.len();
    let (mut longest, mut at) = (0, 0);
    // The first line is taken, so no gap crosses the border.
    let mut from = 0;
    for run in taken.chunk_by(|a, b| a == b) {
        if !run[0] && run.len() > longest {
            (longest, at) = (run.len(), from + run.len());
        }
        from += run.len();
    }
    Reach { start: at % n.max(1), length: n - longest }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_ids_of_all_kinds() {
        // Gaps, fractions, negative and large ids, and both zeros.
        let ids = [3.0, 3.0, -2.0, 0.0, -0.0, 0.5, 16_777_215.0, 3.0, 262_143.0, 262_144.0, 9.0, -2.0];
        let pieces = Pieces::of(&ids);
        assert_eq!(pieces.ids, [-2.0, 0.0, 0.5, 3.0, 9.0, 262_143.0, 262_144.0, 16_777_215.0]);
        assert_eq!(pieces.area, [2, 2, 1, 3, 1, 1, 1, 1]);
        for (place, id) in pieces.ids.iter().enumerate() {
            assert_eq!(find(&pieces.ids, *id), place);
        }
        assert_eq!((find(&pieces.ids, 4.0), find(&pieces.ids, 1e9), find(&[], 1.0)), (4, 7, 0));
        let dense: Vec<f32> = (5_u8..90).map(f32::from).collect();
        assert!(dense.iter().enumerate().all(|(place, id)| find(&dense, *id) == place));
    }

    #[test]
    fn reaches_cross_the_border_where_it_wraps() {
        // Eight pixels a row. The first piece has columns 6, 7, 0 and rows 3 and 0; the second one all of a row.
        let rows = ["10000011", "00000000", "22222222", "00000011"];
        let ids: Vec<f32> = rows.iter().flat_map(|row| row.bytes()).map(|b| f32::from(b - b'0')).collect();
        let pieces = Pieces::of(&ids);
        assert_eq!(pieces.ids, [0.0, 1.0, 2.0]);
        assert_eq!(pieces.area, [19, 5, 8]);
        let reach = |start, length| Reach { start, length };
        let [x, y] = reaches(&pieces, &ids, 8, [true, true]);
        assert_eq!((x[1], y[1]), (reach(6, 3), reach(3, 2)));
        assert_eq!((x[2], y[2]), (reach(0, 8), reach(2, 1)));
        let [x, y] = reaches(&pieces, &ids, 8, [false, true]);
        assert_eq!((x[1], y[1]), (reach(0, 8), reach(3, 2)));
    }
}
