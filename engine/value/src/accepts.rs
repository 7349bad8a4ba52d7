//! Types that ports accept, and the conversions into them.
use super::{Solid, Tree, Type, Value};
use std::fmt;

/// Types that a port accepts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Accepts {
    /// Values of one type, and values that can be converted to it.
    One(Type),
    /// A field of numbers or colours: `Gray`, `Rgb` or `Normal`.
    Field,
    /// Any field.
    EveryField,
    /// A field of vectors whose components are used separately: `Rgb`, `Normal` or `Vec2`.
    AnyVector,
    /// A direction: degrees from +x towards +y (`Gray`), or a vector of any length (`Vec2`).
    Direction,
    /// Any solid.
    AnySolid,
    /// One number on the canvas or in space: `Gray` or `Solid`.
    Number,
    /// A colour on the canvas or in space: `Rgb` or `SolidColor`.
    Color,
    /// A normal on the canvas, or for cuts of a solid: `Normal` or `SolidVector`.
    AnyNormal,
    /// A material on the canvas or in space.
    AnyMaterial,
    /// Anything in space: a solid, or a material of solids.
    InSpace,
    /// Numbers or colours on the canvas or in space: a `Field`, or any solid.
    FieldOrSolid,
    /// Any field, or any solid.
    EveryFieldOrSolid,
    /// Any field, or a material on the canvas.
    FieldOrMaterial,
}

impl From<Type> for Accepts {
    fn from(ty: Type) -> Self {
        Self::One(ty)
    }
}

impl Accepts {
    /// All variants.
    pub fn all() -> impl Iterator<Item = Self> {
        let several = [
            Self::Field,
            Self::EveryField,
            Self::AnyVector,
            Self::Direction,
            Self::AnySolid,
            Self::Number,
            Self::Color,
            Self::AnyNormal,
            Self::AnyMaterial,
            Self::InSpace,
            Self::FieldOrSolid,
            Self::EveryFieldOrSolid,
            Self::FieldOrMaterial,
        ];
        Type::ALL.iter().copied().map(Self::One).chain(several)
    }

    /// The name as users read it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::One(ty) => ty.name(),
            Self::Field => "Field",
            Self::EveryField => "EveryField",
            Self::AnyVector => "AnyVector",
            Self::Direction => "Direction",
            Self::AnySolid => "AnySolid",
            Self::Number => "Number",
            Self::Color => "Color",
            Self::AnyNormal => "AnyNormal",
            Self::AnyMaterial => "AnyMaterial",
            Self::InSpace => "InSpace",
            Self::FieldOrSolid => "FieldOrSolid",
            Self::EveryFieldOrSolid => "EveryFieldOrSolid",
            Self::FieldOrMaterial => "FieldOrMaterial",
        }
    }

    /// The variant with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::all().find(|accepts| accepts.name() == name)
    }

    /// Type of the converted values, if it is always the same.
    pub const fn only(self) -> Option<Type> {
        match self {
            Self::One(ty) => Some(ty),
            Self::Direction => Some(Type::Gray),
            Self::Field
            | Self::EveryField
            | Self::AnyVector
            | Self::AnySolid
            | Self::Number
            | Self::Color
            | Self::AnyNormal
            | Self::AnyMaterial
            | Self::InSpace
            | Self::FieldOrSolid
            | Self::EveryFieldOrSolid
            | Self::FieldOrMaterial => None,
        }
    }

    /// For a port that takes solids: the type of solid that a constant field of type `field` becomes there.
    pub const fn solid_of(self, field: Type) -> Option<Type> {
        match (self, field) {
            (Self::One(ty @ (Type::Solid | Type::SolidColor | Type::SolidVector)), Type::Gray) => Some(ty),
            (Self::One(ty @ (Type::SolidColor | Type::SolidVector)), Type::Rgb) => Some(ty),
            (Self::AnySolid | Self::InSpace, Type::Gray) => Some(Type::Solid),
            (Self::AnySolid | Self::InSpace, Type::Rgb) => Some(Type::SolidColor),
            _ => None,
        }
    }

    /// True for ports that take values on the canvas and in space.
    pub const fn is_anywhere(self) -> bool {
        matches!(
            self,
            Self::Number
                | Self::Color
                | Self::AnyNormal
                | Self::AnyMaterial
                | Self::FieldOrSolid
                | Self::EveryFieldOrSolid
        )
    }

    /// True if the port `other` accepts everything that this port accepts. A port that accepts several types fits only
    /// into a port that accepts the same ones.
    pub fn fits(self, other: Self) -> bool {
        match self {
            Self::One(ty) => ty.fits(other),
            Self::Field => matches!(other, Self::Field | Self::FieldOrSolid) || Self::EveryField.fits(other),
            Self::AnyVector => other == Self::AnyVector || Self::EveryField.fits(other),
            Self::EveryField => matches!(other, Self::EveryField | Self::EveryFieldOrSolid | Self::FieldOrMaterial),
            Self::AnySolid => {
                matches!(other, Self::AnySolid | Self::InSpace | Self::FieldOrSolid | Self::EveryFieldOrSolid)
            }
            Self::Number | Self::FieldOrSolid => {
                other == self || matches!(other, Self::FieldOrSolid | Self::EveryFieldOrSolid)
            }
            Self::Direction
            | Self::Color
            | Self::AnyNormal
            | Self::AnyMaterial
            | Self::InSpace
            | Self::EveryFieldOrSolid
            | Self::FieldOrMaterial => self == other,
        }
    }
}

