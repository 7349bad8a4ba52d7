//! A kind with earlier versions, one of which is kept.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_node::{Context, Node, Output, Outputs};
use shibo_value::{Stop, Type};

/// A kind with earlier versions.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Rays {
    /// A width.
    pub(crate) width: Option<f64>,
}

/// Its version 3.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct RaysOf3 {
    /// A width.
    pub(crate) width: Option<f64>,
}

macro_rules! rays {
    ($name:ident, $version:literal) => {
        impl Node for $name {
            const VERSION: u32 = $version;
            const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "Rays.")];
            fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
                Err(Stop::Cancelled)
            }
        }
    };
}
rays!(Rays, 5);
rays!(RaysOf3, 3);

/// The changes of `Rays`.
pub(crate) const CHANGES: &str = r#"[
    (change: 1, all: true, version: 1, look: Look, what: "first", touches: All, worst: 0, keeps: Gone),
    (change: 2, kind: "Rays", version: 3, look: Look, what: "other rays", touches: All, worst: 0.2, keeps: Gone),
    (change: 3, kind: "Rays", version: 4, look: Look, what: "thin rays keep their share", touches: Given(["width"]), worst: 0.31, keeps: Kernel),
    (change: 4, kind: "Rays", version: 5, look: Roundings, what: "sums", touches: All, worst: 0.002, keeps: Gone),
]"#;
