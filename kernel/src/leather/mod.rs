//! Leather by the method of JP4905282B2: points, the links between them, the reading of pictures along links, segments
//! across links, and bands. The springs are in [`crate::springs`], the drawing of lines in [`crate::strokes`].

pub mod area;
pub mod bands;
pub mod delaunay;
pub mod lines;
pub mod links;
pub mod points;
pub mod poisson;
pub mod scatter;
pub mod segments;
