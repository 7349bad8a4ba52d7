//! [`ConnectMeshPoints`]: links between points of a surface.
//!
//! See [`kernel::mesh::links`](shibo_kernel::mesh::links). Cost: O(points · neighbours).
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::mesh::links::Points;
use shibo_node::{Context, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Stop, SurfaceNet, Type};

/// Rule that decides which points of a surface are linked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum MeshNeighbors {
    /// Neighbours: points whose cells touch, about six for each.
    #[default]
    Delaunay,
    /// All points that are at most this many mm apart.
    Radius(f64),
}

/// Maximum number of links.
const MOST: usize = 4_000_000;

/// Links the points of a mesh with their neighbours.
///
/// ```ron
/// "ball": MeshShape(shape: Sphere),
/// "atlas": MeshAtlas(mesh: "ball"),
/// "points": MeshPoints(atlas: "atlas", pitch: 5),
/// "links": ConnectMeshPoints(net: "points"),
/// "example": DrawMeshWrinkles(net: "links", atlas: "atlas", width: 1, depth: 0.4),
/// ```
///
/// Elsewhere: Houdini *Connect Adjacent Pieces*; Blender and Substance have none.
#[node]
pub struct ConnectMeshPoints {
    /// The points.
    pub net: In<SurfaceNet>,
    /// Rule that decides which points are linked.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    #[default(MeshNeighbors::Delaunay)]
    pub neighbors: MeshNeighbors,
    /// With `Delaunay`: the largest distance between linked points.
    #[schemars(range(min = 1, max = 10), extend("unit" = "pitch"))]
    #[default(2.5)]
    pub longest: f64,
}

impl Node for ConnectMeshPoints {
    const OUTPUTS: &'static [Output] = &[Output::new("net", Type::SurfaceNet, "The points with their links.")];
    const FACTS: &'static [shibo_node::Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let net = cx.get(&self.net)?;
        let points = Points { places: &net.positions, normals: &net.normals };
        if let MeshNeighbors::Radius(radius) = self.neighbors {
            let around = std::f64::consts::PI * (radius / net.pitch).powi(2);
            let expected = 0.5 * around * net.positions.len() as f64;
            if expected > MOST as f64 {
                let message = format!(
                    "neighbors is `Radius({radius})`, which gives about {expected:.0e} links; at most {MOST} are made"
                );
                return Err(Problem::new(Code::TooLarge, message)
                    .at("neighbors")
                    .help("choose a smaller radius")
                    .into());
            }
        }
        let links = match self.neighbors {
            MeshNeighbors::Delaunay => points.delaunay(self.longest * net.pitch),
            MeshNeighbors::Radius(radius) if radius > 0.0 => points.within(radius),
            MeshNeighbors::Radius(_) => Vec::new(),
        };
        cx.check()?;
        let mut linked = SurfaceNet { links, broken: Vec::new(), ..SurfaceNet::clone(&net) };
        linked.lengths = (0..linked.links.len()).map(|link| narrow(linked.span(link).length())).collect();
        Ok(Outputs::one(linked))
    }
}
