//! Tests of the rewriting of trees.
use super::migrated;

#[test]
fn nodes_of_one_tree_share_it() {
    let text = r#"(
  nodes: {
    "pith": TrunkNodes(count: 7),
    "trunk": FitSkeleton(curve: "pith"),
    // Time.
    "even": TrunkTime(skeleton: "trunk", elongation_speed: 260, thickening_speed: "$rings", age_boost: 0.6),
    "grown": VaryGrowth(time: "even", skeleton: "trunk", eccentricity: 0.1),
    "time": VaryGrowth(time: "grown", series: Generated),
    "fiber": FiberSpace(time: "grown", skeleton: "trunk", elongation_speed: 260, thickening_speed: "$rings"),
    "branches": BranchTime(skeleton: "trunk", elongation_speed: 260),
    "pores": WoodPores(color: "c", fiber: "fiber", time: "time", calendar: "time.calendar", elongation_speed: 260,
      thickening_speed: "$rings", cell: 0.2),
  },
)
"#;
    let wanted = r#"(
  nodes: {
    "pith": TrunkNodes(count: 7),
    "trunk": FitSkeleton(curve: "pith"),
    "tree": Tree(skeleton: "trunk", elongation_speed: 260, thickening_speed: "$rings"),
    // Time.
    "even": TrunkTime(tree: "tree", age_boost: 0.6),
    "grown": VaryGrowth(time: "even", tree: "trunk", eccentricity: 0.1),
    "time": VaryGrowth(time: "grown", series: Generated),
    "fiber": FiberSpace(time: "grown", tree: "tree"),
    "branches": BranchTime(tree: "tree"),
    "pores": WoodPores(color: "c", fiber: "fiber", time: "time", tree: "tree", cell: 0.2),
  },
)
"#;
    let migration = migrated(text);
    assert_eq!(migration.text, wanted);
    assert_eq!((migration.changes.len(), migration.warnings.len()), (5, 0));
    assert_eq!(migrated(wanted).text, wanted);
}

#[test]
fn skeletons_of_usual_speed_need_no_tree() {
    let text = "(nodes: { \"t\": TrunkTime(skeleton: \"s\", elongation_speed: 230), \"p\": WoodPores(time: \"t\", ground: 0) })\n";
    assert_eq!(migrated(text).text, "(nodes: { \"t\": TrunkTime(tree: \"s\", ), \"p\": WoodPores(time: \"t\", ) })\n");
    // A skeleton without a name, two trees, and pores of a tree that is not there.
    let text = r#"(nodes: { "tree": A(), "t": TrunkTime(skeleton: FitSkeleton(curve: "c"), ground: -5),
 "a": TrunkTime(skeleton: "tree", thickening_speed: 1), "b": TrunkTime(skeleton: "tree", thickening_speed: 2) })"#;
    let wanted = r#"(nodes: { "tree": A(),
          "tree_tree": Tree(skeleton: "tree", thickening_speed: 1),
          "tree_2": Tree(skeleton: "tree", thickening_speed: 2), "t": TrunkTime(tree: Tree(skeleton: FitSkeleton(curve: "c"), ground: -5), ),
 "a": TrunkTime(tree: "tree_tree", ), "b": TrunkTime(tree: "tree_2", ) })"#;
    assert_eq!(migrated(text).text, wanted);
    let migration = migrated("(nodes: { \"p\": WoodPores(time: \"t\", thickening_speed: 3) })");
    assert!(migration.changes.is_empty() && migration.warnings.len() == 1, "{migration:?}");
}
