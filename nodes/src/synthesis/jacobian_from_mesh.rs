//! [`JacobianFromMesh`]: equation (4) of the source at each texel of an atlas.
//!
//! Source: JP5149288B2 III, claim 12 (rows C19, C22, C23): `J = (t b)⁺ J_f`, J_f of the texel's triangle, t and b at
//! its centre. Cost: about 0.2 µs a texel.
use glam::DVec2;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::mesh::frame::{Face, Framing, jacobian};
use shibo_kernel::mesh::texels;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Atlas, Field, FieldSource, Frames, Given, Grid, Read, Stop, Tile, Tiling, Type, Window};
use std::sync::Arc;

/// The rotation and scale of features on an atlas that makes them follow directions on the surface.
///
/// Beyond the charts and their gutters the Jacobian is 1. `SynthesizeSurface` does this automatically; use this node
/// for single stages, and to look at directions as pictures.
///
/// No other program has this: tangents in Substance and Blender are those of the UVs.
///
/// ```ron
/// "ball": MeshShape(shape: Torus),
/// "atlas": MeshAtlas(mesh: "ball"),
/// "flow": TangentField(mesh: "ball", from: Around),
/// "jacobian": JacobianFromMesh(atlas: "atlas", frames: "flow"),
/// "example": BakeNormal(atlas: "atlas"),
/// ```
#[node]
pub struct JacobianFromMesh {
    /// The atlas.
    pub atlas: In<Atlas>,
    /// Directions on its mesh.
    pub frames: In<Frames>,
    /// Rotation of the directions in the surface in degrees, clockwise seen from outside.
    pub angle: Option<In<Gray>>,
    /// Factor on the size of features.
    pub scale: Option<In<Gray>>,
}

/// The output that is computed from the frame at each texel.
#[derive(Clone, Copy, PartialEq)]
enum Shows {
    Jacobian,
    Along,
    Across,
}

struct Framed {
    atlas: Arc<Atlas>,
    frames: Arc<Frames>,
    angle: Option<Field>,
    scale: Option<Field>,
    shows: Shows,
}

/// Refuses frames of another mesh.
pub(super) fn of_one_mesh(atlas: &Atlas, frames: &Frames) -> Result<(), Problem> {
    let same = Arc::ptr_eq(&atlas.mesh, &frames.mesh)
        || (atlas.mesh.positions == frames.mesh.positions && atlas.mesh.triangles == frames.mesh.triangles);
    if same {
        return Ok(());
    }
    let message = format!(
        "the directions are of a mesh of {} triangles, the atlas of another one of {}",
        frames.mesh.triangles.len(),
        atlas.mesh.triangles.len()
    );
    let help = "connect the same mesh to TangentField and MeshAtlas";
    Err(Problem::new(Code::BadValue, message).at("frames").help(help))
}

impl FieldSource for Framed {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.angle.iter().chain(&self.scale).map(|field| Read::new(field, grid, window)).collect()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (grid, window, n) = (out.grid, out.window, out.window.len());
        let mut ids = vec![0.0f32; n];
        texels::fill(&self.atlas, &grid, window, &mut ids);
        let mut tiles = given.tiles();
        let angles = self.angle.as_ref().and_then(|_| tiles.next());
        let scales = self.scale.as_ref().and_then(|_| tiles.next());
        let framing = Framing { atlas: &self.atlas, frames: &self.frames };
        let mut face: Option<(usize, Face)> = None;
        let rest: &[f32] = if self.shows == Shows::Jacobian { &[1.0, 0.0, 0.0, 1.0] } else { &[0.5; 3] };
        for (p, id) in ids.into_iter().enumerate() {
            let Some(triangle) = texels::triangle(id) else {
                rest.iter().enumerate().for_each(|(c, v)| out.data_mut()[c * n + p] = *v);
                continue;
            };
            if face.as_ref().is_none_or(|(of, _)| *of != triangle) {
                face = Some((triangle, framing.face(triangle)));
            }
            let Some((_, face)) = &face else { continue };
            let step = |k: usize| i32::try_from(k).unwrap_or(i32::MAX);
            let (x, y) = (window.x + step(p % window.width as usize), window.y + step(p / window.width as usize));
            let at: DVec2 = grid.center(x, y) / self.atlas.size_mm;
            let angle = angles.map_or(0.0, |tile| f64::from(tile.plane(0)[p]).to_radians());
            let scale = scales.map_or(1.0, |tile| f64::from(tile.plane(0)[p]));
            let frame = face.frame_turned(at, angle, scale);
            let shown = |v: f64| 0.5 + 0.5 * v;
            let values: [f64; 4] = match self.shows {
                Shows::Jacobian => {
                    jacobian(frame, [face.jf[0] / self.atlas.size_mm.x, face.jf[1] / self.atlas.size_mm.y])
                }
                Shows::Along => [shown(frame[0].x), shown(frame[0].y), shown(frame[0].z), 0.0],
                Shows::Across => [shown(frame[1].x), shown(frame[1].y), shown(frame[1].z), 0.0],
            };
            (0..rest.len()).for_each(|c| out.data_mut()[c * n + p] = narrow(values[c]));
        }
        Ok(())
    }
}

impl Node for JacobianFromMesh {
    const FACTS: &'static [Fact] = &[];
    const OUTPUTS: &'static [Output] = &[
        Output::new("jacobian", Type::Jacobian, "From the canvas to the exemplar: J00 J01 J10 J11."),
        Output::new("t", Type::Rgb, "The direction of the exemplar's x axis in space, ½ + ½t."),
        Output::new("b", Type::Rgb, "The direction of its y axis, ½ + ½b."),
    ];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (atlas, frames) = (cx.get(&self.atlas)?, cx.get(&self.frames)?);
        of_one_mesh(&atlas, &frames)?;
        let (angle, scale) = (cx.get_opt(&self.angle)?, cx.get_opt(&self.scale)?);
        let field = |shows: Shows| {
            let (atlas, frames) = (Arc::clone(&atlas), Arc::clone(&frames));
            let ty = if shows == Shows::Jacobian { Type::Jacobian } else { Type::Rgb };
            Field::new(ty, Tiling::NONE, Framed { atlas, frames, angle: angle.clone(), scale: scale.clone(), shows })
        };
        let outputs = Outputs::one(field(Shows::Jacobian)).with("t", field(Shows::Along));
        Ok(outputs.with("b", field(Shows::Across)))
    }
}
