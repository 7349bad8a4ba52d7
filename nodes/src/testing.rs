//! Evaluates single nodes in unit tests, without a graph.
use shibo_kernel::ground::math::{cos, sin};
use shibo_kernel::ground::number::narrow;
use shibo_node::{Call, DynNode, Node, Outputs};
use shibo_picture::{Compression, Depth, Encoding, Format, PictureSpec, Writer};
use shibo_value::diagnostics::Problem;
use shibo_value::{
    Canvas, Evaluator, Field, Given, Grid, Mesh, Pictures, Piece, Read, Stop, Tile, Tiling, Type, Value, Window,
};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

/// The canvas of unit tests: 32 × 32 mm, 64 × 64 pixels, tiling in both directions.
pub(crate) fn canvas() -> Canvas {
    Canvas { size_mm: glam::DVec2::splat(32.0), resolution: glam::UVec2::splat(64), tile: Tiling::BOTH, seed: 1 }
}

/// Writes a TIFF file of 32-bit planes, `width` pixels wide.
pub(crate) fn write_tiff(path: &std::path::Path, width: u32, channels: &[&str], planes: &[&[f32]]) {
    let height = u32::try_from(planes[0].len()).expect("small") / width;
    let spec = PictureSpec {
        width,
        height,
        channels: channels.iter().map(ToString::to_string).collect(),
        format: Format::Tiff,
        depth: Depth::F32,
        encoding: Encoding::default(),
        compression: Compression::Fast,
        mips: Vec::new(),
        chromaticities: None,
        pixel_mm: None,
        metadata: Vec::new(),
    };
    let mut writer = Writer::create(path, &spec).expect("a folder to write to");
    writer.write_rows(planes, height).expect("room");
    writer.finish().expect("room");
}

/// Stripes of 4 mm; neighbouring stripes have very different numbers.
pub(crate) fn pieces() -> Field {
    Field::generate(Type::Ids, Tiling::BOTH, |out: &mut Tile, _| {
        let (grid, window) = (out.grid, out.window);
        for row in 0..out.height() {
            for (id, x) in out.row_mut(0, row).iter_mut().zip(window.x..) {
                *id = if grid.center(x, 0).x.rem_euclid(8.0) < 4.0 { 100.0 } else { 9000.0 };
            }
        }
        Ok(())
    })
}

/// An engine without a cache: it computes every request again.
pub(crate) struct Plain;

/// A window of another field that a field reads; like the engine, it reads the first repeat of a field that repeats.
fn read(read: &Read<'_>) -> Result<Tile, Stop> {
    let Read { field, grid, window } = *read;
    let blocks = field.domain().blocks(&grid, window);
    if blocks.iter().all(|(x, y)| (x.shift, y.shift) == (0, 0)) {
        return fill(field, &grid, window);
    }
    let mut out = Tile::new(grid, window, field.channels());
    let mut made = BTreeMap::new();
    for (x, y) in blocks.iter() {
        let block = match made.entry((x.index, y.index)) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => entry.insert(fill(field, &grid, Piece::window(x, y))?),
        };
        out.copy_from(block, x.shift, y.shift);
    }
    Ok(out)
}

fn fill(field: &Field, grid: &Grid, window: Window) -> Result<Tile, Stop> {
    if window.is_empty() {
        return Ok(Tile::new(*grid, window, field.channels()));
    }
    let source = field.source();
    let prepared = source.prepare(grid, &PlainPictures(source.whole(grid)))?;
    let inputs = source.inputs(grid, window);
    let mut tiles = inputs.iter().map(|input| read(input).map(Arc::new)).collect::<Result<Vec<_>, _>>()?;
    let later = source.later(grid, window);
    if !later.is_empty() {
        let narrow = source.narrow(&Given::new(&tiles, prepared.as_ref(), &|| false), grid, window);
        for (bound, window) in later.iter().zip(narrow) {
            assert!(bound.window.contains(&window), "a field reads {window:?}, beyond {:?}", bound.window);
            tiles.push(Arc::new(read(&Read { window, ..*bound })?));
        }
    }
    let mut tile = Tile::new(*grid, window, field.channels());
    source.fill(&Given::new(&tiles, prepared.as_ref(), &|| false), &mut tile)?;
    Ok(tile)
}

