//! Radiance HDR (`.hdr`): three mantissas with one exponent per pixel, plain or in runs.
//!
//! Source: G. Ward, "Real Pixels", Graphics Gems II, 1991, and the file formats of Radiance. `EXPOSURE` is divided out.
use super::limits::{Claim, ReadError, ReadLimits};
use super::{FileFormat, Header, HeaderStatements, Picture, SampleKind, default_names};
use std::io::{BufRead, Read};

/// Most bytes of the lines before the pixels.
const LONGEST_HEAD: u64 = 1 << 16;
/// Widths whose rows may store each channel in runs of its own.
const RUNS: std::ops::Range<usize> = 8..0x8000;
/// The longest run, in pixels; it takes two bytes.
const LONGEST_RUN: usize = 127;

/// The statements before the pixels.
#[derive(Debug)]
struct Head {
    width: usize,
    height: usize,
    /// True if the first row in the file is the lowest.
    from_below: bool,
    /// True if the first pixel of a row is the rightmost.
    from_right: bool,
    /// The product of all exposures.
    exposure: f32,
    chromaticities: Option<[f32; 8]>,
    /// Bytes of all lines.
    len: usize,
}

pub(super) fn header(reader: impl BufRead) -> Result<Header, ReadError> {
    let mut start = Vec::new();
    reader.take(LONGEST_HEAD).read_to_end(&mut start).map_err(ReadError::Io)?;
    described(&Head::parse(&start)?)
}

pub(super) fn check(reader: impl BufRead, length: u64, limits: &ReadLimits) -> Result<Header, ReadError> {
    let mut start = Vec::new();
    reader.take(LONGEST_HEAD).read_to_end(&mut start).map_err(ReadError::Io)?;
    let head = Head::parse(&start)?;
    head.check(length, start.get(head.len..).unwrap_or_default(), limits)?;
    described(&head)
}

pub(super) fn read(bytes: &[u8], limits: &ReadLimits) -> Result<Picture, ReadError> {
    let head = Head::parse(bytes)?;
    let rest = bytes.get(head.len..).unwrap_or_default();
    head.check(bytes.len() as u64, rest, limits)?;
    let Header { width, height, channels, names, has_alpha, kind: source, .. } = described(&head)?;
    let pixels = head.width * head.height;
    let mut planes = vec![0.0; 3 * pixels];
    let mut row = vec![[0_u8; 4]; head.width];
    let mut input = Input { rest };
    for y in 0..head.height {
        input.row(&mut row)?;
        let y = if head.from_below { head.height - 1 - y } else { y };
        for (x, [red, green, blue, exponent]) in row.iter().copied().enumerate() {
            let x = if head.from_right { head.width - 1 - x } else { x };
            // The exponent is that of a mantissa below 1, with an offset of 128; no light has the exponent 0.
            let unit = if exponent == 0 { 0.0 } else { scale(i32::from(exponent) - 136) / head.exposure };
            for (channel, mantissa) in [red, green, blue].into_iter().enumerate() {
                planes[channel * pixels + y * head.width + x] = f32::from(mantissa) * unit;
            }
        }
    }
    Ok(Picture { width, height, channels, planes, source, names, has_alpha })
}

/// A power of two from 2⁻¹³⁵ to 2¹¹⁹, in two factors because the smallest are subnormal.
fn scale(exponent: i32) -> f32 {
    let half = exponent / 2;
    let power = |exponent: i32| f32::from_bits(u32::try_from(exponent + 127).unwrap_or(0) << 23);
    power(half) * power(exponent - half)
}

fn described(head: &Head) -> Result<Header, ReadError> {
    let size = |n: usize| u32::try_from(n).map_err(ReadError::corrupt);
    Ok(Header {
        format: FileFormat::Hdr,
        width: size(head.width)?,
        height: size(head.height)?,
        channels: 3,
        kind: SampleKind::F32,
        names: default_names(3),
        has_alpha: false,
        icc: None,
        associated: false,
        told: HeaderStatements { chromaticities: head.chromaticities, ..HeaderStatements::default() },
    })
}

