//! Bundles: the pictures of a material, and documents that refer to them.
use super::archive::archive;
use super::colors::Colors;
use super::set;
use crate::value::{Channel, Field, Material, Type};
use crate::{
    AtomicFile, Compression, Depth, Encoding, Format, MipFilter, PictureSpec, Transfer, WriteError, WriteStats, Writer,
    texture_attributes,
};
use glam::{DVec2, UVec2};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Facts that an export needs besides the material.
#[derive(Clone, Debug)]
pub struct ExportContext {
    /// Prefix of all file names.
    pub stem: String,
    /// The size of the canvas, which the pictures cover, in mm.
    pub size_mm: DVec2,
    /// Directions in which pictures repeat beyond their edges.
    pub wraps: [bool; 2],
    /// Metadata for the headers of pictures of a height.
    pub metadata: Vec<(String, String)>,
}

/// The format of the samples of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Samples {
    /// A colour: 8 bits with the sRGB curve.
    Color,
    /// A colour: JPEG of this quality.
    Jpeg(u8),
    /// Numbers from 0 to 1, 8 bits.
    Data,
    /// Numbers from 0 to 1, 16 bits.
    Fine,
    /// Any numbers, 16-bit floats.
    Half,
    /// Any numbers, 32-bit floats.
    Float,
}

/// A picture of an exported material.
#[derive(Clone, Debug)]
pub struct Map {
    /// The name of the file.
    pub file: String,
    /// The fields whose channels it holds, one after another, then fields that only its mip levels are computed from.
    pub fields: Vec<Field>,
    pub(super) samples: Samples,
    /// The mip filters of a texture; empty for a picture without mip levels.
    pub(super) mips: Vec<MipFilter>,
    /// Metadata for the header of the file.
    pub(super) metadata: Vec<(String, String)>,
}

impl Map {
    /// Number of planes in the rows that it is given.
    fn planes(&self) -> usize {
        self.fields.iter().map(Field::channels).sum()
    }

    /// Number of channels in the file.
    fn channels(&self) -> usize {
        if self.mips.is_empty() { self.planes() } else { self.mips.iter().map(|filter| filter.channels()).sum() }
    }

    fn spec(&self, (size, pixel_mm): (UVec2, [f32; 2]), (dither, compression): (bool, Compression)) -> PictureSpec {
        let (format, depth, transfer) = match self.samples {
            Samples::Color => (Format::Png, Depth::U8, Transfer::Srgb),
            Samples::Jpeg(quality) => (Format::Jpeg(quality), Depth::U8, Transfer::Srgb),
            Samples::Data => (Format::Png, Depth::U8, Transfer::Raw),
            Samples::Fine => (Format::Png, Depth::U16, Transfer::Raw),
            Samples::Half => (Format::Exr, Depth::F16, Transfer::Raw),
            Samples::Float => (Format::Exr, Depth::F32, Transfer::Raw),
        };
        let names: &[&str] = if self.channels() < 3 { &["Y", "A"] } else { &["R", "G", "B", "A"] };
        PictureSpec {
            width: size.x,
            height: size.y,
            channels: names.iter().take(self.channels()).map(ToString::to_string).collect(),
            format,
            depth,
            encoding: Encoding { transfer, dither, ..Encoding::default() },
            compression,
            mips: self.mips.clone(),
            chromaticities: None,
            pixel_mm: Some(pixel_mm),
            metadata: self.metadata.clone(),
        }
    }
}

/// The files of an exported material.
#[derive(Clone, Debug, Default)]
pub struct Bundle {
    /// The pictures.
    pub maps: Vec<Map>,
    /// Names and contents of the documents.
    pub documents: Vec<(String, String)>,
    /// The archive that contains all the other files; `None` if they are separate files in the folder.
    pub archive: Option<String>,
    /// The channels that the target format cannot express.
    pub lost: Vec<Channel>,
}

impl Bundle {
    /// The names of all files, the documents first.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        let apart = self.archive.is_none();
        let names = self.documents.iter().map(|(name, _)| name).chain(self.maps.iter().map(|map| &map.file));
        self.archive.iter().chain(names.filter(move |_| apart)).map(String::as_str)
    }
}

