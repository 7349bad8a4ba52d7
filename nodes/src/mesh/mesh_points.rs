//! [`MeshPoints`]: points spread evenly over a surface.
//!
//! See [`kernel::mesh::sow`](shibo_kernel::mesh::sow). Cost: O(points), about 12 candidates per point.
use super::at_points::AtPoints;
use glam::Vec3;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::mesh::sow::{MOST, normal, sow, wanted};
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Atlas, Stop, SurfaceNet, Tiling, Type};

/// Spreads points over a mesh, about equally far apart everywhere: the first stage of leather that grows on the surface
/// itself.
///
/// The points depend only on the mesh, not on its charts, so there are no seams.
///
/// ```ron
/// "ball": MeshShape(shape: Torus),
/// "atlas": MeshAtlas(mesh: "ball"),
/// "points": MeshPoints(atlas: "atlas", pitch: 4),
/// "links": ConnectMeshPoints(net: "points"),
/// "example": DrawMeshWrinkles(net: "links", atlas: "atlas", width: (0.5, 1.2), depth: 0.4),
/// ```
///
/// Elsewhere: Blender *Distribute Points on Faces* (Poisson disk); Houdini *Scatter*; Substance has none.
#[node]
pub struct MeshPoints {
    /// The atlas of the mesh, on which `density` lies.
    pub atlas: In<Atlas>,
    /// Density of the points, 0..1: at 1 they are a pitch apart, at ¼ two pitches, at low densities at most four; at 0
    /// there are none.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub density: Option<In<Gray>>,
    /// The mean distance between neighbours.
    #[schemars(range(min = 0.01, max = 1e5), extend("unit" = "mm"))]
    #[default(2.0)]
    pub pitch: f64,
    /// Another seed gives other points.
    pub seed: u64,
}

impl Node for MeshPoints {
    const OUTPUTS: &'static [Output] = &[Output::new("net", Type::SurfaceNet, "The points, without links.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let atlas = cx.get(&self.atlas)?;
        let count = wanted(atlas.area, self.pitch);
        if count > MOST {
            let message = format!("the mesh has room for about {count:.1e} points; at most {MOST:.0e} are made");
            return Err(Problem::new(Code::TooLarge, message).at("pitch").help("choose a larger pitch").into());
        }
        let density = cx.get_opt(&self.density)?;
        let read = density.map(|field| AtPoints::read(cx, &atlas, self.pitch, (&field, "density"))).transpose()?;
        let share = |triangle: usize, weights| read.as_ref().map_or(1.0, |read| read.at(&atlas, triangle, weights));
        let hash = Hash::new(cx.seed(self.seed));
        let sown = sow((&atlas.mesh, &atlas.smooth), self.pitch, &share, hash, &|| cx.check().is_err());
        cx.check()?;
        let normals: Vec<Vec3> = sown.iter().map(|point| normal(&atlas.mesh, &atlas.smooth, point)).collect();
        Ok(Outputs::one(SurfaceNet {
            mesh: atlas.mesh.clone(),
            positions: sown.iter().map(|point| point.place).collect(),
            triangles: sown.iter().map(|point| point.triangle).collect(),
            normals,
            pitch: self.pitch,
            links: Vec::new(),
            lengths: Vec::new(),
            broken: Vec::new(),
        }))
    }
}
