//! Synthesis on canvases that tile only in x or only in y: each axis is treated by itself.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;

/// Synthesises from an exemplar of the canvas itself, whose sides join where the canvas tiles; many seeds give a
/// lattice.
fn values(desk: &Desk, tile: &str, seed: u64, size: (u32, u32)) -> Vec<f64> {
    let (w, h) = size;
    let text = format!(
        "(version: 1, canvas: (size_mm: ({w}, {h}), resolution: ({}, {}), tile: {tile}, seed: {seed}), nodes: {{\n  \
         \"c\": Worley(size: 5, jitter: 0.8),\n  \"e\": Exemplar(input: \"c.border\", size: (64, 64), size_mm: 12),\n  \
         \"m\": Synthesize(exemplar: \"e\"),\n  \"s\": SampleExemplar(coords: \"m\", input: \"c.border\") }},\n  \
         outputs: {{ \"o\": \"s\" }} )",
        w * 64 / 12,
        h * 64 / 12
    );
    desk.write("a.ron", text);
    let dump = desk.shibo("dump a.ron s --no-cache").expect(0).json();
    dump["values"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// The mean step between adjacent columns or rows: across the edge of the canvas, and inside.
fn steps(values: &[f64], rows: bool) -> [f64; 2] {
    let at = |k: usize, m: usize| if rows { values[k % 64 * 64 + m] } else { values[m * 64 + k % 64] };
    let step = |k: usize| (0..64).map(|m| (at(k, m) - at(k + 1, m)).abs()).sum::<f64>() / 64.0;
    [step(63), (0..63).map(step).sum::<f64>() / 63.0]
}

#[test]
fn joins_only_tiling_sides() {
    let desk = Desk::new();
    for (tile, joins) in [("X", [true, false]), ("Y", [false, true])] {
        let mut sums = [[0.0; 2]; 2];
        for seed in 0..12 {
            let values = values(&desk, tile, seed, (12, 12));
            for (rows, sums) in [false, true].into_iter().zip(&mut sums) {
                let steps = steps(&values, rows);
                (sums[0], sums[1]) = (sums[0] + steps[0], sums[1] + steps[1]);
            }
        }
        let joined = sums.map(|[side, inside]| side < 1.6 * inside);
        assert_eq!(joined, joins, "{tile}: {sums:?}");
    }
}

#[test]
fn extends_along_non_tiling_axis() {
    let desk = Desk::new();
    for seed in [1, 6] {
        let (small, large) = (values(&desk, "X", seed, (12, 12)), values(&desk, "X", seed, (12, 24)));
        assert_eq!(small[..], large[..64 * 64], "seed {seed}");
    }
}
