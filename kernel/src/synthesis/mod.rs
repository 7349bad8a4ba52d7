//! Exemplar synthesis in the plane: exemplar coordinates for every pixel, found level by level.
//!
//! Source: JP5149288B2, whose equations are numbered (1) to (6); and the published work on parallel controllable
//! synthesis and appearance space.
//!
//! Coordinates are in pixels of the finest exemplar level; pixel `i` has its centre at `i + ½`. Level spacing is `h`
//! finest pixels, `h = 1` at the finest level. A Jacobian `J = ∂S/∂p` maps output to exemplar.
//!
//! [`exact`] holds the stages as in the source, on real coordinates. [`iso`] and [`aniso`] are the fast correctors on
//! analysed exemplars ([`analysis`]), driven by [`driver`]; where `J = 1`, joints are mended after them. All reads of a
//! neighbour's coordinates go through [`Lookup`].

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
mod layer;
pub mod levels;
pub mod magnify;
mod mend;
pub mod origin;
mod patches;
pub mod pca;
mod phase;
mod placing;
mod plane;
pub mod region;
mod rematch;
pub mod sampling;
pub mod seams;
mod settle;
pub mod sheet;
mod spots;
pub mod surface;
pub mod surface_measure;
mod surface_pass;
pub mod surface_sampling;
mod table;
pub mod texels;
mod vote;

pub use plane::{Lookup, Neighbours, PixelPlane};