/// Source of a channel of a material.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ChannelSource {
    /// One value for the whole canvas.
    Value(Vec<f64>),
    /// A picture in this file.
    File(String),
}

/// Collects the pictures that an exporter asks for.
pub(super) struct Maps<'a> {
    pub(super) material: &'a Material,
    stem: &'a str,
    pub(super) maps: Vec<Map>,
    colors: Colors,
    used: Vec<Channel>,
    /// The channels that were exported separately.
    known: Vec<(Channel, ChannelSource)>,
}

impl<'a> Maps<'a> {
    pub(super) fn new(material: &'a Material, stem: &'a str) -> Self {
        Self { material, stem, maps: Vec::new(), colors: Colors::Png, used: Vec::new(), known: Vec::new() }
    }

    /// Sets how colours are stored.
    pub(super) fn with_colors(self, colors: Colors) -> Self {
        Self { colors, ..self }
    }

    pub(super) fn has(&self, channel: Channel) -> bool {
        self.material.get(channel).is_some()
    }

    /// The field of a channel, or the channel's default if the material lacks it.
    pub(super) fn field(&mut self, channel: Channel) -> Field {
        self.used.push(channel);
        self.material.or_default(channel)
    }

    /// Adds a picture of some fields and returns the name of its file.
    pub(super) fn add(&mut self, suffix: &str, fields: Vec<Field>, samples: Samples) -> String {
        let extension = match samples {
            Samples::Half | Samples::Float => "exr",
            Samples::Jpeg(_) => "jpg",
            Samples::Color | Samples::Data | Samples::Fine => "png",
        };
        let file = format!("{}_{suffix}.{extension}", self.stem);
        self.maps.push(Map { file: file.clone(), fields, samples, mips: Vec::new(), metadata: Vec::new() });
        file
    }

    /// Adds a channel as a texture for a renderer: floats in tiles, with mip levels in which a roughness grows by the
    /// variation of the normals averaged away.
    pub(super) fn texture(&mut self, suffix: &str, channel: Channel, samples: Samples, wraps: [bool; 2]) {
        let field = self.field(channel);
        let normal = match channel {
            Channel::Roughness => self.material.get(Channel::Normal),
            Channel::CoatRoughness => self.material.get(Channel::CoatNormal),
            _ => None,
        };
        let mips = match (channel.ty(), normal) {
            (_, Some(_)) => vec![MipFilter::Roughness { normal: 1 }],
            (Type::Normal, _) => vec![MipFilter::Normal],
            _ => vec![MipFilter::Mean; field.channels()],
        };
        self.add(suffix, [Some(&field), normal].into_iter().flatten().cloned().collect(), samples);
        if let Some(map) = self.maps.last_mut() {
            (map.mips, map.metadata) = (mips, texture_attributes(wraps));
        }
    }

    /// Exports a channel separately, and once, if the material has it: as its value, or as a picture under its name. An
    /// anisotropy always gets its angle, because the default angles of programs differ.
    pub(super) fn channel(&mut self, channel: Channel) -> Option<ChannelSource> {
        if let Some((_, source)) = self.known.iter().find(|(known, _)| *known == channel) {
            return Some(source.clone());
        }
        let implied = channel == Channel::AnisotropyAngle && self.has(Channel::Anisotropy);
        let field = self.material.get(channel).cloned().or_else(|| implied.then(|| channel.default_field()))?;
        self.used.push(channel);
        let source = match field.as_constant() {
            Some(values) => ChannelSource::Value(values.iter().map(|value| f64::from(*value)).collect()),
            None => {
                let samples = match (self.colors, channel) {
                    (Colors::Jpeg(quality), Channel::BaseColor | Channel::Emission) => Samples::Jpeg(quality),
                    _ => samples(channel),
                };
                ChannelSource::File(self.add(channel.name(), vec![field], samples))
            }
        };
        self.known.push((channel, source.clone()));
        Some(source)
    }

    /// The pictures that were asked for, with documents, and the channels that were not asked for.
    pub(super) fn bundle(self, documents: Vec<(String, String)>) -> Bundle {
        let channels = self.material.channels().iter().map(|(channel, _)| *channel);
        let lost = channels.filter(|channel| !self.used.contains(channel)).collect();
        Bundle { maps: self.maps, documents, archive: None, lost }
    }
}

