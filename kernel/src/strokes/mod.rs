//! Strokes with a cross-section: wrinkle segments as grooves, bands as a scalar field.
//!
//! Source: JP4905282B2 §7, claims 17 to 19: each segment gets a width W and a cross-section. A [`StrokeSet`] is built
//! once, in mm, and fills any window at any resolution; a pixel's value depends on its position alone, so windows fit
//! together bit by bit. Strokes are combined in their order, so sums do not depend on the windows either. The output is
//! depth, 0 where there is no stroke; heights are its negative.

mod fill;
mod job;
mod pen;
mod set;
mod style;

pub use set::{StrokeSet, layers};
pub use style::{Combine, CrossSection, Draw, NO_STROKE, Profile, Stroke, StrokeStyle};
