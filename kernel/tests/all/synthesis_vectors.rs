//! The synthesis kernels against reference values computed independently in double precision.
#![allow(clippy::cast_possible_truncation, reason = "the vectors are small")]
use serde_json::Value;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::synthesis::exact::{CorrectionRule, Corrector, Features, offsets, upsample};
use shibo_kernel::synthesis::jacobian::{OCTANTS, octant};
use shibo_kernel::synthesis::levels::pyramid_level;
use shibo_kernel::synthesis::magnify::places;
use shibo_kernel::synthesis::texels::{Fetch, Texels};
use shibo_kernel::synthesis::{Lookup, PixelPlane};

const TOLERANCE: f64 = 1e-9;

fn vectors() -> Value {
    serde_json::from_str(include_str!("../vectors/synthesis.json")).expect("valid JSON")
}

/// All numbers of nested lists, in order.
fn flat(v: &Value) -> Vec<f64> {
    match v {
        Value::Array(list) => list.iter().flat_map(flat).collect(),
        _ => vec![v.as_f64().expect("a number")],
    }
}

fn pairs(v: &Value) -> Vec<[f64; 2]> {
    flat(v).chunks_exact(2).map(|p| [p[0], p[1]]).collect()
}

fn close(a: &[f64], b: &[f64], what: &str) {
    assert_eq!(a.len(), b.len(), "{what}");
    let worst = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst <= TOLERANCE, "{what}: {worst}");
}

fn torus(side: usize) -> PixelPlane {
    PixelPlane { w: side, h: side, wrap: [true; 2] }
}

fn picture(v: &Value, channels: usize) -> Texels<f64> {
    let data = flat(v);
    let side = (data.len() / channels).isqrt();
    Texels::new(torus(side), channels, data)
}

#[test]
fn stacks_and_pyramids() {
    let all = vectors();
    let finest = picture(&all["exemplar_8x8x2_row_col_channel"], 2);
    for levels in all["levels"].as_array().expect("a list") {
        let stack = levels["choice"] == "stack";
        for (level, h) in levels["coarse_to_fine"].as_array().expect("a list").iter().zip([8, 4, 2, 1]) {
            let made = if stack { finest.blurred(h) } else { pyramid_level(&finest, h) };
            close(&made.data, &flat(level), "level");
        }
    }
}

#[test]
fn finds_neighbour_in_direction() {
    for case in vectors()["immediate_neighbour"].as_array().expect("a list") {
        let degrees = case["degrees"].as_f64().expect("a number");
        let (y, x) = degrees.to_radians().sin_cos();
        let wanted: Vec<i64> = flat(&case["offset"]).iter().map(|v| v.round() as i64).collect();
        assert_eq!(OCTANTS[octant(x, y)].map(i64::from).to_vec(), wanted, "{degrees}");
    }
}

struct Case {
    j: Vec<[f64; 4]>,
    map: Vec<[f64; 2]>,
}

fn cases(all: &Value) -> Vec<(Value, Case)> {
    let list = all["cases"].as_array().expect("a list").iter();
    list.map(|case| {
        let j = flat(&case["J_6x6"]).chunks_exact(4).map(|j| [j[0], j[1], j[2], j[3]]).collect();
        (case.clone(), Case { j, map: pairs(&case["upsampled_6x6"]) })
    })
    .collect()
}

#[test]
fn places_children_around_parents() {
    for (json, case) in cases(&vectors()) {
        let h = json["h"].as_f64().expect("a number");
        let made = upsample(&pairs(&json["S_parent_3x3"]), torus(3), h, |x, y| case.j[y * 6 + x]);
        close(made.as_flattened(), case.map.as_flattened(), "upsampled");
    }
}

