//! Strips and tiles that are packed as JPEG.
use super::super::limits::ReadError;
use super::super::read_jpeg;
use super::layout::Layout;

/// Follows the markers of a JPEG strip or tile.
pub(super) fn check_jpeg(packed: &[u8], layout: &Layout, frame: (u32, u32)) -> Result<(), ReadError> {
    read_jpeg::check_part(&joined(packed, layout)?, frame, layout.together())
}

/// A JPEG strip or tile as a complete file: with the shared tables, and with the Adobe segment that tells whether its
/// three channels are RGB.
pub(super) fn joined(packed: &[u8], layout: &Layout) -> Result<Vec<u8>, ReadError> {
    const START: &[u8] = &[0xff, 0xd8];
    const END: &[u8] = &[0xff, 0xd9];
    let broken = || ReadError::corrupt("a part of it that is packed as JPEG is none");
    let mut file = [START, &[0xff, 0xee, 0, 14], b"Adobe", &[0, 100, 0, 0, 0, 0, u8::from(layout.is_ycbcr)]].concat();
    if let Some(tables) = &layout.tables {
        let tables = tables.strip_prefix(START).ok_or_else(broken)?;
        file.extend_from_slice(tables.strip_suffix(END).unwrap_or(tables));
    }
    file.extend_from_slice(packed.strip_prefix(START).ok_or_else(broken)?);
    Ok(file)
}