impl fmt::Display for Accepts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Type {
    /// The type of the solid whose cut is a field of this type; a type of solids stays.
    pub const fn in_space(self) -> Self {
        match self {
            Self::Gray => Self::Solid,
            Self::Rgb => Self::SolidColor,
            Self::Normal => Self::SolidVector,
            other => other,
        }
    }

    /// The table of conversions: true if a wire of this type may go into `port`. [`Value::convert`] performs the
    /// conversion.
    ///
    /// A type goes into itself; `Gray` → `Rgb` is grey; `Picture` → `Gray` is its only channel or its luminance,
    /// `Picture` → `Rgb` its colour; a `Skeleton` goes into a port for a `Tree` as a
    /// tree with the usual speeds; `Normal` ↔ `Rgb` and `Picture` → `Normal` keep the numbers; a `Field` port takes
    /// `Gray`, `Rgb`, `Normal` and `Picture` (as `Gray` if the picture has one channel, else as `Rgb`); an `EveryField`
    /// port takes all these and every other field; an `AnyVector` port takes `Rgb`, `Normal`, `Vec2` and `Picture` (as
    /// `Rgb`); a `Direction` port takes `Gray` (degrees), `Vec2` (its angle) and `Picture`; an `AnySolid` port takes
    /// every solid; a `Number` port takes `Gray`, `Picture` (as its luminance) and `Solid`; a `Color` port takes what
    /// an `Rgb` port takes (as `Rgb`), `SolidColor`, and `Solid` as grey; an `AnyNormal` port takes what a `Normal` port takes and
    /// `SolidVector`; an `AnyMaterial` port takes both kinds of materials; an
    /// `InSpace` port takes every solid and `SolidMaterial`; a `FieldOrSolid` port takes what a `Field` port takes and every
    /// solid, an `EveryFieldOrSolid` port any field and any solid, and a `FieldOrMaterial` port any field and `Material`. Literals (a number for `Gray`, a number or a colour for `Rgb`) become constant fields; in a port for
    /// solids, a constant field becomes a solid ([`Accepts::solid_of`]).
    pub const fn fits(self, port: Accepts) -> bool {
        match port {
            Accepts::Field => matches!(self, Self::Gray | Self::Rgb | Self::Normal | Self::Picture),
            Accepts::EveryField => self.is_field() || matches!(self, Self::Picture),
            Accepts::AnyVector => matches!(self, Self::Rgb | Self::Normal | Self::Vec2 | Self::Picture),
            Accepts::Direction => matches!(self, Self::Gray | Self::Vec2 | Self::Picture),
            Accepts::AnySolid => self.is_solid(),
            Accepts::Number => matches!(self, Self::Gray | Self::Picture | Self::Solid),
            Accepts::Color => {
                matches!(self, Self::Gray | Self::Rgb | Self::Normal | Self::Picture | Self::Solid | Self::SolidColor)
            }
            Accepts::AnyNormal => matches!(self, Self::Rgb | Self::Normal | Self::Picture | Self::SolidVector),
            Accepts::AnyMaterial => self.is_material(),
            Accepts::InSpace => self.is_in_space(),
            Accepts::FieldOrSolid => self.is_solid() || self.fits(Accepts::Field),
            Accepts::EveryFieldOrSolid => self.is_solid() || self.fits(Accepts::EveryField),
            Accepts::FieldOrMaterial => matches!(self, Self::Material) || self.fits(Accepts::EveryField),
            Accepts::One(ty) => {
                self as usize == ty as usize
                    || matches!(
                        (self, ty),
                        (Self::Gray, Self::Rgb)
                            | (Self::Rgb, Self::Normal)
                            | (Self::Normal, Self::Rgb)
                            | (Self::Picture, Self::Gray | Self::Rgb | Self::Normal)
                            | (Self::Skeleton, Self::Tree)
                    )
            }
        }
    }
}

