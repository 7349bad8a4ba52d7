//! A field seen through displacements: the core of [`Warp`](crate::space::Warp).
use shibo_kernel::filter::warp::{self, WarpSpec};
use shibo_kernel::ground::tile;
use shibo_value::{Field, FieldSource, Given, Grid, Read, Stop, Tile, Type, Window};

/// A field seen through displacements.
pub(crate) struct Warped {
    pub(crate) input: Field,
    /// Displacements in x and y, mm.
    pub(crate) by: Field,
    /// Longest displacement, mm.
    pub(crate) limit: f64,
}

impl Warped {
    fn spec(&self, grid: &Grid) -> WarpSpec {
        WarpSpec { step: tile::step(grid), limit: [self.limit; 2] }
    }
}

impl FieldSource for Warped {
    fn inputs(&self, grid: &Grid, at: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.by, grid, at)]
    }

    fn later(&self, grid: &Grid, at: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.input, grid, self.spec(grid).reach(at))]
    }

    fn narrow(&self, given: &Given<'_>, grid: &Grid, at: Window) -> Vec<Window> {
        let by = given.tile(0);
        vec![self.spec(grid).reads(at, [by.plane(0), by.plane(1)])]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (by, input) = (given.tile(0), given.tile(1));
        let views: Vec<_> = (0..out.channels()).map(|channel| tile::view(input, channel)).collect();
        let (window, spec) = (out.window, self.spec(&out.grid));
        if self.input.ty() == Type::Ids {
            warp::warp_nearest(&views[0], window, [by.plane(0), by.plane(1)], &spec, out.plane_mut(0));
            return Ok(());
        }
        warp::warp(&views, window, [by.plane(0), by.plane(1)], &spec, &mut out.planes_mut());
        Ok(())
    }
}
