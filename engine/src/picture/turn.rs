//! Turning pictures upright, as cameras and scanners say that they were held.
use super::Header;
use super::limits::ReadError;
use image::metadata::Orientation;
use rayon::prelude::*;

/// Whether a picture that is turned so becomes as wide as it was high.
pub(super) fn swaps_sides(orientation: Orientation) -> bool {
    use Orientation::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
    matches!(orientation, Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH)
}

/// The header of the upright picture, from that of the stored one.
pub(super) fn upright_header(stored: Header, orientation: Orientation) -> Header {
    if swaps_sides(orientation) {
        return Header { width: stored.height, height: stored.width, ..stored };
    }
    stored
}

/// Turns stored samples, pixel after pixel, into those of the upright picture that `header` describes.
pub(super) fn upright(bytes: Vec<u8>, header: &Header, orientation: Orientation) -> Result<Vec<u8>, ReadError> {
    use Orientation::{
        FlipHorizontal, FlipVertical, NoTransforms, Rotate90, Rotate90FlipH, Rotate180, Rotate270, Rotate270FlipH,
    };
    if orientation == NoTransforms {
        return Ok(bytes);
    }
    let pixel = usize::from(header.channels) * header.kind.bytes();
    let (width, height) = (header.width as usize, header.height as usize);
    if bytes.len() != width * height * pixel {
        return Err(ReadError::corrupt("it holds another number of samples than its header says"));
    }
    let stored_width = if swaps_sides(orientation) { height } else { width };
    // Where the pixel in column x of row y is stored.
    let place = |x: usize, y: usize| match orientation {
        NoTransforms => (x, y),
        FlipHorizontal => (width - 1 - x, y),
        Rotate180 => (width - 1 - x, height - 1 - y),
        FlipVertical => (x, height - 1 - y),
        Rotate90FlipH => (y, x),
        Rotate90 => (y, width - 1 - x),
        Rotate270FlipH => (height - 1 - y, width - 1 - x),
        Rotate270 => (height - 1 - y, x),
    };
    let mut turned = vec![0; bytes.len()];
    turned.par_chunks_exact_mut(width * pixel).enumerate().for_each(|(y, row)| {
        for (x, out) in row.chunks_exact_mut(pixel).enumerate() {
            let (column, line) = place(x, y);
            out.copy_from_slice(&bytes[(line * stored_width + column) * pixel..][..pixel]);
        }
    });
    Ok(turned)
}
