//! [`PlaceInTree`]: places an object in a tree.
//!
//! Source: Momoi & Takatera 2014, §4.1, §4.2 (row B26): the target can be placed anywhere in the texture's space, and
//! fine-tuned. Cost: about 1 ns a point.
use super::trees::{Triple, vector};
use crate::degrees::about;
use glam::DVec3;
use shibo_kernel::wood::solids::Code;
use shibo_node::{Context, Fact, In, InSpace, MaterialInputs, Node, Output, Outputs, node};
use shibo_value::{ChannelSet, Stop, Type};

/// Places an object in a solid, or in a material of solids: the result is the solid in the coordinates of the object.
///
/// At a point P of the object the solid is evaluated at position + R · (P · scale), where R rotates about x, then y,
/// then z.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "time": TrunkTime(tree: "tree"),
/// "rings": ColorPattern(),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "placed": PlaceInTree(solid: "wood", position: (0, 20, 0), turn: (35, 0, 20)),
/// "example": CutPlane(solid: "placed"),
/// ```
///
/// Elsewhere: Blender *Mapping*; Houdini *Transform*.
#[node]
pub struct PlaceInTree {
    /// The solid, or the material of solids, in the coordinates of the tree.
    pub solid: In<InSpace>,
    /// Position of the object's origin in the tree.
    #[schemars(extend("minimum" = -1e7, "maximum" = 1e7, "unit" = "mm"))]
    pub position: Triple,
    /// Rotations of the object about x, then y, then z.
    #[schemars(extend("minimum" = -360.0, "maximum" = 360.0, "unit" = "°"))]
    pub turn: Triple,
    /// Factor on the size of the object in the tree.
    #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0))]
    #[default(1.0)]
    pub scale: f64,
}

impl Node for PlaceInTree {
    const OUTPUTS: &'static [Output] =
        &[Output::value_of("solid", &["solid"], "The solid in the coordinates of the object.")];
    const FACTS: &'static [Fact] = &[];

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        inputs.at("solid")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let solid = cx.get(&self.solid)?;
        let (x, y, z) = self.turn;
        let matrix = about(DVec3::Z, z) * about(DVec3::Y, y) * about(DVec3::X, x) * self.scale;
        let position = vector(self.position);
        let level = self.turn.0 == 0.0 && self.turn.1 == 0.0;
        let code = Code::of_place(move |patch, _, out| {
            let [x, y, z] = patch.place;
            for (i, ((x, y), z)) in x.iter().zip(y).zip(z).enumerate() {
                let p = position + matrix * DVec3::new(f64::from(*x), f64::from(*y), f64::from(*z));
                (0..3).for_each(|k| out[k][i] = shibo_kernel::ground::number::narrow(p[k]));
            }
        })
        .with_exact(move |at, _| {
            let moved: Vec<DVec3> = at.iter().map(|p| position + matrix * *p).collect();
            (0..3).flat_map(|k| moved.iter().map(move |p| p[k]).collect::<Vec<_>>()).collect()
        });
        let place = code.solid(Type::SolidVector, Vec::new());
        let place = cx.shared("place", place);
        Ok(Outputs::one(solid.map(|solid| solid.moved(place.clone(), level))))
    }
}
