//! Pictures as numbers: resampling, OKLab, even light.
use shibo_picture::Picture;

/// One number for each pixel, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f64>,
}

/// Three planes: red, green and blue as shown on a screen, 0..1; or OKLab.
pub(super) type Colors = [Plane; 3];

impl Plane {
    pub(super) fn mean(&self) -> f64 {
        self.values.iter().sum::<f64>() / self.values.len().max(1) as f64
    }

    /// Standard deviation.
    pub(super) fn deviation(&self) -> f64 {
        let mean = self.mean();
        let squares: f64 = self.values.iter().map(|value| (value - mean) * (value - mean)).sum();
        (squares / self.values.len().max(1) as f64).sqrt()
    }

    /// The values minus their mean.
    pub(super) fn centred(&self) -> Self {
        let mean = self.mean();
        Self { values: self.values.iter().map(|value| value - mean).collect(), ..*self }
    }

    /// A part; the rectangle must be inside.
    pub(super) fn part(&self, [x, y]: [usize; 2], [width, height]: [usize; 2]) -> Self {
        let rows = (y..y + height).flat_map(|row| &self.values[row * self.width + x..][..width]);
        Self { width, height, values: rows.copied().collect() }
    }

    /// The value below which a share of all values lies: that value of the sorted ones, between neighbours.
    pub(super) fn quantile(&self, share: f64) -> f64 {
        let mut sorted = self.values.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        quantile(&sorted, share)
    }
}

/// The value at a share of sorted values.
#[expect(clippy::cast_possible_truncation, reason = "an index into the values")]
pub(super) fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
    let at = share * last as f64;
    let low = (at.floor() as usize).min(last);
    sorted[low] + (at - low as f64) * (sorted[(low + 1).min(last)] - sorted[low])
}

/// A part of three planes.
pub(super) fn part(colors: &Colors, at: [usize; 2], size: [usize; 2]) -> Colors {
    [0, 1, 2].map(|channel| colors[channel].part(at, size))
}

/// Colours of a decoded picture as shown on a screen. Transparent parts show a medium grey. Floats count as linear.
pub(super) fn shown(picture: &Picture) -> Colors {
    let data = picture.data_channels();
    let alpha = picture.has_alpha.then(|| picture.plane(picture.channels - 1));
    [0, 1, 2].map(|channel: u8| {
        let plane = picture.plane(if data >= 3 { channel } else { 0 });
        let value = |(index, sample): (usize, &f32)| {
            let sample = if sample.is_finite() { f64::from(*sample) } else { 0.0 };
            let sample = if picture.source.is_float() { encoded(sample.clamp(0.0, 1.0)) } else { sample };
            let alpha = alpha.map_or(1.0, |alpha| f64::from(alpha[index]));
            sample * alpha + (1.0 - alpha) * 128.0 / 255.0
        };
        let values = plane.iter().enumerate().map(value).collect();
        Plane { width: picture.width as usize, height: picture.height as usize, values }
    })
}

fn encoded(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 }
}

/// Scales a picture to a width in pixels, by areas where it becomes much smaller, else by Lanczos' filter.
#[expect(clippy::cast_possible_truncation, reason = "sizes of pictures")]
pub(super) fn resample(colors: &Colors, width: usize) -> Colors {
    let (old_width, old_height) = (colors[0].width, colors[0].height);
    let height = ((old_height as f64 * width as f64 / old_width as f64).round() as usize).max(8);
    if (width, height) == (old_width, old_height) {
        return colors.clone();
    }
    let area = width * 2 <= old_width;
    [0, 1, 2].map(|channel| {
        let rows = along(&colors[channel], width, area);
        let scaled = turned(&along(&turned(&rows), height, area));
        Plane { values: scaled.values.iter().map(|value| value.clamp(0.0, 1.0)).collect(), ..scaled }
    })
}

fn turned(plane: &Plane) -> Plane {
    let Plane { width, height, values } = plane;
    let values = (0..*width).flat_map(|x| (0..*height).map(move |y| values[y * width + x])).collect();
    Plane { width: *height, height: *width, values }
}

