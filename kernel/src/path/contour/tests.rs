//! Tests of level lines.
use super::*;

fn disc(tiling: Tiling, middle: DVec2) -> Mask {
    let (size, pixel) = (UVec2::new(64, 48), DVec2::splat(0.5));
    let value = |n: u32| {
        let p = (DVec2::new(f64::from(n % 64), f64::from(n / 64)) + 0.5) * pixel;
        let mut to = (p - middle).abs();
        if tiling == Tiling::BOTH {
            to = to.min(DVec2::new(32.0, 24.0) - to);
        }
        crate::ground::number::narrow((0.5 + (7.0 - to.length()) * 0.5).clamp(0.0, 1.0))
    };
    Mask::new((0..64 * 48).map(value).collect(), size, pixel, tiling)
}

#[test]
fn borders_lie_on_the_shape_and_close() {
    for (tiling, middle) in [(Tiling::NONE, DVec2::new(15.0, 12.0)), (Tiling::BOTH, DVec2::new(1.0, 23.0))] {
        let border = disc(tiling, middle).border();
        let mut length = 0.0;
        for [a, b] in &border {
            let to = (*a - middle).abs();
            let to = if tiling == Tiling::BOTH { to.min((DVec2::new(32.0, 24.0) - to).abs()) } else { to };
            assert!((to.length() - 7.0).abs() < 0.02, "{a}");
            length += a.distance(*b);
        }
        assert!((length - 44.0).abs() < 0.1, "{length}");
    }
}

#[test]
fn interpolates_between_samples_and_repeats() {
    let mask = disc(Tiling::BOTH, DVec2::new(1.0, 23.0));
    for n in 0..100 {
        let p = DVec2::new(f64::from(n) * 0.7 - 20.0, f64::from(n) * 0.31);
        assert!((mask.at(p) - mask.at(p + DVec2::new(32.0, -24.0))).abs() < 1e-9);
    }
    assert!(mask.at(DVec2::new(1.0, 23.0)) > 0.5 && mask.at(DVec2::new(16.0, 10.0)) < 0.5);
    let one = Mask::new(vec![f32::NAN, 1.0, f32::INFINITY, 0.0], UVec2::splat(2), DVec2::ONE, Tiling::NONE);
    assert!(one.border().iter().flatten().all(|p| p.is_finite()));
}

fn area(path: &Path) -> f64 {
    path.pieces().map(|[a, b]| 0.5 * a.perp_dot(b)).sum()
}

#[test]
fn lines_of_a_disc_close_with_the_disc_on_their_right() {
    for n in [64, 256, 1024] {
        let (size, pixel) = (UVec2::new(n, n), DVec2::splat(32.0 / f64::from(n)));
        let centre = |k: u32| (DVec2::new(f64::from(k % n), f64::from(k / n)) + 0.5) * pixel;
        let value = |k: u32| crate::ground::number::narrow(7.0 - centre(k).distance(DVec2::new(15.3, 16.1)));
        let mask = Mask::new((0..n * n).map(value).collect(), size, pixel, Tiling::BOTH);
        let path = mask.lines(0.0, &|| false).unwrap();
        let [curve] = &path.curves[..] else { panic!("{} curves", path.curves.len()) };
        assert!(curve.closed && curve.points.first() == curve.points.last());
        let (length, area) = (curve.length() / 14.0, area(&path) / 49.0);
        assert!((length / std::f64::consts::PI - 1.0).abs() < 0.01, "{n}: {length}");
        assert!((area / std::f64::consts::PI - 1.0).abs() < 0.01, "{n}: {area}");
    }
}

