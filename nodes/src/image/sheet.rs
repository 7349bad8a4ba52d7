//! The files of a picture, and how they are read: a single file, or one for each UDIM tile, side by side as a sheet.
use rayon::prelude::*;
use shibo_picture::{
    self as picture, ColorSpace, Conversion, FileError, Header, Picture, ReadLimits, divide_by_alpha, udim_file,
};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::files::FileHandle;
use std::path::Path;

/// Options for turning samples of a file into values; `None` follows the file.
#[derive(Clone)]
pub(super) struct DecodeOptions {
    pub(super) layer: Option<String>,
    pub(super) space: Option<ColorSpace>,
    pub(super) premultiplied: Option<bool>,
    /// The number that replaces NaN and infinities; `None` stands for 0, with a warning.
    pub(super) not_finite: Option<f64>,
}

/// A file of a sheet.
struct Part {
    path: FileHandle,
    header: Header,
    /// Column and row among the tiles; rows go upwards.
    place: [u32; 2],
}

/// Files of the same form, side by side; usually a single one.
pub(super) struct Sheet {
    parts: Vec<Part>,
    /// Columns and rows of tiles.
    tiles: [u32; 2],
}

impl DecodeOptions {
    /// The header of a file.
    pub(super) fn header(&self, path: &FileHandle) -> Result<Header, FileError> {
        self.layer.as_deref().map_or_else(|| picture::header(path), |layer| picture::header_layer(path, layer))
    }

    fn conversion(&self, header: &Header) -> (Conversion, Vec<String>) {
        self.space.map_or_else(|| Conversion::of_file(header), |space| (space.into(), Vec::new()))
    }

    /// Advice about assumptions: for a file that does not state its colours, or states them in an unsupported way.
    pub(super) fn assumed(&self, path: &FileHandle, header: &Header) -> Vec<Problem> {
        let advice = |what: &String, help: &str| {
            Problem::new(Code::Advice, format!("`{}`: {what}", path.display())).at("path").help(help)
        };
        let channels = "look at the picture; `layer` takes one channel or layer by its name";
        let named = header.told.assumed.iter().map(|assumed| advice(assumed, channels));
        let colors = "set `color_space`, or convert the file to sRGB";
        named.chain(self.conversion(header).1.iter().map(|unused| advice(unused, colors))).collect()
    }

    /// The picture in linear Rec. 709, and a warning if it has one.
    fn read(&self, part: &Part, limits: &ReadLimits) -> Result<(Picture, Option<Problem>), Problem> {
        let Part { path, header, .. } = part;
        let picture = match &self.layer {
            Some(layer) => picture::read_layer(path, layer, limits),
            None => picture::read(path, limits),
        };
        let mut picture = picture.map_err(|error| problem(&error))?;
        if (picture.width, picture.height, picture.channels) != (header.width, header.height, header.channels) {
            let message = format!("`{}` was changed after the run had begun", path.display());
            return Err(Problem::new(Code::BadFile, message).at("path").help("run it again"));
        }
        let warning = self.replace_non_finite(path, &mut picture);
        if self.premultiplied.unwrap_or(header.associated) {
            divide_by_alpha(&mut picture);
        }
        self.conversion(header).0.apply(&mut picture);
        Ok((picture, warning))
    }

    /// Replaces NaN and infinities; returns a warning unless the user chose the value.
    fn replace_non_finite(&self, path: &FileHandle, picture: &mut Picture) -> Option<Problem> {
        let first = picture.first_non_finite()?;
        let (count, all) = (picture.count_non_finite(), picture.planes.len());
        #[expect(clippy::cast_possible_truncation, reason = "rounding to the precision of a sample is meant")]
        let value = self.not_finite.unwrap_or(0.0) as f32;
        picture.planes.par_iter_mut().filter(|sample| !sample.is_finite()).for_each(|sample| *sample = value);
        if self.not_finite.is_some() {
            return None;
        }
        let channel = picture.names.get(usize::from(first.channel)).map_or("?", String::as_str);
        let message = format!(
            "`{}`: {count} of {all} samples are NaN or infinite; 0 is used instead. The first is `{}` in channel `{channel}` at \
             pixel ({}, {})",
            path.display(),
            first.value,
            first.x,
            first.y
        );
        let help = "mend the file, or say by `not_finite` what replaces them";
        Some(Problem::new(Code::Advice, message).at("path").help(help))
    }
}

