//! Nodes that break the contract.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_node::{Context, Fact, Node, Output, Outputs};
use shibo_value::{Cost, Field, FieldSource, Given, Grid, Read, Stop, Tile, Tiling, Type, Window};
use std::sync::atomic::{AtomicU32, Ordering};

static CALLS: AtomicU32 = AtomicU32::new(0);

#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Impure {
    pub(crate) value: f64,
}

impl Node for Impure {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "")];

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(gray(|out| {
            let call = CALLS.fetch_add(1, Ordering::Relaxed);
            out.data_mut().fill(f32::from(u16::try_from(call % 1000).unwrap()));
        })))
    }
}

#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Unwindowed {
    pub(crate) value: f64,
}

impl Node for Unwindowed {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "Depends on the window.")];

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(gray(|out| {
            let value = f32::from(u16::try_from(out.width()).unwrap());
            out.data_mut().fill(value);
        })))
    }
}

#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Infinite {
    pub(crate) value: f64,
}

impl Node for Infinite {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "Is not finite.")];

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(gray(|out| out.data_mut().fill(f32::INFINITY))))
    }
}

/// Reads the size of the canvas, which it does not declare.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Curious {
    pub(crate) value: f64,
}

impl Node for Curious {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "Depends on the size of the canvas.")];
    const FACTS: &'static [Fact] = &[Fact::Tile, Fact::Seed];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let value = if cx.size_mm().x > 10.0 { 1.0 } else { 0.0 };
        Ok(Outputs::one(Field::constant(Type::Gray, &[value])))
    }
}

/// Reads more of its input than it states.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Greedy {
    pub(crate) value: f64,
}

impl Node for Greedy {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "Reads beyond its window.")];

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = gray(|out| out.data_mut().fill(0.5));
        Ok(Outputs::one(Field::new(Type::Gray, Tiling::NONE, Beyond(input))))
    }
}

struct Beyond(Field);

impl FieldSource for Beyond {
    fn inputs(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    fn later(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.0, grid, window)]
    }

    fn narrow(&self, _given: &Given<'_>, _grid: &Grid, window: Window) -> Vec<Window> {
        vec![window.grow(1, 1)]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        out.copy_from(given.tile(0), 0, 0);
        Ok(())
    }
}

/// Needs a larger window for a part than for the whole.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Contrary {
    pub(crate) value: f64,
}

impl Node for Contrary {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "Reads more for less.")];

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = gray(|out| out.data_mut().fill(0.5));
        Ok(Outputs::one(Field::new(Type::Gray, Tiling::NONE, Around(input))))
    }
}

struct Around(Field);

impl FieldSource for Around {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let halo = 100_i32.saturating_sub_unsigned(window.width);
        vec![Read::new(&self.0, grid, window.grow(halo.max(0), 0))]
    }

    fn fill(&self, _given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        out.data_mut().fill(0.5);
        Ok(())
    }
}

/// A field that `fill` computes window by window.
fn gray(fill: impl Fn(&mut Tile) + Send + Sync + 'static) -> Field {
    let source = Plain(fill);
    Field::new(Type::Gray, Tiling::NONE, source)
}

struct Plain<F>(F);

impl<F: Fn(&mut Tile) + Send + Sync> FieldSource for Plain<F> {
    fn inputs(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    fn fill(&self, _given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        (self.0)(out);
        Ok(())
    }

    fn cost(&self) -> Cost {
        Cost::Pointwise
    }
}
