//! Strokes prepared for drawing.

use super::style::{Draw, StrokeStyle};
use glam::{DVec2, IVec2, Vec2};

/// A stroke, prepared for drawing at any resolution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Groove {
    pub(super) middle: DVec2,
    /// Unit vector from the first end to the second.
    pub(super) along: Vec2,
    pub(super) half_length: f32,
    pub(super) half_width: f32,
    pub(super) depth: f32,
    /// The stroke's id.
    pub(super) id: u32,
}

/// A stroke near a window: its id, its copy of the canvas, and the index of its groove.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Near {
    pub(super) id: u32,
    pub(super) copy: u32,
    pub(super) groove: u32,
}

/// The input of a drawing.
pub(super) struct Job<'s> {
    pub(super) grooves: &'s [Groove],
    pub(super) near: &'s [Near],
    pub(super) copies: &'s [IVec2],
    pub(super) style: StrokeStyle,
    pub(super) period: Vec2,
    pub(super) draw: Draw,
}
