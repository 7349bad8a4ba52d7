//! The matrix of a node, or of an instance.
use glam::{DMat4, DQuat, DVec3};

/// The matrix that scales, then rotates, then moves; `turn` may have any length.
pub(super) fn transform(scale: DVec3, turn: DQuat, translation: DVec3) -> DMat4 {
    let turn = if turn.length_squared() > 1e-12 { turn.normalize() } else { DQuat::IDENTITY };
    DMat4::from_scale_rotation_translation(scale, turn, translation)
}