impl Sheet {
    /// The sheet for the path `named` in a graph file; reads the headers of `files`.
    pub(super) fn of(named: &Path, files: &[&FileHandle], reading: &DecodeOptions) -> Result<Self, Problem> {
        let mut parts: Vec<Part> = Vec::with_capacity(files.len());
        for &path in files {
            let header = reading.header(path).map_err(|error| problem(&error))?;
            let place = udim_file(named, path.path()).map_or([0, 0], |file| file.place());
            let part = Part { path: path.clone(), header, place };
            if let Some(first) = parts.first().filter(|first| looks(&first.header) != looks(&part.header)) {
                return Err(unlike(first, &part));
            }
            parts.push(part);
        }
        let tiles = [0, 1].map(|axis| parts.iter().map(|part| part.place[axis] + 1).max().unwrap_or(1));
        Ok(Self { parts, tiles })
    }

    /// The header of the whole picture.
    pub(super) fn header(&self) -> Result<Header, Problem> {
        let header = self.parts[0].header.clone();
        let [across, up] = self.tiles;
        match (header.width.checked_mul(across), header.height.checked_mul(up)) {
            (Some(width), Some(height)) => Ok(Header { width, height, ..header }),
            _ => Err(Problem::new(Code::TooLarge, "the pictures of all tiles together are too large").at("path")),
        }
    }

    /// Advice about assumptions for the files, and about tiles without a file.
    pub(super) fn assumed(&self, reading: &DecodeOptions) -> Vec<Problem> {
        let mut found: Vec<Problem> =
            self.parts.iter().flat_map(|part| reading.assumed(&part.path, &part.header)).collect();
        let number = |[column, row]: [u32; 2]| format!("`{}`", 1001 + column + 10 * row);
        let all = (0..self.tiles[1]).flat_map(|row| (0..self.tiles[0]).map(move |column| [column, row]));
        let is_missing = |place: &[u32; 2]| self.parts.iter().all(|part| part.place != *place);
        let missing: Vec<String> = all.filter(is_missing).map(number).collect();
        if !missing.is_empty() {
            let existing: Vec<String> = self.parts.iter().map(|part| number(part.place)).collect();
            let (missing, existing) = (missing.join(", "), existing.join(", "));
            let message =
                format!("there is no file for {missing}, where the picture is 0; there are files for {existing}");
            found.push(
                Problem::new(Code::Advice, message).at("path").help("add the files, if something shows these tiles"),
            );
        }
        found
    }

    /// The whole picture in linear Rec. 709, and a warning if it has one.
    pub(super) fn read(
        &self,
        reading: &DecodeOptions,
        limits: &ReadLimits,
    ) -> Result<(Picture, Option<Problem>), Problem> {
        let (mut picture, mut warning) = reading.read(&self.parts[0], limits)?;
        if self.tiles == [1, 1] {
            return Ok((picture, warning));
        }
        let Header { width, height, .. } = self.header()?;
        let pixels = width as usize * height as usize;
        let mut planes = vec![0.0; pixels * usize::from(picture.channels)];
        for (index, part) in self.parts.iter().enumerate() {
            if index > 0 {
                let (next, found) = reading.read(part, limits)?;
                (picture, warning) = (next, warning.or(found));
            }
            let (wide, high) = (picture.width as usize, picture.height as usize);
            let (left, top) = (part.place[0] as usize * wide, (self.tiles[1] - 1 - part.place[1]) as usize * high);
            let stored = picture.planes.chunks_exact(wide * high);
            for (whole, plane) in planes.chunks_exact_mut(pixels).zip(stored) {
                let rows = whole.chunks_exact_mut(width as usize).skip(top);
                rows.zip(plane.chunks_exact(wide)).for_each(|(row, line)| row[left..left + wide].copy_from_slice(line));
            }
        }
        Ok((Picture { width, height, planes, ..picture }, warning))
    }
}

/// The properties that all files of a sheet share.
fn looks(header: &Header) -> (u32, u32, u8, bool) {
    (header.width, header.height, header.channels, header.has_alpha)
}

fn unlike(first: &Part, other: &Part) -> Problem {
    let shown = |part: &Part| {
        let (width, height, channels, _) = looks(&part.header);
        format!("`{}` has {channels} channels of `{width}x{height}` pixels", part.path.display())
    };
    let message = format!("the tiles of a set must be alike; {}, {}", shown(first), shown(other));
    Problem::new(Code::BadFile, message)
        .at("path")
        .help("give all of them the size and the channels of the largest one")
}

/// The problem for a picture that cannot be read, at the parameter that names it.
pub(super) fn problem(error: &picture::FileError) -> Problem {
    let (code, at) = match &error.reason {
        picture::ReadError::NoSuchLayer { .. } => (Code::UnknownVariant, "layer"),
        reason if reason.is_not_found() => (Code::FileNotFound, "path"),
        reason if reason.is_too_large() => (Code::TooLarge, "path"),
        _ => (Code::BadFile, "path"),
    };
    Problem::new(code, error.to_string()).at(at)
}
