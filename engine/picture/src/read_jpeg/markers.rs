//! Follows the markers of a JPEG file to its end without decoding: every segment must be complete, every scan needs its
//! tables, and the file needs an end marker. Decoders fill missing data with grey, so it must be found here.
//!
//! Source: ITU-T T.81, annex B. The check is as strict as `zune-jpeg` where that is stricter than the standard, so
//! `zune-jpeg` accepts every file that passes.
use super::super::limits::ReadError;
use super::tables::Tables;

/// Markers: the byte after 255.
mod code {
    pub(super) const SOF0: u8 = 0xc0;
    pub(super) const SOF2: u8 = 0xc2;
    pub(super) const SOF15: u8 = 0xcf;
    pub(super) const DHT: u8 = 0xc4;
    pub(super) const JPG: u8 = 0xc8;
    pub(super) const DAC: u8 = 0xcc;
    pub(super) const RST0: u8 = 0xd0;
    pub(super) const RST7: u8 = 0xd7;
    pub(super) const SOI: u8 = 0xd8;
    pub(super) const EOI: u8 = 0xd9;
    pub(super) const SOS: u8 = 0xda;
    pub(super) const DQT: u8 = 0xdb;
    pub(super) const DNL: u8 = 0xdc;
    pub(super) const DRI: u8 = 0xdd;
    pub(super) const APP0: u8 = 0xe0;
    pub(super) const APP14: u8 = 0xee;
}

/// The decoder's limit for scans, and for segments between two scans.
const MOST_SCANS: usize = 100;
const MOST_BETWEEN: usize = 64;
/// The maximum ratio between the sampling factors of two components, per direction.
const MOST_SAMPLING: u8 = 4;

/// A colour component.
struct Component {
    id: u8,
    quantization: u8,
    dc: u8,
    ac: u8,
    /// True after a scan with its first coefficients.
    scanned: bool,
}

/// The frame header.
struct Frame {
    progressive: bool,
    components: Vec<Component>,
}

struct Walk<'a> {
    bytes: &'a [u8],
    at: usize,
    tables: Tables,
    frame: Option<Frame>,
    scans: usize,
    /// Number of segments since the last scan.
    between: usize,
}

/// Follows the markers of a file to the end of the picture.
pub(super) fn walk(bytes: &[u8]) -> Result<(), ReadError> {
    let (at, tables) = (2, Tables::default());
    let mut walk = Walk { bytes, at, tables, frame: None, scans: 0, between: 0 };
    while walk.step()? {}
    walk.finish()
}

fn missing_end() -> ReadError {
    ReadError::truncated("its end marker is missing")
}

fn corrupt(message: impl Into<String>) -> ReadError {
    ReadError::Corrupt(message.into())
}

fn unsupported(what: String, instead: &'static str) -> ReadError {
    ReadError::Unsupported { what, instead }
}

impl<'a> Walk<'a> {
    /// Processes a marker with its segment; returns `false` at the end of the picture.
    fn step(&mut self) -> Result<bool, ReadError> {
        let marker = self.marker()?;
        match marker {
            code::EOI => return Ok(false),
            code::SOS => {
                let content = self.segment()?;
                self.scan(content)?;
                self.between = 0;
                self.skip_data()?;
                return Ok(true);
            }
            code::SOI => return Err(corrupt("another picture begins before it ends")),
            code::DAC => {
                return Err(unsupported("it is packed by arithmetic coding".into(), "save it as a usual JPEG"));
            }
            code::DNL => return Err(unsupported("its height follows its samples".into(), "save it as a usual JPEG")),
            1..=0xbf | code::RST0..=code::RST7 => {
                return Err(corrupt(format!("there is a marker {marker:#04x} where none of its sort may be")));
            }
            _ => {}
        }
        let content = self.segment()?;
        self.between += 1;
        if self.scans > 0 && self.between > MOST_BETWEEN {
            return Err(corrupt(format!("there are more than {MOST_BETWEEN} segments between two scans")));
        }
        match marker {
            code::DQT => self.tables.define_quantization(content)?,
            code::DHT => self.tables.define_huffman(content)?,
            code::DRI if content.len() != 2 => return Err(corrupt("its restart interval has not two bytes")),
            code::APP0 if content.starts_with(b"AVI1\0") => self.tables.add_usual(),
            code::APP14 if content.starts_with(b"Adobe") => self.adobe(content)?,
            code::JPG | code::DRI => {}
            code::SOF0..=code::SOF15 => self.frame = Some(self.frame(marker, content)?),
            _ => {}
        }
        Ok(true)
    }

