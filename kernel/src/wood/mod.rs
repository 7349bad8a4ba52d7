//! Wood as growth time in a tree (Momoi & Takatera 2014): skeletons, times, years, colours, and the details that make
//! them look natural. x and y lie on the ground, z points up; lengths in mm, times in years, speeds in mm a year.
pub mod branch;
pub mod discs;
pub mod fiber;
pub mod fit;
pub mod knots;
pub mod pattern;
pub mod pieces;
pub mod pores;
pub mod rays;
pub mod solids;
pub mod straight;
pub mod strip;
pub mod surface;
pub mod trunk;
pub mod vary;
pub mod year_table;
pub mod years;
