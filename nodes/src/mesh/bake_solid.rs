//! [`BakeSolid`]: the surface of a mesh cut out of a solid.
//!
//! Source: Momoi & Takatera 2014, §4.1, §4.2 (rows B25, B26, B29): surfaces of any form, placed anywhere in the tree, a
//! point for each pixel. Beyond the source: footprints that do not depend on the layout of the charts (row B30), and
//! parts cut from other places of the tree. Cost: that of the solid; more in `Space`, where the
//! channels of a material share their work.
use super::bake_parts::Parts;
use crate::on_atlas::normals;
use crate::shown::{shown, shown_channels};
use glam::DVec3;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::mesh::bake;
use shibo_kernel::mesh::fields;
use shibo_kernel::mesh::motion::{RigidMotion, Scatter, motions};
use shibo_kernel::surface::normal::{NormalSpec, SlopeFilter};
use shibo_node::{
    CanvasFacts, Context, Fact, In, InSpace, MaterialInputs, Node, Output, Outputs, SolidOrMaterial, choice, node,
};
use shibo_value::{
    Atlas, ChannelSet, Cut, Field, FieldSource, Given, Grid, PieceMap, Read, Solid, Stop, Tile, Tiling, Type, Window,
};
use std::sync::Arc;

/// Definition of the width of a texel, which matters where rings are thinner than texels.
#[choice]
pub enum Footprint {
    /// The same everywhere, along the surface: charts agree at their common border, unless the surface has a sharp edge
    /// there.
    #[default]
    Surface,
    /// The same everywhere, in all directions of space: charts agree everywhere. Takes longer, and blurs thin
    /// rings where the surface runs along them.
    Space,
    /// The width of each texel itself: sharpest where texels are stretched, but charts do not agree at borders.
    Texel,
}

/// The pieces that are each cut from another place of the solid.
#[choice]
pub enum CutBy {
    /// None: the mesh is cut out as a whole.
    #[default]
    None,
    /// Each part that the file names.
    Part,
    /// Each connected piece.
    Piece,
}

/// Orientation of parts in the solid.
#[choice]
pub enum AlignParts {
    /// As they lie in the mesh.
    #[default]
    None,
    /// Their longest axis along z, as boards along the trunk.
    Longest,
}

/// The texture of a mesh that is cut out of a solid: a turned bowl, a chair.
///
/// Each texel shows the solid at its place on the surface, in mm; the mesh and the solid share one space, z up along
/// the trunk. To cut the mesh from elsewhere, place the solid by `PlaceInTree` first. The texture continues for two
/// texels beyond charts; `DilateGutter` extends it farther.
///
/// On meshes `RingColor` makes the borders of years at least 0.06 years wide, unless its `border` is given: charts then
/// agree for rings of 24 texels and more.
///
/// ```ron
/// "nodes": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "time": TrunkTime(tree: "tree"),
/// "rings": ColorPattern(),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "placed": PlaceInTree(solid: "wood", position: (0, 70, 0)),
/// "ball": MeshShape(shape: Torus),
/// "atlas": MeshAtlas(mesh: "ball"),
/// "example": BakeSolid(atlas: "atlas", solid: "placed"),
/// ```
///
/// Elsewhere: Blender baking a procedural texture of *Object* coordinates; Houdini *Maps Baker*.
#[node]
pub struct BakeSolid {
    /// The atlas.
    pub atlas: In<Atlas>,
    /// The solid, or the material of solids, from which the mesh is cut.
    pub solid: In<InSpace>,
    /// Definition of the width of a texel.
    pub footprint: Footprint,
    /// The pieces that are each cut from another place.
    pub by: CutBy,
    /// With `by`: largest random shift of parts along x, y and z, either way.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e6, "unit" = "mm"))]
    pub spread: (f64, f64, f64),
    /// With `by`: largest random rotation of parts about z, either way.
    #[schemars(range(min = 0, max = 180), extend("unit" = "°"))]
    pub turn: f64,
    /// With `by`: orientation of parts in the solid.
    pub align: AlignParts,
    /// With `by`: another seed cuts parts from other places.
    pub seed: u64,
}

/// Bytes of numbers, for cache keys that tell apart the cuts of one atlas.
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
    /// Cache key of the motions of the parts.
    fn motion_key(&self, seed: u64) -> Vec<u8> {
        if self.by == CutBy::None {
            return Vec::new();
        }
        let (x, y, z) = self.spread;
        let upright = f64::from(u8::from(self.align == AlignParts::Longest));
        [&[self.by as u8][..], &bytes(&[x, y, z, self.turn, upright]), &seed.to_le_bytes()].concat()
    }

    /// The positions of texels in the solid.
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

    /// The cut of the solid along the surface.
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

/// Solids at the texels of an atlas, each texel computed on its own: the channels of one solid after those of another.
struct TexelsInSpace {
    solids: Vec<Solid>,
    place: Field,
    texels: Field,
    scale: f64,
}

/// Number of texels computed at a time.
const AT_ONCE: usize = 8192;

impl FieldSource for TexelsInSpace {
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
            let values = Solid::quads(&self.solids, &[&points[0], &points[1], &points[2]], pixel);
            let values = values.iter().flat_map(|values| values.chunks(some.len()));
            for (plane, values) in out.planes_mut().into_iter().zip(values) {
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

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        shown_channels(inputs.at("solid"))
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (atlas, solid, seed) = (cx.get(&self.atlas)?, cx.get(&self.solid)?, cx.seed(self.seed));
        let place = self.places(&atlas, seed);
        let normals = |height: &Field| {
            let (step, slope) = ([1.0; 2], SlopeFilter::default());
            let spec = NormalSpec { step, strength: 1.0, y_up: true, encode: true, slope };
            normals(height.clone(), atlas.clone(), spec)
        };
        if self.footprint != Footprint::Space {
            let cut = self.cut(&atlas, place, seed);
            return Ok(Outputs::one(shown(&solid, |solid| cx.cut(solid, &cut), normals)));
        }
        let solids: Vec<Solid> = match &solid {
            SolidOrMaterial::Solid(solid) => vec![solid.clone()],
            SolidOrMaterial::Material(material) => material.channels().iter().map(|(_, solid)| solid.clone()).collect(),
        };
        // The channels of a material have most of their work in common.
        let channels = solids.iter().map(Solid::channels).sum();
        let mut next = 0;
        let source = TexelsInSpace { solids, place, texels: fields::texels(&atlas), scale: atlas.scale() };
        let all = cx.shared_field("channels", Field::bundle(channels, Tiling::NONE, source).overwriting());
        let baked = |solid: &Solid| {
            let first = next;
            next += solid.channels();
            all.pick(solid.field_type(), (first..next).collect::<Vec<_>>())
        };
        Ok(Outputs::one(shown(&solid, baked, normals)))
    }
}

#[cfg(test)]
mod tests;
