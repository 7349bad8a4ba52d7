//! The colours of a year from a picture of real wood (Momoi & Takatera 2014, §4.3); beyond the source, rings are found
//! automatically.
//!
//! A strip across the rings is straightened and averaged. The slope of its light gives its direction (slow darkening
//! and sudden lightening point to the bark) and the borders of years. Dynamic programming chooses borders at similar
//! distances. Every year is resampled and flattened, and the years that are similar to the others are averaged.
use shibo_macros::choice;

/// A strip of pixels across rings, `rows` rows of `length` scene-linear colours.
#[derive(Clone, Debug)]
pub struct Strip {
    /// The colours by rows; the middle row is the line itself.
    pub pixels: Vec<[f32; 3]>,
    /// The number of pixels along the line.
    pub length: usize,
    /// The number of rows, odd.
    pub rows: usize,
}

/// Direction of a line across rings.
#[choice]
pub enum Direction {
    /// Detected: colours darken slowly and lighten suddenly on the way to the bark.
    #[default]
    Auto,
    /// From the pith to the bark.
    Bark,
    /// From the bark to the pith.
    Pith,
}

/// Settings for reading a strip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StripSpec {
    /// Direction of the strip.
    pub towards: Direction,
    /// True if early wood is the darker part of the year.
    pub early_dark: bool,
    /// Number of table entries per year.
    pub entries: usize,
    /// True if all years are returned instead of their mean.
    pub all: bool,
    /// The width of a year in pixels, if known: then years are not searched for.
    pub period: Option<f32>,
}

/// Result of reading a strip.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampled {
    /// The colours of one year, or of all.
    pub table: Vec<[f32; 3]>,
    /// The widths of the years relative to their mean, from the pith outwards.
    pub widths: Vec<f32>,
    /// Number of years found, and number of years that are similar to the others.
    pub years: (usize, usize),
    /// Confidence that these are years, 0..1.
    pub confidence: f32,
    /// Confidence in the direction: the skewness of the slope.
    pub skew: f32,
}

/// Errors of reading a strip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StripError {
    /// Too short to hold two years.
    Short,
    /// All pixels have the same colour.
    Flat,
    /// No years stand out.
    NoRings,
    /// The years are not similar.
    Unlike(f32),
}

fn light(c: &[f32; 3]) -> f32 {
    0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
}

fn correlation(a: &[f32], b: &[f32]) -> f32 {
    let n = a.len().min(b.len()).max(1) as f32;
    let (ma, mb) = (a.iter().sum::<f32>() / n, b.iter().sum::<f32>() / n);
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        ab += (x - ma) * (y - mb);
        aa += (x - ma) * (x - ma);
        bb += (y - mb) * (y - mb);
    }
    ab / (aa * bb).sqrt().max(1e-12)
}

fn gaussian(values: &[f32], sigma: f32) -> Vec<f32> {
    let weight = |d: f32| crate::ground::math::exp(-0.5 * d * d / (sigma * sigma));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a radius of a few pixels")]
    let radius = (3.0 * sigma).ceil().min(4096.0) as usize;
    let kernel: Vec<f32> = (0..=radius).map(|d| weight(d as f32)).collect();
    let at = |i: usize| {
        let (low, high) = (i.saturating_sub(radius), (i + radius).min(values.len() - 1));
        let (sum, all) = (low..=high)
            .fold((0.0, 0.0), |(s, w), j| (s + kernel[i.abs_diff(j)] * values[j], w + kernel[i.abs_diff(j)]));
        sum / all
    };
    (0..values.len()).map(at).collect()
}

