//! Speed of exemplar synthesis. `cargo bench -p shibo-kernel --bench synthesis` prints preparation, correction and
//! sampling in CPU seconds of the whole process (wall time if the system is not Linux), on one thread and on two;
//! `SHIBO_BENCH_REPORT=1` prints only those. The comparison with other programs is `benches/synthesis.sh`.
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::synthesis::PixelPlane;
use shibo_kernel::synthesis::analysis::{AnalysisSpec, Level, analyse, find_seconds, spacings};
use shibo_kernel::synthesis::levels::image;
use shibo_kernel::synthesis::texels::Texels;

fn main() {
    report::all();
    if std::env::var_os("SHIBO_BENCH_REPORT").is_none() {
        divan::main();
    }
}

/// Curved stripes in three channels.
fn exemplar(side: usize) -> Texels<f32> {
    let hash = Hash::new(7);
    let plane = PixelPlane { w: side, h: side, wrap: [false; 2] };
    let noise = |n: u64, blur: usize| {
        let data = (0..(side * side) as u64).map(|k| hash.with(n).unit_f32(k) - 0.5).collect();
        Texels::new(plane, 1, data).blurred(blur)
    };
    let (a, b, c) = (noise(1, 8), noise(2, 12), noise(3, 2));
    let data = (0..side * side)
        .flat_map(|p| {
            let v = ((a.data[p] - b.data[p]) * 120.0).clamp(-1.0, 1.0);
            [v + 0.2 * c.data[p], 0.8 * v + 0.1 * c.data[p], 0.5 * v]
        })
        .collect();
    Texels::new(plane, 3, data)
}

fn prepare(exemplar: &Texels<f32>) -> Vec<Level> {
    let spacings = spacings(exemplar.plane.w);
    let spec = AnalysisSpec::default();
    let mut levels = analyse(&spacings, |h| image(exemplar, h, false), &[], &spec, Hash::new(1));
    find_seconds(&mut levels, exemplar.plane, &[], 0.05 * exemplar.plane.w as f64, Hash::new(2));
    levels
}

/// 128² to 256², prepared.
#[divan::bench]
fn isometric(bencher: divan::Bencher<'_, '_>) {
    let exemplar = exemplar(128);
    let levels = prepare(&exemplar);
    bencher.bench_local(|| report::synthesise(&exemplar, &levels, 256, report::Bend::None));
}

mod report {
    use super::{exemplar, prepare};
    use shibo_kernel::ground::hash::Hash;
    use shibo_kernel::ground::window::WindowExt;
    use shibo_kernel::synthesis::PixelPlane;
    use shibo_kernel::synthesis::analysis::Level;
    use shibo_kernel::synthesis::aniso::{Jacobians, Position};
    use shibo_kernel::synthesis::coverage::EvenUse;
    use shibo_kernel::synthesis::driver::{Analysed, Inputs, Settings, Start, run};
    use shibo_kernel::synthesis::jacobian::{IDENTITY, from_angle_scale};
    use shibo_kernel::synthesis::lattice::detect;
    use shibo_kernel::synthesis::region::{Output, Region};
    use shibo_kernel::synthesis::sampling::{Area, Source};
    use shibo_kernel::synthesis::texels::{Fetch, Texels};
    use shibo_value::Window;
    use std::hint::black_box;
    use std::time::Instant;

    /// CPU seconds of the process, in steps of 1/100 s; wall time on other systems than Linux.
    fn cpu(start: Instant) -> f64 {
        let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
        let fields: Vec<f64> =
            stat.rsplit(')').next().unwrap_or("").split(' ').map(|f| f.parse().unwrap_or(0.0)).collect();
        match fields[..] {
            [_, _, _, _, _, _, _, _, _, _, _, _, user, system, ..] => (user + system) / 100.0,
            _ => start.elapsed().as_secs_f64(),
        }
    }

    /// CPU seconds of `work`: the best of three means over at least a quarter of a second.
    fn timed<T>(mut work: impl FnMut() -> T) -> f64 {
        let start = Instant::now();
        let mut best = f64::INFINITY;
        for _ in 0..3 {
            let (before, mut runs) = (cpu(start), 0u32);
            while cpu(start) - before < 0.25 {
                black_box(work());
                runs += 1;
            }
            best = best.min((cpu(start) - before) / f64::from(runs));
        }
        best
    }

