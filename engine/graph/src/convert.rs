//! The node of a sub-graph's input whose value may have a type other than the declared one.
use crate::node::{Arg, DynNode};
use crate::node::{Context, Fact, Gray, In, Node, Output, Outputs, PortType, Rgb, build};
use crate::value::{Accepts, Field, Stop, Type, Value};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::sync::Arc;

/// The port of the node.
pub(super) const PORT: &str = "input";

/// Passes on its input, converted to the type `T`.
#[derive(Serialize, Deserialize)]
#[serde(bound = "", default)]
struct Convert<T: PortType> {
    input: In<T>,
    /// True if the input already has the type.
    same: bool,
}

impl<T: PortType> Default for Convert<T> {
    fn default() -> Self {
        Self { input: In::default(), same: false }
    }
}

impl<T: PortType> JsonSchema for Convert<T> {
    fn schema_name() -> Cow<'static, str> {
        Cow::Borrowed("Input")
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        json_schema!({})
    }
}

impl<T: PortType<Got = Field>> Node for Convert<T> {
    const OUTPUTS: &'static [Output] = &[Output::new("value", given::<T>(), "What is given to the input.")];
    const FACTS: &'static [Fact] = &[];

    fn no_op(&self) -> Option<&'static str> {
        self.same.then_some(PORT)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(cx.get(&self.input)?))
    }
}

/// The output type.
const fn given<T: PortType>() -> Type {
    match T::ACCEPTS.only() {
        Some(ty) => ty,
        None => Type::Gray,
    }
}

/// Makes a material without channels, for an input without a value.
#[derive(Default, Serialize, Deserialize)]
struct NoMaterial {}

impl JsonSchema for NoMaterial {
    fn schema_name() -> Cow<'static, str> {
        Cow::Borrowed("Input")
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        json_schema!({})
    }
}

impl Node for NoMaterial {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Material, "A material without channels.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(Value::Material(Arc::default())))
    }
}

/// The node of a material input without a value.
pub(super) fn no_material() -> Option<Arc<dyn DynNode>> {
    build::<NoMaterial>(&[]).ok()
}

/// The node that converts its input to `ty`; `same` if the input already has that type.
pub(super) fn node(ty: Accepts, same: bool) -> Option<Arc<dyn DynNode>> {
    let same = if same { "true" } else { "false" };
    let args = [(PORT, Arg::Slot(0)), ("same", Arg::Ron(same))];
    match ty {
        Accepts::One(Type::Gray) => build::<Convert<Gray>>(&args).ok(),
        Accepts::One(Type::Rgb) => build::<Convert<Rgb>>(&args).ok(),
        _ => None,
    }
}
