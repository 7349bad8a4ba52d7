//! Cost of meshes: `cargo bench -p shibo-kernel --bench mesh`, the minimum of several runs, in CPU time of one thread.
use glam::{DVec2, DVec3, UVec2};
use shibo_kernel::ground::stop::{NEVER, Watch};
use shibo_kernel::mesh::bake::{Texels, normals, places};
use shibo_kernel::mesh::field::{FieldSpec, Wish, tangent_field};
use shibo_kernel::mesh::motion::RigidMotion;
use shibo_kernel::mesh::{atlas, shapes, texels, topology};
use shibo_value::{Grid, Window};
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

const SIDE: u32 = 4096;
const TILE: u32 = 256;

/// CPU seconds of this thread, or wall time if the system does not report them.
fn cpu_seconds(start: Instant) -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|s| s.split_whitespace().next()?.parse::<f64>().ok())
        .map_or_else(|| start.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// CPU seconds of the fastest of five runs.
fn seconds(mut body: impl FnMut()) -> f64 {
    let start = Instant::now();
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let before = cpu_seconds(start);
        body();
        best = best.min(cpu_seconds(start) - before);
    }
    best
}

fn main() {
    // 98,304 triangles.
    let mesh = shapes::sphere(DVec3::splat(60.0), 362);
    let count = mesh.triangles.len();
    let mut welded = mesh.clone();
    let weld = seconds(|| {
        topology::weld(black_box(&mut welded), 0.0, &Watch::never());
        topology::orient(&mut welded, &Watch::never());
    });
    let (mesh, size) = (Arc::new(mesh), DVec2::splat(100.0));
    let tables = seconds(|| drop(black_box(atlas::atlas(mesh.clone(), &mesh.uvs, size))));
    println!("{count} triangles: welded and turned in {weld:.3} s, tables of an atlas in {tables:.3} s");

    let atlas = atlas::atlas(mesh.clone(), &mesh.uvs, size).expect("a sphere has UVs");
    let grid = Grid { origin: DVec2::ZERO, step: size / f64::from(SIDE), period: None, shown: None };
    let tiles: Vec<Window> = (0..SIDE / TILE)
        .flat_map(|y| (0..SIDE / TILE).map(move |x| (x * TILE, y * TILE)))
        .map(|(x, y)| Window { x: x.cast_signed(), y: y.cast_signed(), width: TILE, height: TILE })
        .collect();
    let mut values = vec![0.0; (TILE * TILE) as usize];
    let mut planes: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; values.len()]);
    let owned = {
        let all = texels::owners(&atlas, &grid, Window::full(UVec2::splat(SIDE)));
        all.iter().filter(|owner| **owner > 0).count() as f64 * 1e-6
    };
    let rate = |seconds: f64| owned / seconds;
    let owners = seconds(|| tiles.iter().for_each(|tile| drop(black_box(texels::owners(&atlas, &grid, *tile)))));
    let filled = seconds(|| tiles.iter().for_each(|tile| texels::fill(&atlas, &grid, *tile, &mut values)));
    let mut bake = |body: &dyn Fn(&Texels<'_>, [&mut [f32]; 3])| {
        seconds(|| {
            for tile in &tiles {
                texels::fill(&atlas, &grid, *tile, &mut values);
                let [x, y, z] = &mut planes;
                body(&Texels { atlas: &atlas, grid: &grid, window: *tile, values: &values }, [x, y, z]);
            }
        })
    };
    let position = bake(&|texels, out| places(texels, |_| RigidMotion::NONE, out));
    let normal = bake(&|texels, out| normals(texels, true, out));
    println!(
        "texels in charts at {SIDE}², Mpx/s: owners {:.0}, with gutters {:.0}, and places {:.0}, and normals {:.0}",
        rate(owners),
        rate(filled),
        rate(position),
        rate(normal)
    );

    let stroke: Vec<DVec3> = (0..8).map(|k| DVec3::new(0.0, 0.5 * f64::from(k), 30.0)).collect();
    let wish = Wish::Strokes(vec![stroke], DVec3::Z);
    let spec = FieldSpec { wish, smooth: 0.0, symmetry: 1, turn: 0.0, length: 1.0 };
    let found = seconds(|| drop(black_box(tangent_field(&mesh, &spec, NEVER))));
    println!("a field along one stroke, no other wish: {found:.2} s");
}
