//! Primaries and white points of colour spaces, and the matrices from them to linear Rec. 709. Everything is computed
//! in double precision with sums and products only, so the bits are the same on every machine.
use glam::{DMat3, DVec3};

/// A row for each channel of linear Rec. 709. `None` is the identity.
pub(super) type Matrix = Option<[[f32; 3]; 3]>;

/// The chromaticities of Rec. 709: x and y of red, green, blue and white.
pub(super) const REC709: [f64; 8] = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329];
/// The white point of ICC profiles.
const D50: DVec3 = DVec3::new(0.9642, 1.0, 0.8249);
/// From XYZ to the cone responses of Bradford's method.
const BRADFORD: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);
/// A matrix that differs from the identity by less than this stands for Rec. 709 itself, rounded in a file.
const ROUNDED: f64 = 1e-3;

/// The matrix for these chromaticities of primaries and white, adapted to the white of Rec. 709. `None` if they do not
/// span a colour space.
pub(super) fn from_chromaticities(chromaticities: [f64; 8]) -> Option<Matrix> {
    let adapted = adapt(white(chromaticities), white(REC709));
    checked(to_xyz(REC709).inverse() * adapted * to_xyz(chromaticities))
}

/// The matrix for the XYZ of red, green and blue in an ICC profile. `None` if they do not span a colour space.
pub(super) fn from_colorants(colorants: [[f64; 3]; 3]) -> Option<Matrix> {
    let [red, green, blue] = colorants.map(DVec3::from_array);
    checked(to_xyz(REC709).inverse() * adapt(D50, white(REC709)) * DMat3::from_cols(red, green, blue))
}

fn white([.., x, y]: [f64; 8]) -> DVec3 {
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

fn to_xyz(chromaticities: [f64; 8]) -> DMat3 {
    let [rx, ry, gx, gy, bx, by, ..] = chromaticities;
    let column = |x: f64, y: f64| DVec3::new(x, y, 1.0 - x - y);
    let primaries = DMat3::from_cols(column(rx, ry), column(gx, gy), column(bx, by));
    primaries * DMat3::from_diagonal(primaries.inverse() * white(chromaticities))
}

/// Bradford's chromatic adaptation from one white to another.
fn adapt(from: DVec3, to: DVec3) -> DMat3 {
    BRADFORD.inverse() * DMat3::from_diagonal((BRADFORD * to) / (BRADFORD * from)) * BRADFORD
}

#[expect(clippy::cast_possible_truncation, reason = "samples have single precision")]
fn checked(matrix: DMat3) -> Option<Matrix> {
    const MOST: f64 = 100.0;
    let off = matrix - DMat3::IDENTITY;
    let entries = matrix.to_cols_array();
    if !entries.iter().all(|entry| entry.abs() <= MOST) || matrix.determinant().abs() < 1e-6 {
        return None;
    }
    if off.to_cols_array().iter().all(|entry| entry.abs() < ROUNDED) {
        return Some(None);
    }
    Some(Some(matrix.transpose().to_cols_array_2d().map(|row| row.map(|entry| entry as f32))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::AP1_TO_REC709;

    fn near(matrix: Matrix, expected: [[f32; 3]; 3], most: f32) {
        for (row, expected) in matrix.unwrap().iter().zip(expected) {
            for (entry, expected) in row.iter().zip(expected) {
                assert!((entry - expected).abs() < most, "{row:?} {expected:?}");
            }
        }
    }

    #[test]
    fn finds_the_matrix_of_aces() {
        let ap1 = [0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.321_68, 0.337_67];
        near(from_chromaticities(ap1).unwrap(), AP1_TO_REC709, 1e-5);
    }

    #[test]
    fn finds_the_matrix_of_p3() {
        // Row sums are 1, because white maps to white; the first row is that of the CSS specification.
        let p3 = [0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.329];
        let expected = [[1.224_94, -0.224_94, 0.0], [-0.042_06, 1.042_06, 0.0], [-0.019_64, -0.078_64, 1.098_27]];
        near(from_chromaticities(p3).unwrap(), expected, 1e-4);
    }

    #[test]
    fn leaves_colours_of_srgb_alone() {
        assert_eq!(from_chromaticities(REC709), Some(None));
        // The colorants of common sRGB profiles, rounded to 1/65536.
        let srgb = [[0.436_07, 0.222_49, 0.013_92], [0.385_15, 0.716_87, 0.097_08], [0.143_07, 0.060_61, 0.714_1]];
        assert_eq!(from_colorants(srgb), Some(None));
    }

    #[test]
    fn refuses_degenerate_primaries() {
        for wrong in [[0.0; 8], [0.3; 8], [f64::NAN; 8], [f64::MAX; 8]] {
            assert_eq!(from_chromaticities(wrong), None, "{wrong:?}");
        }
        for wrong in [[[0.0; 3]; 3], [[0.5; 3]; 3], [[3e4, 0.0, 1.0]; 3]] {
            assert_eq!(from_colorants(wrong), None, "{wrong:?}");
        }
    }
}
