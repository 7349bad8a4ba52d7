//! [`BakeSolid`]: what a surface shows of a solid.
//!
//! Source: Momoi & Takatera 2014, §4.1, §4.2 (rows B25, B26, B29): surfaces of any form, placed anywhere in the tree, a
//! point for each pixel. Beyond the source: footprints that do not depend on how charts lie on the canvas (row B30), and
//! parts from other places of the tree. Cost: that of the solid; about three times as much in `Space`.
use super::bake_parts::Parts;
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::node::{AnySolid, CanvasFacts, Context, Fact, In, Node, Output, Outputs};
use shibo_engine::value::{
    Atlas, Cut, Field, FieldSource, Given, Grid, PieceMap, Read, Solid, Stop, Tile, Tiling, Type, Window,
};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::mesh::bake;
use shibo_kernel::mesh::fields;
use shibo_kernel::mesh::motion::{RigidMotion, Scatter, motions};
use std::sync::Arc;

/// What the width of a texel is, where rings are thinner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Footprint {
    /// The same everywhere, along the surface: charts agree about their common border, unless the surface has an edge there.
    #[default]
    Surface,
    /// The same everywhere, in all directions of space: charts agree everywhere. Takes about three times as long, and makes thin
    /// rings softer where the surface runs along them.
    Space,
    /// The texel's own: sharpest where texels are stretched, but charts do not agree.
    Texel,
}

/// What is cut from another place of the solid each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum CutBy {
    /// Nothing: the mesh is cut out as it is.
    #[default]
    None,
    /// Each part that the file names.
    Part,
    /// Each piece that is connected in space.
    Piece,
}

/// How parts lie in the solid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum AlignParts {
    /// As they lie in the mesh.
    #[default]
    None,
    /// Their longest axis along z, as boards along the trunk.
    Longest,
}

/// The texture of a mesh that is cut out of a solid: a turned bowl, a chair.
///
/// Each texel shows the solid at its place on the surface, in mm; the mesh and the solid share one space, z up along the
/// trunk. Place the solid by `PlaceInTree` first to cut the mesh from elsewhere. It goes on for two texels beyond charts;
/// `DilateGutter` carries it farther.
///
/// Here `RingColor` makes the borders of years at least 0.06 years wide, unless its `border` says otherwise: charts then agree
/// about rings of 24 texels and more.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "time": TrunkTime(skeleton: "tree"),
/// "rings": ColorPattern(),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "placed": PlaceInTree(solid: "wood", position: (0, 70, 0)),
/// "ball": MeshShape(shape: Torus),
/// "atlas": MeshAtlas(mesh: "ball"),
/// "example": BakeSolid(atlas: "atlas", solid: "placed"),
/// ```
///
/// Elsewhere: Blender baking a procedural texture of *Object* coordinates; Houdini *Maps Baker*.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BakeSolid {
    /// The atlas.
    pub atlas: In<Atlas>,
    /// What the mesh is cut out of.
    pub solid: In<AnySolid>,
    /// What the width of a texel is.
    pub footprint: Footprint,
    /// What is cut from another place each.
    pub by: CutBy,
    /// With `by`: how far parts are moved at most along x, y and z, one way or the other.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e6, "unit" = "mm"))]
    pub spread: (f64, f64, f64),
    /// With `by`: how far parts are turned at most about z, one way or the other.
    #[schemars(range(min = 0, max = 180), extend("unit" = "°"))]
    pub turn: f64,
    /// With `by`: how parts lie.
    pub align: AlignParts,
    /// With `by`: another number cuts them elsewhere.
    pub seed: u64,
}

/// What tells a cut from others of the same atlas.
fn bytes(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|n| (n + 0.0).to_bits().to_le_bytes()).collect()
}

/// The texel size that 95 % of the triangles do not exceed, as mm on the surface for a mm of canvas.
fn largest(atlas: &Atlas) -> f64 {
    let mut sizes: Vec<f64> = (0..atlas.uvs.len()).map(|n| bake::stretch(atlas, n)[0]).collect();
    sizes.sort_by(f64::total_cmp);
    sizes[(sizes.len() - 1) * 19 / 20]
}

impl BakeSolid {
    /// The numbers that tell motions apart.
    fn motion_key(&self, seed: u64) -> Vec<u8> {
        if self.by == CutBy::None {
            return Vec::new();
        }
        let (x, y, z) = self.spread;
        let upright = f64::from(u8::from(self.align == AlignParts::Longest));
        [&[self.by as u8][..], &bytes(&[x, y, z, self.turn, upright]), &seed.to_le_bytes()].concat()
    }

