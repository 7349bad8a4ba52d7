//! Turns pictures upright, by the orientation that cameras and scanners store.
use super::limits::ReadError;
use super::{Header, Picture};
use image::metadata::Orientation;
use image::{ImageBuffer, Luma, imageops};

/// The header of the upright picture, from that of the stored one.
pub(super) fn upright_header(stored: Header, orientation: Orientation) -> Header {
    let (width, height) = turned(orientation, (stored.width, stored.height));
    Header { width, height, ..stored }
}

/// Turns stored samples upright: EXIF and TIFF state which corner of the stored picture is the upper left one.
/// `picture` already has the size of the upright one.
pub(super) fn upright(mut picture: Picture, orientation: Orientation) -> Result<Picture, ReadError> {
    let (width, height) = turned(orientation, (picture.width, picture.height));
    let pixels = (width as usize * height as usize).max(1);
    for plane in picture.planes.chunks_mut(pixels) {
        let stored = ImageBuffer::<Luma<f32>, &[f32]>::from_raw(width, height, plane);
        let stored =
            stored.ok_or_else(|| ReadError::corrupt("it holds another number of samples than its header says"))?;
        let mut turned = match orientation {
            Orientation::NoTransforms => break,
            Orientation::Rotate90 | Orientation::Rotate90FlipH => imageops::rotate90(&stored),
            Orientation::Rotate180 => imageops::rotate180(&stored),
            Orientation::Rotate270 | Orientation::Rotate270FlipH => imageops::rotate270(&stored),
            Orientation::FlipHorizontal => imageops::flip_horizontal(&stored),
            Orientation::FlipVertical => imageops::flip_vertical(&stored),
        };
        if matches!(orientation, Orientation::Rotate90FlipH | Orientation::Rotate270FlipH) {
            imageops::flip_horizontal_in_place(&mut turned);
        }
        plane.copy_from_slice(&turned);
    }
    Ok(picture)
}

/// Size of a picture after turning.
fn turned(orientation: Orientation, (width, height): (u32, u32)) -> (u32, u32) {
    use Orientation::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
    match orientation {
        Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH => (height, width),
        _ => (width, height),
    }
}
