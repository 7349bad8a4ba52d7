//! Fields that follow from statistics of whole pictures.
//!
//! Statistics are taken of the canvas at one resolution of their own, whatever the resolution of the result: so a preview
//! looks like the final picture, and the cost does not grow with it.
use glam::DVec2;
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::value::{Cost, Field, FieldSource, Given, Grid, Pictures, Read, Resolution, Stop, Tile, Window};
use std::sync::OnceLock;

/// Pixels along the longer side of the canvas.
const SIDE: u32 = 512;

/// The grid on which a canvas of that size is measured, and all of its pixels.
pub(crate) fn grid(size: DVec2) -> (Grid, Window) {
    let pixels = Resolution::Longer(SIDE).of(size);
    (
        Grid { origin: DVec2::ZERO, step: size / pixels.as_dvec2(), period: Some(pixels), shown: None },
        Window::full(pixels),
    )
}

/// What was measured, or the error of who forgot to.
pub(crate) fn known<T>(made: &OnceLock<T>) -> Result<&T, Stop> {
    made.get().ok_or_else(|| {
        let problem = Problem::new(Code::BadValue, "a picture was not measured before it was filled");
        problem.help("this is a defect of the node").into()
    })
}

/// A field that changes each value of its first input by itself, as follows from whole pictures of all of them.
pub(crate) struct Measured<T, M, F> {
    /// What is measured; the first is also what is changed.
    pub(crate) fields: Vec<Field>,
    /// The canvas, mm.
    pub(crate) size: DVec2,
    /// What is taken of the pictures.
    pub(crate) measure: M,
    /// Fills a tile from that and the first input.
    pub(crate) fill: F,
    /// Once it is known.
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
