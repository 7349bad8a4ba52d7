//! [`Image`]: a picture from a file.
//!
//! PNG, JPEG, TIFF, OpenEXR and Radiance HDR. Only the header is read until a pixel is needed. A pixel of the result that covers
//! several pixels of the picture shows their area average, so small results do not alias. Cost: decoding once, then
//! O(pixels).
use super::pixels::{Crop, Pick, PicturePlacement, PictureSource, Pixels};
use super::sheet::{DecodeOptions, Sheet, problem};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_kernel::filter::sample::{Filter, Outside};
use shibo_node::{CanvasFacts, Context, Fact, FilePath, Node, Output, Outputs, Xy, choice, node};
use shibo_picture::{self as picture, ReadLimits};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::files::FileHandle;
use shibo_value::{Field, Grid, PictureFields, Stop, Tiling, Type, Value};
use std::path::Path;
use std::sync::Arc;

/// Meaning of the numbers in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum ColorSpace {
    /// Colour, encoded by the sRGB curve.
    Srgb,
    /// Colour, proportional to light.
    Linear,
    /// Colour of ACEScg: AP1 primaries, proportional to light.
    AcesCg,
    /// Data: heights, masks, normals.
    Raw,
}

/// Values outside the picture.
#[choice]
pub enum Wrap {
    /// The picture is repeated.
    #[default]
    Repeat,
    /// The pixels at its border are repeated.
    Clamp,
}

/// A picture from a file, placed with its corner at the canvas' corner. It can be used as grey and as colour. Nodes
/// that take both use a picture with one channel as grey, and any other picture as colour.
///
/// `check` reads the file to its end without decoding it. Pictures are turned upright: the orientation in a TIFF or in
/// the EXIF data of a JPEG or PNG is applied, and `crop` counts upright pixels. If a TIFF holds several pictures,
/// `Image` reads the first one that is not marked as a smaller version of another. Signed integers in a TIFF become
/// -1..1. Print colours (CMYK) are an error: convert them to RGB.
///
/// **Colours.** Colours become scene-linear Rec. 709. Without `color_space` the file decides. In a PNG the chunk `cICP`
/// has priority, then an ICC profile, then `sRGB`, then `gAMA` and `cHRM`. In a JPEG or TIFF it is the ICC profile, in
/// OpenEXR `chromaticities`. Profiles made of a matrix and curves are applied. For other and damaged profiles, a
/// warning names the assumption. In PQ and HLG, paper white (203 cd/m²) becomes 1. A file without colour information is
/// read as sRGB if it has three or four channels of 8 or 16 bits, and as linear Rec. 709 if they are floats. A single
/// channel is data and stays unchanged, unless it has a grey profile. So normals in integers need `color_space: Raw`.
///
/// **OpenEXR.** Channels are found by their names, in upper or lower case: `R`, `G`, `B` or `red`, `green`, `blue`,
/// then `X`, `Y`, `Z`, pairs of these or `U`, `V`, then `Y`. If names give no order, a warning lists the channels that
/// are used. The picture is the display window; outside the data window it is 0.
///
/// **UDIM.** `path: "skin.<UDIM>.png"` reads the files of all tiles as one picture. Tile 1001 is at its lower left,
/// columns go to the right and rows upwards, up to the last tile that has a file. The files must have the same size and
/// channels. A tile without a file is 0, with a warning.
///
/// At the centre of a pixel of the picture the value is exactly that pixel, with every filter but `BSpline`.
///
/// ```ron
/// "picture": Image(path: "ramp.png", size_mm: (20, 15)),
/// "example": Warp(input: "picture", amount: 1.5, size: 9),
/// ```
///
/// Elsewhere: Substance Designer *Bitmap*; Blender *Image Texture*; Houdini *File*; Material Maker *Image*.
#[node]
pub struct Image {
    /// The file: PNG, JPEG, TIFF, OpenEXR or Radiance HDR; relative to the graph file. `<UDIM>` in its name stands for the numbers of
    /// tiles.
    pub path: FilePath,
    /// Layer or channel of an OpenEXR file: `normal` for channels such as `normal.X`, or `height`. By default its
    /// colours, or the channels closest to colours. Files of other formats have channels `R`, `G`, `B`, `A`, or `Y`.
    pub layer: Option<String>,
    /// The part to use: left column, top row, width and height in pixels. By default the whole picture.
    #[schemars(extend("unit" = "px"))]
    pub crop: Option<(u32, u32, u32, u32)>,
    /// Position of the upper left corner on the canvas.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub position: Xy,
    /// Size of the picture, or of its `crop`, on the canvas; the whole canvas by default.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e6, "unit" = "mm"))]
    pub size_mm: Option<Xy>,
    /// Meaning of the numbers in the file. By default as the file states; otherwise sRGB for colour of 8 and 16 bits,
    /// linear for float colour, and raw for one channel.
    pub color_space: Option<ColorSpace>,
    /// True if the colours in the file are multiplied by its opacity (associated or premultiplied alpha); they are then
    /// divided by it. By default true for OpenEXR, as declared for TIFF, and false for other formats. Write `false` for
    /// data that are packed into four channels of an OpenEXR file.
    pub premultiplied: Option<bool>,
    /// The value that replaces float samples that are NaN or infinite. By default 0, with a warning that names the
    /// first such sample.
    #[schemars(range(min = -1e9, max = 1e9))]
    pub not_finite: Option<f64>,
    /// Interpolation between pixel centres.
    pub filter: Filter,
    /// Values outside the picture.
    pub wrap: Wrap,
}

