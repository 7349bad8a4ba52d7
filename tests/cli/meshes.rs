//! Meshes from graph files.
use crate::support::Desk;

/// Checks a graph with these arguments of `MeshAtlas`, and gives the messages.
fn check(atlas: &str, code: i32) -> String {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        format!(
            "(canvas: (size_mm: 150, resolution: 64, tile: None), nodes: {{ \"ball\": MeshShape(shape: Sphere, size: (60, 60, 60)), \
             \"atlas\": MeshAtlas(mesh: \"ball\", {atlas}) }}, outputs: {{ \"charts\": \"atlas.charts\" }})"
        ),
    );
    desk.shibo("render a.ron --no-cache --quiet").expect(code).stderr.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn seams_are_followed_or_refused_at_their_place() {
    let half = "seams: [[(0, 0, 30), (30, 0, 0), (0, 0, -30)]]";
    let said = check(&format!("charts: New, {half}"), 0);
    assert!(!said.contains("of seam") && !said.contains("`seams`"), "{said}");
    let said = check("charts: New, seams: [[(0, 0, 30), (0, 0, 90)]]", 1);
    assert!(
        said.contains("point 1 of seam 0 lies 60.0 mm from the nearest vertex") && said.contains("a.ron:1:"),
        "{said}"
    );
    assert!(check("charts: New, seams: [[(0, 0, 30)]]", 1).contains("fewer than two points"));
    assert!(check(&format!("charts: Given, {half}"), 0).contains("`seams` does nothing"));
    assert!(check(half, 0).contains("`seams` does nothing"));
}

/// Where rings are narrow in texels, charts agree only with `footprint: Space`, and a message advises that.
#[test]
fn thin_rings_on_a_surface_are_told() {
    let desk = Desk::new();
    let said = |size: u32, footprint: &str| {
        desk.write(
            "a.ron",
            format!(
                r#"(version: 1, canvas: (size_mm: 100, resolution: 128, tile: None), nodes: {{
  "curve": TrunkNodes(height: (-200, 200), count: 5),
  "tree": FitSkeleton(curve: "curve"),
  "time": TrunkTime(tree: "tree"),
  "year": ColorPattern(),
  "wood": RingColor(time: "time", pattern: "year"),
  "placed": PlaceInTree(solid: "wood", position: (0, 50, 0)),
  "cube": MeshShape(size: ({size}, {size}, {size})),
  "atlas": MeshAtlas(mesh: "cube"),
  "baked": BakeSolid(atlas: "atlas", solid: "placed", footprint: {footprint}),
}}, outputs: {{ "out": "baked" }})"#
            ),
        );
        desk.shibo("render a.ron --no-cache").expect(0).stderr
    };
    let thin = "rings are less than 16 texels wide on a surface";
    let told = said(60, "Surface");
    assert!(told.contains(thin) && told.contains("set `footprint: Space` in BakeSolid"), "{told}");
    assert!(!said(60, "Space").contains(thin));
    assert!(!said(2, "Surface").contains(thin));
}