    /// The places of texels in the solid.
    fn places(&self, atlas: &Arc<Atlas>, seed: u64) -> Field {
        let of: Vec<u32> = match self.by {
            CutBy::None => return fields::places(atlas),
            CutBy::Part => atlas.mesh.parts.iter().map(|n| u32::from(*n)).collect(),
            CutBy::Piece => atlas.mesh.pieces().0,
        };
        let scatter = Scatter {
            spread: DVec3::from(self.spread),
            turn: self.turn.to_radians(),
            upright: self.align == AlignParts::Longest,
            hash: Hash::new(seed),
        };
        let motions = motions(&atlas.mesh, &of, &scatter);
        let motion = move |n: usize| {
            of.get(n).and_then(|part| motions.get(*part as usize)).map_or(RigidMotion::NONE, |motion| *motion)
        };
        let places = fields::baked(Type::Rgb, atlas, move |texels, planes| {
            if let Ok(planes) = <[&mut [f32]; 3]>::try_from(planes) {
                bake::places(texels, &motion, planes);
            }
        });
        places.keyed(atlas.key_of("places of parts", &self.motion_key(seed)))
    }

    /// The cut that the surface makes.
    fn cut(&self, atlas: &Arc<Atlas>, place: Field, seed: u64) -> Cut {
        let parameters = [&[self.footprint as u8][..], &self.motion_key(seed)].concat();
        let key = atlas.key_of("surface of a mesh", &parameters);
        let ids = Parts::Chart.field(atlas).keyed(atlas.key_of("charts", &[]));
        let scale = if self.footprint == Footprint::Texel { largest(atlas) } else { atlas.scale() };
        let pieces = PieceMap { ids, planes: None, holes: true };
        let rounded = fields::baked(Type::Rgb, atlas, |texels, planes| {
            if let Ok(planes) = <[&mut [f32]; 3]>::try_from(planes) {
                bake::rounded(texels, planes);
            }
        });
        let rounded = rounded.keyed(atlas.key_of("normals on facets", &[]));
        let cut = Cut::new(key, place, move |grid| width(scale, grid)).with_pieces(pieces).with_rounded(rounded);
        if self.footprint == Footprint::Texel {
            return cut;
        }
        let metric = fields::baked(Type::Rgb, atlas, |texels, planes| {
            if let Ok(planes) = <[&mut [f32]; 3]>::try_from(planes) {
                bake::metric(texels, planes);
            }
        });
        cut.with_metric(metric.keyed(atlas.key_of("metric", &[])))
    }
}

/// The width of a texel in mm where a mm of canvas is `scale` mm.
fn width(scale: f64, grid: &Grid) -> f64 {
    scale * (grid.step.x * grid.step.y).sqrt()
}

/// A solid at the texels of an atlas, each for itself.
struct InSpace {
    solid: Solid,
    place: Field,
    texels: Field,
    scale: f64,
}

/// So many texels are computed at a time.
const AT_ONCE: usize = 8192;

impl FieldSource for InSpace {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        [&self.place, &self.texels].map(|field| Read::new(field, grid, window)).into()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (place, texels) = (given.tile(0), given.tile(1));
        let pixel = narrow(width(self.scale, &out.grid));
        out.data_mut().fill(0.0);
        let owned: Vec<usize> = (0..texels.window.len()).filter(|k| texels.plane(0)[*k] != 0.0).collect();
        for some in owned.chunks(AT_ONCE) {
            given.check()?;
            let points = [0, 1, 2].map(|axis| some.iter().map(|k| place.plane(axis)[*k]).collect::<Vec<f32>>());
            let values = self.solid.quads(&[&points[0], &points[1], &points[2]], pixel);
            for (plane, values) in out.planes_mut().into_iter().zip(values.chunks(some.len())) {
                some.iter().zip(values).for_each(|(k, value)| plane[*k] = *value);
            }
        }
        Ok(())
    }
}

impl Node for BakeSolid {
    const OUTPUTS: &'static [Output] = &[Output::like("value", &["solid"], "What the surface shows of the solid.")];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (atlas, solid, seed) = (cx.get(&self.atlas)?, cx.get(&self.solid)?, cx.seed(self.seed));
        let place = self.places(&atlas, seed);
        if self.footprint != Footprint::Space {
            return Ok(Outputs::one(cx.cut(&solid, &self.cut(&atlas, place, seed))));
        }
        let ty = solid.field_type();
        let source = InSpace { solid, place, texels: fields::texels(&atlas), scale: atlas.scale() };
        Ok(Outputs::one(Field::new(ty, Tiling::NONE, source).overwriting()))
    }
}

#[cfg(test)]
mod tests;