#[test]
fn neighbourhoods_candidates_errors_and_corrections() {
    let all = vectors();
    let texels = picture(&all["exemplar_8x8x2_row_col_channel"], 2);
    let features = Features { texels: &texels, ratio: 1.0, second: &[], plane: torus(8) };
    let plane = torus(6);
    let mut checked = 0;
    for (json, case) in cases(&all) {
        for correction in json["corrections"].as_array().expect("a list") {
            let square = if correction["offsets"] == "full3" { 3 } else { 4 };
            let rule = CorrectionRule {
                square,
                averaged: correction["averaged"] == true,
                fetch: if correction["fetch"] == "nearest" { Fetch::Nearest } else { Fetch::Bilinear },
                h: 1.0,
                kappa: 1.0,
                sub_passes: 1,
            };
            let corrector =
                Corrector { features: &features, rule: &rule, lookup: &plane, jacobian: |p: usize| case.j[p] };
            // The vectors list offsets in another order.
            let order: &[[i32; 2]] = if square == 3 {
                &[[-1, -1], [-1, 0], [-1, 1], [0, -1], [0, 0], [0, 1], [1, -1], [1, 0], [1, 1]]
            } else {
                &[[1, -1], [-1, 1], [-1, -1], [1, 1]]
            };
            let ours = offsets(square);
            for (k, pixel) in pairs(&correction["pixels_xy"]).iter().enumerate() {
                let at = (pixel[0] as i32, pixel[1] as i32);
                let seen = corrector.neighbourhood(&case.map, at);
                let sorted: Vec<f64> = order
                    .iter()
                    .flat_map(|o| {
                        let k = ours.iter().position(|ours| ours == o).expect("the same offsets");
                        seen[2 * k..2 * k + 2].to_vec()
                    })
                    .collect();
                close(&sorted, &flat(&correction["neighbourhood"][k]), "neighbourhood");
                let candidates = corrector.candidates(&case.map, at);
                close(candidates.as_flattened(), &flat(&correction["candidates"][k]), "candidates");
                let errors: Vec<f64> = candidates.iter().map(|u| corrector.error(&seen, *u)).collect();
                close(&errors, &flat(&correction["error"][k]), "errors");
                checked += 1;
            }
            let mut map = case.map.clone();
            corrector.pass(plane, &[], &mut map);
            close(map.as_flattened(), &flat(&correction["corrected_sub1"]), "corrected at once");
            let rule = CorrectionRule { sub_passes: 4, ..rule };
            let mut map = case.map.clone();
            Corrector { rule: &rule, ..corrector }.pass(plane, &[], &mut map);
            close(map.as_flattened(), &flat(&correction["corrected_sub2"]), "corrected in four groups");
        }
        let rule =
            CorrectionRule { square: 4, averaged: true, fetch: Fetch::Bilinear, h: 1.0, kappa: 1.0, sub_passes: 1 };
        let corrector = Corrector { features: &features, rule: &rule, lookup: &plane, jacobian: |p: usize| case.j[p] };
        let centres: Vec<[f64; 2]> = (0..64).map(|p| [f64::from(p % 8) + 0.5, f64::from(p / 8) + 0.5]).collect();
        let mut map = case.map.clone();
        corrector.pass(plane, &centres, &mut map);
        close(map.as_flattened(), &flat(&json["brute_force"]["corrected_sub1"]), "all pixels tried");
    }
    assert_eq!(checked, 3 * 8 * 3);
}

