//! What wires carry: objects, computed whole, and fields, evaluated lazily by tiles. Data and accessors, no algorithm.
mod area;
mod buffer;
mod canvas;
mod color;
mod cut;
mod cuts;
mod domain;
mod exemplar;
mod field;
mod key;
mod lattice;
mod link;
mod material;
mod points;
mod segments;
mod solid;
mod tile;
mod ty;
mod wood;

pub use area::Area;
pub use buffer::Buffer;
pub use canvas::{Canvas, Grid, GridId, TileMode, Tiling, Window};
pub use color::{linear_to_srgb, srgb_to_linear};
pub use cut::Cut;
pub use cuts::Cuts;
pub use domain::{Blocks, Domain, Piece, TILE};
pub use exemplar::{CoordMap, Exemplar, ExemplarFrame, ExemplarLattice, ExemplarLevel, Neighborhood};
pub use field::{Cost, Evaluator, Field, FieldId, FieldSource, Given, Halo, Pictures, Read, Stop};
pub use key::Key;
pub use lattice::{GridLinks, Lattice, LiveMass, SpringNet};
pub use material::{Channel, Material};
pub use points::{GridOrder, Points};
pub use segments::{Segments, clip_line};
pub use solid::{Patch, Planes, Solid, SolidSource, Wants};
pub use tile::Tile;
pub use ty::Type;
pub use wood::{Branch, ColorPattern, Curve, Skeleton};

use std::sync::Arc;

/// A picture file on the canvas, as the two fields it can serve as.
#[derive(Clone, Debug)]
pub struct PictureFields {
    /// Its only channel, or its luminance.
    pub gray: Field,
    /// Its colour, scene-linear.
    pub rgb: Field,
}

/// What a wire carries.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Value {
    /// Any of the field types.
    Field(Field),
    /// A picture file.
    Picture(Arc<PictureFields>),
    /// Positions.
    Points(Arc<Points>),
    /// Points and links.
    Lattice(Arc<Lattice>),
    /// Springs.
    SpringNet(Arc<SpringNet>),
    /// Line segments.
    Segments(Arc<Segments>),
    /// Points of a line in space.
    Curve(Arc<Curve>),
    /// The line along which a trunk grew, and its branches.
    Skeleton(Arc<Skeleton>),
    /// The colours of wood through the year.
    ColorPattern(Arc<ColorPattern>),
    /// Any of the solid types.
    Solid(Solid),
    /// Channels of a surface.
    Material(Arc<Material>),
    /// A picture to synthesise from.
    Exemplar(Arc<Exemplar>),
    /// Positions in an exemplar.
    CoordMap(Arc<CoordMap>),
}

impl Value {
    /// The type it has.
    pub fn ty(&self) -> Type {
        match self {
            Self::Field(field) => field.ty(),
            Self::Picture(_) => Type::Picture,
            Self::Points(_) => Type::Points,
            Self::Lattice(_) => Type::Lattice,
            Self::SpringNet(_) => Type::SpringNet,
            Self::Segments(_) => Type::Segments,
            Self::Curve(_) => Type::Curve,
            Self::Skeleton(_) => Type::Skeleton,
            Self::ColorPattern(_) => Type::ColorPattern,
            Self::Solid(solid) => solid.ty(),
            Self::Material(_) => Type::Material,
            Self::Exemplar(_) => Type::Exemplar,
            Self::CoordMap(_) => Type::CoordMap,
        }
    }

    /// The memory it takes; what several values share counts in each of them.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Field(field) => field.source().bytes() + size_of::<Field>(),
            Self::Picture(picture) => picture.rgb.source().bytes() + size_of::<PictureFields>(),
            Self::Points(points) => points.bytes(),
            Self::Lattice(lattice) => lattice.bytes(),
            Self::SpringNet(springs) => springs.bytes(),
            Self::Segments(segments) => segments.bytes(),
            Self::Exemplar(exemplar) => exemplar.bytes(),
            Self::CoordMap(map) => map.bytes(),
            Self::Curve(curve) => curve.bytes(),
            Self::Skeleton(skeleton) => skeleton.bytes(),
            Self::ColorPattern(pattern) => pattern.bytes(),
            Self::Solid(solid) => solid.bytes(),
            Self::Material(material) => material.channels().len() * size_of::<Field>(),
        }
    }

    /// The value as it goes into a port of type `port`, by the table of [`Type::fits`].
    pub fn convert(&self, port: Type) -> Option<Self> {
        if !self.ty().fits(port) {
            return None;
        }
        Some(match (self, port) {
            (Self::Field(field), Type::Rgb | Type::Normal) => Self::Field(field.to_rgb()),
            (Self::Picture(picture), Type::Gray) => Self::Field(picture.gray.clone()),
            (Self::Picture(picture), Type::Rgb | Type::Normal | Type::Field) => Self::Field(picture.rgb.clone()),
            (value, _) => value.clone(),
        })
    }
}
