//! The pixels of a picture file, decoded on first use, and the fields that show them.
use super::sheet::{DecodeOptions, Sheet};
use crate::values::LUMINANCE;
use glam::DVec2;
use rayon::prelude::*;
use shibo_kernel::filter::placed::{self, PlacedWindow};
use shibo_kernel::filter::sample::{Filter, Outside, Pyramid};
use shibo_kernel::ground::tile;
use shibo_picture::{Header, ReadLimits};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::files::FileHandle;
use shibo_value::{FieldSource, Given, Grid, Pictures, Read, Stop, Tile, Window};
use std::sync::{Arc, OnceLock};

/// A part of a picture in pixels, known to lie within it.
#[derive(Clone, Copy)]
pub(super) struct Crop {
    pub(super) x: u32,
    pub(super) y: u32,
    pub(super) width: u32,
    pub(super) height: u32,
}

impl Crop {
    /// Cuts the crop out of a plane of a picture that is `width` pixels wide.
    fn of(self, plane: &[f32], width: usize) -> Vec<f32> {
        let (x, w) = (self.x as usize, self.width as usize);
        let rows = plane.chunks_exact(width).skip(self.y as usize).take(self.height as usize);
        rows.flat_map(|row| &row[x..x + w]).copied().collect()
    }
}

/// A picture stored in one or several files.
pub(super) struct Pixels {
    sheet: Sheet,
    reading: DecodeOptions,
    limits: ReadLimits,
    crop: Crop,
    /// Bytes of the decoded channels and their pyramids, and of the file's samples during decoding.
    bytes: u64,
    decoding: u64,
    decoded: OnceLock<Result<Decoded, Problem>>,
}

struct Decoded {
    /// By channel; opacity last.
    channels: Vec<Pyramid>,
    /// Number of channels that are colour or data.
    data: usize,
    /// A warning about the pixels.
    warning: Option<Problem>,
}

impl Pixels {
    /// Decodes nothing yet; refuses files that would not fit into `memory` bytes.
    pub(super) fn new(
        path: &FileHandle,
        (sheet, reading): (Sheet, DecodeOptions),
        (header, crop): (&Header, Crop),
        memory: u64,
    ) -> Result<Self, Problem> {
        let samples = u64::from(header.width) * u64::from(header.height) * u64::from(header.channels);
        let bytes = samples * 16 / 3;
        let decoding = samples * (4 + header.kind.bytes() as u64);
        if bytes + decoding > memory {
            let message = format!(
                "`{}`: the picture of `{}x{}` pixels needs {} MiB; {} MiB are allowed",
                path.display(),
                header.width,
                header.height,
                (bytes + decoding) >> 20,
                memory >> 20
            );
            return Err(Problem::new(Code::TooLarge, message).at("path").help("scale it down, or raise --memory"));
        }
        let limits = ReadLimits { max_bytes_decoded: memory, ..ReadLimits::default() };
        Ok(Self { sheet, reading, limits, crop, bytes, decoding, decoded: OnceLock::new() })
    }

    /// The pixels. They are decoded outside of the lock: decoding waits for other threads, which may call this
    /// function.
    fn get(&self) -> Result<&Decoded, Stop> {
        let decoded = match self.decoded.get() {
            Some(decoded) => decoded,
            None => {
                let decoded = self.decode();
                self.decoded.get_or_init(|| decoded)
            }
        };
        decoded.as_ref().map_err(|problem| problem.clone().into())
    }

    fn decode(&self) -> Result<Decoded, Problem> {
        let (picture, warning) = self.sheet.read(&self.reading, &self.limits)?;
        let (width, height) = (picture.width as usize, picture.height as usize);
        let (w, h) = (self.crop.width as usize, self.crop.height as usize);
        let planes: Vec<Vec<f32>> =
            picture.planes.chunks_exact(width * height).map(|plane| self.crop.of(plane, width)).collect();
        let data = usize::from(picture.data_channels());
        drop(picture);
        let channels = planes.into_par_iter().map(|plane| Pyramid::new(plane, w, h, [Outside::Clamp; 2])).collect();
        Ok(Decoded { channels, data, warning })
    }
}

/// The channels that a field shows.
#[derive(Clone, Copy)]
pub(super) enum Pick {
    /// Three channels; the first one three times if there is no other.
    Color,
    /// The only channel, or the luminance.
    Gray,
    /// The channel of this number; the first if there is no other.
    Channel(usize),
    /// Opacity.
    Alpha,
}

/// Placement of a picture on the canvas.
#[derive(Clone, Copy)]
pub(super) struct PicturePlacement {
    /// Position of its upper left corner, mm.
    pub(super) position: DVec2,
    /// Size of a pixel, mm.
    pub(super) pitch: DVec2,
    pub(super) filter: Filter,
    pub(super) outside: [Outside; 2],
}

/// A picture as a field.
pub(super) struct PictureSource {
    pub(super) pixels: Arc<Pixels>,
    pub(super) placement: PicturePlacement,
    pub(super) pick: Pick,
}

impl FieldSource for PictureSource {
    fn inputs(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let pixels = self.pixels.get()?;
        pixels.warning.iter().for_each(|warning| given.warn(warning.clone()));
        let PicturePlacement { position, pitch, filter, outside } = self.placement;
        let (origin, step) = ((out.grid.origin - position) / pitch, out.grid.step / pitch);
        let place =
            PlacedWindow { window: out.window, origin: origin.to_array(), step: step.to_array(), filter, outside };
        // A picture of two channels has 0 in the third.
        let is_missing = |k: usize| k == 2 && pixels.data == 2;
        let channel = |k: usize| &pixels.channels[if k < pixels.data { k } else { 0 }];
        match self.pick {
            Pick::Color => {
                for (k, plane) in tile::planes3(out).into_iter().enumerate() {
                    match is_missing(k) {
                        true => plane.fill(0.0),
                        false => placed::fill(channel(k), &place, plane),
                    }
                }
            }
            Pick::Gray if pixels.data < 3 => placed::fill(channel(0), &place, out.plane_mut(0)),
            Pick::Gray => {
                let mut plane = vec![0.0; out.window.len()];
                for (k, weight) in LUMINANCE.into_iter().enumerate() {
                    placed::fill(channel(k), &place, &mut plane);
                    out.data_mut().iter_mut().zip(&plane).for_each(|(out, v)| *out += weight * v);
                }
            }
            Pick::Channel(k) if is_missing(k) => out.plane_mut(0).fill(0.0),
            Pick::Channel(k) => placed::fill(channel(k), &place, out.plane_mut(0)),
            Pick::Alpha => placed::fill(&pixels.channels[pixels.channels.len() - 1], &place, out.plane_mut(0)),
        }
        Ok(())
    }

    fn prepare(&self, _grid: &Grid, _pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        self.pixels.get().map(|_| None)
    }

    fn prepare_bytes(&self, _grid: &Grid) -> u64 {
        if self.pixels.decoded.get().is_some() { 0 } else { self.pixels.bytes + self.pixels.decoding }
    }

    fn bytes(&self) -> usize {
        usize::try_from(self.pixels.bytes).unwrap_or(usize::MAX)
    }
}