/// Shifts the rows onto each other by at most 2 pixels a row, outwards from the middle, and averages them.
fn straighten(strip: &Strip) -> Vec<[f32; 3]> {
    let n = strip.length;
    let row = |r: usize| &strip.pixels[r * n..(r + 1) * n];
    let middle = strip.rows / 2;
    let mut sum: Vec<[f32; 3]> = row(middle).to_vec();
    let mut count = vec![1.0_f32; n];
    for side in [true, false] {
        let mut shift = 0_i32;
        let mut before: Vec<f32> = row(middle).iter().map(light).collect();
        let rows: Vec<usize> = if side { (middle + 1..strip.rows).collect() } else { (0..middle).rev().collect() };
        for r in rows {
            let values: Vec<f32> = row(r).iter().map(light).collect();
            let shifted = |s: i32| -> Vec<f32> {
                (0..n).map(|i| values[i.saturating_add_signed(s as isize).min(n - 1)]).collect()
            };
            let score = |s: i32| correlation(&before, &shifted(s)) - 1e-4 * (s - shift).unsigned_abs() as f32;
            shift = (shift - 2..=shift + 2).max_by(|a, b| score(*a).total_cmp(&score(*b))).unwrap_or(shift);
            // A running mean: from one row to the next a slant is less than a pixel and would be lost.
            before.iter_mut().zip(shifted(shift)).for_each(|(mean, v)| *mean += 0.2 * (v - *mean));
            for i in 0..n {
                let Some(from) = i.checked_add_signed(shift as isize).filter(|j| *j < n) else { continue };
                (0..3).for_each(|c| sum[i][c] += row(r)[from][c]);
                count[i] += 1.0;
            }
        }
    }
    sum.iter().zip(count).map(|(c, n)| c.map(|v| v / n)).collect()
}

/// The borders of years in a slope: the best choice of its peaks over all periods, by their share of the slope.
fn borders(slope: &[f32]) -> Vec<usize> {
    let mut sorted: Vec<f32> = slope.iter().map(|s| s.max(0.0)).collect();
    sorted.sort_by(f32::total_cmp);
    let peaks: Vec<(usize, f32)> = (1..slope.len() - 1)
        .filter(|&i| slope[i] > 0.0 && slope[i] >= slope[i - 1] && slope[i] > slope[i + 1])
        .map(|i| (i, slope[i]))
        .collect();
    let mut best = (0.0_f32, Vec::new());
    let mut period = 5.0_f32;
    while period < slope.len() as f32 / 2.0 {
        // One slope in a period is a border: keep the slopes that are steeper than the rest.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place within the strip")]
        let rare = ((1.0 - 1.0 / period) * sorted.len() as f32) as usize;
        let scale = sorted[rare.min(sorted.len() - 1)].max(1e-9);
        let mut total = vec![0.0_f32; peaks.len()];
        let mut back = vec![usize::MAX; peaks.len()];
        for i in 0..peaks.len() {
            let earn = (peaks[i].1 / scale).min(3.0) - 0.3;
            total[i] = earn;
            for j in (0..i).rev() {
                let w = (peaks[i].0 - peaks[j].0) as f32;
                if w > 4.0 * period {
                    break;
                }
                let off = libm::logf(w / period) / 0.5;
                let sum = total[j] + earn - 0.12 * off * off;
                if sum > total[i] {
                    (total[i], back[i]) = (sum, j);
                }
            }
        }
        if let Some(end) = (0..peaks.len()).max_by(|a, b| total[*a].total_cmp(&total[*b]))
            && total[end] * scale > best.0
        {
            let mut chain = vec![end];
            while let Some(&last) = chain.last()
                && back[last] != usize::MAX
            {
                chain.push(back[last]);
            }
            best = (total[end] * scale, chain.into_iter().rev().map(|i| peaks[i].0).collect());
        }
        period *= 1.2;
    }
    best.1
}

/// Moves borders by at most one pixel to the largest rise of light between two pixels, since the slope over two pixels
/// is equal on both sides of a sharp border. The pixel at a border is the first one of its year.
fn sharpened(borders: Vec<usize>, values: &[f32], sign: f32) -> Vec<usize> {
    let rise = |i: usize| if (1..values.len()).contains(&i) { sign * (values[i] - values[i - 1]) } else { f32::MIN };
    let best = |i: usize| (i.saturating_sub(1)..=i + 1).max_by(|a, b| rise(*a).total_cmp(&rise(*b))).unwrap_or(i);
    borders.into_iter().map(best).collect()
}

