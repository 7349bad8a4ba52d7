//! Tests of the laws of growth: monotone, linear in time, rougher with larger delays, closed on the torus.
use super::*;
use crate::ground::stop::NEVER;

const SIDE: f64 = 60.0;

fn law() -> Law {
    Law { grain: 0.4, roughness: 0.5, spacing: SIDE, stagger: 0.0, amount: 8.0, drip: 0.0, down: DVec2::Y }
}

fn plan(tiling: Tiling) -> Plan {
    Plan::new(DVec2::splat(SIDE), 0.4, tiling)
}

fn grown(law: &Law, seed: u64, speed: impl Fn(DVec2) -> f32) -> Drawing {
    let plan = plan(Tiling::BOTH);
    let speeds: Vec<f32> = (0..plan.len()).map(|n| speed(plan.centre(n))).collect();
    let (fertile, started) = (vec![1.0; plan.len()], vec![false; plan.len()]);
    let ground = Ground { speeds: &speeds, fertile: &fertile, started: &started };
    law.grow(&plan, &ground, Hash::new(seed), NEVER).unwrap()
}

fn places() -> impl Iterator<Item = DVec2> {
    (0..300 * 300u32).map(|n| (DVec2::new(f64::from(n % 300), f64::from(n / 300)) + 0.5) * (SIDE / 300.0))
}

/// Radius of a disc of the area that is grown over.
fn radius(drawing: &Drawing) -> f64 {
    let area = places().map(|p| f64::from(drawing.front(p, 0.2).mask)).sum::<f64>() * 0.04;
    (area / std::f64::consts::PI).sqrt()
}

#[test]
fn a_later_moment_contains_an_earlier_one() {
    let law = Law { spacing: 12.0, stagger: 3.0, drip: 10.0, ..law() };
    let drawings: Vec<Drawing> =
        [1.0, 2.0, 3.5, 5.0].iter().map(|amount| grown(&Law { amount: *amount, ..law }, 5, |_| 1.0)).collect();
    let mut covered = Vec::new();
    for pair in drawings.windows(2) {
        for p in places() {
            let [a, b] = [&pair[0], &pair[1]].map(|drawing| drawing.front(p, 0.2).late <= 0.0);
            assert!(!a || b, "{p}");
            let [a, b] = [&pair[0], &pair[1]].map(|drawing| drawing.history(p)[1]);
            assert!(b >= a - 1e-6 || pair[1].front(p, 0.2).late < -0.5, "{p}: {a} {b}");
        }
        covered.push(radius(&pair[1]));
    }
    assert!(covered.windows(2).all(|pair| pair[1] > pair[0]), "{covered:?}");
}

#[test]
fn colonies_grow_in_proportion_to_time() {
    for roughness in [0.0, 0.3, 0.6, 1.0] {
        let shares: Vec<f64> = [6.0, 12.0, 24.0]
            .iter()
            .map(|amount| {
                let radii =
                    (1..=5).map(|seed| radius(&grown(&Law { amount: *amount, roughness, ..law() }, seed, |_| 1.0)));
                radii.sum::<f64>() / 5.0 / amount
            })
            .collect();
        println!("radius over time at {roughness}: {shares:.3?}");
        let most = if roughness > 0.8 { 0.4 } else { 0.25 };
        assert!(shares.iter().all(|share| (share - 1.0).abs() < most), "{roughness}: {shares:?}");
    }
}

#[test]
fn an_even_front_is_round() {
    let drawing = grown(&Law { roughness: 0.0, amount: 20.0, ..law() }, 1, |_| 1.0);
    let seed = law().seeds(&plan(Tiling::BOTH), &vec![1.0; plan(Tiling::BOTH).len()], Hash::new(1).with(2))[0].place;
    for k in 0..64 {
        let way = DVec2::from_angle(f64::from(k) * 0.1);
        let reach = (0..4000).map(|n| f64::from(n) * 0.01).find(|r| drawing.front(seed + way * *r, 0.1).late > 0.0);
        assert!((reach.unwrap() - 20.0).abs() < 0.5, "{k}: {reach:?}");
    }
}

/// Length of the border over that of a disc of the same area.
fn border(drawing: &Drawing) -> f64 {
    let inside: Vec<bool> = places().map(|p| drawing.front(p, 0.2).late <= 0.0).collect();
    let count = (0..300 * 300)
        .map(|n: usize| {
            let (right, down) = (n - n % 300 + (n + 1) % 300, (n + 300) % 90_000);
            usize::from(inside[n] != inside[right]) + usize::from(inside[n] != inside[down])
        })
        .sum::<usize>();
    count as f64 * 0.2 / (8.0 * radius(drawing))
}

