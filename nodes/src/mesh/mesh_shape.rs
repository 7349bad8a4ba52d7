//! [`MeshShape`]: a mesh of a simple shape.
//!
//! Made of patches, see [`kernel::shapes`](shibo_kernel::mesh::shapes). Cost: O(triangles).
use glam::{DVec2, DVec3};
use shibo_kernel::mesh::shapes;
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Stop, Type};

/// Simple shapes.
#[choice]
pub enum MeshForm {
    /// A box; each side is a chart.
    Cube,
    /// A sphere, or an ellipsoid; six charts with little stretch.
    #[default]
    Sphere,
    /// A ring about the z axis: x and y of `size` are the diameters of the centre line of its tube, `radius` is the
    /// radius of the tube. One chart.
    Torus,
    /// A cylinder about the z axis: its side, cut once, and two caps.
    Cylinder,
    /// A flat sheet that faces up, with the x and y of `size`. Its longer side spans the canvas. One chart.
    Plane,
    /// A turned body: `profile` rotated about the z axis. One chart.
    Lathe,
}

/// A sphere, a box, a ring, a turned bowl … as a mesh with UVs: for first steps, tests and turned objects.
///
/// It is centred on the origin, z up; the heights of a `Lathe` are those of its profile.
///
/// ```ron
/// "ball": MeshShape(shape: Sphere, size: (60, 60, 60)),
/// "atlas": MeshAtlas(mesh: "ball"),
/// "example": BakeNormal(atlas: "atlas"),
/// ```
///
/// Elsewhere: Blender *Mesh Primitives*, *Screw*; Houdini *Sphere*, *Torus*, *Revolve*.
#[node]
pub struct MeshShape {
    /// The shape.
    #[default(MeshForm::Sphere)]
    pub shape: MeshForm,
    /// Size along x, y and z.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e6, "unit" = "mm"))]
    #[default((60.0, 60.0, 60.0))]
    pub size: (f64, f64, f64),
    /// Radius of the tube of a `Torus`, less than half of the smaller one of x and y of `size`.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(15.0)]
    pub radius: f64,
    /// For `Lathe`: at least 2 and at most 500 points `(distance from the axis, height)`, in order along the outline. A
    /// profile that begins and ends on the axis makes a closed body. A bowl by default.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    #[default(vec![ (0.0, 0.0), (25.0, 0.0), (27.0, 4.0), (48.0, 16.0), (60.0, 38.0), (56.0, 38.0), (43.0, 18.0), (20.0, 8.0), (0.0, 6.0), ])]
    pub profile: Vec<(f64, f64)>,
    /// True if the outline of a `Lathe` is a smooth curve through the points, except at corners of more than 40°.
    #[default(true)]
    pub smooth: bool,
    /// Number of straight segments of a full circle; a `Cube` has an eighth of it along each edge, a `Plane` a quarter.
    #[schemars(range(min = 3, max = 1024))]
    #[default(64)]
    pub segments: u32,
}

/// Maximum number of points of a profile.
const MOST: usize = 500;

impl MeshShape {
    fn points(&self) -> Vec<DVec2> {
        self.profile.iter().map(|p| DVec2::new(p.0, p.1)).collect()
    }

    /// The first fault of the profile.
    fn profile_problem(&self) -> Option<(Code, String)> {
        let points = self.points();
        if !(2..=MOST).contains(&points.len()) {
            return Some((Code::BadValue, format!("profile has {} points; it must have 2 to {MOST}", points.len())));
        }
        if let Some(n) = points.iter().position(|p| p.x < 0.0) {
            let message = format!("profile[{n}] lies at `{}` mm from the axis; it must be 0 or more", points[n].x);
            return Some((Code::OutOfRange, message));
        }
        if let Some(n) = points.windows(2).position(|p| p[0].distance(p[1]) < 1e-6) {
            return Some((Code::BadValue, format!("profile[{}] is the same point as the one before it", n + 1)));
        }
        let flat = points.iter().all(|p| p.x == 0.0);
        flat.then(|| (Code::BadValue, "all points of the profile lie on the axis; some must lie beside it".into()))
    }