/// Distributes rows to several pictures. `planes` holds the channels of all pictures, one picture after another; each
/// writer comes with the number of its channels.
pub(super) fn write_rows<'w>(
    pictures: impl Iterator<Item = (usize, &'w mut Writer)>,
    mut planes: &[&[f32]],
    rows: u32,
) -> Result<(), WriteError> {
    for (channels, writer) in pictures {
        let (own, rest) = planes.split_at(channels.min(planes.len()));
        writer.write_rows(own, rows)?;
        planes = rest;
    }
    Ok(())
}

/// The samples of a channel in a file of its own.
pub(super) fn samples(channel: Channel) -> Samples {
    match channel {
        Channel::BaseColor => Samples::Color,
        Channel::Normal | Channel::CoatNormal => Samples::Fine,
        Channel::Height => Samples::Float,
        Channel::AnisotropyAngle | Channel::Emission | Channel::Ior => Samples::Half,
        _ => Samples::Data,
    }
}

/// A bundle of one picture whose file is named by the stem alone.
pub(super) fn packed(fields: Vec<Field>, place: &ExportContext) -> Bundle {
    let file = format!("{}.png", place.stem);
    let map = Map { file, fields, samples: Samples::Data, mips: Vec::new(), metadata: Vec::new() };
    Bundle { maps: vec![map], ..Bundle::default() }
}

/// The files of a bundle under construction; see [`Writer`]. Dropping the writer leaves no files.
#[derive(Debug)]
pub struct BundleWriter {
    folder: PathBuf,
    bundle: Bundle,
    writers: Vec<Writer>,
}

impl BundleWriter {
    /// Starts the pictures of the given size in pixels; each pixel has the given width and height in mm.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn create(
        folder: &Path,
        bundle: Bundle,
        size: (UVec2, [f32; 2]),
        how: (bool, Compression),
    ) -> Result<Self, WriteError> {
        let start = |map: &Map| {
            let file = bundle.archive.as_ref().unwrap_or(&map.file);
            Writer::create(&folder.join(file), &map.spec(size, how))
        };
        let writers = bundle.maps.iter().map(start).collect::<Result<_, _>>()?;
        Ok(Self { folder: folder.to_owned(), bundle, writers })
    }

    /// Writes the next rows of all pictures. `planes` holds their channels, one picture after another.
    ///
    /// # Errors
    /// As [`Writer::write_rows`].
    pub fn write_rows(&mut self, planes: &[&[f32]], rows: u32) -> Result<(), WriteError> {
        write_rows(self.bundle.maps.iter().map(Map::planes).zip(&mut self.writers), planes, rows)
    }

    /// Completes all files and gives them their names. Removes the documents of the last run first, and writes the new
    /// documents last.
    ///
    /// # Errors
    /// If rows are missing or the system refuses. As long as some files are incomplete, existing files keep their
    /// content.
    pub fn finish(self) -> Result<Vec<WriteStats>, WriteError> {
        let Self { folder, bundle, writers } = self;
        let done = writers.into_iter().map(Writer::finish_unnamed).collect::<Result<Vec<_>, _>>()?;
        let (mut pictures, written): (Vec<AtomicFile>, Vec<WriteStats>) = done.into_iter().unzip();
        if let Some(name) = &bundle.archive {
            let path = folder.join(name);
            let names = bundle.maps.iter().map(|map| map.file.as_str());
            let pictures =
                names.zip(&mut pictures).zip(&written).map(|((name, file), written)| (name, file, written.bytes));
            archive(&path, &bundle.documents, pictures.collect()).map_err(|error| WriteError::at(&path, error))?;
            return Ok(written);
        }
        let document = |(name, text): &(String, String)| {
            let path = folder.join(name);
            let made = AtomicFile::create(&path).and_then(|mut file| file.write_all(text.as_bytes()).map(|()| file));
            made.map_err(|error| WriteError::at(&path, error))
        };
        let documents = bundle.documents.iter().map(document).collect::<Result<Vec<_>, _>>()?;
        set::commit(pictures, documents)?;
        Ok(written)
    }
}
