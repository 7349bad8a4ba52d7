//! A custom kind of node: a struct, its documentation, and a function. Graph files use it like any other kind, with
//! checks, caches, tiles and a manual in `shibo nodes`.
//!
//! `cargo run --release --example own_node` writes `out/zones.png`.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::graph::{LoadOptions, load_text};
use shibo_engine::node::{CanvasFacts, Context, Fact, Node, Output, Outputs};
use shibo_engine::registry::{Family, Kind};
use shibo_engine::session::{RenderRequest, Session, Settings};
use shibo_engine::value::{Field, Given, Stop, Tile, Tiling, Type};
use std::path::Path;

/// Rings that become narrower outwards, as a test for aliasing.
///
/// ```ron
/// "example": Zones(width: 4),
/// ```
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Zones {
    /// The radius of the innermost ring.
    #[schemars(range(min = 0.01, max = 1000), extend("unit" = "mm"))]
    width: f64,
}

impl Default for Zones {
    fn default() -> Self {
        Self { width: 4.0 }
    }
}

impl Node for Zones {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "The rings, 0..1.")];
    // The facts of the canvas on which the result depends; they are part of the key in the cache.
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (middle, width) = (0.5 * cx.size_mm(), self.width);
        // A field is computed in windows. Each pixel depends only on its position, so all windows have the same bits.
        let fill = move |out: &mut Tile, _: &Given<'_>| {
            let (grid, window) = (out.grid, out.window);
            for (row, y) in (window.y..window.bottom()).enumerate() {
                for (value, x) in out.row_mut(0, row).iter_mut().zip(window.x..) {
                    let turns = grid.center(x, y).distance_squared(middle) / (width * width);
                    #[expect(
                        clippy::disallowed_methods,
                        reason = "the nodes of Shibo take libm's: the same on any machine"
                    )]
                    let ring = 0.5 + 0.5 * (std::f64::consts::PI * turns).cos();
                    *value = single(ring);
                }
            }
            Ok(())
        };
        Ok(Outputs::one(Field::generate(Type::Gray, Tiling::NONE, fill).overwriting()))
    }
}

/// Converts to single precision, in which fields are stored.
#[expect(clippy::cast_possible_truncation, reason = "the number is between 0 and 1")]
fn single(value: f64) -> f32 {
    value as f32
}

const GRAPH: &str = "(
  canvas: (size_mm: 60, resolution: 512, tile: None),
  nodes: { \"zones\": Zones(width: 5), \"soft\": Blur(input: \"zones\", radius: 0.3) },
  outputs: { \"zones\": \"soft\" },
)";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mine = Family { name: "Examples", doc: "Kinds of another crate.", kinds: vec![Kind::of::<Zones>()] };
    // The fingerprint separates the cached results of different versions of this code.
    let registry = shibo_nodes::registry_with([mine]).with_code(env!("CARGO_PKG_VERSION"));
    let session = Session::new(registry, &Settings::default())?;
    let loaded = load_text(Path::new("zones.ron"), GRAPH, session.registry(), &LoadOptions::default());
    for diagnostic in &loaded.diagnostics {
        println!("{}", diagnostic.message);
    }
    let graph = loaded.graph.ok_or("the graph has errors")?;
    let request = RenderRequest { dir: "out".into(), ..RenderRequest::default() };
    let report = session.render(&graph, &request, &CancelToken::default(), &Silent)?;
    for file in report.files {
        println!("wrote {}", file.display());
    }
    Ok(())
}