/// The pictures that [`Plain`] gives to fields that read whole pictures.
pub(crate) struct PlainPictures<'f>(pub(crate) Vec<Read<'f>>);

impl Pictures for PlainPictures<'_> {
    fn read(&self, number: usize, window: Window) -> Result<Tile, Stop> {
        let whole = &self.0[number];
        assert!(whole.window.contains(&window), "a field reads {window:?}, beyond {:?}", whole.window);
        fill(whole.field, &whole.grid, window)
    }

    fn check(&self) -> Result<(), Stop> {
        Ok(())
    }
}

impl Evaluator for Plain {
    fn raster(&self, field: &Field, grid: &Grid, window: Window) -> Result<Tile, Stop> {
        fill(field, grid, window)
    }

    fn check(&self) -> Result<(), Stop> {
        Ok(())
    }

    fn progress(&self, _done: u64, _total: u64) {}

    fn memory(&self) -> u64 {
        1 << 30
    }

    fn warn(&self, _problem: Problem) {}
}

/// A node's outputs; its ports were connected by `port` to the slots 0, 1, … of `inputs`.
pub(crate) fn outputs<N: Node>(node: &N, inputs: &[Value], canvas: &Canvas) -> Result<Outputs, Stop> {
    let kind = N::schema_name();
    DynNode::evaluate(node, &Call { kind: &kind, canvas, inputs, files: &[], evaluator: &Plain })
}

/// Calls the methods of a node that depend on the canvas, with the facts that the node declares.
pub(crate) trait OnCanvas: DynNode {
    /// [`Node::check`].
    fn check_on(&self, canvas: &Canvas) -> Vec<Problem> {
        self.check(canvas)
    }

    /// [`Node::advice`].
    fn advice_on(&self, canvas: &Canvas) -> Vec<Problem> {
        self.advice(canvas)
    }

    /// [`Node::tiling`].
    fn tiling_on(&self, canvas: &Canvas) -> Tiling {
        self.tiling(canvas)
    }
}

impl<N: Node> OnCanvas for N {}

/// A port connected to slot `n`.
#[allow(dead_code, reason = "the first nodes with ports use it")]
pub(crate) fn port<T>(n: u32) -> shibo_node::In<T> {
    serde_json::from_value(n.into()).unwrap()
}

/// A mesh of the shipped graphs.
pub(crate) fn shipped_mesh(name: &str) -> Arc<Mesh> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../graphs/meshes").join(name);
    let (files, canvas) = ([("path", (&path).into())], canvas());
    let call = Call { kind: "LoadMesh", canvas: &canvas, inputs: &[], files: &files, evaluator: &Plain };
    let loaded = DynNode::evaluate(&crate::mesh::LoadMesh::default(), &call).unwrap();
    let Some(Value::Mesh(mesh)) = loaded.take("mesh", true).cloned() else { panic!("no mesh") };
    mesh
}

/// The main output of a node, rendered on [`canvas`].
pub(crate) fn render<N: Node>(node: &N, inputs: &[Value]) -> Tile {
    let canvas = canvas();
    let outputs = outputs(node, inputs, &canvas).unwrap();
    let Some(Value::Field(field)) = outputs.take("", true).cloned() else { panic!("the main output is no field") };
    raster(&field, &canvas)
}

/// A field, rendered on a canvas.
pub(crate) fn raster(field: &Field, canvas: &Canvas) -> Tile {
    fill(field, &canvas.grid(canvas.resolution), Window::full(canvas.resolution)).unwrap()
}

/// The same, or the reason why there is no picture.
pub(crate) fn tried(field: &Field, canvas: &Canvas) -> Result<Tile, Stop> {
    fill(field, &canvas.grid(canvas.resolution), Window::full(canvas.resolution))
}

