//! Bodies with a relief: closed meshes of height fields, with an exact bound of their distance to the field.
//!
//! [`Heights`] are the samples of a canvas and of its rims. [`fewest()`] and `even` divide them into triangles, in
//! blocks. [`Plate`] and [`Roll`] close the surface to a body and give its vertices and triangles one by one. Heights are
//! read some rows at a time, and triangles are kept in a [`Store`], so that bodies may be larger than the memory.
//! [`Heights::left_by_ball`] finds the material that a milling tool cannot reach.
mod block;
mod budget;
mod builder;
pub mod displace;
mod even;
mod fewest;
mod heights;
mod model;
mod patch;
mod plate;
mod posts;
mod roll;
mod scan;
mod sides;
mod store;
mod table;
mod tiles;
mod tool;

pub use budget::{Mesher, Pattern};
pub use builder::{Figures, Receiver, Vertex};
pub use even::{Even, Stores};
pub use fewest::fewest;
pub use heights::{Heights, Rows};
pub use model::{Facing, facing, model, open_edge};
pub use patch::Tolerance;
pub use plate::Plate;
pub use roll::Roll;
pub use store::Store;
pub use tiles::{Room, Tiles};
pub use tool::{Left, MOST_REACH};

/// The largest distance between a body and its height that may be asked for, in mm.
pub const MOST_ERROR: f64 = 10.0;

#[cfg(test)]
mod tests;
