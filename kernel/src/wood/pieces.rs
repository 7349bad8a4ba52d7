//! Pieces of wood: boards, blocks and veneers, each cut from another position in a tree and along another direction.
use crate::ground::hash::Hash;
use crate::ground::number::narrow;
use crate::ground::simd::dispatch;
use crate::region::pieces::runs;
use glam::{DQuat, DVec3};

/// Position of a piece in the tree: its middle, and the directions of its own x and y axes, of length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WoodPiece {
    /// Middle, in mm.
    pub middle: DVec3,
    /// Direction of the x axis.
    pub along: DVec3,
    /// Direction of the y axis.
    pub across: DVec3,
}

/// Random variation of pieces.
#[derive(Clone, Copy, Debug)]
pub struct Scatter {
    /// The piece without variation.
    pub from: WoodPiece,
    /// Axis of the tilt: the direction of the pieces' breadth, of length 1.
    pub tilt: DVec3,
    /// Maximum shift of their middles, in mm, in x, y and z.
    pub spread: DVec3,
    /// Maximum rotation about the vertical, and maximum tilt about the breadth, in degrees.
    pub turn: [f64; 2],
    /// True if half of them are rotated end for end.
    pub flip: bool,
    /// Random numbers.
    pub hash: Hash,
}

/// Rotation of a piece: yaw, pitch and rotation in its own plane, in degrees.
pub type Turned = [f64; 3];

impl Scatter {
    /// The piece with an id, and its rotation.
    #[expect(clippy::cast_possible_truncation, reason = "numbers of pieces are whole")]
    pub fn piece(&self, id: f32) -> (WoodPiece, Turned) {
        let hash = self.hash.with((id.round() as i64).cast_unsigned());
        let draw = |k: u64| 2.0 * hash.unit(k) - 1.0;
        let WoodPiece { middle, along, across } = self.from;
        let middle = middle + self.spread * DVec3::new(draw(0), draw(1), draw(2));
        let [yaw, pitch] = [self.turn[0] * draw(3), self.turn[1] * draw(4)];
        let round = |axis: DVec3, degrees: f64| {
            let half = 0.5 * degrees.to_radians();
            DQuat::from_vec4((axis * libm::sin(half)).extend(libm::cos(half)))
        };
        let turn = round(DVec3::Z, yaw) * round(self.tilt, pitch);
        let turned = yaw != 0.0 || pitch != 0.0;
        let [along, across] = if turned { [turn * along, turn * across] } else { [along, across] };
        let flipped = self.flip && hash.u64(5) & 1 == 1;
        let sign = if flipped { -1.0 } else { 1.0 };
        let piece = WoodPiece { middle, along: sign * along, across: sign * across };
        (piece, [yaw, pitch, if flipped { 180.0 } else { 0.0 }])
    }

    /// Maps pixels at `local` mm within their pieces to points in the tree.
    pub fn places(&self, ids: &[f32], [x, y]: [&[f32]; 2], out: &mut [&mut [f32]]) {
        let [ox, oy, oz] = out else { return };
        runs(ids, |from, to| {
            let (piece, _) = self.piece(ids[from]);
            for (axis, plane) in [&mut **ox, &mut **oy, &mut **oz].into_iter().enumerate() {
                let (middle, along, across) = (piece.middle[axis], piece.along[axis], piece.across[axis]);
                let points = x[from..to].iter().zip(&y[from..to]).zip(&mut plane[from..to]);
                dispatch(
                    #[inline(always)]
                    || {
                        points.for_each(|((x, y), out)| {
                            *out = narrow(middle + along * f64::from(*x) + across * f64::from(*y));
                        });
                    },
                );
            }
        });
    }

    /// Index of the tree (of `count`) from which a piece is cut.
    #[expect(clippy::cast_possible_truncation, reason = "whole numbers, and a remainder that is smaller than `count`")]
    pub fn tree(&self, id: f32, count: usize) -> usize {
        let hash = self.hash.with((id.round() as i64).cast_unsigned());
        (hash.u64(6) % (count as u64).max(1)) as usize
    }

    /// Evaluates `of` for each piece, and writes the result to all its pixels.
    pub fn each(&self, ids: &[f32], out: &mut [&mut [f32]], of: impl Fn(&WoodPiece, &Turned) -> [f64; 3]) {
        runs(ids, |from, to| {
            let (piece, turned) = self.piece(ids[from]);
            let value = of(&piece, &turned);
            out.iter_mut().zip(value).for_each(|(plane, value)| plane[from..to].fill(narrow(value)));
        });
    }
}

/// Cosine and sine of an angle in degrees at all pixels.
pub fn turned_by(angle: &[f32], [cos, sin]: [&mut [f32]; 2]) {
    let mut known = (f32::NAN, [1.0, 0.0]);
    for ((angle, cos), sin) in angle.iter().zip(cos).zip(sin) {
        if *angle != known.0 {
            let radians = f64::from(*angle).to_radians();
            known = (*angle, straight([narrow(libm::cos(radians)), narrow(libm::sin(radians))], 1e-6));
        }
        [*cos, *sin] = known.1;
    }
}

