//! Fields that depend on statistics of whole pictures.
//!
//! Statistics are taken of the canvas at a fixed resolution, independent of that of the result. So a preview looks like
//! the final picture, and the cost does not grow with the resolution.
use glam::DVec2;
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Cost, Field, FieldSource, Given, Grid, Pictures, Read, Resolution, Stop, Tile, Window};
use std::sync::OnceLock;

/// Pixels along the longer side of the canvas.
const SIDE: u32 = 512;

/// The grid on which a canvas of this size is measured, and the window of the whole canvas.
pub(crate) fn grid(size: DVec2) -> (Grid, Window) {
    let pixels = Resolution::Longer(SIDE).of(size);
    (
        Grid { origin: DVec2::ZERO, step: size / pixels.as_dvec2(), period: Some(pixels), shown: None },
        Window::full(pixels),
    )
}

/// Returns the measurement, or an error if the field was read before it was prepared.
pub(crate) fn known<T>(made: &OnceLock<T>) -> Result<&T, Stop> {
    made.get().ok_or_else(|| {
        let problem = Problem::new(Code::BadValue, "a picture was not measured before it was filled");
        problem.help("this is a defect of the node").into()
    })
}

/// A field that maps each value of its first input, by a mapping that depends on statistics of all inputs.
pub(crate) struct Measured<T, M, F> {
    /// Fields to measure; the first one is also the one that is mapped.
    pub(crate) fields: Vec<Field>,
    /// The canvas, mm.
    pub(crate) size: DVec2,
    /// Computes the statistics from the pictures.
    pub(crate) measure: M,
    /// Fills a tile from the statistics and the first input.
    pub(crate) fill: F,
    /// The statistics, once they are known.
    pub(crate) made: OnceLock<T>,
}

impl<T, M, F> FieldSource for Measured<T, M, F>
where
    T: Send + Sync,
    M: Fn(&[Tile]) -> T + Send + Sync,
    F: Fn(&T, &Tile, &mut Tile) + Send + Sync,
{
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.fields.first().into_iter().map(|field| Read::new(field, grid, window)).collect()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        (self.fill)(known(&self.made)?, given.tile(0), out);
        Ok(())
    }

    fn cost(&self) -> Cost {
        Cost::Pointwise
    }

    fn whole(&self, _grid: &Grid) -> Vec<Read<'_>> {
        let (grid, window) = grid(self.size);
        self.fields.iter().map(|field| Read::new(field, &grid, window)).collect()
    }

    fn prepare(&self, _grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        if self.made.get().is_none() {
            let window = grid(self.size).1;
            let read = |number| pictures.read(number, window);
            let tiles = (0..self.fields.len()).map(read).collect::<Result<Vec<_>, _>>()?;
            pictures.check()?;
            let made = (self.measure)(&tiles);
            self.made.get_or_init(|| made);
        }
        Ok(None)
    }

    fn prepare_bytes(&self, _grid: &Grid) -> u64 {
        let channels: usize = self.fields.iter().map(Field::channels).sum();
        if self.made.get().is_some() { 0 } else { 8 * (channels * grid(self.size).1.len()) as u64 }
    }
}