/// True if a picture has one channel besides its opacity.
fn is_gray(header: &picture::Header) -> bool {
    header.channels == 1 + u8::from(header.has_alpha)
}

impl Image {
    /// Options for reading the files: colours, opacity and samples that are not finite.
    fn reading(&self) -> DecodeOptions {
        let space = self.color_space.map(|space| match space {
            ColorSpace::Srgb => picture::ColorSpace::Srgb,
            ColorSpace::Linear => picture::ColorSpace::Linear,
            ColorSpace::AcesCg => picture::ColorSpace::AcesCg,
            ColorSpace::Raw => picture::ColorSpace::Raw,
        });
        let (layer, premultiplied, not_finite) = (self.layer.clone(), self.premultiplied, self.not_finite);
        DecodeOptions { layer, space, premultiplied, not_finite }
    }

    fn placement(&self, canvas: glam::DVec2, pixels: [u32; 2]) -> PicturePlacement {
        let size = self.size_mm.map_or(canvas, |size| glam::DVec2::new(size.x, size.y));
        let outside = match self.wrap {
            Wrap::Repeat => Outside::Wrap,
            Wrap::Clamp => Outside::Clamp,
        };
        let pitch = size / glam::UVec2::from(pixels).as_dvec2();
        let position = glam::DVec2::new(self.position.x, self.position.y);
        PicturePlacement { position, pitch, filter: self.filter, outside: [outside; 2] }
    }

    /// The crop of a picture of this size.
    fn part(&self, width: u32, height: u32) -> Result<Crop, Problem> {
        let Some((x, y, w, h)) = self.crop else { return Ok(Crop { x: 0, y: 0, width, height }) };
        let fits =
            |at: u32, length: u32, whole: u32| length > 0 && at.checked_add(length).is_some_and(|end| end <= whole);
        if fits(x, w, width) && fits(y, h, height) {
            return Ok(Crop { x, y, width: w, height: h });
        }
        let message = format!(
            "crop is `({x}, {y}, {w}, {h})`, which does not lie within the picture of {width} × {height} pixels"
        );
        let help = "crop takes the left column, the top row, the width and the height";
        Err(Problem::new(Code::OutOfRange, message).at("crop").help(help))
    }

    fn repeats(&self, canvas: glam::DVec2) -> Tiling {
        let size = self.size_mm.map_or(canvas, |size| glam::DVec2::new(size.x, size.y));
        let whole = |n: f64| self.wrap == Wrap::Repeat && (n - n.round()).abs() < 1e-9 * n && n.round() >= 1.0;
        let times = canvas / size;
        Tiling { x: whole(times.x), y: whole(times.y) }
    }
}

