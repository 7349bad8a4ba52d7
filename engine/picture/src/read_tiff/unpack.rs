//! The compression methods of strips and tiles.
use super::super::limits::ReadError;
use super::super::read_jpeg;
use super::jpeg::joined;
use super::layout::Layout;
use super::places::ChunkLocations;
use flate2::read::ZlibDecoder;
use std::borrow::Cow;
use std::io::Read;
use tiff::tags::CompressionMethod;
use weezl::BitOrder;
use weezl::decode::Decoder;

/// The unpacked rows of a strip or tile that lie within the picture.
pub(super) fn unpack(
    file: &[u8],
    layout: &Layout,
    places: &ChunkLocations,
    index: usize,
) -> Result<Vec<u8>, ReadError> {
    let (place, length) = places.part(index);
    let whole = |number: u64| usize::try_from(number).map_err(ReadError::corrupt);
    let (place, length) = (whole(place)?, whole(length)?);
    let packed = place.checked_add(length).and_then(|end| file.get(place..end)).ok_or_else(cut)?;
    let size = places.bytes(index);
    if layout.method == CompressionMethod::ModernJPEG {
        let mut bytes = read_jpeg::read_part(&joined(packed, layout)?, places.frame(index), layout.together())?;
        bytes.truncate(size);
        return Ok(bytes);
    }
    let packed = match layout.reversed {
        true => Cow::Owned(packed.iter().map(|byte| byte.reverse_bits()).collect()),
        false => Cow::Borrowed(packed),
    };
    match layout.method {
        CompressionMethod::LZW => lzw(&packed, size),
        CompressionMethod::Deflate | CompressionMethod::OldDeflate => {
            let mut bytes = vec![0; size];
            let done = ZlibDecoder::new(&*packed).read_exact(&mut bytes);
            done.map_err(|error| ReadError::from_decoder(&error).in_data())?;
            Ok(bytes)
        }
        CompressionMethod::PackBits => pack_bits(&packed, size),
        _ => Ok(packed.into_owned()),
    }
}

fn cut() -> ReadError {
    ReadError::damaged("it ends within the picture")
}

/// LZW with the highest bit first. Bytes behind the last sample are ignored: some programs write no end code, or one
/// that is a bit too short.
fn lzw(packed: &[u8], size: usize) -> Result<Vec<u8>, ReadError> {
    if let [0, second, ..] = packed
        && second & 1 == 1
    {
        return Err(ReadError::damaged("its LZW codes are of the kind in use before 1992"));
    }
    let mut bytes = vec![0; size];
    let mut decoder = Decoder::with_tiff_size_switch(BitOrder::Msb, 8);
    let (mut read, mut written) = (0, 0);
    while written < size {
        let step = decoder.decode_bytes(&packed[read..], &mut bytes[written..]);
        (read, written) = (read + step.consumed_in, written + step.consumed_out);
        match step.status {
            _ if written >= size => {}
            Err(error) => return Err(ReadError::damaged(error)),
            Ok(_) if step.consumed_in == 0 && step.consumed_out == 0 => return Err(cut()),
            Ok(_) if decoder.has_ended() => return Err(cut()),
            Ok(_) => {}
        }
    }
    Ok(bytes)
}

/// A control byte gives the number of literal bytes that follow, or the number of repeats of the next byte.
fn pack_bits(packed: &[u8], size: usize) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::with_capacity(size);
    let mut rest = packed;
    while bytes.len() < size {
        let (head, after) = rest.split_first().ok_or_else(cut)?;
        rest = match *head {
            128 => after,
            length @ 0..=127 => {
                let (run, after) = after.split_at_checked(usize::from(length) + 1).ok_or_else(cut)?;
                bytes.extend_from_slice(run);
                after
            }
            length => {
                let (byte, after) = after.split_first().ok_or_else(cut)?;
                bytes.resize(bytes.len() + 257 - usize::from(length), *byte);
                after
            }
        };
    }
    bytes.truncate(size);
    Ok(bytes)
}