#[test]
fn magnified_colours() {
    for (json, case) in cases(&vectors()) {
        let magnification = &json["magnification"];
        let fine = picture(&magnification["EH_16x16x2"], 2);
        let plane = torus(6);
        for (k, p) in pairs(&magnification["positions"]).into_iter().enumerate() {
            let show = |jacobian: &dyn Fn(usize) -> [f64; 4]| {
                let mut out = [0.0; 2];
                for (at, weight) in places(&case.map, &plane, p, jacobian) {
                    fine.add([at[0] * 2.0, at[1] * 2.0], Fetch::Bilinear, weight, &mut out);
                }
                out
            };
            close(&show(&|_| [1.0, 0.0, 0.0, 1.0]), &flat(&magnification["isometric"][k]), "isometric (5)");
            close(&show(&|q| case.j[q]), &flat(&magnification["anisometric_J_at_tap"][k]), "anisometric (6)");
            // J at p, interpolated.
            let mut j = [0.0; 4];
            for (_, weight, q) in taps(&plane, p) {
                j.iter_mut().zip(case.j[q]).for_each(|(j, v)| *j += weight * v);
            }
            let at_p = flat(&magnification["anisometric_J_at_p"][k]);
            let shown = show(&|_| j);
            let near = show(&|_| case.j[plane.index(p[0].floor() as i32, p[1].floor() as i32)]);
            let off = |a: [f64; 2]| a.iter().zip(&at_p).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off(shown).min(off(near)) <= TOLERANCE, "J at p: {} {}", off(shown), off(near));
        }
    }
}

/// The four pixels around a position, their weights and indices.
fn taps(plane: &PixelPlane, p: [f64; 2]) -> Vec<([i32; 2], f64, usize)> {
    let cell = p.map(|v| (v - 0.5).floor());
    let rest = [p[0] - 0.5 - cell[0], p[1] - 0.5 - cell[1]];
    [[0, 0], [1, 0], [0, 1], [1, 1]]
        .into_iter()
        .map(|[x, y]: [i32; 2]| {
            let weight = |k: i32, rest: f64| if k == 0 { 1.0 - rest } else { rest };
            let q = plane.index(cell[0] as i32 + x, cell[1] as i32 + y);
            ([x, y], weight(x, rest[0]) * weight(y, rest[1]), q)
        })
        .collect()
}

/// The source's method starting from zeros, without jitter: the only whole runs that do not depend on random numbers.
#[test]
fn whole_runs_from_zeros() {
    let all = vectors();
    let runs = &all["whole_runs"];
    let finest = picture(&runs["exemplar_16x16"], 1);
    let hash = |k: u64| Hash::new(7000 + k).unit(0);
    let expected: Vec<f64> = (0..256).map(hash).collect();
    close(&finest.data, &expected, "the exemplar");
    for run in runs["runs"].as_array().expect("a list") {
        if run["jitter"] != 0.0 {
            continue;
        }
        let turn = run["jacobian"] == "turn";
        let pyramid = run["choice"] == "pyramid";
        let mut map = vec![[0.0f64; 2]; 4];
        for level in 1..=4 {
            let (side, h) = (2usize << level, f64::from(1 << (4 - level)));
            let j = |x: usize, _y: usize| {
                // The angle grows with x, in finest pixels at the pixel's centre.
                let (s, c) = if turn { ((x as f64 + 0.5) * h / 20.0).sin_cos() } else { (0.0, 1.0) };
                [c, -s, s, c]
            };
            map = upsample(&map, torus(side / 2), h, j);
            let texels = if pyramid { pyramid_level(&finest, h as usize) } else { finest.blurred(h as usize) };
            let ratio = if pyramid { h } else { 1.0 };
            let features = Features { texels: &texels, ratio, second: &[], plane: torus(16) };
            let rule =
                CorrectionRule { square: 4, averaged: true, fetch: Fetch::Bilinear, h, kappa: 1.0, sub_passes: 4 };
            let plane = torus(side);
            let corrector = Corrector {
                features: &features,
                rule: &rule,
                lookup: &plane,
                jacobian: |p: usize| j(p % side, p / side),
            };
            for _ in 0..2 {
                corrector.pass(plane, &[], &mut map);
            }
        }
        let wanted = pairs(&run["S_32x32"]);
        let off = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).abs() + (a[1] - b[1]).abs() > 1e-6;
        let different = map.iter().zip(&wanted).filter(|p| off(*p)).count();
        assert_eq!(different, 0, "{} {}", run["jacobian"], run["choice"]);
    }
}