    /// The points of the outline, subdivided.
    fn outline(&self) -> Vec<DVec2> {
        let points = self.points();
        if !self.smooth {
            return points;
        }
        let widest = points.iter().fold(0.0, |most: f64, p| most.max(p.x));
        // Segments as long as those around the axis, and at most about 900.
        let length: f64 = points.windows(2).map(|p| p[0].distance(p[1])).sum();
        let piece = std::f64::consts::TAU * widest / f64::from(self.segments);
        shapes::smooth_profile(&points, piece.max(length / 400.0))
    }
}

impl Node for MeshShape {
    const OUTPUTS: &'static [Output] = &[Output::new("mesh", Type::Mesh, "The mesh.")];
    const FACTS: &'static [Fact] = &[];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let ring = 0.5 * self.size.0.min(self.size.1);
        match self.shape {
            MeshForm::Torus if self.radius >= ring => {
                let message = format!(
                    "radius is `{}` mm; with this size it must be less than {ring} mm, or the tube meets itself",
                    self.radius
                );
                vec![Problem::new(Code::OutOfRange, message).at("radius")]
            }
            MeshForm::Lathe => {
                let problem = |(code, message)| Problem::new(code, message).at("profile");
                self.profile_problem().map(problem).into_iter().collect()
            }
            _ => Vec::new(),
        }
    }

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (size, n) = (DVec3::from(self.size), self.segments);
        let mesh = match self.shape {
            MeshForm::Cube => shapes::cube(size, n),
            MeshForm::Sphere => shapes::sphere(size, n),
            MeshForm::Torus => shapes::torus(size.truncate(), self.radius, n),
            MeshForm::Cylinder => shapes::cylinder(size, n),
            MeshForm::Plane => shapes::plane(size.truncate(), n),
            MeshForm::Lathe => shapes::lathe(&self.outline(), n),
        };
        Ok(Outputs::one(mesh))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{OnCanvas as _, canvas, outputs};
    use shibo_value::{Mesh, Value};
    use std::sync::Arc;

    fn made(node: &MeshShape) -> Arc<Mesh> {
        assert!(node.check_on(&canvas()).is_empty());
        match outputs(node, &[], &canvas()).unwrap().take("mesh", true) {
            Some(Value::Mesh(mesh)) => mesh.clone(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn every_shape_has_its_size() {
        for (shape, size) in [
            (MeshForm::Cube, [60.0, 60.0, 60.0]),
            (MeshForm::Sphere, [60.0, 60.0, 60.0]),
            (MeshForm::Torus, [90.0, 90.0, 30.0]),
            (MeshForm::Cylinder, [60.0, 60.0, 60.0]),
            (MeshForm::Plane, [60.0, 60.0, 0.0]),
            (MeshForm::Lathe, [120.0, 120.0, 38.0]),
        ] {
            let mesh = made(&MeshShape { shape, ..MeshShape::default() });
            let [low, high] = mesh.bounds();
            assert!((high - low).distance(DVec3::from_array(size)) < 0.5, "{shape:?} {low} {high}");
            assert_eq!(mesh.uvs.len(), mesh.triangles.len());
        }
    }

    #[test]
    fn refuses_impossible_shapes() {
        let refused = |node: MeshShape| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        let torus = MeshShape { shape: MeshForm::Torus, radius: 30.0, ..MeshShape::default() };
        assert_eq!(refused(torus).as_deref(), Some("radius"));
        for profile in
            [vec![], vec![(0.0, 1.0), (-1.0, 2.0)], vec![(1.0, 1.0), (1.0, 1.0)], vec![(0.0, 0.0), (0.0, 5.0)]]
        {
            let lathe = MeshShape { shape: MeshForm::Lathe, profile, ..MeshShape::default() };
            assert_eq!(refused(lathe).as_deref(), Some("profile"));
        }
    }

    /// The largest shapes stay within the limit of triangles.
    #[test]
    fn shapes_are_never_too_large() {
        let most =
            |shape, size| made(&MeshShape { shape, size, segments: 1024, ..MeshShape::default() }).triangles.len();
        for (shape, size) in [
            (MeshForm::Torus, (60.0, 60.0, 60.0)),
            (MeshForm::Cylinder, (1.0, 1.0, 1e6)),
            (MeshForm::Lathe, (1.0, 1.0, 1.0)),
        ] {
            assert!(most(shape, size) <= 2_000_000);
        }
    }
}
