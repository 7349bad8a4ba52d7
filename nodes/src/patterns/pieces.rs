//! The outputs of the nodes that lay pieces.
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::ground::window::Frame;
use shibo_kernel::pattern::finish::{self, Finish, FinishPlane};
use shibo_kernel::pattern::layout::Grid;
use shibo_node::{Output, Outputs};
use shibo_value::{Field, Tiling, Type};
use std::sync::Arc;

/// The outputs of `Brick` and `Hex`.
pub(super) const OUTPUTS: &[Output] = &[
    Output::new("height", Type::Gray, "0 on the pieces, `depth` lower in the gaps.").in_unit("mm"),
    Output::new("bevel", Type::Gray, "The same from 0 in the gaps to 1 on the pieces."),
    Output::new("gap", Type::Gray, "1 in the gaps, 0 on the pieces.").formerly("mask"),
    Output::new("ids", Type::Ids, "The number of the piece, from 1; in a gap that of the nearest piece."),
    Output::new("local", Type::Vec2, "The place within the piece from its middle: along its long side and across it.")
        .in_unit("mm"),
    Output::new("angle", Type::Gray, "The angle of the long side, from +x towards +y.").in_unit("°"),
];

/// The fields of the pieces of a layout.
pub(super) fn outputs(grid: Grid, finish: Finish, depth: f64, tiling: Tiling) -> Outputs {
    let grid = Arc::new(grid);
    let plane = |ty: Type, plane: FinishPlane| {
        drawn(&grid, ty, tiling, move |grid, frame, out| finish::fill(grid, &finish, plane, frame, out))
    };
    let local = places(&grid, tiling, finish::local);
    Outputs::one(plane(Type::Gray, FinishPlane::Height(narrow(depth))))
        .with("bevel", plane(Type::Gray, FinishPlane::Bevel))
        .with("gap", plane(Type::Gray, FinishPlane::Gap))
        .with("ids", plane(Type::Ids, FinishPlane::Ids))
        .with("local", local)
        .with("angle", plane(Type::Gray, FinishPlane::Angle))
}

/// A field whose plane a pattern fills.
pub(super) fn drawn<P: Send + Sync + 'static>(
    pattern: &Arc<P>,
    ty: Type,
    tiling: Tiling,
    fill: impl Fn(&P, &Frame, &mut [f32]) + Send + Sync + 'static,
) -> Field {
    let pattern = pattern.clone();
    Field::generate(ty, tiling, move |out, _| {
        fill(&pattern, &tile::frame(out), out.plane_mut(0));
        Ok(())
    })
}

/// A field of the places within the pieces of a pattern.
pub(super) fn places<P: Send + Sync + 'static>(
    pattern: &Arc<P>,
    tiling: Tiling,
    fill: impl Fn(&P, &Frame, [&mut [f32]; 2]) + Send + Sync + 'static,
) -> Field {
    let pattern = pattern.clone();
    Field::generate(Type::Vec2, tiling, move |out, _| {
        let frame = tile::frame(out);
        if let [x, y] = &mut out.planes_mut()[..] {
            fill(&pattern, &frame, [x, y]);
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patterns::{Brick, Hex, Truchet, Weave};
    use shibo_node::Node;

    #[test]
    fn gaps_are_found_by_their_former_name() {
        for outputs in [Brick::OUTPUTS, Hex::OUTPUTS, Weave::OUTPUTS] {
            let gap = Output::position(outputs, "gap");
            assert!(gap.is_some() && Output::position(outputs, "mask") == gap);
        }
        let band = Output::position(Truchet::OUTPUTS, "mask").unwrap();
        assert_eq!((Truchet::OUTPUTS[band].name, Output::position(Truchet::OUTPUTS, "gap")), ("mask", None));
    }
}
