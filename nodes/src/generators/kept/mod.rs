//! Earlier versions of kinds, whole and unedited, for graphs that are pinned. The table of changes names them.
mod fractal_2;
mod fractal_3;

pub use fractal_2::Fractal as Fractal2;
pub use fractal_3::Fractal as Fractal3;
