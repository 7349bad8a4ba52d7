//! The outputs of the nodes that lay pieces.
use shibo_engine::node::{Output, Outputs};
use shibo_engine::value::{Field, Tiling, Type};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::pattern::finish::{self, Finish, Plane};
use shibo_kernel::pattern::layout::Grid;
use std::sync::Arc;

/// Those of `Brick` and `Hex`.
pub(super) const OUTPUTS: &[Output] = &[
    Output::new("height", Type::Gray, "0 on the pieces, `depth` lower in the gaps.").in_unit("mm"),
    Output::new("bevel", Type::Gray, "The same from 0 in the gaps to 1 on the pieces."),
    Output::new("mask", Type::Gray, "1 in the gaps, 0 on the pieces."),
    Output::new("ids", Type::Ids, "The number of the piece, from 1; in a gap that of the nearest piece."),
    Output::new("local", Type::Vec2, "The place within the piece from its middle: along its long side and across it.")
        .in_unit("mm"),
    Output::new("angle", Type::Gray, "The angle of the long side, from +x towards +y.").in_unit("°"),
];

/// The fields of pieces that are laid.
pub(super) fn outputs(grid: Grid, finish: Finish, depth: f64, tiling: Tiling) -> Outputs {
    let grid = Arc::new(grid);
    let plane = |ty: Type, plane: Plane| {
        let grid = grid.clone();
        Field::generate(ty, tiling, move |out, _| {
            finish::fill(&grid, &finish, plane, &tile::frame(out), out.plane_mut(0));
            Ok(())
        })
    };
    let local = {
        let grid = grid.clone();
        Field::generate(Type::Vec2, tiling, move |out, _| {
            let frame = tile::frame(out);
            let mut planes = out.planes_mut().into_iter();
            if let (Some(x), Some(y)) = (planes.next(), planes.next()) {
                finish::local(&grid, &frame, [x, y]);
            }
            Ok(())
        })
    };
    Outputs::one(plane(Type::Gray, Plane::Height(narrow(depth))))
        .with("bevel", plane(Type::Gray, Plane::Bevel))
        .with("mask", plane(Type::Gray, Plane::Gap))
        .with("ids", plane(Type::Ids, Plane::Ids))
        .with("local", local)
        .with("angle", plane(Type::Gray, Plane::Angle))
}
