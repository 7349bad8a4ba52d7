//! Tests of envelopes against all sums.
use super::*;
use crate::ground::hash::Hash;
use proptest::prelude::*;

/// Smooth hills with steps and noise, from 0 to 1.
fn hills(window: Window, seed: u64) -> Vec<f32> {
    let hash = Hash::new(seed);
    let value = |x: i32, y: i32| {
        let (u, v) = (f64::from(x) * 0.21 + seed as f64, f64::from(y) * 0.17);
        let wave = 0.5 + 0.25 * (libm::sin(u) + libm::cos(v + 0.3 * u));
        let step = if (x.div_euclid(13) + y.div_euclid(11)).rem_euclid(3) == 0 { 0.3 } else { 0.0 };
        let noise = hash.unit_f32((i64::from(x + 1000) * 5000 + i64::from(y + 1000)).cast_unsigned());
        (narrow(0.6 * wave + step) + 0.1 * noise).clamp(0.0, 1.0)
    };
    (window.y..window.bottom()).flat_map(|y| (window.x..window.right()).map(move |x| value(x, y))).collect()
}

fn brute(view: &View<'_>, rect: Window, profile: Profile, reach: f64, step: [f64; 2]) -> Vec<f64> {
    let far = Foot::reach(reach, step).map(index);
    let at = |x: i32, y: i32| {
        let places = (-far[1]..=far[1]).flat_map(|dy| (-far[0]..=far[0]).map(move |dx| (dx, dy)));
        let sums = places.filter_map(|(dx, dy)| {
            let distance = f64::hypot(f64::from(dx) * step[0], f64::from(dy) * step[1]);
            (distance <= reach).then(|| f64::from(view.at(x + dx, y + dy)) + profile.at(distance))
        });
        sums.fold(f64::INFINITY, f64::min)
    };
    (rect.y..rect.bottom()).flat_map(|y| (rect.x..rect.right()).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect()
}

fn lowered(view: &View<'_>, rect: Window, foot: &Foot) -> Vec<f32> {
    let mut out = vec![0.0; rect.len()];
    lower(view, rect, foot, range(view, rect.with_halo(foot.reach)), &mut out);
    out
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn is_the_least_of_all_sums(seed in 0u64..1000, kind in 0usize..4, degrees in 3f64..80.0, sx in 0.05f64..0.3, aspect in 0.5f64..2.0, x in -20i32..20, y in -20i32..20, w in 1usize..45, h in 1usize..45) {
        let (profile, reach) = match kind {
            0 | 1 => (Profile::Cone(degrees.to_radians().tan()), 1.0 / degrees.to_radians().tan()),
            2 => (Profile::Ball(0.1 * degrees * sx), 0.1 * degrees * sx),
            _ => (Profile::Flat, 0.1 * degrees * sx),
        };
        let reach = reach.min(60.0 * sx);
        // A cone that ends early is exact for lower heights.
        let high = if kind < 2 { narrow((profile.at(reach) * 0.999).min(1.0)) } else { 1.0 };
        let (step, rect) = ([sx, sx * aspect], Window::of(x, y, w, h));
        let foot = Foot::new(profile, reach, step);
        let big = rect.with_halo(foot.reach);
        let data: Vec<f32> = hills(big, seed).iter().map(|v| v * high).collect();
        let view = View::new(&data, big);
        let got = lowered(&view, rect, &foot);
        let wanted = brute(&view, rect, profile, reach, step);
        for (k, (got, wanted)) in got.iter().zip(&wanted).enumerate() {
            prop_assert!((f64::from(*got) - wanted).abs() < 1e-6, "{} {} {}", k, got, wanted);
            prop_assert!(*got <= view.at(x + index(k % w), y + index(k / w)));
        }
    }
}

#[test]
fn a_region_has_the_bits_of_the_whole() {
    let (whole, step) = (Window::of(-7, 3, 150, 130), [0.1, 0.13]);
    for (profile, reach) in
        [(Profile::Cone(0.3), 1.0 / 0.3), (Profile::Cone(2.0), 0.5), (Profile::Ball(1.5), 1.5), (Profile::Flat, 0.7)]
    {
        let foot = Foot::new(profile, reach, step);
        let big = whole.with_halo(foot.reach);
        let data = hills(big, 7);
        let view = View::new(&data, big);
        let all = lowered(&view, whole, &foot);
        let all = View::new(&all, whole);
        for rect in [Window::of(5, 9, 64, 64), Window::of(-7, 3, 1, 1), Window::of(100, 20, 43, 113)] {
            let part = lowered(&view, rect, &foot);
            for (j, row) in part.chunks_exact(rect.columns()).enumerate() {
                assert_eq!(row, all.row(rect.x, rect.y + index(j), rect.columns()), "{profile:?}");
            }
        }
    }
}

/// Sweeps with sources, a usual method for distances, are wrong at some places.
#[test]
fn is_below_the_bound_of_the_sweeps_at_some_places() {
    let foot = Foot::new(Profile::Cone(0.2), 5.0, [0.1, 0.1]);
    let rect = Window::of(0, 0, 200, 200);
    let big = rect.with_halo(foot.reach);
    let data = hills(big, 3);
    let view = View::new(&data, big);
    let bound = sweep(&view, big, &foot, foot.reach);
    let (bound, exact) = (View::new(&bound, big), lowered(&view, rect, &foot));
    let over = (0..rect.len()).filter(|k| bound.at(index(k % 200), index(k / 200)) > exact[*k] + 1e-6).count();
    assert!((0..rect.len()).all(|k| bound.at(index(k % 200), index(k / 200)) >= exact[k]));
    assert!(over > 0 && over < rect.len() / 20, "{over}");
}

#[test]
fn half_a_cone_reads_one_side() {
    let (rect, foot) = (Window::of(3, -4, 40, 30), Foot::new(Profile::Cone(0.5), 2.0, [0.1, 0.2]));
    let big = rect.with_halo(foot.reach);
    let data = hills(big, 1);
    let view = View::new(&data, big);
    for way in [[1, 0], [-1, 0], [0, 1], [0, -1]] {
        let mut out = vec![0.0; rect.len()];
        lower_along(&view, rect, &foot, way, range(&view, big), &mut out);
        for (k, got) in out.iter().enumerate() {
            let (x, y) = (rect.x + index(k % 40), rect.y + index(k / 40));
            let step: f32 = if way[0] == 0 { 0.1 } else { 0.05 };
            let reach = if way[0] == 0 { 10 } else { 20 };
            let sums = (0..=reach).map(|n| view.at(x + way[0] * n, y + way[1] * n) + n as f32 * step);
            assert!((sums.fold(f32::INFINITY, f32::min) - got).abs() < 1e-6, "{way:?}");
        }
    }
}