    #[derive(Clone, Copy)]
    pub(crate) enum Bend {
        None,
        Constant,
        Varying,
    }

    struct Bent(Bend);

    impl Inputs for Bent {
        type Stop = ();
        fn jacobians(&self, region: &Region) -> Result<Option<Jacobians>, ()> {
            let w = region.plane.w;
            Ok(match self.0 {
                Bend::None => None,
                Bend::Constant => Some(Jacobians::Constant(from_angle_scale(0.646, 1.0, 1.0))),
                Bend::Varying => Some(Jacobians::Each(
                    (0..w * region.plane.h)
                        .map(|p| {
                            #[expect(clippy::cast_possible_truncation, reason = "a place on the output")]
                            let [x, y] = region.center(p % w, p / w).map(|v| v as f32);
                            from_angle_scale(0.01 * x, 1.0 + 0.001 * y, 1.0)
                        })
                        .collect(),
                )),
            })
        }
    }

    pub(crate) fn synthesise(exemplar: &Texels<f32>, levels: &[Level], side: usize, bend: Bend) -> Vec<Position> {
        let settings = Settings {
            kappa: 2.5,
            even: Some(EvenUse { amount: 1.0, tile: None, halved: false }),
            passes: 2,
            rounds: 0,
            enough: 0.015,
            averaged: true,
            jitter: 0.0,
            guide_weight: 1.0,
            margin: 0.25,
            coarsest: exemplar.plane.w / 4,
            start: Start::Random,
            adrift: true,
            hash: Hash::new(3),
        };
        let analysed = Analysed { plane: exemplar.plane, levels, usable: &[], guide: &[], picture: None };
        let output = Output { start: [0, 0], size: [side, side], wrap: [true; 2] };
        run(&analysed, &output, &settings, &Bent(bend)).expect("nothing stops it").coords
    }

    fn rates(threads: usize) {
        for side in [64, 128, 256] {
            let exemplar = exemplar(side);
            let preparation = timed(|| prepare(&exemplar));
            let lattice = timed(|| detect(&exemplar));
            println!("{threads} threads, exemplar {side}²: analysis {preparation:.4} s, lattice {lattice:.4} s");
        }
        for (from, to) in [(128, 512), (256, 1024)] {
            let exemplar = exemplar(from);
            let levels = prepare(&exemplar);
            let pixels = (to * to) as f64 * 1e-6;
            for (name, bend) in
                [("isometric", Bend::None), ("constant J", Bend::Constant), ("varying J", Bend::Varying)]
            {
                let time = timed(|| synthesise(&exemplar, &levels, to, bend));
                println!("{threads} threads, {from}² to {to}², {name:10}: {time:.4} s, {:5.2} Mpx/s", pixels / time);
            }
        }
    }

    fn sampling() {
        let exemplar = exemplar(128);
        let levels = prepare(&exemplar);
        let map = synthesise(&exemplar, &levels, 256, Bend::None);
        let fine = super::exemplar(512);
        let planes: Vec<Vec<f32>> = (0..3).map(|c| fine.data.iter().skip(c).step_by(3).copied().collect()).collect();
        let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
        let jacobians = vec![IDENTITY; 1024 * 1024];
        for (name, follow, fetch) in [
            ("(5)", false, Fetch::Bilinear),
            ("(6)", true, Fetch::Bilinear),
            ("(6), CatmullRom", true, Fetch::CatmullRom),
        ] {
            let source = Source::new(fine.plane, &planes, [4.0, 4.0], fetch, false);
            let area = Area {
                map: &map,
                plane: PixelPlane { w: 256, h: 256, wrap: [true; 2] },
                spacing: 1.0,
                origin: [0.0; 2],
                step: [0.25; 2],
                window: Window::of(0, 0, 1024, 1024),
                jacobians: follow.then_some(&jacobians[..]),
                follow,
            };
            let mut out = vec![0.0; 3 * 1024 * 1024];
            let time = timed(|| area.fill(&source, 3, &mut out));
            println!("magnification {name}, 3 channels: {:.1} Mpx/s", 1.048_576 / time);
        }
    }

    pub(crate) fn all() {
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| rates(threads));
        }
        sampling();
    }
}