    /// The next marker. Bytes other than 255 before it are skipped, as decoders do.
    fn marker(&mut self) -> Result<u8, ReadError> {
        let rest = self.bytes.get(self.at..).ok_or_else(missing_end)?;
        let start = rest.iter().position(|byte| *byte == 0xff).ok_or_else(missing_end)?;
        // A marker may be preceded by any number of bytes 255.
        let length = rest[start..].iter().position(|byte| *byte != 0xff).ok_or_else(missing_end)?;
        self.at += start + length + 1;
        match rest[start + length] {
            0 => Err(corrupt(format!("there is no marker at byte {}, where one must be", self.at - 2))),
            marker => Ok(marker),
        }
    }

    /// The content of a segment.
    fn segment(&mut self) -> Result<&'a [u8], ReadError> {
        let cut = || ReadError::truncated("it ends within a segment of its header");
        let rest = self.bytes.get(self.at..).ok_or_else(cut)?;
        let (length, _) = rest.split_first_chunk::<2>().ok_or_else(cut)?;
        let length = usize::from(u16::from_be_bytes(*length));
        let content = rest.get(2..length.max(2)).ok_or_else(cut)?;
        if length < 2 {
            return Err(corrupt(format!("the segment at byte {} has no length", self.at)));
        }
        self.at += length;
        Ok(content)
    }

    /// Skips compressed data, in which 255 is followed by 0 or by a restart marker.
    fn skip_data(&mut self) -> Result<(), ReadError> {
        loop {
            let rest = self.bytes.get(self.at..).ok_or_else(missing_end)?;
            self.at += rest.iter().position(|byte| *byte == 0xff).ok_or_else(missing_end)?;
            match self.bytes.get(self.at + 1).ok_or_else(missing_end)? {
                0 | code::RST0..=code::RST7 => self.at += 2,
                0xff => self.at += 1,
                _ => return Ok(()),
            }
        }
    }

    fn frame(&self, marker: u8, content: &[u8]) -> Result<Frame, ReadError> {
        if self.frame.is_some() {
            return Err(corrupt("it has more than one frame header"));
        }
        if marker > code::SOF2 {
            let what = if marker > 0xc8 { "by arithmetic coding" } else { "without loss or in several sizes" };
            return Err(unsupported(format!("it is packed {what}"), "save it as a usual JPEG"));
        }
        let Some(([bits, h0, h1, w0, w1, count], components)) = content.split_first_chunk::<6>() else {
            return Err(corrupt("its frame header is too short"));
        };
        if *bits != 8 {
            return Err(unsupported(format!("it has {bits} bits a channel"), "save it with 8, or as PNG or TIFF"));
        }
        if [h0, h1] == [&0, &0] || [w0, w1] == [&0, &0] {
            return Err(corrupt("its header says it has no pixels"));
        }
        match count {
            1 | 3 => {}
            4 => {
                let what = "its colours are those of print, CMYK or YCCK, which mean nothing without their profile";
                return Err(unsupported(what.into(), "convert it to RGB"));
            }
            _ => return Err(unsupported(format!("it has {count} channels"), "save it as grey or RGB")),
        }
        let (components, rest) = components.as_chunks::<3>();
        if components.len() != usize::from(*count) || !rest.is_empty() {
            return Err(corrupt("its frame header has not the length for its channels"));
        }
        check_sampling(components)?;
        let component = |[id, _, quantization]: &[u8; 3]| Component {
            id: *id,
            quantization: *quantization,
            dc: 0,
            ac: 0,
            scanned: false,
        };
        let components: Vec<Component> = components.iter().map(component).collect();
        let ids = components.iter().enumerate();
        if ids.clone().any(|(k, one)| components[..k].iter().any(|other| other.id == one.id)) {
            return Err(corrupt("two of its channels have the same number"));
        }
        Ok(Frame { progressive: marker == code::SOF2, components })
    }

    /// Adobe's segment states the meaning of the channels. It must come before the frame header.
    fn adobe(&self, content: &[u8]) -> Result<(), ReadError> {
        if content.len() < 12 || content[11] > 2 {
            return Err(corrupt("its Adobe segment is damaged"));
        }
        let late = self.frame.as_ref().is_some_and(|frame| frame.components.len() == 1);
        if late || self.scans > 0 {
            return Err(unsupported("what its channels are comes after them".into(), "save it again"));
        }
        Ok(())
    }

    /// Checks a scan header: its channels and their tables must exist.
    fn scan(&mut self, content: &[u8]) -> Result<(), ReadError> {
        let Some(frame) = &mut self.frame else { return Err(corrupt("its samples come before its frame header")) };
        let (count, rest) = content.split_first().ok_or_else(|| corrupt("a scan header is empty"))?;
        let count = usize::from(*count);
        let (selectors, ends) = rest.split_at_checked(2 * count).unwrap_or((&[], &[]));
        let (1..=4, &[first, last, approximation]) = (count, ends) else {
            return Err(corrupt("a scan header has not the length for its channels"));
        };
        let mut chosen = Vec::new();
        for [id, places] in selectors.as_chunks::<2>().0 {
            let index = frame.components.iter().position(|component| component.id == *id);
            let index = index.filter(|index| !chosen.contains(index));
            let index = index.ok_or_else(|| corrupt("a scan has a channel twice, or one that does not exist"))?;
            (frame.components[index].dc, frame.components[index].ac) = (places >> 4, places & 15);
            chosen.push(index);
        }
        let [before, after] = [approximation >> 4, approximation & 15];
        let order = if frame.progressive { first <= last && (first == 0) == (last == 0) } else { true };
        if last > 63
            || first > 63
            || before > 13
            || after > 13
            || !order
            || (first > 0 && frame.progressive && count > 1)
        {
            return Err(corrupt("a scan has a range of coefficients that cannot be"));
        }
        self.scans += 1;
        if self.scans > MOST_SCANS && frame.progressive {
            return Err(unsupported(format!("it has more than {MOST_SCANS} scans"), "save it with fewer"));
        }
        // The decoder looks up all tables of a sequential file before its first scan, and the quantization tables of
        // every file.
        let all = self.scans == 1;
        let of_scan = |index: usize| chosen.contains(&index);
        for (index, component) in frame.components.iter_mut().enumerate() {
            let quantized = !all || Tables::has(&self.tables.quantization, component.quantization);
            let asked = of_scan(index) || (all && !frame.progressive);
            let dc = !asked || (frame.progressive && first > 0) || Tables::has(&self.tables.dc, component.dc);
            let ac = !asked || (frame.progressive && first == 0) || Tables::has(&self.tables.ac, component.ac);
            if !(quantized && dc && ac) {
                return Err(corrupt(format!("channel {} has no table to unpack it with", component.id)));
            }
            component.scanned |= of_scan(index) && (first == 0 || !frame.progressive);
        }
        Ok(())
    }

    fn finish(self) -> Result<(), ReadError> {
        match self.frame {
            Some(frame) if frame.components.iter().all(|component| component.scanned) => Ok(()),
            Some(_) => Err(ReadError::truncated("it ends before all of its channels were stored")),
            None => Err(ReadError::truncated("it ends before its picture begins")),
        }
    }
}

/// Refuses channels whose sampling factors are not simple fractions of one another.
fn check_sampling(components: &[[u8; 3]]) -> Result<(), ReadError> {
    let most =
        |direction: fn(u8) -> u8| components.iter().map(|[_, factors, _]| direction(*factors)).max().unwrap_or(1);
    let across = |factors: u8| factors >> 4;
    let directions: [fn(u8) -> u8; 2] = [across, |factors| factors & 15];
    for direction in directions {
        let most = most(direction);
        let wrong = |factor: u8| factor == 0 || factor > MOST_SAMPLING || !most.is_multiple_of(factor);
        if let Some([_, factors, _]) = components.iter().find(|[_, factors, _]| wrong(direction(*factors))) {
            let what = format!("its channels have sizes {} to {most}, which is unusual", direction(*factors));
            return Err(unsupported(what, "save it as a usual JPEG"));
        }
    }
    // The decoder supports horizontal factors of 1, 2 and 4.
    match components.iter().find(|[_, factors, _]| !across(*factors).is_power_of_two()) {
        Some(_) => Err(unsupported("its channels have a third of its width".into(), "save it as a usual JPEG")),
        None => Ok(()),
    }
}