impl Node for Image {
    const VERSION: u32 = 3;
    const OUTPUTS: &'static [Output] = &[
        Output::new("image", Type::Picture, "The picture, for ports of either kind."),
        Output::new("rgb", Type::Rgb, "Its colour, scene-linear; grey if it has one channel."),
        Output::new("gray", Type::Gray, "Its luminance; its first channel if it has one or two."),
        Output::new("red", Type::Gray, "Its first channel."),
        Output::new("green", Type::Gray, "Its second channel; the first if there is none."),
        Output::new("blue", Type::Gray, "Its third channel; 0 if it has two, and the first if it has one."),
        Output::new("alpha", Type::Gray, "Its opacity; 1 if it has none."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        self.repeats(canvas.size_mm())
    }

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        vec![("path", &self.path)]
    }

    fn makes_gray(&self, files: &[(&'static str, FileHandle)]) -> bool {
        let header = files.first().and_then(|(_, file)| self.reading().header(file).ok());
        header.is_some_and(|header| is_gray(&header))
    }

    fn takes_udim(&self) -> bool {
        true
    }

    /// Checks the files without decoding: their formats, that they are complete and alike, and that the crop lies
    /// within. Assumptions are advice.
    fn check_files(&self, files: &[(&'static str, FileHandle)]) -> Vec<Problem> {
        // The memory for decoding depends on the run, so no limit is checked here.
        let limits = ReadLimits { max_bytes_decoded: u64::MAX, ..ReadLimits::default() };
        let files: Vec<&FileHandle> = files.iter().map(|(_, file)| file).collect();
        let check = |file: &&FileHandle| picture::check(*file, self.layer.as_deref(), &limits).err();
        let broken: Vec<Problem> = files.iter().filter_map(check).map(|error| problem(&error)).collect();
        if !broken.is_empty() || files.is_empty() {
            return broken;
        }
        let reading = self.reading();
        let checked = Sheet::of(Path::new(&self.path.0), &files, &reading).and_then(|sheet| {
            let header = sheet.header()?;
            self.part(header.width, header.height)?;
            Ok(sheet.assumed(&reading))
        });
        checked.unwrap_or_else(|problem| vec![problem])
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let missing = || Problem::new(Code::MissingInput, "`path` is not given; it must name a picture");
        let paths = cx.files("path");
        let path = *paths.first().ok_or_else(missing)?;
        let reading = self.reading();
        let sheet = Sheet::of(Path::new(&self.path.0), &paths, &reading)?;
        let header = sheet.header()?;
        let crop = self.part(header.width, header.height)?;
        let placement = self.placement(cx.size_mm(), [crop.width, crop.height]);
        let resolution = glam::UVec2::new(crop.width, crop.height);
        let whole = placement.pitch * resolution.as_dvec2() == cx.size_mm() || self.size_mm.is_none();
        let fits = whole && placement.position == glam::DVec2::ZERO;
        let native =
            Grid { origin: placement.position, step: placement.pitch, period: fits.then_some(resolution), shown: None };
        let tiling = self.repeats(cx.size_mm());
        let pixels = Arc::new(Pixels::new(path, (sheet, reading), (&header, crop), cx.evaluator.memory())?);
        let field = |ty: Type, pick: Pick| {
            Field::new(ty, tiling, PictureSource { pixels: pixels.clone(), placement, pick })
                .with_native(native)
                .with_pixels(resolution)
        };
        let alpha = if header.has_alpha { field(Type::Gray, Pick::Alpha) } else { Field::constant(Type::Gray, &[1.0]) };
        let (rgb, gray) = (field(Type::Rgb, Pick::Color), field(Type::Gray, Pick::Gray));
        let picture = PictureFields { gray: gray.clone(), rgb: rgb.clone(), is_gray: is_gray(&header) };
        Ok(Outputs::one(Value::Picture(Arc::new(picture)))
            .with("rgb", rgb)
            .with("gray", gray)
            .with("red", field(Type::Gray, Pick::Channel(0)))
            .with("green", field(Type::Gray, Pick::Channel(1)))
            .with("blue", field(Type::Gray, Pick::Channel(2)))
            .with("alpha", alpha))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, PlainPictures, canvas, check_field, crop, raster, write_tiff};
    use shibo_node::{Call, DynNode};
    use shibo_value::Canvas;
    use shibo_value::{Given, Tile, Window};
    use std::path::PathBuf;

    /// A picture of 16 × 8 pixels of noise with `channels` channels.
    fn file(folder: &Path, name: &str, channels: usize, wrong: Option<f32>) -> (PathBuf, Vec<f32>) {
        let path = folder.join(name);
        let mut planes: Vec<f32> = (0..128 * channels).map(|k| (k * k % 97) as f32 / 97.0).collect();
        if let Some(wrong) = wrong {
            planes[128 + 17] = wrong;
        }
        write_tiff(&path, 16, &["R", "G", "B", "A"][..channels], &planes.chunks_exact(128).collect::<Vec<_>>());
        (path, planes)
    }

    fn outputs(node: &Image, path: &Path) -> Result<Outputs, Stop> {
        let files = [("path", path.into())];
        let canvas = Canvas { size_mm: glam::DVec2::new(32.0, 16.0), ..canvas() };
        DynNode::evaluate(node, &Call { kind: "Image", canvas: &canvas, inputs: &[], files: &files, evaluator: &Plain })
    }

    fn output(outputs: &Outputs, name: &str) -> Field {
        match outputs.take(name, name == "image") {
            Some(Value::Field(field)) => field.clone(),
            Some(Value::Picture(picture)) => picture.rgb.clone(),
            other => panic!("{name}: {other:?}"),
        }
    }

    /// The canvas of [`outputs`], at the picture's resolution.
    fn native() -> Canvas {
        Canvas { size_mm: glam::DVec2::new(32.0, 16.0), resolution: glam::UVec2::new(16, 8), ..canvas() }
    }

    #[test]
    fn its_own_pixels_are_exact() {
        let folder = tempfile::tempdir().unwrap();
        let (path, planes) = file(folder.path(), "a.tif", 4, None);
        let outputs = outputs(&Image::default(), &path).unwrap();
        let rgb = output(&outputs, "image");
        assert_eq!(rgb.native(), Some(native().grid(native().resolution)));
        assert_eq!(raster(&rgb, &native()).data(), &planes[..384]);
        assert_eq!(raster(&output(&outputs, "green"), &native()).data(), &planes[128..256]);
        assert_eq!(raster(&output(&outputs, "alpha"), &native()).data(), &planes[384..]);
        let gray = raster(&output(&outputs, "gray"), &native());
        assert!((gray.data()[5] - (0.2126 * planes[5] + 0.7152 * planes[133] + 0.0722 * planes[261])).abs() < 1e-6);
        let again = crop(&rgb, &native(), Window { x: -32, y: 8, width: 16, height: 8 });
        assert_eq!(again.data(), &planes[..384]);
    }

    #[test]
    fn one_channel_is_grey_and_opaque() {
        let folder = tempfile::tempdir().unwrap();
        let (path, planes) = file(folder.path(), "a.tif", 1, None);
        let outputs = outputs(&Image { color_space: Some(ColorSpace::Raw), ..Image::default() }, &path).unwrap();
        for name in ["gray", "red", "green", "blue"] {
            assert_eq!(raster(&output(&outputs, name), &native()).data(), planes);
        }
        assert_eq!(raster(&output(&outputs, "rgb"), &native()).plane(2), planes);
        assert_eq!(output(&outputs, "alpha").as_constant(), Some(&[1.0][..]));
    }

    #[test]
    fn one_of_several_layers_can_be_taken() {
        let folder = tempfile::tempdir().unwrap();
        let (path, planes) = file(folder.path(), "a.tif", 4, None);
        let node = Image { layer: Some("G".into()), color_space: Some(ColorSpace::Raw), ..Image::default() };
        let outputs = outputs(&node, &path).unwrap();
        for name in ["gray", "red", "blue"] {
            assert_eq!(raster(&output(&outputs, name), &native()).data(), &planes[128..256]);
        }
        assert_eq!(output(&outputs, "alpha").as_constant(), Some(&[1.0][..]));
    }

    #[test]
    fn holds_in_any_window() {
        let folder = tempfile::tempdir().unwrap();
        let (path, _) = file(folder.path(), "a.tif", 3, None);
        for wrap in [Wrap::Repeat, Wrap::Clamp] {
            for size in [0.01, 5.0, 16.0, 1e6] {
                for filter in [Filter::Nearest, Filter::CatmullRom, Filter::BSpline] {
                    let node = Image { size_mm: Some(Xy::new(size, size)), wrap, filter, ..Image::default() };
                    check_field(&output(&outputs(&node, &path).unwrap(), "rgb"));
                    assert_eq!(
                        node.repeats(glam::DVec2::splat(32.0)).x,
                        wrap == Wrap::Repeat && size < 32.0 && size != 5.0
                    );
                }
            }
        }
    }

    #[test]
    fn a_part_can_be_put_anywhere() {
        let folder = tempfile::tempdir().unwrap();
        let (path, planes) = file(folder.path(), "a.tif", 1, None);
        let node = Image {
            crop: Some((3, 2, 4, 5)),
            position: Xy::new(4.0, -2.0),
            size_mm: Some(Xy::new(8.0, 10.0)),
            color_space: Some(ColorSpace::Raw),
            ..Image::default()
        };
        let gray = output(&outputs(&node, &path).unwrap(), "gray");
        // Pixel (1, 2) of the crop is pixel (4, 4) of the file; it lies 1.5 · 2 mm right of and 2.5 · 2 mm below the
        // corner.
        let pixel = crop(&gray, &native(), Window { x: 3, y: 1, width: 1, height: 1 });
        assert_eq!(pixel.data(), &planes[4 * 16 + 4..][..1]);
        let again = crop(&gray, &native(), Window { x: 3 + 4, y: 1 + 5, width: 1, height: 1 });
        assert_eq!(again.data(), pixel.data());
        check_field(&gray);
        for part in [(0, 0, 0, 1), (14, 0, 3, 1), (0, 8, 1, 1), (u32::MAX, 0, 2, 2)] {
            let Err(Stop::Failed(problem)) = outputs(&Image { crop: Some(part), ..node.clone() }, &path) else {
                panic!()
            };
            assert_eq!((problem.code, problem.field.as_deref()), (Code::OutOfRange, Some("crop")));
        }
    }

    #[test]
    fn names_missing_files_and_bad_samples() {
        let folder = tempfile::tempdir().unwrap();
        let fails = |path: &Path| match outputs(&Image::default(), path) {
            Err(Stop::Failed(problem)) => problem,
            other => panic!("{other:?}"),
        };
        let missing = fails(&folder.path().join("none.png"));
        assert_eq!((missing.code, missing.field.as_deref()), (Code::FileNotFound, Some("path")));
        let (path, _) = file(folder.path(), "nan.tif", 3, Some(f32::NAN));
        let rgb = output(&outputs(&Image::default(), &path).unwrap(), "rgb");
        let grid = native().grid(native().resolution);
        assert!(rgb.source().prepare(&grid, &PlainPictures(Vec::new())).is_ok());
        let told = std::cell::RefCell::new(Vec::new());
        let warn = |problem: Problem| told.borrow_mut().push(problem.message);
        let mut tile = Tile::new(grid, Window { x: 0, y: 0, width: 16, height: 8 }, 3);
        rgb.source().fill(&Given::new(&[], None, &|| false).warning(&warn), &mut tile).unwrap();
        let place = "1 of 384 samples are NaN or infinite; 0 is used instead. The first is `NaN` in channel `G` at pixel (1, 1)";
        assert!(told.borrow()[0].contains(place), "{told:?}");
        assert_eq!(tile.plane(1)[17], 0.0);
        let (path, _) = file(folder.path(), "a.tif", 3, None);
        let Err(Stop::Failed(problem)) = outputs(&Image { layer: Some("height".into()), ..Image::default() }, &path)
        else {
            panic!("no error")
        };
        assert_eq!((problem.code, problem.field.as_deref()), (Code::UnknownVariant, Some("layer")));
        assert!(problem.message.contains("must be one of `R`, `G`, `B`"), "{}", problem.message);
    }
}