/// Compares the first channel of a field on [`canvas`] with its rendering at twice the resolution, averaged to the same
/// pixels: the RMS difference, divided by the standard deviation of the average.
pub(crate) fn unlike_average(field: &Field) -> f64 {
    let small = raster(field, &canvas());
    let large = raster(field, &Canvas { resolution: glam::UVec2::splat(128), ..canvas() });
    let average = |p: usize| {
        let four = [[0, 0], [1, 0], [0, 1], [1, 1]];
        four.map(|[dx, dy]| f64::from(large.row(0, 2 * (p / 64) + dy)[2 * (p % 64) + dx])).iter().sum::<f64>() / 4.0
    };
    let wanted: Vec<f64> = (0..64 * 64).map(average).collect();
    let mean = wanted.iter().sum::<f64>() / wanted.len() as f64;
    let off: f64 = small.plane(0).iter().zip(&wanted).map(|(a, b)| (f64::from(*a) - b).powi(2)).sum();
    let spread: f64 = wanted.iter().map(|v| (v - mean).powi(2)).sum();
    (off / spread).sqrt()
}

/// A window of a field on a canvas' grid.
pub(crate) fn crop(field: &Field, canvas: &Canvas, window: Window) -> Tile {
    fill(field, &canvas.grid(canvas.resolution), window).unwrap()
}

/// The main output of a node, a field, unevaluated.
pub(crate) fn field<N: Node>(node: &N, inputs: &[Value]) -> Field {
    match outputs(node, inputs, &canvas()).unwrap().take("", true) {
        Some(Value::Field(field)) => field.clone(),
        other => panic!("the main output is no field: {other:?}"),
    }
}

/// A field on the test canvas whose values depend on x alone, in mm from 0 to 32.
pub(crate) fn by_x(value: fn(f64) -> f64) -> Value {
    Field::generate(shibo_value::Type::Gray, Tiling::BOTH, move |out, _| {
        let (grid, window) = (out.grid, out.window);
        let width = window.width.cast_signed();
        for (k, v) in (0..).zip(out.plane_mut(0)) {
            *v = narrow(value(grid.center(window.x + k % width, window.y).x.rem_euclid(32.0)));
        }
        Ok(())
    })
    .into()
}

/// A test picture for filters: round lumps with hard edges, periodic with [`canvas`].
pub(crate) fn lumps() -> Field {
    Field::generate(shibo_value::Type::Gray, Tiling::BOTH, |out, _| {
        let (grid, window) = (out.grid, out.window);
        let width = window.width.cast_signed();
        for (k, v) in (0..).zip(out.plane_mut(0)) {
            let turns = grid.center(window.x + k % width, window.y + k / width) / 32.0;
            let at = ((turns - turns.floor()) * std::f64::consts::TAU).as_vec2();
            *v = (0.5 + 2.0 * sin(3.0 * at.x) * cos(2.0 * at.y + at.x)).clamp(0.0, 1.0);
        }
        Ok(())
    })
}

/// Checks that hold for every field: values are finite; any window has the same bits as that part of a larger one; and
/// values repeat with [`canvas`] in the directions that the field states.
pub(crate) fn check_field(field: &Field) {
    let canvas = canvas();
    let whole = crop(field, &canvas, Window { x: -9, y: -5, width: 80, height: 76 });
    assert!(whole.data().iter().all(|v| v.is_finite()), "a value is not finite");
    let same = |a: f32, b: f32, tolerance: f32| (a - b).abs() <= tolerance;
    for part in [Window { x: 7, y: 13, width: 31, height: 22 }, Window { x: -9, y: 64, width: 3, height: 1 }] {
        let tile = crop(field, &canvas, part);
        let mut cut = Tile::new(tile.grid, part, field.channels());
        cut.copy_from(&whole, 0, 0);
        assert_eq!(tile, cut, "a window differs");
    }
    let channels = 0..field.channels();
    for channel in channels {
        for y in 0..64 {
            for x in 0..8 {
                let at = |x: usize, y: usize| whole.row(channel, y)[x];
                assert!(!field.tiling().x || same(at(x, y), at(x + 64, y), 2e-3), "{x} {y}");
                assert!(!field.tiling().y || same(at(y, x), at(y, x + 64), 2e-3), "{y} {x}");
            }
        }
    }
}
