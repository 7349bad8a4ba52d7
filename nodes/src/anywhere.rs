//! Values on the canvas or in space, for nodes that work on both. Constants exist in space, too; other fields do not.
use shibo_node::{Anywhere, MaterialAnywhere};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Solid, SolidMaterial, Stop, Type};
use std::sync::Arc;

/// True for solids.
pub(crate) fn is_solid(value: &Anywhere) -> bool {
    matches!(value, Anywhere::Solid(_))
}

/// True for materials of solids.
pub(crate) fn is_in_space(material: &MaterialAnywhere) -> bool {
    matches!(material, MaterialAnywhere::Space(_))
}

/// The value as a solid of type `ty`; an error at `port` for a field that is not constant.
pub(crate) fn solid(value: Anywhere, ty: Type, port: &str) -> Result<Solid, Stop> {
    match value {
        Anywhere::Solid(solid) => Ok(solid),
        Anywhere::Field(field) => {
            let values = field.as_constant().ok_or_else(|| mixed(port, "is a field"))?;
            Ok(Solid::constant(ty, values))
        }
    }
}

/// The value as a field; an error at `port` for a solid.
pub(crate) fn field(value: Anywhere, port: &str) -> Result<Field, Stop> {
    match value {
        Anywhere::Field(field) => Ok(field),
        Anywhere::Solid(_) => Err(mixed(port, "is a solid, other values are on the canvas").into()),
    }
}

/// The material as a material of solids; an error at `port` if it has a channel that is not constant on the canvas.
pub(crate) fn solids(material: &MaterialAnywhere, port: &str) -> Result<Arc<SolidMaterial>, Stop> {
    match material {
        MaterialAnywhere::Space(material) => Ok(material.clone()),
        MaterialAnywhere::Canvas(material) => {
            let problem = |channel: shibo_value::Channel| mixed(port, &format!("has a field as `{}`", channel.name()));
            Ok(Arc::new(material.in_space().map_err(problem)?))
        }
    }
}

fn mixed(port: &str, what: &str) -> Problem {
    let message = format!("`{port}` {what}; values on the canvas and in space do not go together");
    Problem::new(Code::TypeMismatch, message).at(port.to_owned()).help("cut what is in space first, by `CutPlane`")
}
