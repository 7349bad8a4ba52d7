//! Pieces of a solid: each shows the same as a plain cut placed where the piece was cut.
#![allow(clippy::unwrap_used, reason = "a test may fail where something is missing")]

use glam::{DQuat, DVec2, DVec3};
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Session, Settings};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_value::{Tile, Value, Window};
use std::path::Path;

/// A tree with rings finer than a pixel in places, a floor of turned boards, and solids that depend on the footprint of
/// pixels or on the direction of the cut.
const FLOOR: &str = r#"
    "nodes": TrunkNodes(height: (-600, 600), count: 9, wander: 6),
    "tree": FitSkeleton(curve: "nodes"),
    "time": TrunkTime(tree: Tree(skeleton: "tree", thickening_speed: 0.9)),
    "rings": ColorPattern(),
    "fiber": FiberSpace(time: "time", tree: Tree(skeleton: "tree", thickening_speed: 0.9), curl: 0.3),
    "colored": RingColor(time: "time", pattern: "rings", fiber: "fiber"),
    "rays": WoodRays(color: "colored", fiber: "fiber", tree: "tree"),
    "pores": WoodPores(color: "rays", fiber: "fiber", time: "time", tree: Tree(skeleton: "tree", thickening_speed: 0.9)),
    "light": FiberShading(color: "pores", direction: "fiber.direction", figure: 0.8),
    "floor": Brick(layout: Herringbone, size: (23.0, 11.3), gap: 0.4, angle: ANGLE),
"#;

/// The solids that are cut.
const SHOWN: [&str; 4] = ["light.color", "light.anisotropy", "light.x", "light.y"];

fn graph(session: &Session, nodes: &str) -> Graph {
    let text = format!("(canvas: (size_mm: (64, 48), resolution: 256, tile: None, seed: 5), nodes: {{ {nodes} }})");
    let loaded = load_text(Path::new("test.ron"), &text, session.registry(), &LoadOptions::default());
    let errors: Vec<&str> = loaded.diagnostics.iter().filter(|d| !d.warning).map(|d| d.message.as_str()).collect();
    assert_eq!(errors, Vec::<&str>::new());
    loaded.graph.unwrap()
}

/// The picture of an output of a node.
fn picture(session: &Session, graph: &Graph, name: &str) -> Tile {
    let (node, output) = name.split_once('.').unwrap_or((name, ""));
    let node = graph.nodes.node_indices().find(|i| graph.nodes[*i].name == node).unwrap();
    let output = graph.nodes[node].node.outputs().iter().position(|o| o.name == output).unwrap_or(0);
    let cancel = CancelToken::default();
    let Value::Field(field) = session.value(graph, (node, output), &cancel, &Silent).unwrap() else { panic!("{name}") };
    let size = graph.canvas.resolution;
    let wanted = [(graph.canvas.grid(size), Window::full(size))];
    session.rasters(graph, &field, &wanted, &cancel, &Silent).unwrap().0.remove(0)
}

fn session() -> Session {
    Session::new(shibo_nodes::registry(), &Settings { threads: 2, ..Settings::default() }).unwrap()
}

fn at(tile: &Tile, i: usize) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|c| if c < tile.channels() { f64::from(tile.plane(c)[i]) } else { 0.0 }))
}

/// A floor with boards at `angle`; `told` passes that angle to the cuts.
fn floor(session: &Session, angle: f64, told: bool, more: &str) -> (Graph, String) {
    let own = if told { "angle: \"floor.angle\", " } else { "" };
    let cuts = SHOWN.iter().enumerate().map(|(k, solid)| {
        format!(
            "\"cut{k}\": CutPlane(solid: \"{solid}\", preset: FlatSawn, distance: 22, height: 30, yaw: 10, local: \"floor.local\", \
             ids: \"floor.ids\", {own}spread: (15, 12, 200), turn: (50, 8), flip: true),"
        )
    });
    let base = FLOOR.replace("ANGLE", &angle.to_string());
    let text = format!("{base} {} {more}", cuts.collect::<String>());
    (graph(session, &text), base)
}