#[test]
fn rough_delays_make_rough_borders() {
    let borders: Vec<f64> = [0.0, 0.3, 0.6, 1.0]
        .iter()
        .map(|roughness| {
            let all = (1..=3)
                .map(|seed| border(&grown(&Law { amount: 14.0, roughness: *roughness, ..law() }, seed, |_| 1.0)));
            all.sum::<f64>() / 3.0
        })
        .collect();
    println!("length of the border over that of a disc: {borders:.2?}");
    assert!((borders[0] - 1.0).abs() < 0.1 && borders.windows(2).all(|pair| pair[1] > 1.1 * pair[0]), "{borders:?}");
}

#[test]
fn growth_repeats_and_stops_at_other_borders() {
    let law = Law { spacing: 15.0, drip: 9.0, ..law() };
    let drawing = grown(&law, 2, |_| 1.0);
    for p in places().step_by(7) {
        let q = p + DVec2::new(SIDE, -SIDE);
        let ([a, b], [c, d]) = (drawing.history(p), drawing.history(q));
        assert!((a - c).abs() < 1e-3 && (b - d).abs() < 1e-3, "{p}");
    }
    // From a start at the left edge, the front comes to the right edge through the seam, if there is one.
    for (tiling, late) in [(Tiling::BOTH, false), (Tiling::NONE, true)] {
        let plan = plan(tiling);
        let even = vec![1.0; plan.len()];
        let started: Vec<bool> = (0..plan.len()).map(|n| plan.centre(n).x < 1.0).collect();
        let ground = Ground { speeds: &even, fertile: &even, started: &started };
        let law = Law { spacing: 0.0, roughness: 0.0, ..law };
        let time = law.grow(&plan, &ground, Hash::new(1), NEVER).unwrap().history(DVec2::new(57.0, 30.0))[0];
        let want = if late { 56.0 } else { 3.0 };
        assert!((f64::from(time) - want).abs() < 0.5, "{time} {want}");
    }
}

#[test]
fn growth_follows_exposure() {
    // The left half is twice as fast, a stripe is never grown over.
    let speed = |p: DVec2| {
        if (28.0..32.0).contains(&p.x) {
            0.0
        } else if p.x < 30.0 {
            1.0
        } else {
            0.5
        }
    };
    let law = Law { spacing: 10.0, amount: 3.0, ..law() };
    let mut shares = [0.0; 3];
    for seed in 1..=4 {
        let drawing = grown(&law, seed, speed);
        for p in places() {
            let part = if (29.0..31.0).contains(&p.x) { 2 } else { usize::from(p.x > 30.0) };
            shares[part] += f64::from(drawing.front(p, 0.2).mask);
        }
    }
    assert!(shares[2] == 0.0 && shares[0] > 1.8 * shares[1] && shares[1] > 0.0, "{shares:?}");
}

#[test]
fn edges_are_distances_from_the_margin() {
    let drawing = grown(&Law { roughness: 0.0, amount: 15.0, ..law() }, 1, |_| 1.0);
    let seed = law().seeds(&plan(Tiling::BOTH), &vec![1.0; plan(Tiling::BOTH).len()], Hash::new(1).with(2))[0].place;
    for (r, most) in [(2.0, 1.2), (8.0, 0.8), (12.0, 0.5), (14.0, 0.3)] {
        for k in 0..16 {
            let spot = drawing.front(seed + DVec2::from_angle(f64::from(k) * 0.4) * r, 0.1);
            assert!((f64::from(spot.edge) - (15.0 - r)).abs() < most, "{r} {k}: {}", spot.edge);
            assert_eq!(spot.owner, 2);
        }
    }
    let outside = drawing.front(seed + 14.0, 0.1);
    assert_eq!((outside.mask, outside.edge, outside.owner), (0.0, 0.0, 0));
}

#[test]
fn runs_go_down() {
    let law = Law { spacing: 30.0, amount: 6.0, drip: 14.0, ..law() };
    let drawing = grown(&law, 3, |_| 1.0);
    // Outside the growth, stains lie below it more often than above it.
    let (mut below, mut above) = (0.0, 0.0);
    for p in places().filter(|p| drawing.front(*p, 0.2).late > 0.5) {
        let run = f64::from(drawing.history(p)[1]);
        let grown = |to: f64| drawing.front(p + DVec2::new(0.0, to), 0.2).mask > 0.5;
        below += if grown(-2.5) { run } else { 0.0 };
        above += if grown(2.5) { run } else { 0.0 };
    }
    assert!(below > 20.0 && above < 0.1 * below, "{below} {above}");
}
