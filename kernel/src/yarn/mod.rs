//! Yarn: one thread model for knitting, braids, rope and cloth.
//!
//! A *line* is the middle of a thread: points in mm with a height, which repeat with the canvas ([`lines`]). A *yarn* is
//! its make: width, thickness, plies, twist, fibres ([`section`]). [`laid`] cuts the lines into segments and draws the
//! threads: the highest one shows. [`knit`], [`braid`] and [`cloth`] make the lines.
pub mod braid;
pub mod chart;
pub mod cloth;
pub mod draft;
pub mod knit;
pub mod laid;
pub mod lines;
mod noise;
pub mod section;
#[cfg(test)]
mod tests;
