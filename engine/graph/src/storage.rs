//! Storage options of an output's pictures: mip levels, colour space, direction of normals.
use super::part::{Entry, SyntaxValue};
use super::read::{self, choice};
use super::report::Report;
use crate::diagnostics::Code;
use crate::picture::Format;

/// Storage options of pictures, besides format and depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Storage {
    /// The pictures are tiled and have mip levels; only in `Exr` and `Tiff`.
    pub mip: bool,
    /// The mip levels of a roughness grow by the variance of the averaged normals.
    pub widen_roughness: bool,
    /// The range of integers is that of the values.
    pub fit: bool,
    /// The `y` of normals points down, as in Direct3D.
    pub normal_down: bool,
    /// The colour space of colours; chosen by the format if not stated.
    pub color_space: Option<FileColors>,
}

impl Default for Storage {
    fn default() -> Self {
        Self { mip: false, widen_roughness: true, fit: false, normal_down: false, color_space: None }
    }
}

/// The colours of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FileColors {
    /// Rec.709 primaries with the sRGB curve.
    Srgb,
    /// Rec.709 primaries, proportional to light.
    LinearRec709,
    /// ACEScg: AP1 primaries, proportional to light.
    AcesCg,
}

impl FileColors {
    /// All colour spaces, by name.
    pub const ALL: [(&'static str, Self); 3] =
        [("Srgb", Self::Srgb), ("LinearRec709", Self::LinearRec709), ("AcesCg", Self::AcesCg)];
}

impl Storage {
    /// The words for the direction of `y` in normals; true if it points down.
    pub const NORMALS: [(&'static str, bool); 2] = [("OpenGl", false), ("DirectX", true)];
}

/// Reads the storage options; faulty options keep their defaults.
pub(super) fn read(fields: &[Entry], format: Option<Format>, report: &mut Report) -> Storage {
    let mut storage = Storage::default();
    let truth = [("true", true), ("false", false)];
    let get = |name: &str| read::get(fields, name);
    if let Some(part) = get("mip") {
        storage.mip = choice(part, "mip", &truth, report).unwrap_or_default();
        if let (true, Some(format)) = (storage.mip, format.filter(|format| !format.has_mips())) {
            let message = format!("`{format}` files have no mip levels here");
            report.push(part.error(Code::BadValue, message).help("write `format: Exr` or `Tiff`, or leave `mip` out"));
        }
    }
    if let Some(part) = get("widen_roughness") {
        storage.widen_roughness = choice(part, "widen_roughness", &truth, report).unwrap_or(true);
    }
    if let Some(part) = get("normal") {
        storage.normal_down = choice(part, "normal", &Storage::NORMALS, report).unwrap_or_default();
    }
    if let Some(part) = get("color_space") {
        storage.color_space = choice(part, "color_space", &FileColors::ALL, report);
        check_curve(part, storage.color_space, format, report);
    }
    storage
}

fn check_curve(part: &SyntaxValue, space: Option<FileColors>, format: Option<Format>, report: &mut Report) {
    if space == Some(FileColors::Srgb) && format == Some(Format::Exr) {
        let message = "`Exr` holds light, which has no sRGB curve";
        report.push(part.error(Code::BadValue, message).help("write `color_space: LinearRec709`, or another format"));
    }
}