/// Compares some pieces of a floor with plain cuts.
fn check(angle: f64, told: bool) {
    let session = session();
    let (laid, base) = floor(&session, angle, told, "");
    let show = |name: &str| picture(&session, &laid, name);
    let (ids, local, turned) = (show("floor.ids"), show("floor.local"), show("floor.angle"));
    let (place, turns) = (show("cut0.place"), show("cut0.turned"));
    let shown: Vec<Tile> = (0..SHOWN.len()).map(|k| show(&format!("cut{k}"))).collect();
    let (w, n) = (ids.width(), ids.plane(0).len());
    for i in [w * 20 + 30, w * 20 + 200, w * 100 + 128, w * 150 + 60, w * 170 + 210, w * 60 + 100] {
        // The board's place on the canvas and in the tree, computed from the outputs.
        let pixel = DVec2::new((i % w) as f64 + 0.5, (i / w) as f64 + 0.5) * 0.25;
        let axis = DVec2::from_angle(at(&turned, i).x.to_radians());
        let corner = at(&local, i).truncate() - DVec2::new(axis.dot(pixel), axis.perp_dot(pixel));
        let [yaw, pitch, round] = at(&turns, i).to_array().map(f64::to_radians);
        let own = DQuat::from_rotation_z(10_f64.to_radians());
        let turn = DQuat::from_rotation_z(yaw) * DQuat::from_axis_angle(own * DVec3::X, pitch) * own;
        let sign = round.cos().round();
        let (along, across) = (sign * (turn * DVec3::Z), sign * (turn * DVec3::X));
        let origin = at(&place, i) + corner.x * along + corner.y * across;
        let u = 64.0 * (axis.x * along - axis.y * across);
        let v = 48.0 * (axis.y * along + axis.x * across);
        let plain = SHOWN.iter().enumerate().map(|(k, solid)| {
            format!("\"plain{k}\": CutPlane(solid: \"{solid}\", origin: {origin:?}, u: {u:?}, v: {v:?}),")
                .replace("DVec3", "")
        });
        let plain = graph(&session, &format!("{base} {}", plain.collect::<String>()));
        let id = ids.plane(0)[i];
        let mine: Vec<usize> = (0..n).filter(|k| ids.plane(0)[*k] == id).collect();
        let whole = |k: usize| {
            let corner = ((k / w) & !1) * w + ((k % w) & !1);
            [corner, corner + 1, corner + w, corner + w + 1].iter().all(|k| ids.plane(0)[*k] == id)
        };
        for (k, cut) in shown.iter().enumerate() {
            let plain = picture(&session, &plain, &format!("plain{k}"));
            let away = |i: &usize| (at(cut, *i) - at(&plain, *i)).abs().max_element();
            let (inside, border): (Vec<usize>, Vec<usize>) = mine.iter().partition(|i| whole(**i));
            assert!(inside.len() > 500 && border.len() > 20, "{} {}", inside.len(), border.len());
            let worst = inside.iter().map(&away).fold(0.0, f64::max);
            // Places are rounded differently; without `angle`, directions follow from rounded places.
            let allowed = if told { 4e-3 } else { 8e-3 };
            assert!(worst < allowed, "{angle}° {} of piece {id}: {worst} inside", SHOWN[k]);
            // At borders the footprint is that of the neighbouring pixel.
            let mean = border.iter().map(&away).sum::<f64>() / border.len() as f64;
            assert!(mean < 6e-3, "{angle}° {} of piece {id}: {mean} at the border", SHOWN[k]);
        }
    }
}

#[test]
fn piece_equals_cut_placed_by_hand() {
    check(0.0, true);
    check(37.0, true);
}

#[test]
fn derives_piece_direction_from_local() {
    check(37.0, false);
    check(90.0, false);
}

#[test]
fn identity_placement_keeps_pieces() {
    let session = session();
    let more = r#""moved": PlaceInTree(solid: "light.color", position: (0, 0, 0)),
        "again": CutPlane(solid: "moved", preset: FlatSawn, distance: 22, height: 30, yaw: 10, local: "floor.local", ids: "floor.ids",
          angle: "floor.angle", spread: (15, 12, 200), turn: (50, 8), flip: true),"#;
    let (laid, _) = floor(&session, 37.0, true, more);
    let (one, other) = (picture(&session, &laid, "cut0"), picture(&session, &laid, "again"));
    let away = one.data().iter().zip(other.data()).map(|(a, b)| f64::from((a - b).abs()));
    let (sum, worst) = away.fold((0.0, 0.0_f64), |(sum, worst), away| (sum + away, worst.max(away)));
    // Directions follow from differences of places; a piece of a single pixel has none.
    assert!(sum / (one.data().len() as f64) < 1e-4 && worst < 0.2, "{sum} {worst}");
}

#[test]
fn solids_among_the_outputs_are_not_rendered() {
    let session = session();
    let text = r#"(canvas: (size_mm: 8), nodes: { "years": SolidNoise(size: 3), "cut": CutPlane(solid: "years") },
        outputs: { "solid": "years", "picture": "cut" })"#;
    let loaded = load_text(Path::new("test.ron"), text, session.registry(), &LoadOptions::default());
    assert!(loaded.diagnostics.is_empty(), "{:?}", loaded.diagnostics);
    let names: Vec<String> = loaded.graph.unwrap().outputs.into_iter().map(|output| output.name).collect();
    assert_eq!(names, ["picture"]);
}

#[test]
fn each_piece_shows_one_tree() {
    let session = session();
    // Three different trees, cut one by one and together.
    let trees = ["light.color", "half", "plain"];
    let more = "\"half\": \"= mix(light.color, colored, 0.5)\", \"plain\": SolidNoise(size: 7),";
    let cut = |name: &str, solids: &str| {
        format!(
            "\"{name}\": CutPlane({solids}, preset: FlatSawn, distance: 22, local: \"floor.local\", ids: \"floor.ids\", \
             angle: \"floor.angle\", spread: (15, 12, 200), turn: (50, 8), flip: true, seed: 4),"
        )
    };
    let alone: String = (0..3).map(|k| cut(&format!("cut{k}"), &format!("solid: \"{}\"", trees[k]))).collect();
    let all = cut("all", "solid: \"light.color\", others: [\"half\", \"plain\"]");
    let graph = graph(&session, &format!("{} {more} {alone} {all}", FLOOR.replace("ANGLE", "20")));
    let show = |name: &str| picture(&session, &graph, name);
    let (ids, which, together) = (show("floor.ids"), show("all.tree"), show("all"));
    let apart: Vec<Tile> = (0..3).map(|k| show(&format!("cut{k}"))).collect();
    let mut of_piece = std::collections::BTreeMap::new();
    for i in 0..ids.plane(0).len() {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small whole numbers")]
        let tree = which.plane(0)[i] as usize;
        // A tree with one channel shows as grey among coloured ones.
        let want = &apart[tree];
        for channel in 0..3 {
            assert_eq!(together.plane(channel)[i], want.plane(channel.min(want.channels() - 1))[i], "{i} {tree}");
        }
        assert_eq!(*of_piece.entry(ids.plane(0)[i].to_bits()).or_insert(tree), tree, "one tree to a piece");
    }
    assert!((0..3).all(|tree| of_piece.values().any(|of| *of == tree)), "all trees are used");
}
