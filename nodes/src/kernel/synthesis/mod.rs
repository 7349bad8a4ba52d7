//! Exemplar synthesis in the plane: exemplar coordinates for every pixel, found level by level.
//!
//! Coordinates are in pixels of the finest exemplar level, pixel `i` having its centre at `i + ½`. Level spacing is `h`
//! finest pixels, `h = 1` being the finest level. A Jacobian `J = ∂S/∂p` leads from output to exemplar.
//!
//! [`exact`] holds the stages as the source has them, on real coordinates; [`iso`] and [`aniso`] are the fast correctors
//! on analysed exemplars ([`analysis`]), driven by [`driver`]. Whatever reads a neighbour's coordinates goes through
//! [`Lookup`].

pub mod analysis;
pub mod aniso;
pub mod candidates;
pub mod coverage;
pub mod driver;
mod driver_aniso;
mod driver_iso;
pub mod exact;
pub mod feature;
pub mod iso;
pub mod jacobian;
pub mod lattice;
pub mod lattice_start;
pub mod levels;
pub mod magnify;
pub mod opening;
pub mod pca;
mod placing;
pub mod region;
pub mod sampling;
pub mod seams;
mod table;
pub mod texels;

/// Where the coordinates of a neighbour are found: the one point of indirection.
pub trait Lookup: Sync {
    /// The index of pixel (x, y), which lies at most two pixels outside of the map.
    fn index(&self, x: i32, y: i32) -> usize;
}

/// A rectangle of pixels whose sides join, or not, in x and y; a read beyond a side that does not gives the border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plane {
    /// Width in pixels.
    pub w: usize,
    /// Height in pixels.
    pub h: usize,
    /// Whether left and right, top and bottom join.
    pub wrap: [bool; 2],
}

impl Plane {
    /// The column or row that is read for `k`, of `n`.
    #[inline(always)]
    pub fn bring(k: i32, n: usize, wrap: bool) -> usize {
        let n = super::window::index(n);
        let k = if (0..n).contains(&k) {
            k
        } else if wrap {
            k.rem_euclid(n)
        } else {
            k.clamp(0, n - 1)
        };
        super::window::offset(k)
    }
}

impl Lookup for Plane {
    #[inline(always)]
    fn index(&self, x: i32, y: i32) -> usize {
        Self::bring(y, self.h, self.wrap[1]) * self.w + Self::bring(x, self.w, self.wrap[0])
    }
}