#[test]
fn lines_go_around_the_canvas_or_end_at_its_border() {
    // A band whose two borders are waves across the whole canvas.
    let value = |k: u32| {
        let (x, y) = (f64::from(k % 32) + 0.5, f64::from(k / 32) + 0.5);
        crate::ground::number::narrow(5.0 - (y - 16.0 - 3.0 * (x * std::f64::consts::TAU / 32.0).sin()).abs())
    };
    let values: Vec<f32> = (0..1024).map(value).collect();
    for tiling in [Tiling::BOTH, Tiling { x: false, y: true }, Tiling::NONE] {
        let path = Mask::new(values.clone(), UVec2::splat(32), DVec2::ONE, tiling).lines(0.0, &|| false).unwrap();
        assert_eq!(path.curves.len(), 2, "{tiling:?}");
        for curve in &path.curves {
            let way = *curve.points.last().unwrap() - curve.points[0];
            let far = if tiling.x { 32.0 } else { 33.0 };
            assert!(curve.closed == tiling.x && (way.x.abs() - far).abs() < 1e-9 && way.y.abs() < 3.0, "{way}");
            // The band lies on the right.
            let to = (curve.points[1] - curve.points[0]).perp() + curve.points[0];
            assert!((to.y - 16.0).abs() < (curve.points[0].y - 16.0).abs(), "{tiling:?}");
        }
    }
}

#[test]
fn saddles_and_noise_give_whole_lines() {
    let hash = crate::ground::hash::Hash::new(3);
    let values: Vec<f32> = (0..40 * 30).map(|n| hash.unit_f32(n)).collect();
    for tiling in [Tiling::BOTH, Tiling { x: true, y: false }, Tiling::NONE] {
        let mask = Mask::new(values.clone(), UVec2::new(40, 30), DVec2::new(0.5, 0.5), tiling);
        let path = mask.lines(0.5, &|| false).unwrap();
        let inside = |p: DVec2| p.x > 0.25 && p.y > 0.25 && p.x < 19.75 && p.y < 14.75;
        let ends = path.curves.iter().filter(|curve| !curve.closed);
        for curve in ends {
            assert!(![curve.points[0], *curve.points.last().unwrap()].iter().any(|p| inside(*p)), "{tiling:?}");
        }
        if tiling == Tiling::BOTH {
            assert!(path.curves.iter().all(|curve| curve.closed));
            assert_eq!(path.len(), mask.border().len());
        }
    }
}

/// All levels of a field, in any number of batches, have the bits of the levels one by one.
#[test]
fn many_levels_are_those_of_each_alone() {
    let hash = crate::ground::hash::Hash::new(5);
    let mut values: Vec<f32> = (0..50 * 40).map(|n| (hash.unit_f32(n) * 64.0).round() / 64.0).collect();
    (values[77], values[90]) = (f32::NAN, f32::INFINITY);
    let levels: Vec<f64> = (-3..70).map(|k| f64::from(k) / 64.0).collect();
    for tiling in [Tiling::BOTH, Tiling { x: false, y: true }, Tiling::NONE] {
        let mask = Mask::new(values.clone(), UVec2::new(50, 40), DVec2::ONE, tiling);
        let mut found = Vec::new();
        mask.levels(&levels, &|| false, &mut |level, path| found.push((level, path))).unwrap();
        assert_eq!(found.len(), levels.len());
        for (n, (level, path)) in found.iter().enumerate() {
            let alone = mask.lines(levels[n], &|| false).unwrap();
            assert!(*level == n && alone.curves == path.curves, "{tiling:?}: level {n}");
        }
        assert!(mask.levels(&levels, &|| true, &mut |_, _| {}).is_none());
    }
}

/// Work follows the lines, not the product of samples and levels: 20,000 levels of 256² samples that rise to the right.
#[test]
fn cells_are_visited_for_their_levels_only() {
    let values: Vec<f32> = (0..256 * 256).map(|n| crate::ground::number::narrow(f64::from(n % 256))).collect();
    let mask = Mask::new(values, UVec2::splat(256), DVec2::ONE, Tiling::NONE);
    let levels: Vec<f64> = (0..20_000).map(|k| f64::from(k) * 0.01 + 0.005).collect();
    let (asked, mut points) = (std::cell::Cell::new(0), 0);
    let stop = || {
        asked.set(asked.get() + 1);
        false
    };
    let mut count = |_: usize, path: Path| points += path.curves.iter().map(|curve| curve.points.len()).sum::<usize>();
    mask.levels(&levels, &stop, &mut count).unwrap();
    assert_eq!(points, 20_000 * 258);
    assert!(asked.get() < 20_000 + 2 * 258, "{}", asked.get());
}