/// Scales the rows of a plane.
#[expect(clippy::cast_possible_truncation, reason = "positions of pixels")]
fn along(plane: &Plane, width: usize, area: bool) -> Plane {
    let scale = plane.width as f64 / width as f64;
    let stretch = scale.max(1.0);
    let support = if area { 0.5 } else { 3.0 } * stretch;
    let weights: Vec<(usize, Vec<f64>)> = (0..width)
        .map(|x| {
            let centre = (x as f64 + 0.5) * scale;
            let first = (centre - support + 0.5).max(0.0) as usize;
            let end = ((centre + support + 0.5).max(0.0) as usize).min(plane.width).max(first + 1);
            let weight = |at: usize| {
                let distance = (at as f64 - centre + 0.5) / stretch;
                if area { f64::from(u8::from(distance > -0.5 && distance <= 0.5)) } else { lanczos(distance) }
            };
            let weights: Vec<f64> = (first..end).map(weight).collect();
            let sum: f64 = weights.iter().sum();
            let sum = if sum == 0.0 { 1.0 } else { sum };
            (first, weights.iter().map(|weight| weight / sum).collect())
        })
        .collect();
    let row = |y: usize| {
        let row = &plane.values[y * plane.width..][..plane.width];
        let sum = |(first, weights): &(usize, Vec<f64>)| {
            row[*first..].iter().zip(weights).map(|(value, weight)| value * weight).sum::<f64>()
        };
        weights.iter().map(sum).collect::<Vec<_>>()
    };
    Plane { width, height: plane.height, values: (0..plane.height).flat_map(row).collect() }
}

fn lanczos(x: f64) -> f64 {
    let sinc = |x: f64| if x == 0.0 { 1.0 } else { libm::sin(std::f64::consts::PI * x) / (std::f64::consts::PI * x) };
    if x.abs() < 3.0 { sinc(x) * sinc(x / 3.0) } else { 0.0 }
}

/// OKLab of colours as shown on a screen.
pub(super) fn oklab(colors: &Colors) -> Colors {
    let mut lab = colors.clone();
    for index in 0..colors[0].values.len() {
        let linear = |channel: usize| {
            let value = colors[channel].values[index].max(0.0);
            if value <= 0.04045 { value / 12.92 } else { libm::pow((value + 0.055) / 1.055, 2.4) }
        };
        let [r, g, b] = [linear(0), linear(1), linear(2)];
        let l = libm::cbrt(0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b);
        let m = libm::cbrt(0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b);
        let s = libm::cbrt(0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b);
        lab[0].values[index] = 0.210_454_255_3 * l + 0.793_617_785 * m - 0.004_072_046_8 * s;
        lab[1].values[index] = 1.977_998_495_1 * l - 2.428_592_205 * m + 0.450_593_709_9 * s;
        lab[2].values[index] = 0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766 * s;
    }
    lab
}

/// Removes uneven light from the lightness: the plane and the second order, which no material of this size has.
pub(super) fn flatten(lightness: &Plane) -> Plane {
    let (width, height) = (lightness.width, lightness.height);
    let at = |index: usize, count: usize| if count > 1 { 2.0 * index as f64 / (count - 1) as f64 - 1.0 } else { -1.0 };
    let terms = |index: usize| {
        let (x, y) = (at(index % width, width), at(index / width, height));
        [1.0, x, y, x * y, x * x - 1.0 / 3.0, y * y - 1.0 / 3.0]
    };
    // The normal equations, with the right side as the last column.
    let mut rows = [[0.0_f64; 7]; 6];
    for (index, value) in lightness.values.iter().enumerate() {
        let terms = terms(index);
        for (row, a) in rows.iter_mut().zip(terms) {
            for (sum, b) in row.iter_mut().zip(terms.into_iter().chain([*value])) {
                *sum += a * b;
            }
        }
    }
    let solution = solve(rows);
    let slow =
        |index: usize| terms(index).iter().zip(solution).skip(1).map(|(term, factor)| term * factor).sum::<f64>();
    let values = lightness.values.iter().enumerate().map(|(index, value)| value - slow(index)).collect();
    Plane { width, height, values }
}

/// Solves six equations by elimination; unknowns without an equation are 0.
fn solve(mut rows: [[f64; 7]; 6]) -> [f64; 6] {
    for column in 0..6 {
        let pivot =
            (column..6).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs())).unwrap_or(column);
        rows.swap(column, pivot);
        let first = rows[column];
        if first[column].abs() < 1e-12 {
            continue;
        }
        for (index, row) in rows.iter_mut().enumerate() {
            if index != column {
                let factor = row[column] / first[column];
                row.iter_mut().zip(first).for_each(|(value, pivot)| *value -= factor * pivot);
            }
        }
    }
    [0, 1, 2, 3, 4, 5].map(|k| if rows[k][k].abs() < 1e-12 { 0.0 } else { rows[k][6] / rows[k][k] })
}
