//! A program that uses Shibo as a library: it loads a graph, sets a parameter, computes a window of an output into its
//! own memory, shows progress, and stops a computation half way.
//!
//! `cargo run --release --example host` or `… --example host -- GRAPH.ron`
use shibo_engine::eval::{CancelToken, Event, Observer, Silent};
use shibo_engine::graph::LoadOptions;
use shibo_engine::session::{Failure, Session, Settings};
use shibo_engine::value::{Resolution, Value, Window};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

/// Prints finished nodes and warnings, and cancels at the first event if `cancel` is given.
struct Progress {
    events: AtomicU64,
    cancel: Option<CancelToken>,
}

impl Observer for Progress {
    fn event(&self, event: Event) {
        self.events.fetch_add(1, Ordering::Relaxed);
        match event {
            Event::Node { name, done, total } if done == total => println!("  {name} is done"),
            Event::Warning(warning) => println!("  {}", warning.message),
            _ => {}
        }
        if let Some(cancel) = &self.cancel {
            cancel.cancel();
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/graphs/walnut.ron");
    let path = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| default.into()));

    // One session holds threads and caches for any number of graphs.
    let session = Session::new(shibo_nodes::registry(), &Settings { memory: 512 << 20, ..Settings::default() })?;
    let set = if path.ends_with("walnut.ron") { vec![("distance".to_owned(), "40".to_owned())] } else { Vec::new() };
    let options = LoadOptions { set, resolution: Some(Resolution::Longer(1024)), ..LoadOptions::default() };
    let loaded = session.load(&path, &options);
    for diagnostic in &loaded.diagnostics {
        println!("{}", diagnostic.message);
    }
    let Some(graph) = loaded.graph else { return Err("the graph has errors".into()) };

    // The first output, or its first channel if it is a material.
    let output = graph.outputs.first().ok_or("the graph has no output")?;
    println!("computing `{}` of {}", output.name, path.display());
    let cancel = CancelToken::default();
    let progress = Progress { events: AtomicU64::new(0), cancel: None };
    let value = session.value(&graph, (output.node, output.output), &cancel, &progress)?;
    let field = match &value {
        Value::Material(material) => material.channels().first().map(|(_, field)| field.clone()),
        other => other.field(),
    };
    let field = field.ok_or("the output is no picture")?;

    // A window of 256 pixels in the middle. The pixels of a window do not depend on its size.
    let size = graph.canvas.resolution;
    let corner = (size / 2).as_ivec2() - 128;
    let window = Window { x: corner.x, y: corner.y, width: 256, height: 256 };
    let grid = graph.canvas.grid(size);
    let mut mine = vec![0.0_f32; window.len() * field.channels()];
    let stats = session.raster_into(&graph, &field, (&grid, window), &mut mine, &cancel, &progress)?;
    let mean = mine.iter().map(|v| f64::from(*v)).sum::<f64>() / mine.len() as f64;
    println!("{} channels of {}×{} pixels, mean {mean:.4}", field.channels(), window.width, window.height);
    println!("{} nodes took part; {} events", stats.len(), progress.events.load(Ordering::Relaxed));

    // A cancelled computation ends soon with an error. A new session without a cache computes everything again.
    let again = Session::new(shibo_nodes::registry(), &Settings::default())?;
    let cancel = CancelToken::default();
    let stopping = Progress { events: AtomicU64::new(0), cancel: Some(cancel.clone()) };
    let whole = [(graph.canvas.grid(size), Window::full(size))];
    let result = again
        .value(&graph, (output.node, output.output), &cancel, &stopping)
        .and_then(|_| again.rasters(&graph, &field, &whole, &cancel, &Silent).map(|_| ()));
    match result {
        Err(Failure::Cancelled) => println!("cancelled, as asked"),
        Err(failure) => return Err(failure.into()),
        Ok(()) => println!("it was done before it could be cancelled"),
    }
    Ok(())
}
