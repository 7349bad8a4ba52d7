//! One of several fields at every pixel, selected by the value of another field: the core of `Each`,
//! [`Switch`](crate::combine::Switch) and the pieces of [`CutPlane`](crate::wood::CutPlane). Of each input a tile
//! computes only the part that shows in it.
use shibo_value::{Cost, Field, FieldSource, Given, Grid, Read, Stop, Tile, Type, Window};

/// Index of the input that shows where the selecting field has a value.
type Choice = Box<dyn Fn(f32) -> usize + Send + Sync>;

/// For each of `count` inputs, the smallest window of the pixels of a tile of ids where that input shows; empty where
/// it does not show.
fn shown(ids: &Tile, at: Window, count: usize, choice: &Choice) -> Vec<Window> {
    let mut found: Vec<Option<[i32; 4]>> = vec![None; count];
    // Pieces are larger than pixels, so most pixels have the id of the one before.
    let mut last = (f32::NAN, 0);
    for (y, row) in (at.y..at.bottom()).enumerate() {
        for (x, id) in (at.x..at.right()).zip(ids.row(0, y)) {
            if *id != last.0 {
                last = (*id, choice(*id));
            }
            let [left, top, right, bottom] = found[last.1].get_or_insert([x, row, x, row]);
            (*left, *top, *right, *bottom) = ((*left).min(x), (*top).min(row), (*right).max(x), (*bottom).max(row));
        }
    }
    let empty = Window { x: at.x, y: at.y, width: 0, height: 0 };
    let window = |[left, top, right, bottom]: [i32; 4]| Window {
        x: left,
        y: top,
        width: (right - left).unsigned_abs() + 1,
        height: (bottom - top).unsigned_abs() + 1,
    };
    found.into_iter().map(|found| found.map_or(empty, window)).collect()
}

/// The selected field, pixel by pixel.
pub(crate) struct Chosen {
    ids: Field,
    inputs: Vec<Field>,
    choice: Choice,
}

impl Chosen {
    /// Fields of one type, of which one shows at each pixel, selected by the value of the field of ids there.
    pub(crate) fn field(
        ids: &Field,
        inputs: Vec<Field>,
        choice: impl Fn(f32) -> usize + Send + Sync + 'static,
    ) -> Field {
        let Some(first) = inputs.first() else { return Field::constant(Type::Gray, &[0.0]) };
        if inputs.len() == 1 {
            return first.clone();
        }
        if let Some([id]) = ids.as_constant() {
            return inputs.get(choice(*id)).unwrap_or(first).clone();
        }
        let tiling = inputs.iter().fold(ids.tiling(), |tiling, input| tiling.and(input.tiling()));
        Field::new(first.ty(), tiling, Self { ids: ids.clone(), inputs, choice: Box::new(choice) })
    }
}

impl FieldSource for Chosen {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.ids, grid, window)]
    }

    fn later(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.inputs.iter().map(|input| Read::new(input, grid, window)).collect()
    }

    fn narrow(&self, given: &Given<'_>, _grid: &Grid, window: Window) -> Vec<Window> {
        shown(given.tile(0), window, self.inputs.len(), &self.choice)
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (ids, at) = (given.tile(0), out.window);
        let channels = out.channels();
        for (y, line) in (at.y..at.bottom()).enumerate() {
            let ids = ids.row(0, y);
            let mut x = 0;
            while x < ids.len() {
                // A run of pixels of one piece is copied at once.
                let run = ids[x..].iter().take_while(|id| **id == ids[x]).count().max(1);
                let input = given.tile(1 + (self.choice)(ids[x]));
                // The window of an input begins where it first shows.
                let row = (line - input.window.y).unsigned_abs() as usize;
                let from = (at.x - input.window.x + i32::try_from(x).unwrap_or_default()).unsigned_abs() as usize;
                for channel in 0..channels {
                    let width = at.width as usize;
                    let to = &mut out.plane_mut(channel)[y * width + x..y * width + x + run];
                    to.copy_from_slice(&input.row(channel, row)[from..from + run]);
                }
                x += run;
            }
        }
        Ok(())
    }

    fn cost(&self) -> Cost {
        Cost::Local
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_each_input_only_where_it_shows() {
        let window = Window { x: 10, y: 20, width: 4, height: 2 };
        let mut ids = Tile::new(crate::testing::canvas().grid(glam::UVec2::splat(64)), window, 1);
        // Two numbers that choose different inputs of three.
        let other = 2.0;
        let choice: Choice = Box::new(|id| if id == 2.0 { 1 } else { 0 });
        ids.data_mut().copy_from_slice(&[0.0, 0.0, other, 0.0, 0.0, 0.0, other, other]);
        let windows = shown(&ids, window, 3, &choice);
        assert_eq!(windows[0], window);
        assert_eq!(windows[1], Window { x: 12, y: 20, width: 2, height: 2 });
        assert_eq!(windows.iter().filter(|window| window.is_empty()).count(), 1);
    }
}
