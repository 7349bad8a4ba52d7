//! Virtual springs: the motion of points under springs along the links of a lattice.
//!
//! Source: JP4905282B2 §4 to §6, claims 13 to 16. A spring of stiffness k and natural length L between points D apart
//! pulls both with the force `F = k (D - L)` along the link and pushes when `D < L`; `a = ΣF / m`; all points start at
//! rest and move from the same instant. Extensions: masses, dampers, drag, breakage and periodic lattices. Lengths are
//! mm; stiffness, mass, drag and step only have meaning in the groups `k δ²/m` and `drag δ/m`.
//!
//! Two paths give the same motion but sum the forces of a point in different orders: `grid` for lattices that are
//! grids, without index lists, and `list` for all others. Each is deterministic for any number of threads: work is
//! divided into parts of fixed size and each part sums in a fixed order. Everything is generic over
//! [`Real`](crate::ground::real::Real) so that the tests run the shipped code in double precision; only the inner loops
//! of lists have a variant for `f32` in wide instructions, `wide`, which a test compares with the plain loops bit for
//! bit.

mod adjacency;
mod advance;
mod block;
mod grid;
mod layout;
mod list;
#[cfg(test)]
mod list_tests;
mod moving;
mod net;
mod owners;
mod rows;
mod simulate;
mod step;
mod tables;

mod wide;

pub use net::{BreakOn, Broken, Integrator, Mass, Motion, Net, Outcome, Rest, SpringError};
pub use simulate::{forces, simulate, stretch};