impl Head {
    fn parse(bytes: &[u8]) -> Result<Self, ReadError> {
        let bytes = &bytes[..bytes.len().min(usize::try_from(LONGEST_HEAD).unwrap_or(usize::MAX))];
        let ends = || ReadError::truncated("it ends within its header");
        let (mut at, mut exposure, mut chromaticities) = (0, 1.0_f32, None);
        let mut line = || {
            let len = bytes[at..].iter().position(|&byte| byte == b'\n').ok_or_else(ends)?;
            let line = String::from_utf8_lossy(&bytes[at..at + len]).trim_end().to_owned();
            at += len + 1;
            Ok::<String, ReadError>(line)
        };
        loop {
            let line = line()?;
            let Some((name, value)) = line.split_once('=') else {
                if line.is_empty() {
                    break;
                }
                continue;
            };
            match name.trim() {
                "FORMAT" if value.trim() != "32-bit_rle_rgbe" => {
                    let what = format!("its pixels have the format `{}`", value.escape_debug());
                    return Err(ReadError::Unsupported { what, instead: "save it as RGBE or as EXR" });
                }
                "EXPOSURE" => exposure *= value.trim().parse::<f32>().map_err(ReadError::corrupt)?,
                "PRIMARIES" => {
                    let numbers: Vec<f32> = value.split_whitespace().filter_map(|word| word.parse().ok()).collect();
                    chromaticities = <[f32; 8]>::try_from(numbers).ok();
                }
                _ => {}
            }
        }
        if !(exposure.is_finite() && exposure > 0.0) {
            return Err(ReadError::corrupt(format!("its exposure is {exposure}")));
        }
        let size = line()?;
        let words: Vec<&str> = size.split_whitespace().collect();
        let (from_below, from_right) = match words[..] {
            ["-Y" | "+Y", _, "+X" | "-X", _] => (words[0] == "+Y", words[2] == "-X"),
            ["+X" | "-X", _, "+Y" | "-Y", _] => {
                let what = "its rows run from top to bottom".to_owned();
                return Err(ReadError::Unsupported { what, instead: "save it upright, or as EXR" });
            }
            _ => return Err(ReadError::corrupt("there is no size of the picture after its header")),
        };
        let number = |word: &str| word.parse::<usize>().map_err(ReadError::corrupt);
        let (height, width) = (number(words[1])?, number(words[3])?);
        Ok(Self { width, height, from_below, from_right, exposure, chromaticities, len: at })
    }

    /// Compares the size with the limits, and with the length of the file if its first row is stored in runs.
    fn check(&self, length: u64, pixels: &[u8], limits: &ReadLimits) -> Result<(), ReadError> {
        let (width, height) = (self.width as u64, self.height as u64);
        limits.check(Claim { width, height, channels: 3, sample_bytes: 4 })?;
        let least = if in_runs(self.width, pixels) { 4 + 8 * self.width.div_ceil(LONGEST_RUN) as u64 } else { 0 };
        if length.saturating_sub(self.len as u64) < least.saturating_mul(height) {
            return Err(ReadError::truncated("it ends within the picture"));
        }
        Ok(())
    }
}

/// Returns true if a row that begins here stores each channel in runs.
fn in_runs(width: usize, row: &[u8]) -> bool {
    RUNS.contains(&width)
        && matches!(row, [2, 2, high, low, ..] if usize::from(*high) << 8 | usize::from(*low) == width)
}

/// The bytes of the rows that follow.
struct Input<'a> {
    rest: &'a [u8],
}

