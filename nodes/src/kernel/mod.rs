//! Pure numeric functions on slices and `glam` types: no node, no serde, no files.
//!
//! Rules for all of them: results never depend on the number of threads or on how a picture is cut into tiles;
//! random numbers are hashed from a seed and an index; reductions have a fixed order; transcendental functions come
//! from [`math`], never from the system. Pictures are planar `f32`, rows from y = 0.

pub mod area;
pub mod bands;
mod bins;
pub mod blend;
pub mod blur;
pub mod cells;
pub mod cubic;
pub mod delaunay;
pub mod distance;
pub mod fields;
pub mod gradient;
pub mod hash;
pub mod lattice;
pub mod lines;
pub mod math;
pub mod math_ops;
pub mod noise;
pub mod noise3;
pub mod normal;
pub mod occlusion;
pub mod placed;
pub mod points;
pub mod poisson;
pub mod pyramid;
pub mod real;
pub mod relief;
pub mod resample;
pub mod sample;
pub mod scatter;
pub mod segments;
pub mod simd;
pub mod solids;
pub mod springs;
mod springs_grid;
mod springs_layout;
mod springs_list;
#[cfg(test)]
mod springs_list_tests;
mod springs_owners;
mod springs_patch;
mod springs_rows;
mod springs_step;
mod springs_tables;
mod springs_turns;
mod springs_wide;
pub mod stop;
mod stroke_fill;
mod stroke_pen;
pub mod strokes;
pub mod synthesis;
pub mod tile;
pub mod tone;
pub mod warp;
pub mod window;
pub mod wood;
pub mod worley;
