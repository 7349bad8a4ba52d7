//! The types of wires, and the conversions between them.
use serde::{Deserialize, Serialize};
use std::fmt;

/// What a wire carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Type {
    /// One number everywhere on the canvas.
    Gray,
    /// Scene-linear colour everywhere on the canvas.
    Rgb,
    /// A tangent-space normal `n` everywhere on the canvas, kept as `½ + ½n`; y points up unless its node says otherwise.
    Normal,
    /// A vector everywhere on the canvas; displacements are in mm.
    Vec2,
    /// A 2×2 matrix everywhere on the canvas.
    Jacobian,
    /// A region number everywhere on the canvas: whole, below 2^24.
    Ids,
    /// A picture file placed on the canvas; serves as `Gray` and as `Rgb`.
    Picture,
    /// In ports only: `Gray` or `Rgb`.
    Field,
    /// Positions.
    Points,
    /// Points and links between them.
    Lattice,
    /// A lattice whose links are springs.
    SpringNet,
    /// Line segments.
    Segments,
    /// Points of a line in space.
    Curve,
    /// The line along which a trunk grew, and its branches.
    Skeleton,
    /// The colours of wood through the year.
    ColorPattern,
    /// One number at every point in space.
    Solid,
    /// Scene-linear colour at every point in space.
    SolidColor,
    /// A vector at every point in space.
    SolidVector,
    /// In ports only: `Solid`, `SolidColor` or `SolidVector`.
    AnySolid,
    /// Named channels of a surface.
    Material,
    /// A picture to synthesise from.
    Exemplar,
    /// For each pixel of an output, a position in an exemplar.
    CoordMap,
}

impl Type {
    /// All types.
    pub const ALL: [Self; 22] = [
        Self::Gray,
        Self::Rgb,
        Self::Normal,
        Self::Vec2,
        Self::Jacobian,
        Self::Ids,
        Self::Picture,
        Self::Field,
        Self::Points,
        Self::Lattice,
        Self::SpringNet,
        Self::Segments,
        Self::Curve,
        Self::Skeleton,
        Self::ColorPattern,
        Self::Solid,
        Self::SolidColor,
        Self::SolidVector,
        Self::AnySolid,
        Self::Material,
        Self::Exemplar,
        Self::CoordMap,
    ];

    /// The name as users read it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gray => "Gray",
            Self::Rgb => "Rgb",
            Self::Normal => "Normal",
            Self::Vec2 => "Vec2",
            Self::Jacobian => "Jacobian",
            Self::Ids => "Ids",
            Self::Picture => "Picture",
            Self::Field => "Field",
            Self::Points => "Points",
            Self::Lattice => "Lattice",
            Self::SpringNet => "SpringNet",
            Self::Segments => "Segments",
            Self::Curve => "Curve",
            Self::Skeleton => "Skeleton",
            Self::ColorPattern => "ColorPattern",
            Self::Solid => "Solid",
            Self::SolidColor => "SolidColor",
            Self::SolidVector => "SolidVector",
            Self::AnySolid => "AnySolid",
            Self::Material => "Material",
            Self::Exemplar => "Exemplar",
            Self::CoordMap => "CoordMap",
        }
    }

    /// The type of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|ty| ty.name() == name)
    }

    /// Whether it is evaluated by tiles.
    pub const fn is_field(self) -> bool {
        matches!(self, Self::Gray | Self::Rgb | Self::Normal | Self::Vec2 | Self::Jacobian | Self::Ids | Self::Field)
    }

    /// Whether it is a function of a point in space.
    pub const fn is_solid(self) -> bool {
        matches!(self, Self::Solid | Self::SolidColor | Self::SolidVector | Self::AnySolid)
    }

    /// The number of channels of a field or a solid; 0 for anything else.
    pub const fn channels(self) -> usize {
        match self {
            Self::Gray | Self::Ids | Self::Solid => 1,
            Self::Rgb | Self::Normal | Self::SolidColor | Self::SolidVector => 3,
            Self::Vec2 => 2,
            Self::Jacobian => 4,
            _ => 0,
        }
    }

    /// The table of conversions: whether a wire of this type may go into a port of type `port`.
    ///
    /// A type goes into itself; `Gray` → `Rgb` is grey; `Picture` → `Gray` is its only channel or its luminance,
    /// `Picture` → `Rgb` its colour; `Normal` and `Rgb` go into each other as they are, and so does `Picture` → `Normal`;
    /// a `Field` port takes `Gray`, `Rgb`, `Normal` and, as `Rgb`, `Picture`; an `AnySolid` port takes every solid. Literals (a number for `Gray`, a number or a
    /// colour for `Rgb`) become constant fields.
    pub const fn fits(self, port: Self) -> bool {
        matches!(
            (self, port),
            (Self::Gray, Self::Rgb | Self::Field)
                | (Self::Picture, Self::Gray | Self::Rgb | Self::Normal | Self::Field)
                | (Self::Rgb, Self::Normal | Self::Field)
                | (Self::Normal, Self::Rgb | Self::Field)
                | (Self::Solid | Self::SolidColor | Self::SolidVector, Self::AnySolid)
        ) || self as u8 == port as u8
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
