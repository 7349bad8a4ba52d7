//! [`Board`]: the six faces of a board.
//!
//! Source: Momoi & Takatera 2014, §2.1 and §4.1 (rows B26, B28, B29): boards for buildings, cut from anywhere in the
//! tree. Cost: a cut for each output that is used.
use super::cut_plane::PlaneInSolid;
use super::trees::{Triple, vector};
use crate::degrees::about;
use crate::shown::{shown_by, shown_channels};
use glam::DVec3;
use shibo_node::{CanvasFacts, Context, Fact, In, InSpace, MaterialInputs, Node, Output, Outputs, node};
use shibo_value::{ChannelSet, Stop, Tiling};

/// Cuts a board out of a solid, or of a material of solids: all six faces, which agree on their edges.
///
/// Before the rotation, its length runs along the trunk (z), its width along x and its thickness along y. Each output
/// shows one face over the whole canvas, with the length to the right. Ends show the width to the right and the
/// thickness down.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "time": TrunkTime(tree: "tree"),
/// "rings": ColorPattern(),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "board": Board(solid: "wood", size: (120, 60, 20), middle: (0, 45, 0)),
/// "example": Blend(base: "board.face", top: "board.side"),
/// ```
///
/// Elsewhere: Blender *Texture Coordinate* (Object); Houdini *Attribute from Volume*.
#[node]
pub struct Board {
    /// Solid, or material of solids, to cut.
    pub solid: In<InSpace>,
    /// Length, width and thickness.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e6, "unit" = "mm"))]
    #[default((600.0, 120.0, 25.0))]
    pub size: Triple,
    /// Position of the board's middle in the tree.
    #[schemars(extend("minimum" = -1e7, "maximum" = 1e7, "unit" = "mm"))]
    #[default((0.0, 60.0, 1200.0))]
    pub middle: Triple,
    /// Rotations about the length (0 is flat-sawn for a board on the y axis, 90 quarter-sawn), about the width and
    /// about the thickness.
    #[schemars(extend("minimum" = -360.0, "maximum" = 360.0, "unit" = "°"))]
    pub turn: Triple,
}

impl Board {
    /// The planes of the faces, in the order of the outputs.
    fn planes(&self) -> [PlaneInSolid; 6] {
        // Length along z, width along x, thickness along y.
        let turn = about(DVec3::Z, self.turn.0) * about(DVec3::X, self.turn.1) * about(DVec3::Y, self.turn.2);
        let (length, width, thickness) =
            (turn * DVec3::Z * self.size.0, turn * DVec3::X * self.size.1, turn * DVec3::Y * self.size.2);
        let middle = vector(self.middle);
        // A face: the directions out of the board, to the right, and down.
        let face = |out: DVec3, u: DVec3, v: DVec3| PlaneInSolid { origin: middle + 0.5 * (out - u - v), u, v };
        [
            face(thickness, length, -width),
            face(-thickness, length, width),
            face(-width, length, -thickness),
            face(width, length, thickness),
            face(-length, width, thickness),
            face(length, -width, thickness),
        ]
    }
}

impl Node for Board {
    const OUTPUTS: &'static [Output] = &[
        Output::like("face", &["solid"], "The wide face away from the pith."),
        Output::like("back", &["solid"], "The wide face towards the pith."),
        Output::like("side", &["solid"], "The narrow face that `face` ends at below."),
        Output::like("other_side", &["solid"], "The narrow face that `face` ends at above."),
        Output::like("end", &["solid"], "The lower end, on the left of `face`."),
        Output::like("other_end", &["solid"], "The upper end, on the right of `face`."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        shown_channels(inputs.at("solid"))
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (solid, size) = (cx.get(&self.solid)?, cx.size_mm());
        let [face, back, side, other_side, end, other_end] =
            self.planes().map(|plane| shown_by(cx, &solid, &plane.cut(size)));
        Ok(Outputs::one(face)
            .with("back", back)
            .with("side", side)
            .with("other_side", other_side)
            .with("end", end)
            .with("other_end", other_end))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_share_their_edges() {
        let board = Board { turn: (30.0, 5.0, -7.0), ..Board::default() };
        let [face, back, side, other_side, end, other_end] = board.planes();
        let corner = |p: &PlaneInSolid, u: f64, v: f64| p.origin + p.u * u + p.v * v;
        let same = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-9, "{a} {b}");
        // Below the face lies one side, above it the other, on its left the end.
        same(corner(&face, 0.0, 1.0), corner(&side, 0.0, 0.0));
        same(corner(&face, 1.0, 1.0), corner(&side, 1.0, 0.0));
        same(corner(&face, 0.0, 0.0), corner(&other_side, 0.0, 1.0));
        same(corner(&face, 0.0, 0.0), corner(&end, 1.0, 1.0));
        same(corner(&face, 1.0, 0.0), corner(&other_end, 0.0, 1.0));
        same(corner(&side, 0.0, 1.0), corner(&back, 0.0, 0.0));
        let looks = |p: &PlaneInSolid| p.u.cross(p.v).normalize();
        assert!(looks(&face).dot(looks(&back)) < -0.999 && looks(&side).dot(looks(&other_side)) < -0.999);
        // Faces are not mirrored when seen from outside: right × down points into the board.
        let middle = vector(board.middle);
        for plane in board.planes() {
            assert!(looks(&plane).dot(corner(&plane, 0.5, 0.5) - middle) < 0.0);
        }
    }
}