impl Input<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        let (taken, rest) =
            self.rest.split_first_chunk::<N>().ok_or_else(|| ReadError::truncated("it ends within the picture"))?;
        self.rest = rest;
        Ok(*taken)
    }

    fn row(&mut self, row: &mut [[u8; 4]]) -> Result<(), ReadError> {
        if !in_runs(row.len(), self.rest) {
            return self.pixels(row);
        }
        self.take::<4>()?;
        for channel in 0..4 {
            let mut at = 0;
            while at < row.len() {
                let [count] = self.take()?;
                let (count, repeats) = if count > 128 { (count - 128, true) } else { (count, false) };
                let run = row.get_mut(at..at + usize::from(count)).filter(|run| !run.is_empty());
                let run = run.ok_or_else(|| ReadError::damaged("a run does not fit its row"))?;
                at += run.len();
                if repeats {
                    let [value] = self.take()?;
                    run.iter_mut().for_each(|pixel| pixel[channel] = value);
                } else {
                    for pixel in run {
                        [pixel[channel]] = self.take()?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Whole pixels; the mantissas 1, 1, 1 repeat the pixel before as often as the exponent says.
    fn pixels(&mut self, row: &mut [[u8; 4]]) -> Result<(), ReadError> {
        let (mut at, mut shift) = (0, 0);
        while at < row.len() {
            let pixel = self.take()?;
            let [1, 1, 1, count] = pixel else {
                row[at] = pixel;
                (at, shift) = (at + 1, 0);
                continue;
            };
            let count = usize::from(count).checked_shl(shift).unwrap_or(usize::MAX);
            let before = at.checked_sub(1).map(|before| row[before]);
            let run = at.checked_add(count).and_then(|end| row.get_mut(at..end));
            let (Some(before), Some(run)) = (before, run) else {
                return Err(ReadError::damaged("a run does not fit its row"));
            };
            run.fill(before);
            (at, shift) = (at + count, shift + 8);
            if shift > 24 {
                return Err(ReadError::damaged("a run does not fit its row"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(lines: &str, pixels: &[u8]) -> Vec<u8> {
        [format!("#?RADIANCE\n{lines}\n").as_bytes(), pixels].concat()
    }

    fn planes(bytes: &[u8]) -> Vec<f32> {
        read(bytes, &ReadLimits::default()).unwrap().planes
    }

    #[test]
    fn reads_whole_pixels_and_their_runs() {
        let two = [128, 64, 0, 129, 1, 1, 1, 1, 0, 0, 0, 0, 255, 0, 255, 128];
        let found = planes(&file("FORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2", &two));
        // 2^(129 - 136) of 128 is 1.
        assert_eq!(found, [1.0, 1.0, 0.0, 255.0 / 256.0, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 255.0 / 256.0]);
    }

    #[test]
    fn reads_runs_of_channels_and_divides_by_the_exposure() {
        // Eight pixels: a run of red, single values of green, a run of blue, and of the exponent.
        let row = [2, 2, 0, 8, 136, 128, 8, 0, 32, 64, 96, 128, 160, 192, 224, 136, 0, 136, 129];
        let found = planes(&file("EXPOSURE=2\n EXPOSURE=0.5\nEXPOSURE=4\n\n-Y 1 +X 8", &row));
        assert_eq!(found[..8], [0.25; 8]);
        assert_eq!(found[8..16].to_vec(), (0..8).map(|i| i as f32 / 16.0).collect::<Vec<_>>());
        assert_eq!(found[16..], [0.0; 8]);
    }

    #[test]
    fn turns_rows_from_below_and_from_the_right() {
        let pixels = [128, 0, 0, 129, 64, 0, 0, 129, 32, 0, 0, 129, 16, 0, 0, 129];
        assert_eq!(planes(&file("\n+Y 2 -X 2", &pixels))[..4], [0.125, 0.25, 0.5, 1.0]);
    }

    #[test]
    fn reads_the_least_and_the_greatest_exponent() {
        let found = planes(&file("\n-Y 1 +X 2", &[255, 0, 0, 255, 1, 0, 0, 1]));
        assert_eq!(found[..2], [255.0 * 2.0_f32.powi(119), 2.0_f32.powi(-67) * 2.0_f32.powi(-68)]);
    }

    #[test]
    fn refuses_damaged_files() {
        let said = |bytes: &[u8]| read(bytes, &ReadLimits::default()).unwrap_err().to_string();
        let runs = |row: &[u8]| said(&file("\n-Y 1 +X 8", row));
        for (message, part) in [
            (said(b"#?RADIANCE\n"), "ends within its header"),
            (said(&file("FORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1", &[0; 4])), "32-bit_rle_xyze"),
            (said(&file("EXPOSURE=0\n\n-Y 1 +X 1", &[0; 4])), "exposure"),
            (said(&file("\n+X 1 +Y 1", &[0; 4])), "top to bottom"),
            (said(&file("\nsize", &[0; 4])), "no size"),
            (said(&file("\n-Y 0 +X 8", &[])), "no pixels"),
            (said(&file("\n-Y 99999 +X 99999", &[0; 4])), "99999"),
            (said(&file("\n-Y 9999 +X 8", &[2, 2, 0, 8])), "truncated"),
            (said(&file("\n-Y 1 +X 2", &[9; 7])), "truncated"),
            (said(&file("\n-Y 1 +X 2", &[1, 1, 1, 1, 0, 0, 0, 0])), "does not fit"),
            (runs(&[2, 2, 0, 8, 137, 0, 0, 0, 0, 0, 0, 0]), "does not fit"),
            (runs(&[2, 2, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0]), "does not fit"),
            (runs(&[2, 2, 0, 8, 136, 0, 136, 0, 136, 0, 136]), "truncated"),
        ] {
            assert!(message.contains(part), "{part}: {message}");
        }
    }
}
