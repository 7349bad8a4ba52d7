//! Surfaces of triangles: walks over them, frames on them, and the maps by which synthesis reads across borders of charts.
//!
//! Places are a triangle and a point of the atlas, which is the unit square, v down. Topology and walks are computed in
//! double precision, and nothing depends on the order of a hash map.

#[cfg(test)]
pub(crate) mod fixture;
pub mod frame;
pub mod walk;
