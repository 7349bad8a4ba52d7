//! Fields that read one input with a halo and other inputs without.
use shibo_value::{Field, FieldSource, Given, Grid, Halo, Read, Stop, Tile, Tiling, Window};

/// A field that reads one input with a halo and other inputs without.
pub(super) struct Around<F> {
    /// The input that is read with the halo.
    pub(super) input: Field,
    pub(super) halo: Halo,
    /// The inputs that are read without it.
    pub(super) others: Vec<Field>,
    /// Fills a tile from the tiles of the input and of the others.
    pub(super) fill: F,
}

impl<F> Around<F> {
    /// The directions in which all inputs repeat.
    pub(super) fn tiling(&self) -> Tiling {
        self.others.iter().fold(self.input.tiling(), |tiling, other| tiling.and(other.tiling()))
    }
}

impl<F> FieldSource for Around<F>
where
    F: Fn(&mut Tile, &Tile, &[&Tile]) + Send + Sync,
{
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let (dx, dy) = self.halo.pixels(grid);
        let others = self.others.iter().map(|field| Read::new(field, grid, window));
        std::iter::once(Read::new(&self.input, grid, window.grow(dx, dy))).chain(others).collect()
    }

    fn reaches_by(&self) -> Option<&'static str> {
        self.halo.parameter()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        given.check()?;
        let others: Vec<&Tile> = given.tiles().skip(1).collect();
        (self.fill)(out, given.tile(0), &others);
        Ok(())
    }
}
