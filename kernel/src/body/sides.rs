//! Simplifies the samples on the side of a block after Douglas and Peucker: the farthest sample is kept until all others
//! are within the error.
use super::patch::{Facet, Tolerance};

/// The line of samples that a side lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// A row of samples.
    Row(usize),
    /// A column of samples.
    Column(usize),
}

/// The samples between both ends of a side that are kept, rising. `places` are the positions in half steps. `around` is
/// true for a side that goes round a roll.
pub(super) fn simplify(line: &[f64], places: &[i32], tolerance: Tolerance, around: bool) -> Vec<u8> {
    let mut kept = Vec::new();
    let mut waiting = vec![(0, line.len() - 1)];
    while let Some((from, to)) = waiting.pop() {
        if to <= from + 1 {
            continue;
        }
        let (start, run) = (f64::from(places[from]), f64::from(places[to] - places[from]));
        let slope = (line[to] - line[from]) / run;
        let (mut most, mut at) = (0.0, from);
        for index in from + 1..to {
            let height = line[from] + (f64::from(places[index]) - start) * slope;
            let distance = (height - line[index]).abs();
            if distance > most {
                (most, at) = (distance, index);
            }
        }
        let mut share = most / tolerance.heights();
        if around && share <= 1.0 {
            let extent = (line[from].min(line[to]), line[from].max(line[to]));
            let edge = Facet { size: [run, 0.0], slope: [slope, 0.0], extent };
            (share, at) = (tolerance.sagitta(&edge), usize::midpoint(from, to));
        }
        if share > 1.0 {
            kept.push(u8::try_from(at).unwrap_or(u8::MAX));
            waiting.extend([(from, at), (at, to)]);
        }
    }
    kept.sort_unstable();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_a_corner_and_nothing_on_straight_lines() {
        let places: Vec<i32> = (0..9).map(|x| 2 * x).collect();
        let line: Vec<f64> = (0..9).map(|x: i32| f64::from((x - 3).abs())).collect();
        assert_eq!(simplify(&line, &places, Tolerance::flat(0.01), false), [3]);
        assert!(simplify(&line, &places, Tolerance::flat(10.0), false).is_empty());
    }

    #[test]
    fn divides_sides_that_go_round_a_roll() {
        let places: Vec<i32> = (0..=64).map(|x| 2 * x).collect();
        // Chords of a circle of 10 mm with 640 columns: 0.25 · 0.01 mm = r (1 - cos(angle / 2)) at 4.6 columns.
        let kept = simplify(&[0.0; 65], &places, Tolerance::round(0.01, 10.0, 640), true);
        assert_eq!(kept, (1..16).map(|x| 4 * x).collect::<Vec<u8>>());
        assert!(simplify(&[0.0; 65], &places, Tolerance::round(0.01, 10.0, 640), false).is_empty());
    }
}
