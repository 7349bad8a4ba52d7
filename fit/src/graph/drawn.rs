//! Pictures of outputs, and values as text.
use crate::Amount;
use shibo_bridge::picture;
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Failure, Session};
use shibo_graph::Graph;
use shibo_picture::{Picture, SampleKind};
use shibo_value::{Field, Window};

/// The picture of an output at the resolution of a graph.
pub(super) fn drawn(session: &Session, graph: &Graph, output: &str, cancel: &CancelToken) -> Result<Picture, Failure> {
    let pictures = session.pictures(graph, output, cancel, &Silent)?;
    let color = |(name, field): &&(String, Field)| name == "base_color" || field.channels() == 3;
    let found = if pictures.len() == 1 { pictures.first() } else { pictures.iter().find(color) };
    let Some((_, field)) = found else {
        return Err(Failure::Usage(format!("the output `{output}` has no colour: write `{output}.CHANNEL`")));
    };
    let size = graph.canvas.resolution;
    let wanted = [(graph.canvas.grid(size), Window::full(size))];
    let (mut tiles, _) = session.rasters(graph, field, &wanted, cancel, &Silent)?;
    let tile = tiles.pop().ok_or(Failure::Cancelled)?;
    let color = tile.channels() >= 3;
    // Numbers count as they are, as those of a file of integers.
    let source = if color { SampleKind::F32 } else { SampleKind::U16 };
    Ok(Picture { source, ..picture(&tile, color) })
}

/// A colour as `"#rrggbb"`, or a number, as RON.
pub(super) fn ron(amount: Amount) -> String {
    match amount {
        Amount::Number(value) => format!("{value}"),
        Amount::Color(rgb) => {
            #[expect(clippy::cast_possible_truncation, reason = "a whole number from 0 to 255")]
            let [r, g, b] = rgb.map(|channel| (channel * 255.0).round().clamp(0.0, 255.0) as u8);
            format!("\"#{r:02x}{g:02x}{b:02x}\"")
        }
    }
}
