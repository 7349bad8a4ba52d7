//! Fields that depend on measurements of whole pieces.
use super::whole::{picture, whole};
use glam::{DVec2, UVec2};
use shibo_kernel::region::axes::Picture;
use shibo_kernel::region::pieces::{Pieces, find, runs};
use shibo_value::{Field, FieldSource, Given, Grid, Pictures, Read, Stop, Tile, Tiling, Type, Window};

/// A field that depends on `N` measured numbers of each piece.
pub(super) struct PerPiece<const N: usize, M, F> {
    /// The numbers of the pieces.
    pub(super) ids: Field,
    /// Another field to measure.
    pub(super) input: Option<Field>,
    /// The canvas, mm.
    pub(super) size: DVec2,
    /// Measures the numbers of each piece.
    pub(super) measure: M,
    /// The value of a pixel, from the numbers of its piece and its place on the canvas in mm.
    pub(super) value: F,
}

impl<const N: usize, M, F> PerPiece<N, M, F>
where
    M: Fn(&Picture<'_>, &Pieces, Option<&Tile>) -> Vec<[f32; N]> + Send + Sync + 'static,
    F: Fn(&[f32; N], DVec2) -> [f32; 3] + Send + Sync + 'static,
{
    /// The field, of a type with at most three channels.
    pub(super) fn field(self, ty: Type) -> Field {
        Field::new(ty, self.tiling(), self)
    }

    fn tiling(&self) -> Tiling {
        self.input.as_ref().map_or(Tiling::BOTH, Field::tiling).and(self.ids.tiling())
    }
}

impl<const N: usize, M, F> FieldSource for PerPiece<N, M, F>
where
    M: Fn(&Picture<'_>, &Pieces, Option<&Tile>) -> Vec<[f32; N]> + Send + Sync,
    F: Fn(&[f32; N], DVec2) -> [f32; 3] + Send + Sync,
{
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.ids, grid, window)]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let Some(table) = given.prepared().filter(|table| !table.window.is_empty()) else { return Ok(()) };
        let (grid, window, width) = (out.grid, out.window, out.width());
        let mut planes = out.planes_mut();
        for (row, y) in (window.y..window.bottom()).enumerate() {
            let ids = given.tile(0).row(0, row);
            runs(ids, |from, to| {
                let piece = find(table.plane(0), ids[from]);
                let known: [f32; N] = std::array::from_fn(|k| table.plane(k + 1)[piece]);
                for (k, x) in (from..to).zip(window.x + i32::try_from(from).unwrap_or(0)..) {
                    let value = (self.value)(&known, grid.center(x, y));
                    planes.iter_mut().zip(value).for_each(|(plane, value)| plane[row * width + k] = value);
                }
            });
        }
        Ok(())
    }

    fn whole(&self, grid: &Grid) -> Vec<Read<'_>> {
        let (grid, window) = whole(self.size, grid, None);
        [Some(&self.ids), self.input.as_ref()].into_iter().flatten().map(|f| Read::new(f, &grid, window)).collect()
    }

    fn prepare(&self, grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        let (grid, window) = whole(self.size, grid, None);
        let ids = pictures.read(0, window)?;
        let input = self.input.as_ref().map(|_| pictures.read(1, window)).transpose()?;
        pictures.check()?;
        let pieces = Pieces::of(ids.plane(0));
        let known = (self.measure)(&picture(ids.plane(0), &grid, self.ids.tiling()), &pieces, input.as_ref());
        let count = u32::try_from(pieces.ids.len()).unwrap_or(u32::MAX);
        let mut table = Tile::new(grid, Window { x: 0, y: 0, width: count, height: 1 }, N + 1);
        table.plane_mut(0).copy_from_slice(&pieces.ids);
        for k in 0..N {
            table.plane_mut(k + 1).iter_mut().zip(&known).for_each(|(cell, known)| *cell = known[k]);
        }
        Ok(Some(table))
    }

    fn prepare_bytes(&self, grid: &Grid) -> u64 {
        let channels = 1 + self.input.as_ref().map_or(0, Field::channels);
        let window = whole(self.size, grid, None).1;
        of_pieces(UVec2::new(window.width, window.height), channels as u64)
    }
}

/// Bytes for measuring the pieces of a whole picture; the channels are the numbers of pieces and the channels that are
/// measured.
pub(super) fn of_pieces(pixels: UVec2, channels: u64) -> u64 {
    8 * u64::from(pixels.x) * u64::from(pixels.y) * channels
}
