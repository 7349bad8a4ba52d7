//! Points that fill a cube evenly: the sequence of Sobol with the direction numbers of S. Joe and F. Y. Kuo (2008), shifted by random
//! bits. Directions beyond the table are random within equal intervals.
use crate::random::{Random, hash};

const BITS: usize = 32;
/// For each direction after the first: coefficients of its polynomial, and its first numbers.
const TABLE: [(u32, &[u32]); 31] = [
    (0, &[1]),
    (1, &[1, 3]),
    (1, &[1, 3, 1]),
    (2, &[1, 1, 1]),
    (1, &[1, 1, 3, 3]),
    (4, &[1, 3, 5, 13]),
    (2, &[1, 1, 5, 5, 17]),
    (4, &[1, 1, 5, 5, 5]),
    (7, &[1, 1, 7, 11, 19]),
    (11, &[1, 1, 5, 1, 1]),
    (13, &[1, 1, 1, 3, 11]),
    (14, &[1, 3, 5, 5, 31]),
    (1, &[1, 3, 3, 9, 7, 49]),
    (13, &[1, 1, 1, 15, 21, 21]),
    (16, &[1, 3, 1, 13, 27, 49]),
    (19, &[1, 1, 1, 15, 7, 5]),
    (22, &[1, 3, 1, 15, 13, 25]),
    (25, &[1, 1, 5, 5, 19, 61]),
    (1, &[1, 3, 7, 11, 23, 15, 103]),
    (4, &[1, 3, 7, 13, 13, 15, 69]),
    (7, &[1, 1, 3, 13, 7, 35, 63]),
    (8, &[1, 3, 5, 9, 1, 25, 53]),
    (14, &[1, 3, 1, 13, 9, 35, 107]),
    (19, &[1, 3, 1, 5, 27, 61, 31]),
    (21, &[1, 1, 5, 11, 19, 41, 61]),
    (28, &[1, 3, 5, 3, 3, 13, 69]),
    (31, &[1, 1, 7, 13, 1, 19, 1]),
    (32, &[1, 3, 7, 5, 13, 19, 59]),
    (37, &[1, 1, 3, 9, 25, 29, 41]),
    (41, &[1, 3, 5, 13, 23, 1, 55]),
    (42, &[1, 3, 7, 3, 13, 59, 17]),
];

/// The direction numbers of a direction of the table.
fn numbers(direction: usize) -> [u32; BITS] {
    let mut v = [0_u32; BITS];
    let Some((polynomial, first)) = direction.checked_sub(1).and_then(|row| TABLE.get(row)) else {
        for (bit, number) in v.iter_mut().enumerate() {
            *number = 1 << (BITS - 1 - bit);
        }
        return v;
    };
    let degree = first.len();
    for bit in 0..BITS {
        v[bit] = if bit < degree {
            first[bit] << (BITS - 1 - bit)
        } else {
            let mut number = v[bit - degree] ^ (v[bit - degree] >> degree);
            for k in 1..degree {
                if (polynomial >> (degree - 1 - k)) & 1 == 1 {
                    number ^= v[bit - k];
                }
            }
            number
        };
    }
    v
}

/// `count` points in a cube of `directions` sides, each coordinate in 0..1.
pub(crate) fn points(count: usize, directions: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut points = vec![Vec::with_capacity(directions); count];
    for direction in 0..directions {
        let mut random = Random::new(seed, hash(17, direction as u64));
        if direction > TABLE.len() {
            // One point in each of `count` intervals, in random order.
            let mut order: Vec<usize> = (0..count).collect();
            for last in (1..count).rev() {
                order.swap(last, random.below(last + 1));
            }
            for (point, interval) in points.iter_mut().zip(order) {
                point.push((interval as f64 + random.uniform()) / count as f64);
            }
            continue;
        }
        let v = numbers(direction);
        let mut state = (random.next() >> 32) as u32;
        for (index, point) in points.iter_mut().enumerate() {
            point.push((f64::from(state) + 0.5) / 4_294_967_296.0);
            // Gray code: only the number of the lowest zero bit changes.
            state ^= v[(index.trailing_ones() as usize).min(BITS - 1)];
        }
    }
    points
}

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "numbers of cells")]
mod tests {
    use super::*;

    #[test]
    fn each_interval_has_one_point_in_all_directions() {
        let points = points(64, 36, 5);
        for direction in 0..36 {
            let mut seen = [0; 64];
            points.iter().for_each(|point| seen[(point[direction] * 64.0) as usize] += 1);
            assert_eq!(seen, [1; 64], "direction {direction}");
        }
        // Directions differ: pairs of them spread over a square.
        for direction in 1..32 {
            let cells: std::collections::BTreeSet<_> =
                points.iter().map(|point| ((point[0] * 4.0) as usize, (point[direction] * 4.0) as usize)).collect();
            assert!(cells.len() >= 8, "direction {direction}: {} cells", cells.len());
        }
    }
}