/// Resamples a strip's pixels between two positions to `entries` values, linearly.
fn resample(colors: &[[f32; 3]], from: usize, to: usize, entries: usize) -> Vec<[f32; 3]> {
    let width = (to - from) as f32;
    let entry = |k: usize| {
        let at = (k as f32 + 0.5) / entries as f32 * width - 0.5;
        let below = at.floor().max(0.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place within the strip")]
        let i = from + below as usize;
        let (a, b) = (colors[i.min(to - 1)], colors[(i + 1).min(to - 1)]);
        let t = (at - below).clamp(0.0, 1.0);
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)
    };
    (0..entries).map(entry).collect()
}

/// Below this confidence there are no years.
const LEAST: f32 = 0.3;

/// The confidence that years were found, from their similarity, their number, and, if the direction is detected too,
/// the skewness. Borders chosen by their slope make years similar in any noise: 0.5 to 0.75 by measurement (white, soft
/// and streaky noise), more where they are few; real rings have a similarity of 0.85 and more.
fn sureness(alike: f32, years: usize, skew: Option<f32>) -> f32 {
    let more = ((alike - 0.7) / 0.3).clamp(0.0, 1.0);
    let many = years as f32 / (years as f32 + 5.0);
    more * many * skew.map_or(1.0, |skew| (skew.abs() / 0.3).min(1.0))
}

/// Borders at a fixed distance.
fn every(period: f32, length: usize) -> Vec<usize> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place within the strip")]
    let border = |k: usize| (k as f32 * period).round() as usize;
    (0..=length).map(border).take_while(|at| *at <= length).collect()
}

