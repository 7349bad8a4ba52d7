//! Values of wires: objects, which are computed whole, and fields, which are evaluated lazily by tiles. Contains data
//! and accessors, no algorithms. Beside them are [`diagnostics`], [`expression`], [`clock`] and [`files`], which all
//! crates above use.
//!
//! Rules for all crates of the engine:
//! - Lengths are millimetres, on the canvas and in heights. Angles are degrees in graph files, radians inside. `y`
//!   points down.
//! - User input never causes a panic; errors are [`diagnostics::Problem`]s that the graph turns into located
//!   diagnostics.
//! - Results depend only on the graph: never on threads, tile order, machine or the state of a cache.
//!
//! To add an object type, write a file with the struct and its [`Object`] implementation, and add a line to the table
//! `objects` below.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions"))]
mod accepts;
mod area;
mod atlas;
mod buffer;
mod canvas;
mod color;
mod color_pattern;
mod constant_solid;
mod coord_map;
mod curve;
mod cut;
mod cuts;
mod data;
mod domain;
mod evaluator;
mod exemplar;
mod field;
mod field_source;
mod frames;
mod indirection;
mod key;
mod lattice;
mod link;
mod material;
mod mesh;
mod nearest;
mod object;
mod path;
mod points;
mod quads;
mod scalar_map;
mod segments;
mod shown;
mod skeleton;
mod sketch;
mod solid;
mod spring_net;
mod stop;
mod surface;
mod surface_net;
mod tile;
mod tree;
mod ty;

pub mod clock;
pub mod codec;
pub mod diagnostics;
pub mod expression;
pub mod files;

pub use accepts::Accepts;
pub use area::Area;
pub use atlas::{Atlas, Bins};
pub use buffer::Buffer;
pub use buffer::hold_back;
pub use canvas::{Canvas, Grid, GridId, Resolution, TileMode, Tiling, Window};
pub use color::{linear_to_srgb, parse_color, srgb_to_linear};
pub use color_pattern::ColorPattern;
pub use coord_map::CoordMap;
pub use curve::Curve;
pub use cut::{Cut, PieceAxes, PieceMap, PiecePlanes};
pub use cuts::Cuts;
pub use data::{Number, ObjectData};
pub use domain::{Blocks, Domain, Piece, TILE};
pub use evaluator::Evaluator;
pub use exemplar::{Exemplar, ExemplarFrame, ExemplarLattice, ExemplarLevel, Neighborhood};
pub use field::{Field, FieldId, Halo};
pub use field_source::{Cost, FieldSource, Given, Pictures, Read};
pub use frames::Frames;
pub use indirection::{IndirectionLevel, IndirectionMap, Jump, Jump8, Parent};
pub use key::Key;
pub use lattice::{GridLinks, Lattice};
pub use material::{Channel, ChannelSet, ChannelValue, Channels, Material, SolidMaterial};
pub use mesh::Mesh;
pub use nearest::Nearest;
pub use object::{Carried, Object, Renders};
pub use path::{Path, Polyline};
pub use points::{Edges, GridOrder, Points};
pub use quads::SharedValues;
pub use scalar_map::ScalarMap;
pub use segments::{Segments, clip_line};
pub use skeleton::{Branch, Skeleton};
pub use sketch::{Pixels, Shapes, Sketch};
pub use solid::{Listener, Patch, PatchPieces, Planes, Solid, SolidSource, Wants};
pub use spring_net::SpringNet;
pub use stop::Stop;
pub use surface::{Seam, Surface};
pub use surface_net::SurfaceNet;
pub use tile::Tile;
pub use tree::Tree;
pub use ty::Type;

use std::any::Any;
use std::sync::{Arc, Weak};

/// The fingerprint of this crate's code and of the libraries that it uses.
pub const CODE: &str = env!("CODE_FINGERPRINT");

/// The table of all object types: name, colour in drawings of graphs, description. The macro `$make` gets these lines
/// after the lines of the caller, and generates code from them.
macro_rules! objects {
    ($make:ident! { $($before:tt)* }) => {
        $make! {
            $($before)*
            Points       "#3f9c5a" "Positions.",
            Lattice      "#2f8f86" "Points and links between them.",
            SpringNet    "#c2503e" "A lattice whose links are springs.",
            Segments     "#8a6d3b" "Line segments.",
            Path         "#8a6d3b" "Lines and curves on the canvas.",
            Curve        "#6b4a2b" "Points of a line in space.",
            Skeleton     "#6b4a2b" "The line along which a trunk grew, and its branches.",
            Tree         "#6b4a2b" "A trunk and its branches, and how fast they grew.",
            ColorPattern "#d0a21d" "The colours of wood through the year.",
            Mesh         "#4b6f9e" "A surface of triangles in space.",
            Atlas        "#4b6f9e" "A mesh laid out on the canvas.",
            Frames       "#c2503e" "Directions on a mesh.",
            SurfaceNet   "#2f8f86" "Points on a mesh and links between them.",
            IndirectionMap "#7a4fa3" "For the pixels of an atlas, which lie beside them on the surface.",
            Exemplar     "#7a4fa3" "A picture to synthesise from.",
            CoordMap     "#7a4fa3" "For each pixel of an output, a position in an exemplar.",
        }
    };
}
pub(crate) use objects;

