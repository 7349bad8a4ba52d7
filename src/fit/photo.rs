//! The photograph.
use super::FitArgs;
use crate::quit::Quit;
use crate::terminal::Terminal;
use shibo_bridge::compare::Gauge;
use shibo_picture::{Picture, ReadLimits, read};

/// Fewest pixels of a side.
const LEAST: u32 = 16;
/// Fewest pixels without a warning.
const SMALL: u32 = 64;

/// A photograph, cut to the square in its middle.
pub(super) struct Photo {
    pub(super) picture: Picture,
    /// The name of the file, without folders.
    pub(super) name: String,
    /// Size of the file's picture in pixels.
    pub(super) size: [u32; 2],
    /// Width of the square in mm, if the width of the file is known.
    pub(super) width_mm: Option<f64>,
}

impl Photo {
    pub(super) fn read(args: &FitArgs, terminal: &Terminal) -> Result<Self, Quit> {
        let shown = args.photo.display();
        let picture = read(&args.photo, &ReadLimits::default()).map_err(|error| Quit::failed(error.to_string()))?;
        let size = [picture.width, picture.height];
        let [x, y, width, height] = args.crop.unwrap_or([0, 0, size[0], size[1]]);
        let inside =
            |from: u32, count: u32, all: u32| count > 0 && from.checked_add(count).is_some_and(|end| end <= all);
        if !inside(x, width, size[0]) || !inside(y, height, size[1]) {
            return Err(Quit::Usage(format!(
                "--crop is not inside `{shown}`, which has {} × {} pixels",
                size[0], size[1]
            )));
        }
        let side = width.min(height);
        if side < LEAST {
            return Err(Quit::failed(format!(
                "`{shown}` has {width} × {height} pixels; at least {LEAST} a side are needed: take a larger photograph"
            )));
        }
        let square = part(&picture, [x + (width - side) / 2, y + (height - side) / 2], side);
        let data = square.data_channels();
        for channel in 0..data {
            if let Some(at) = square.plane(channel).iter().position(|sample| !sample.is_finite()) {
                let (column, row) = (at % side as usize, at / side as usize);
                return Err(Quit::failed(format!(
                    "`{shown}` has a sample that is no number at pixel {column}, {row} of its square: repair it, or take another part with --crop"
                )));
            }
        }
        let planes = (0..data).flat_map(|channel| square.plane(channel).to_vec());
        let (low, high) = planes.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        let flat = (0..data).all(|channel| {
            let plane = square.plane(channel);
            plane.iter().all(|sample| (sample - plane[0]).abs() < 1e-4)
        });
        if flat || high <= low {
            return Err(Quit::failed(format!(
                "`{shown}` has one colour, so there is nothing to fit: take a photograph of a material"
            )));
        }
        if side < SMALL {
            terminal.warning(&format!(
                "`{shown}` has {side} pixels a side: few wavelengths can be compared, and errors are large; {SMALL} or more are better"
            ));
        }
        let name = args.photo.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let width_mm = args.width_mm.map(|mm| mm * f64::from(side) / f64::from(width));
        Ok(Self { picture: square, name, size, width_mm })
    }

    /// Pixels of a side of the square.
    pub(super) fn side(&self) -> u32 {
        self.picture.width
    }

    /// Warns of faults that spoil a fit.
    pub(super) fn warn(&self, gauge: &Gauge, stretched: bool, terminal: &Terminal) {
        let found = gauge.uneven(&self.picture);
        let name = &self.name;
        if found.light > 0.3 {
            terminal.warning(&format!(
                "`{name}` is lit unevenly: slow changes are {:.0} % of the variance of its lightness, and are left out",
                100.0 * found.light
            ));
        }
        if found.clipped > 0.02 && !stretched {
            terminal.warning(&format!(
                "{:.0} % of the pixels of `{name}` are clipped to black or white: expose it less, or crop it",
                100.0 * found.clipped
            ));
        }
        if let Some([left, right]) = gauge.halves(&self.picture, stretched) {
            let apart = gauge.scale_of_halves().distance(&left, &right).0;
            if apart > 3.0 * HALVES {
                terminal.warning(&format!(
                    "the halves of `{name}` differ much ({apart:.2}): crop it to one material with --crop"
                ));
            }
        }
    }
}

/// The usual distance between halves of one material.
const HALVES: f64 = 0.25;

/// A square part of a picture.
fn part(picture: &Picture, [x, y]: [u32; 2], side: u32) -> Picture {
    let mut planes = Vec::with_capacity(side as usize * side as usize * usize::from(picture.channels));
    for channel in 0..picture.channels {
        let plane = picture.plane(channel);
        for row in y..y + side {
            let from = row as usize * picture.width as usize + x as usize;
            planes.extend_from_slice(&plane[from..from + side as usize]);
        }
    }
    Picture { width: side, height: side, planes, ..picture.clone() }
}