/// Cosine and sine of the angle of pieces, derived from `local`: from its change towards a neighbour in the same piece.
/// The input windows are `columns` wide and one pixel larger on all sides than `out`.
pub fn turned_like(ids: &[f32], [x, y]: [&[f32]; 2], columns: usize, [cos, sin]: [&mut [f32]; 2]) {
    let width = columns.saturating_sub(2).max(1);
    for (k, (cos, sin)) in cos.iter_mut().zip(sin).enumerate() {
        let i = (k / width + 1) * columns + k % width + 1;
        let step = |to: usize, sign: f32| (ids[to] == ids[i]).then(|| [sign * (x[to] - x[i]), sign * (y[to] - y[i])]);
        // To the right local changes by (cos, -sin), down by (sin, cos).
        let right = || step(i + 1, 1.0).or_else(|| step(i - 1, -1.0)).map(|[dx, dy]| [dx, -dy]);
        let down = || step(i + columns, 1.0).or_else(|| step(i - columns, -1.0)).map(|[dx, dy]| [dy, dx]);
        let [c, s] = right().or_else(down).unwrap_or([1.0, 0.0]);
        let length = (c * c + s * s).sqrt();
        // Differences of rounded numbers: snap directions that are nearly vertical or horizontal.
        [*cos, *sin] = if length > 0.0 { straight([c / length, s / length], 2e-3) } else { [1.0, 0.0] };
    }
}

/// Snaps a direction of length 1 to an axis if it is nearly parallel.
fn straight([cos, sin]: [f32; 2], tolerance: f32) -> [f32; 2] {
    if sin.abs() < tolerance {
        [cos.signum(), 0.0]
    } else if cos.abs() < tolerance {
        [0.0, sin.signum()]
    } else {
        [cos, sin]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_trees_equally_often() {
        let mut counts = [0; 4];
        (0_u16..8000).for_each(|id| counts[scatter().tree(f32::from(id), 4)] += 1);
        assert!(counts.iter().all(|count| (1850..2150).contains(count)), "{counts:?}");
    }

    fn scatter() -> Scatter {
        let from = WoodPiece { middle: DVec3::new(3.0, 4.0, 5.0), along: DVec3::Z, across: DVec3::X };
        let hash = Hash::new(9);
        Scatter { from, tilt: DVec3::X, spread: DVec3::new(10.0, 20.0, 400.0), turn: [30.0, 5.0], flip: true, hash }
    }

    #[test]
    fn spreads_pieces_within_bounds() {
        let (mut low, mut high, mut flipped) = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0);
        for id in 0..2000_u16 {
            let (piece, [yaw, pitch, turn]) = scatter().piece(f32::from(id));
            let away = piece.middle - scatter().from.middle;
            (low, high) = (low.min(away), high.max(away));
            assert!(yaw.abs() <= 30.0 && pitch.abs() <= 5.0);
            flipped += u16::from(turn == 180.0);
            // Axes keep length 1 and stay perpendicular; the tilt of the length is the pitch.
            assert!((piece.along.length() - 1.0).abs() < 1e-12 && piece.along.dot(piece.across).abs() < 1e-12);
            let lean = piece.along.z.abs().min(1.0).acos().to_degrees();
            assert!((lean - pitch.abs()).abs() < 1e-5, "{lean} {pitch}");
            assert_eq!(turn == 180.0, piece.along.z < 0.0);
        }
        let spread = scatter().spread;
        assert!((low + spread).abs().max_element() < 4.0 && (high - spread).abs().max_element() < 4.0, "{low} {high}");
        assert!((900..1100).contains(&flipped), "{flipped}");
    }

    #[test]
    fn derives_angles_from_local_positions() {
        for degrees in [0.0, 90.0, 180.0, -90.0, 33.0, -140.0_f64] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            // 4 × 4 pixels of ¼ mm and one around; the third column belongs to another piece.
            let at = |i: usize| (0.25 * (i % 6) as f64, 0.25 * (i / 6) as f64);
            let ids: Vec<f32> = (0..36).map(|i| if i % 6 < 3 { 1.0 } else { 2.0 }).collect();
            let x: Vec<f32> = (0..36).map(|i| narrow(at(i).0 * cos + at(i).1 * sin + f64::from(ids[i]))).collect();
            let y: Vec<f32> = (0..36).map(|i| narrow(at(i).1 * cos - at(i).0 * sin)).collect();
            let (mut c, mut s) = (vec![0.0; 16], vec![0.0; 16]);
            turned_like(&ids, [&x, &y], 6, [&mut c, &mut s]);
            for (c, s) in c.iter().zip(&s) {
                assert!((f64::from(*c) - cos).abs() < 1e-4 && (f64::from(*s) - sin).abs() < 1e-4, "{degrees}: {c} {s}");
            }
            let (mut c, mut s) = ([0.0], [0.0]);
            turned_by(&[narrow(degrees)], [&mut c, &mut s]);
            assert!((f64::from(c[0]) - cos).abs() < 1e-6 && (f64::from(s[0]) - sin).abs() < 1e-6);
        }
    }
}
