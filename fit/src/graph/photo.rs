//! The photograph.
use super::Refused;
use shibo_bridge::compare::Gauge;
use shibo_picture::{Picture, ReadLimits, read};
use std::path::Path;

/// Fewest pixels of a side.
const LEAST: u32 = 16;
/// Fewest pixels without a warning.
const SMALL: u32 = 64;

/// A photograph, cut to the square in its middle.
pub struct Photo {
    pub(super) picture: Picture,
    /// The name of the file, without folders.
    pub(super) name: String,
    /// Size of the file's picture in pixels.
    pub(super) size: [u32; 2],
    /// The given width of the cut part in mm.
    pub(super) given_mm: Option<f64>,
    /// Width of the square in mm, if the width of the file is known.
    pub(super) width_mm: Option<f64>,
    /// Faults that do not prevent a fit.
    warnings: Vec<String>,
}

impl Photo {
    /// Reads a photograph. `name` stands in reports and comments; `width_mm` is the width of the picture, or of `crop`: x, y, width and
    /// height in pixels.
    ///
    /// # Errors
    ///
    /// Fails for a file that is no picture, and as [`of`](Self::of) does.
    pub fn read(path: &Path, name: &str, width_mm: Option<f64>, crop: Option<[u32; 4]>) -> Result<Self, Refused> {
        let picture = read(path, &ReadLimits::default()).map_err(|error| Refused::Unfit(error.to_string()))?;
        Self::of(&picture, (&path.display().to_string(), name), width_mm, crop)
    }

    /// A photograph that is in memory. `shown` is its name in messages, `name` its name in reports and comments.
    ///
    /// # Errors
    ///
    /// Fails if the part is outside or smaller than 16 pixels, and if it has one colour or a sample that is no number.
    pub fn of(
        picture: &Picture,
        (shown, name): (&str, &str),
        width_mm: Option<f64>,
        crop: Option<[u32; 4]>,
    ) -> Result<Self, Refused> {
        let size = [picture.width, picture.height];
        let [x, y, width, height] = crop.unwrap_or([0, 0, size[0], size[1]]);
        let inside =
            |from: u32, count: u32, all: u32| count > 0 && from.checked_add(count).is_some_and(|end| end <= all);
        if !inside(x, width, size[0]) || !inside(y, height, size[1]) {
            return Err(Refused::Usage(format!(
                "crop is not inside `{shown}`, which has {} × {} pixels",
                size[0], size[1]
            )));
        }
        let side = width.min(height);
        if side < LEAST {
            return Err(Refused::Unfit(format!(
                "`{shown}` has {width} × {height} pixels; at least {LEAST} a side are needed: take a larger photograph"
            )));
        }
        let square = part(picture, [x + (width - side) / 2, y + (height - side) / 2], side);
        let data = square.data_channels();
        for channel in 0..data {
            if let Some(at) = square.plane(channel).iter().position(|sample| !sample.is_finite()) {
                let (column, row) = (at % side as usize, at / side as usize);
                return Err(Refused::Unfit(format!(
                    "`{shown}` has a sample that is no number at pixel {column}, {row} of its square: repair it, or take another part"
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
            return Err(Refused::Unfit(format!(
                "`{shown}` has one colour, so there is nothing to fit: take a photograph of a material"
            )));
        }
        let mut warnings = Vec::new();
        if side < SMALL {
            warnings.push(format!(
                "`{shown}` has {side} pixels a side: few wavelengths can be compared, and errors are large; {SMALL} or more are better"
            ));
        }
        let name = name.chars().filter(|c| !c.is_control()).collect();
        let square_mm = width_mm.map(|mm| mm * f64::from(side) / f64::from(width));
        Ok(Self { picture: square, name, size, given_mm: width_mm, width_mm: square_mm, warnings })
    }

    /// The square, for pictures beside each other.
    pub fn picture(&self) -> &Picture {
        &self.picture
    }

    /// The name in reports.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Width and height in pixels, before it was cut.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Width of the square in mm, if it is known.
    pub fn width_mm(&self) -> Option<f64> {
        self.width_mm
    }

    /// Pixels of a side of the square.
    pub(super) fn side(&self) -> u32 {
        self.picture.width
    }

    /// Faults that spoil a fit.
    pub(super) fn warnings(&self, gauge: &Gauge, stretched: bool) -> Vec<String> {
        let mut warnings = self.warnings.clone();
        let found = gauge.uneven(&self.picture);
        let name = &self.name;
        if found.light > 0.3 {
            warnings.push(format!(
                "`{name}` is lit unevenly: slow changes are {:.0} % of the variance of its lightness, and are left out",
                100.0 * found.light
            ));
        }
        if found.clipped > 0.02 && !stretched {
            warnings.push(format!(
                "{:.0} % of the pixels of `{name}` are clipped to black or white: expose it less, or crop it",
                100.0 * found.clipped
            ));
        }
        if let Some([left, right]) = gauge.halves(&self.picture, stretched) {
            let apart = gauge.scale_of_halves().distance(&left, &right).0;
            if apart > 3.0 * HALVES {
                warnings.push(format!("the halves of `{name}` differ much ({apart:.2}): crop it to one material"));
            }
        }
        warnings
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