impl Value {
    /// Converts the value for a port, by the tables of [`Type::fits`] and [`Accepts::solid_of`].
    pub fn convert(&self, port: impl Into<Accepts>) -> Option<Self> {
        let port = port.into();
        if let (Self::Field(field), Some(ty)) = (self, port.solid_of(self.ty())) {
            return field.as_constant().map(|values| Self::Solid(Solid::constant(ty, values)));
        }
        if !self.ty().fits(port) {
            return None;
        }
        Some(match (self, port) {
            (Self::Field(field), Accepts::One(Type::Rgb | Type::Normal) | Accepts::Color | Accepts::AnyNormal) => {
                Self::Field(field.to_rgb())
            }
            (Self::Field(field), Accepts::Direction) => Self::Field(field.to_angle()),
            (Self::Skeleton(skeleton), Accepts::One(Type::Tree)) => Tree::from((**skeleton).clone()).into(),
            (Self::Solid(solid), Accepts::Color) => Self::Solid(solid.to_color()),
            (Self::Picture(picture), Accepts::One(Type::Gray) | Accepts::Direction | Accepts::Number) => {
                Self::Field(picture.gray.clone())
            }
            (
                Self::Picture(picture),
                Accepts::Field
                | Accepts::EveryField
                | Accepts::FieldOrSolid
                | Accepts::EveryFieldOrSolid
                | Accepts::FieldOrMaterial,
            ) if picture.is_gray => Self::Field(picture.gray.clone()),
            (
                Self::Picture(picture),
                Accepts::One(Type::Rgb | Type::Normal)
                | Accepts::Color
                | Accepts::AnyNormal
                | Accepts::Field
                | Accepts::EveryField
                | Accepts::AnyVector
                | Accepts::FieldOrSolid
                | Accepts::EveryFieldOrSolid
                | Accepts::FieldOrMaterial,
            ) => Self::Field(picture.rgb.clone()),
            (value, _) => value.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Field;

    #[test]
    fn vectors_become_angles_where_a_direction_is_wanted() {
        let angle = |field: Field| match Value::from(field).convert(Accepts::Direction) {
            Some(Value::Field(field)) => (field.ty(), field.as_constant().map(<[f32]>::to_vec)),
            other => panic!("{other:?}"),
        };
        let vector = |x: f32, y: f32| angle(Field::constant(Type::Vec2, &[x, y]));
        assert_eq!(vector(0.0, 3.0), (Type::Gray, Some(vec![90.0])));
        assert_eq!(vector(-2.0, 0.0).1, Some(vec![180.0]));
        assert_eq!(vector(1.0, -1.0).1, Some(vec![-45.0]));
        assert_eq!(vector(0.0, 0.0).1, Some(vec![0.0]));
        assert_eq!(vector(f32::NAN, 1.0).1, Some(vec![0.0]));
        // Degrees are unchanged.
        assert_eq!(angle(Field::constant(Type::Gray, &[400.0])).1, Some(vec![400.0]));
        assert!(Value::from(Field::constant(Type::Rgb, &[1.0; 3])).convert(Accepts::Direction).is_none());
    }
}
