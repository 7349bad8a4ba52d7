//! JSON output.
use serde::Serialize;
use shibo_value::{Number, ObjectData, Solid};
use std::collections::BTreeMap;

/// The printed data.
#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum Data {
    Object(ObjectData),
    Field(FieldData),
    Material(MaterialData),
    Solid(SolidData),
}

/// A field at the pixels of a picture, or at points.
#[derive(Serialize)]
pub(super) struct FieldData {
    #[serde(rename = "type")]
    pub(super) ty: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) size: Option<[u32; 2]>,
    pub(super) channels: usize,
    pub(super) values: Vec<Number>,
}

#[derive(Serialize)]
pub(super) struct MaterialData {
    #[serde(rename = "type")]
    ty: &'static str,
    fields: BTreeMap<&'static str, FieldData>,
}

/// A solid at points, channels innermost.
#[derive(Serialize)]
pub(super) struct SolidData {
    #[serde(rename = "type")]
    ty: &'static str,
    channels: usize,
    values: Vec<Number<f64>>,
}

impl Data {
    /// A material, by channel name.
    pub(super) fn material(fields: BTreeMap<&'static str, FieldData>) -> Self {
        Self::Material(MaterialData { ty: "Material", fields })
    }

    /// Values of a solid at points; `values` has one channel after another.
    pub(super) fn solid(solid: &Solid, values: &[f64]) -> Self {
        let (channels, points) = (solid.channels(), values.len() / solid.channels());
        let value = |i: usize| Number(values[i % channels * points + i / channels]);
        Self::Solid(SolidData { ty: solid.ty().name(), channels, values: (0..values.len()).map(value).collect() })
    }
}
