//! The directory of a TIFF file: tags with their values.

use std::io;

/// Tags in ascending order, as the format requires.
pub(crate) struct Directory {
    big: bool,
    entries: Vec<Entry>,
}

struct Entry {
    tag: u16,
    kind: u16,
    count: u64,
    value: Vec<u8>,
}

const ASCII: u16 = 2;
const SHORT: u16 = 3;
const LONG: u16 = 4;
const RATIONAL: u16 = 5;
const LONG8: u16 = 16;

impl Directory {
    pub(crate) fn new(big: bool) -> Self {
        Self { big, entries: Vec::new() }
    }

    pub(crate) fn shorts(&mut self, tag: u16, values: &[u16]) {
        self.add(tag, SHORT, values.len(), values.iter().flat_map(|value| value.to_le_bytes()).collect());
    }

    pub(crate) fn longs(&mut self, tag: u16, values: &[u32]) {
        self.add(tag, LONG, values.len(), values.iter().flat_map(|value| value.to_le_bytes()).collect());
    }

    /// A tag with a rational number.
    pub(crate) fn ratio(&mut self, tag: u16, [above, below]: [u32; 2]) {
        self.add(tag, RATIONAL, 1, [above.to_le_bytes(), below.to_le_bytes()].concat());
    }

    /// A tag with offsets in the file or lengths.
    pub(crate) fn places(&mut self, tag: u16, values: &[u64]) {
        if self.big {
            self.add(tag, LONG8, values.len(), values.iter().flat_map(|value| value.to_le_bytes()).collect());
        } else {
            let short = |value: &u64| u32::try_from(*value).expect("a file of more than 4 GiB is written as BigTIFF");
            self.longs(tag, &values.iter().map(short).collect::<Vec<_>>());
        }
    }

    pub(crate) fn text(&mut self, tag: u16, text: &str) {
        let mut value = text.replace('\0', " ").into_bytes();
        value.push(0);
        self.add(tag, ASCII, value.len(), value);
    }

    fn add(&mut self, tag: u16, kind: u16, count: usize, value: Vec<u8>) {
        debug_assert!(self.entries.last().is_none_or(|last| last.tag < tag), "tags are in ascending order");
        self.entries.push(Entry { tag, kind, count: count as u64, value });
    }

    /// Bytes of the directory for the given offset; values that do not fit their entries follow it. `more`: another
    /// directory follows.
    pub(crate) fn bytes(&self, place: u64, more: bool) -> io::Result<Vec<u8>> {
        let (field, count_bytes) = if self.big { (8, 8) } else { (4, 2) };
        let length = count_bytes + self.entries.len() * (4 + 2 * field) + field;
        let (mut table, mut values) = (Vec::new(), Vec::new());
        put(&mut table, self.entries.len() as u64, count_bytes)?;
        for entry in &self.entries {
            put(&mut table, u64::from(entry.tag), 2)?;
            put(&mut table, u64::from(entry.kind), 2)?;
            put(&mut table, entry.count, field)?;
            if entry.value.len() <= field {
                table.extend(&entry.value);
                table.resize(table.len() + field - entry.value.len(), 0);
            } else {
                put(&mut table, place + (length + values.len()) as u64, field)?;
                values.extend(&entry.value);
                values.resize(values.len().next_multiple_of(2), 0);
            }
        }
        let next = place + (length + values.len()) as u64;
        put(&mut table, if more { next } else { 0 }, field)?;
        table.append(&mut values);
        Ok(table)
    }
}

/// Appends a number in `bytes` bytes.
fn put(out: &mut Vec<u8>, number: u64, bytes: usize) -> io::Result<()> {
    let all = number.to_le_bytes();
    if all[bytes..].iter().any(|byte| *byte != 0) {
        return Err(io::Error::other("the file is too large for TIFF"));
    }
    out.extend(&all[..bytes]);
    Ok(())
}