/// A picture file on the canvas, as the two fields that it can be used as.
#[derive(Clone, Debug)]
pub struct PictureFields {
    /// Its only channel, or its luminance.
    pub gray: Field,
    /// Its colour, scene-linear.
    pub rgb: Field,
    /// True if it has one channel: a port for any field then takes `gray`.
    pub is_gray: bool,
}

/// A weak reference that tells whether an object is still alive.
pub type Handle = Weak<dyn Any + Send + Sync>;

macro_rules! values {
    ($($name:ident $color:literal $doc:literal,)*) => {
        /// A value of a wire.
        #[derive(Clone, Debug)]
        #[non_exhaustive]
        pub enum Value {
            /// A field, of any field type.
            Field(Field),
            /// A picture file.
            Picture(Arc<PictureFields>),
            /// A solid, of any solid type.
            Solid(Solid),
            /// A material.
            Material(Arc<Material>),
            /// A material in space.
            SolidMaterial(Arc<SolidMaterial>),
            $(#[doc = $doc] $name(Arc<$name>),)*
        }

        impl Value {
            /// Its type.
            pub fn ty(&self) -> Type {
                match self {
                    Self::Field(field) => field.ty(),
                    Self::Picture(_) => Type::Picture,
                    Self::Solid(solid) => solid.ty(),
                    Self::Material(_) => Type::Material,
                    Self::SolidMaterial(_) => Type::SolidMaterial,
                    $(Self::$name(_) => Type::$name,)*
                }
            }

            /// Its memory in bytes, including data that it shares with other values.
            pub fn bytes(&self) -> usize {
                match self {
                    Self::Field(field) => field.source().bytes() + size_of::<Field>(),
                    Self::Picture(picture) => picture.rgb.source().bytes() + size_of::<PictureFields>(),
                    Self::Solid(solid) => solid.bytes(),
                    Self::Material(material) => material.channels().len() * size_of::<Field>(),
                    Self::SolidMaterial(material) => material.channels().iter().map(|(_, solid)| solid.bytes()).sum(),
                    $(Self::$name(object) => object.bytes(),)*
                }
            }

            /// A handle that tells whether an object is still alive; `None` for values that are evaluated later.
            pub fn handle(&self) -> Option<Handle> {
                match self {
                    Self::Field(_) | Self::Picture(_) | Self::Solid(_) | Self::Material(_) | Self::SolidMaterial(_) => {
                        None
                    }
                    $(Self::$name(object) => Some(Arc::downgrade(object) as Handle),)*
                }
            }

            /// The field in this value, if it is one.
            pub fn field(&self) -> Option<Field> {
                match self {
                    Self::Field(field) => Some(field.clone()),
                    Self::Picture(picture) => Some(picture.rgb.clone()),
                    _ => None,
                }
            }

            /// The field that is rendered for it, if any, with metadata for the files: names and texts.
            pub fn rendered(&self) -> Option<(Field, Vec<(String, String)>)> {
                match self {
                    $(Self::$name(object) => object.rendered(),)*
                    _ => self.field().map(|field| (field, Vec::new())),
                }
            }

            /// The lines that are rendered for it, if any.
            pub fn lines(&self) -> Option<Arc<Segments>> {
                match self {
                    $(Self::$name(object) => object.lines(),)*
                    _ => None,
                }
            }

            /// The sketch of an object; `None` for other values.
            pub fn sketch(&self) -> Option<Sketch> {
                match self {
                    $(Self::$name(object) => object.sketch(),)*
                    _ => None,
                }
            }
        }

        $(impl Carried for $name {
            const TYPE: Type = Type::$name;

            fn wrap(object: Arc<Self>) -> Value {
                Value::$name(object)
            }

            fn unwrap(value: Value) -> Option<Arc<Self>> {
                match value {
                    Value::$name(object) => Some(object),
                    _ => None,
                }
            }
        })*
    };
}

objects! { values! {} }

impl Value {
    /// Its fields; empty for objects and solids.
    pub fn fields(&self) -> Vec<Field> {
        match self {
            Self::Field(field) => vec![field.clone()],
            Self::Picture(picture) => vec![picture.gray.clone(), picture.rgb.clone()],
            Self::Material(material) => material.channels().iter().map(|(_, field)| field.clone()).collect(),
            _ => Vec::new(),
        }
    }
}
