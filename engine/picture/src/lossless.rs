//! DEFLATE, and the predictors that prepare samples for it.

use super::spec::Compression;
use flate2::{Compress, FlushCompress, Status};
use std::sync::{Mutex, PoisonError};

/// Makes zlib streams, several at a time. A compressor takes a third of a megabyte, so compressors are reused.
pub(super) struct Zlib {
    level: flate2::Compression,
    idle: Mutex<Vec<Compress>>,
}

impl Zlib {
    pub(super) fn new(compression: Compression) -> Self {
        let level = match compression {
            Compression::Fast => 1,
            Compression::Best => 7,
        };
        Self { level: flate2::Compression::new(level), idle: Mutex::default() }
    }

    /// The zlib stream of `bytes`.
    pub(super) fn stream(&self, bytes: &[u8]) -> Vec<u8> {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let mut compressor = idle().pop().unwrap_or_else(|| Compress::new(self.level, true));
        let mut stream = Vec::with_capacity(bytes.len() / 2 + 64);
        let mut rest = bytes;
        loop {
            let flush = if rest.is_empty() { FlushCompress::Finish } else { FlushCompress::None };
            let before = compressor.total_in();
            let status = compressor.compress_vec(rest, &mut stream, flush);
            let taken = usize::try_from(compressor.total_in() - before).unwrap_or(rest.len());
            rest = &rest[taken.min(rest.len())..];
            match status.expect("a compressor in order takes all bytes") {
                Status::StreamEnd => break,
                Status::Ok | Status::BufError => stream.reserve(bytes.len() / 4 + 64),
            }
        }
        compressor.reset();
        idle().push(compressor);
        stream
    }
}

/// Prepares a block for EXR's ZIP methods: even bytes before odd ones, then differences.
pub(super) fn exr_predict(raw: &[u8]) -> Vec<u8> {
    let (pairs, last) = raw.as_chunks::<2>();
    let mut bytes = Vec::with_capacity(raw.len());
    bytes.extend(pairs.iter().map(|pair| pair[0]));
    bytes.extend(last);
    bytes.extend(pairs.iter().map(|pair| pair[1]));
    let mut differences = bytes.clone();
    for (difference, [before, byte]) in differences.iter_mut().skip(1).zip(bytes.array_windows()) {
        *difference = byte.wrapping_sub(*before).wrapping_add(128);
    }
    differences
}

/// TIFF's horizontal predictor for rows of little-endian 8-bit integers.
pub(super) fn tiff_predict_u8(row: &mut [u8], channels: usize) {
    for index in (channels..row.len()).rev() {
        row[index] = row[index].wrapping_sub(row[index - channels]);
    }
}

/// TIFF's horizontal predictor for rows of little-endian 16-bit integers.
pub(super) fn tiff_predict_u16(row: &mut [u8], channels: usize) {
    let (samples, _) = row.as_chunks_mut::<2>();
    for index in (channels..samples.len()).rev() {
        let (sample, before) = (u16::from_le_bytes(samples[index]), u16::from_le_bytes(samples[index - channels]));
        samples[index] = sample.wrapping_sub(before).to_le_bytes();
    }
}

/// TIFF's predictor for rows of 32-bit floats: separates the bytes into four planes, the highest first, then stores
/// differences.
pub(super) fn tiff_predict_f32(row: &mut [u8], channels: usize) {
    let samples = row.as_chunks::<4>().0.to_vec();
    let width = samples.len();
    for (byte, run) in row.chunks_exact_mut(width).enumerate() {
        run.iter_mut().zip(&samples).for_each(|(out, sample)| *out = sample[3 - byte]);
    }
    tiff_predict_u8(row, channels);
}
