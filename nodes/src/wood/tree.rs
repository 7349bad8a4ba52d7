//! [`Tree`]: a skeleton with the speeds of its growth.
//!
//! Source: Momoi & Takatera 2014, §3.3 (eqs 8–13): the parameters of growth that the stages share. Cost: none.
use super::trees::even;
use shibo_node::{Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{self as value, Skeleton, Stop, Type};

/// A tree: its trunk and branches, and the speeds of its growth, for all nodes that need them.
///
/// The control points of the trunk are spaced evenly in height, as by `EqualizeHeight`. A port for a tree also takes a
/// skeleton: it is then a tree with the usual speeds.
///
/// ```ron
/// "nodes": TrunkNodes(nodes: [(0, 0, -20), (6, 2, 10), (-8, 0, 40), (4, 0, 70)]),
/// "tree": Tree(skeleton: FitSkeleton(curve: "nodes"), elongation_speed: 40, thickening_speed: 2),
/// "time": TrunkTime(tree: "tree"),
/// "example": CutPlane(solid: "= fract(time)", origin: (-20, 0, 40), v: (0, 0, -40)),
/// ```
#[node]
pub struct Tree {
    /// The trunk with its branches.
    pub skeleton: In<Skeleton>,
    /// Growth of trunk and branches in length.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm/year"))]
    #[default(value::Tree::ELONGATION)]
    pub elongation_speed: f64,
    /// Growth of the trunk in radius: the width of a year's ring.
    #[schemars(range(max = 1e3), extend("exclusiveMinimum" = 0.0, "unit" = "mm/year"))]
    #[default(value::Tree::THICKENING)]
    pub thickening_speed: f64,
    /// Height at which the tree starts to grow.
    #[schemars(range(min = -1e5, max = 1e5), extend("unit" = "mm"))]
    pub ground: f64,
}

impl Node for Tree {
    const OUTPUTS: &'static [Output] = &[Output::new("tree", Type::Tree, "The tree.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let skeleton = cx.get(&self.skeleton)?;
        let trunk = even(&skeleton, "skeleton")?;
        Ok(Outputs::one(value::Tree {
            skeleton: Skeleton { trunk, even: true, branches: skeleton.branches.clone() },
            elongation_speed: self.elongation_speed,
            thickening_speed: self.thickening_speed,
            ground: self.ground,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, outputs, port};
    use glam::DVec3;
    use shibo_value::Value;

    #[test]
    fn spaces_heights_evenly_and_keeps_the_speeds() {
        let bent = [0.0, 10.0, 50.0, 90.0].map(|z| DVec3::new(0.3 * z, 0.0, z));
        let skeleton = Skeleton { trunk: vec![bent], even: false, branches: Vec::new() };
        let node = Tree { skeleton: port(0), thickening_speed: 4.0, ..Tree::default() };
        let made = outputs(&node, &[skeleton.into()], &canvas()).unwrap();
        let Some(Value::Tree(tree)) = made.take("tree", true) else { panic!("no tree") };
        let heights = tree.skeleton.trunk[0].map(|point| point.z.round());
        assert_eq!((heights, tree.skeleton.even), ([0.0, 30.0, 60.0, 90.0], true));
        assert_eq!((tree.elongation_speed, tree.thickening_speed, tree.ground), (230.0, 4.0, 0.0));
    }
}
