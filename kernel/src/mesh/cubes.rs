//! Spatial index of small objects, by cubes.
use glam::Vec3;
use std::collections::HashMap;

/// Objects by the cubes that they reach into.
#[derive(Clone, Debug)]
pub struct Cubes {
    side: f32,
    /// For each cube the offset of its objects in `order`, and their number.
    cells: HashMap<[i32; 3], (u32, u32)>,
    order: Vec<u32>,
}

impl Cubes {
    /// Sorts objects, each within `reach` mm of its middle, into cubes of `side` mm.
    pub fn new(things: impl Iterator<Item = (Vec3, f32)>, side: f32) -> Self {
        let mut lists: HashMap<[i32; 3], Vec<u32>> = HashMap::new();
        for (n, (middle, reach)) in (0..).zip(things) {
            let [low, high] = [middle - reach, middle + reach].map(|p| cell(p, side));
            for z in low[2]..=high[2] {
                for y in low[1]..=high[1] {
                    for x in low[0]..=high[0] {
                        lists.entry([x, y, z]).or_default().push(n);
                    }
                }
            }
        }
        let mut lists: Vec<([i32; 3], Vec<u32>)> = lists.into_iter().collect();
        lists.sort_unstable();
        let (mut cells, mut order) = (HashMap::with_capacity(lists.len()), Vec::new());
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        for (cell, list) in lists {
            cells.insert(cell, (count(order.len()), count(list.len())));
            order.extend(list);
        }
        Self { side, cells, order }
    }

    /// Calls `each` for every position, with its index and the objects that reach into its cube, in their order.
    /// Consecutive positions should be close to each other.
    pub fn around(&self, places: [&[f32]; 3], mut each: impl FnMut(usize, Vec3, &[u32])) {
        let mut known: Option<([i32; 3], &[u32])> = None;
        for n in 0..places[0].len() {
            let place = Vec3::from_array(places.map(|plane| plane[n]));
            let at = cell(place, self.side);
            let list = match known {
                Some((before, list)) if before == at => list,
                _ => self.in_cell(at),
            };
            known = Some((at, list));
            each(n, place, list);
        }
    }

    fn in_cell(&self, at: [i32; 3]) -> &[u32] {
        self.cells.get(&at).map_or(&[][..], |(from, count)| &self.order[*from as usize..(*from + *count) as usize])
    }

    /// Memory use in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.order) + self.cells.len() * 24
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a place in cubes")]
fn cell(place: Vec3, side: f32) -> [i32; 3] {
    (place / side).floor().to_array().map(|x| x as i32)
}