/// Finds the years in a strip and their colours.
///
/// # Errors
/// Returns an error if no years can be found.
pub fn sample(strip: &Strip, spec: &StripSpec) -> Result<Sampled, StripError> {
    if strip.length < 24 {
        return Err(StripError::Short);
    }
    let mut colors = straighten(strip);
    let values: Vec<f32> = colors.iter().map(light).collect();
    let (low, high) = values.iter().fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    if high - low < 1e-3 * high.max(1e-6) || high <= 0.0 {
        return Err(StripError::Flat);
    }
    let slope_of = |values: &[f32]| {
        let soft = gaussian(values, 1.2);
        (0..soft.len()).map(|i| soft[(i + 1).min(soft.len() - 1)] - soft[i.saturating_sub(1)]).collect::<Vec<f32>>()
    };
    let slope = slope_of(&values);
    let n = slope.len() as f32;
    let mean = slope.iter().sum::<f32>() / n;
    let moment = |k: i32| slope.iter().map(|s| (s - mean).powi(k)).sum::<f32>() / n;
    let skew = moment(3) / libm::powf(moment(2).max(1e-20), 1.5) * if spec.early_dark { -1.0 } else { 1.0 };
    let turned = match spec.towards {
        Direction::Auto => skew < 0.0,
        Direction::Bark => false,
        Direction::Pith => true,
    };
    if turned {
        colors.reverse();
    }
    let values: Vec<f32> = colors.iter().map(light).collect();
    let sign = if spec.early_dark { -1.0 } else { 1.0 };
    let rises: Vec<f32> = slope_of(&values).iter().map(|s| sign * s).collect();
    let found = match spec.period {
        Some(period) => every(period.max(2.0), colors.len()),
        None => sharpened(borders(&rises), &values, sign),
    };
    if found.len() < if spec.period.is_some() { 2 } else { 3 } {
        return Err(StripError::NoRings);
    }
    let widths: Vec<f32> = found.windows(2).map(|p| (p[1] - p[0]) as f32).collect();
    let period = widths.iter().sum::<f32>() / widths.len() as f32;
    // Noise has such close peaks, too.
    if spec.period.is_none() && period < 6.5 {
        return Err(StripError::NoRings);
    }
    let slow = gaussian(&values, 1.5 * period);
    let level = values.iter().sum::<f32>() / n;
    let flat: Vec<[f32; 3]> = colors.iter().zip(&slow).map(|(c, s)| c.map(|v| v * level / s.max(1e-6))).collect();
    let years: Vec<Vec<[f32; 3]>> = found.windows(2).map(|p| resample(&flat, p[0], p[1], spec.entries)).collect();
    let middle = |values: &mut Vec<f32>| {
        values.sort_by(f32::total_cmp);
        values[values.len() / 2]
    };
    let median: Vec<f32> =
        (0..spec.entries).map(|k| middle(&mut years.iter().map(|y| light(&y[k])).collect())).collect();
    let likeness: Vec<f32> =
        years.iter().map(|y| correlation(&y.iter().map(light).collect::<Vec<_>>(), &median)).collect();
    let typical = middle(&mut likeness.clone());
    let bar = if spec.period.is_some() { f32::NEG_INFINITY } else { (typical - 0.25).max(0.3) };
    let kept: Vec<&Vec<[f32; 3]>> = years.iter().zip(&likeness).filter(|(_, l)| **l >= bar).map(|(y, _)| y).collect();
    let alike = typical.max(0.0) * kept.len() as f32 / years.len() as f32;
    let confidence = match spec.period {
        Some(_) => 1.0,
        None => sureness(alike, years.len(), (spec.towards == Direction::Auto).then_some(skew)),
    };
    if spec.period.is_none() && (kept.len() < 3 || confidence < LEAST) {
        return Err(StripError::Unlike(confidence));
    }
    let trimmed = |k: usize| -> [f32; 3] {
        std::array::from_fn(|c| {
            let mut all: Vec<f32> = kept.iter().map(|y| y[k][c]).collect();
            all.sort_by(f32::total_cmp);
            let cut = all.len() / 5;
            let rest = &all[cut..all.len() - cut];
            rest.iter().sum::<f32>() / rest.len() as f32
        })
    };
    let table = if spec.all {
        found.windows(2).flat_map(|p| resample(&colors, p[0], p[1], spec.entries)).collect()
    } else {
        (0..spec.entries).map(trimmed).collect()
    };
    let widths_out = widths.iter().map(|w| w / period).collect();
    Ok(Sampled { table, widths: widths_out, years: (years.len(), kept.len()), confidence, skew })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;
    use crate::wood::years::series;

    /// A slanted strip of years of varying width; `turned`: from the bark inwards.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a test picture")]
    fn strip(turned: bool, sigma: f64) -> (Strip, Vec<f32>) {
        let profile = |p: f32| 0.6 - 0.35 * (p * p * p);
        let widths: Vec<f32> = series(24, sigma, 0.4, Hash::new(5)).iter().map(|w| *w as f32 * 22.0).collect();
        let mut ends = vec![0.0_f32];
        widths.iter().for_each(|w| ends.push(ends[ends.len() - 1] + w));
        let length = ends[ends.len() - 1] as usize - 8;
        let rows = 25;
        let noise = Hash::new(3);
        let pixel = |k: usize| {
            let (r, i) = (k / length, k % length);
            let x = (i as f32 + 0.25 * r as f32 + 0.5).min(ends[ends.len() - 1] - 0.01);
            let y = ends.partition_point(|e| *e <= x).max(1) - 1;
            let p = (x - ends[y]) / widths[y.min(widths.len() - 1)];
            let v = profile(p.clamp(0.0, 1.0)) * (1.0 + 0.04 * (noise.unit_f32(k as u64) - 0.5));
            [v, 0.8 * v, 0.5 * v]
        };
        let mut pixels: Vec<[f32; 3]> = (0..rows * length).map(pixel).collect();
        if turned {
            pixels.chunks_mut(length).for_each(<[_]>::reverse);
        }
        (Strip { pixels, length, rows }, (0..64).map(|i| profile((i as f32 + 0.5) / 64.0)).collect())
    }

    #[test]
    fn finds_years_either_way() {
        let spec = StripSpec { towards: Direction::Auto, early_dark: false, entries: 64, all: false, period: None };
        for turned in [false, true] {
            let (strip, profile) = strip(turned, 0.25);
            let found = sample(&strip, &spec).unwrap();
            assert!(found.years.0 >= 20 && found.confidence > 0.7, "{found:?}");
            let got: Vec<f32> = found.table.iter().map(|c| c[0]).collect();
            assert!(correlation(&got, &profile) > 0.97, "{turned} {got:?}");
            assert!(found.skew.abs() > 0.3);
        }
    }

    #[test]
    fn years_begin_with_the_first_light_pixel() {
        for (early_dark, turned) in [(false, false), (false, true), (true, false), (true, true)] {
            // From 0.7 down to 0.3 in 24 pixels, then at once up again; the line starts within a year.
            let shade = |i: usize| 0.7 - 0.4 * ((i + 7) % 24) as f32 / 23.0;
            let mut pixels: Vec<[f32; 3]> =
                (0..480).map(|i| [if early_dark { 1.0 - shade(i) } else { shade(i) }; 3]).collect();
            if turned {
                pixels.reverse();
            }
            let spec = StripSpec { towards: Direction::Auto, early_dark, entries: 24, all: false, period: None };
            let found = sample(&Strip { pixels, length: 480, rows: 1 }, &spec).unwrap();
            for (k, color) in found.table.iter().enumerate() {
                let want = 0.7 - 0.4 * k as f32 / 23.0;
                let want = if early_dark { 1.0 - want } else { want };
                // Slow changes of the whole strip are removed, which changes its ends slightly.
                assert!((color[0] - want).abs() < 0.03, "{early_dark} {turned}: entry {k} is {color:?}, not {want}");
            }
        }
    }

    /// Noise of deviation 0.1, averaged over `wide` pixels along the line and `tall` across it.
    fn noise(length: usize, wide: usize, tall: usize, seed: u64) -> Strip {
        let (rows, hash) = (25, Hash::new(seed));
        let (w, h) = (length + wide, rows + tall);
        let white: Vec<f32> = (0..w * h).map(|i| hash.unit_f32(i as u64) - 0.5).collect();
        let across: Vec<f32> =
            (0..length * h).map(|k| white[k / length * w + k % length..][..wide].iter().sum()).collect();
        let mean = |k: usize| (0..tall).map(|d| across[k + d * length]).sum::<f32>() / (wide * tall) as f32;
        let strength = 0.35 * ((wide * tall) as f32).sqrt();
        let pixels = (0..rows * length).map(|k| [(0.5 + strength * mean(k)).max(0.01); 3]).collect();
        Strip { pixels, length, rows }
    }

    #[test]
    fn noise_has_no_years() {
        let spec = StripSpec { towards: Direction::Auto, early_dark: false, entries: 64, all: false, period: None };
        for (wide, tall) in [(1, 1), (3, 3), (8, 8), (3, 25), (1, 25), (12, 25)] {
            for (length, seed) in [(240, 1), (600, 2), (600, 3), (1500, 4)] {
                let found = sample(&noise(length, wide, tall, seed), &spec);
                assert!(found.is_err(), "{wide} {tall} {length} {seed}: {:?}", found.map(|f| (f.confidence, f.years)));
            }
        }
    }

    #[test]
    fn uses_known_width_of_years() {
        let spec = StripSpec { towards: Direction::Bark, early_dark: false, entries: 8, all: true, period: Some(60.0) };
        let found = sample(&noise(300, 3, 3, 1), &spec).unwrap();
        assert_eq!((found.years, found.table.len(), found.confidence), ((5, 5), 40, 1.0));
    }

    #[test]
    fn rejects_strips_without_years() {
        let spec = StripSpec { towards: Direction::Auto, early_dark: false, entries: 64, all: false, period: None };
        let flat = Strip { pixels: vec![[0.5; 3]; 25 * 300], length: 300, rows: 25 };
        assert_eq!(sample(&flat, &spec), Err(StripError::Flat));
        let short = Strip { pixels: vec![[0.5; 3]; 10], length: 10, rows: 1 };
        assert_eq!(sample(&short, &spec), Err(StripError::Short));
    }
}
