//! Writers of bodies. Vertices and triangles are written as they come. Formats with two lists keep the second one in a
//! temporary file beside the first.
use super::super::archive::package;
use super::super::heights::refused_at;
use super::Format;
use crate::value::diagnostics::Code;
use crate::{AtomicFile, WriteError};
use shibo_kernel::body::{Receiver, Vertex};
use std::error::Error;
use std::fmt;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

/// Bytes of buffers.
const BUFFER: usize = 1 << 20;
/// Triangles between two checks for a stop, and for the length of the file.
const CHECK: u64 = 1 << 16;
/// The longest model in a 3MF package, in bytes: its archive has 32 bits for lengths, and the greatest number means
/// another kind of archive, which slicers do not all read.
const LONGEST: u64 = u32::MAX as u64 - 1;

/// The error of a 3MF package whose model would be longer than its archive can state.
#[derive(Clone, Copy, Debug)]
struct TooLong;

impl fmt::Display for TooLong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the body needs more than 4 GiB of text, and a 3MF file holds at most as much")
    }
}

impl Error for TooLong {}

/// The error of a body that cannot be written to `path`.
pub(super) fn unwritten(path: &Path, error: io::Error) -> WriteError {
    match error.get_ref() {
        Some(inner) if inner.is::<TooLong>() => {
            let help = "write `format: Ply` or `Stl`, which take larger bodies, or raise `error`";
            refused_at("format", Code::TooLarge, inner.to_string(), help)
        }
        _ => WriteError::at(path, error),
    }
}

/// A file that counts the bytes written to it.
struct Counted {
    file: BufWriter<AtomicFile>,
    bytes: u64,
}

impl Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.file.write(bytes)?;
        self.bytes += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// A file of a body under construction.
pub(super) struct Body<'a> {
    format: Format,
    /// Triangles of STL, vertices of the others.
    first: Counted,
    /// Triangles; not for STL.
    second: Option<Counted>,
    vertices: u64,
    triangles: u64,
    /// The most bytes of a model in a package.
    longest: u64,
    stop: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> Body<'a> {
    pub(super) fn create(path: &Path, format: Format, stop: &'a (dyn Fn() -> bool + Sync)) -> io::Result<Self> {
        let open = || {
            let file = AtomicFile::create(path)?;
            Ok::<_, io::Error>(Counted { file: BufWriter::with_capacity(BUFFER, file), bytes: 0 })
        };
        let (vertices, triangles, longest) = (0, 0, LONGEST);
        let mut body = Self { format, first: open()?, second: None, vertices, triangles, longest, stop };
        if format != Format::Stl {
            body.second = Some(open()?);
        }
        body.header()?;
        Ok(body)
    }

    /// Writes the header. Its counts have a fixed width, so that it can be written once more at the end.
    fn header(&mut self) -> io::Result<()> {
        let (vertices, triangles) = (self.vertices, self.triangles);
        match self.format {
            Format::Stl => {
                let mut header = [b' '; 80];
                let text = b"Shibo: lengths in mm, z up";
                header[..text.len()].copy_from_slice(text);
                self.first.write_all(&header)?;
                let count = u32::try_from(triangles).map_err(|_| io::Error::other("STL holds fewer triangles"))?;
                self.first.write_all(&count.to_le_bytes())
            }
            Format::Ply => write!(
                self.first,
                "ply\nformat binary_little_endian 1.0\ncomment Shibo: lengths in mm, z up\nelement vertex {vertices:010}\n\
                 property float x\nproperty float y\nproperty float z\nelement face {triangles:010}\n\
                 property list uchar uint vertex_indices\nend_header\n"
            ),
            Format::Obj => self.first.write_all(b"# Shibo: lengths in mm, z up\n"),
            Format::ThreeMf => self.first.write_all(
                b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
                  <model unit=\"millimeter\" xml:lang=\"en-US\" \
                  xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n\
                  <resources><object id=\"1\" type=\"model\"><mesh><vertices>\n",
            ),
        }
    }

    /// Refuses a package whose model is too long, before it fills the disk.
    fn check_length(&self) -> io::Result<()> {
        let bytes = self.first.bytes + self.second.as_ref().map_or(0, |second| second.bytes);
        if self.format == Format::ThreeMf && bytes > self.longest {
            return Err(io::Error::new(io::ErrorKind::InvalidInput, TooLong));
        }
        Ok(())
    }

    /// Completes the file without its name.
    pub(super) fn finish(mut self, path: &Path) -> io::Result<AtomicFile> {
        if let Some(second) = self.second.take() {
            if self.format == Format::ThreeMf {
                self.first.write_all(b"</vertices><triangles>\n")?;
            }
            let mut second = second.file.into_inner().map_err(io::IntoInnerError::into_error)?;
            second.seek(SeekFrom::Start(0))?;
            io::copy(&mut second, &mut self.first)?;
            if self.format == Format::ThreeMf {
                self.first.write_all(
                    b"</triangles></mesh></object></resources><build><item objectid=\"1\"/></build></model>\n",
                )?;
            }
        }
        self.check_length()?;
        if matches!(self.format, Format::Stl | Format::Ply) {
            self.first.file.seek(SeekFrom::Start(0))?;
            self.header()?;
        }
        let is_package = self.format == Format::ThreeMf;
        let mut file = self.first.file.into_inner().map_err(io::IntoInnerError::into_error)?;
        if !is_package {
            return Ok(file);
        }
        file.seek(SeekFrom::Start(0))?;
        package(path, &PARTS, ("3D/3dmodel.model", &mut file))
    }
}

/// The files of a 3MF package beside the model.
const PARTS: [(&str, &str); 2] = [
    (
        "[Content_Types].xml",
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">\
         <Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>\
         <Default Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/>\
         </Types>\n",
    ),
    (
        "_rels/.rels",
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">\
         <Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" \
         Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>\n",
    ),
];

impl Receiver for Body<'_> {
    fn vertex(&mut self, at: [f32; 3]) -> io::Result<()> {
        self.vertices += 1;
        let [x, y, z] = at;
        match self.format {
            Format::Stl => Ok(()),
            Format::Ply => self.first.write_all(bytemuck::cast_slice(&at.map(f32::to_le_bytes))),
            Format::Obj => writeln!(self.first, "v {x} {y} {z}"),
            Format::ThreeMf => writeln!(self.first, "<vertex x=\"{x}\" y=\"{y}\" z=\"{z}\"/>"),
        }
    }

    fn triangle(&mut self, corners: [Vertex; 3]) -> io::Result<()> {
        if self.triangles.is_multiple_of(CHECK) {
            if (self.stop)() {
                return Err(io::ErrorKind::Interrupted.into());
            }
            self.check_length()?;
        }
        self.triangles += 1;
        let [a, b, c] = corners.map(|vertex| vertex.number);
        let Some(second) = &mut self.second else {
            let [p, q, r] = corners.map(|vertex| vertex.at);
            let mut record = [0; 50];
            for (to, value) in record.chunks_exact_mut(4).zip([normal(p, q, r), p, q, r].as_flattened()) {
                to.copy_from_slice(&value.to_le_bytes());
            }
            return self.first.write_all(&record);
        };
        match self.format {
            Format::Ply => {
                let mut record = [3; 13];
                for (to, number) in record[1..].chunks_exact_mut(4).zip([a, b, c]) {
                    to.copy_from_slice(&number.to_le_bytes());
                }
                second.write_all(&record)
            }
            Format::ThreeMf => writeln!(second, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>"),
            _ => writeln!(second, "f {} {} {}", u64::from(a) + 1, u64::from(b) + 1, u64::from(c) + 1),
        }
    }
}

/// The unit normal of a triangle; 0 if it has no area.
fn normal(p: [f32; 3], q: [f32; 3], r: [f32; 3]) -> [f32; 3] {
    let [p, q, r] = [p, q, r].map(|at| glam::DVec3::from(at.map(f64::from)));
    (q - p).cross(r - p).normalize_or_zero().as_vec3().to_array()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    /// A tetrahedron as a file.
    fn written(format: Format) -> Vec<u8> {
        written_within(format, LONGEST).unwrap()
    }

    /// The same, if a model of a package has at most `longest` bytes.
    fn written_within(format: Format, longest: u64) -> Result<Vec<u8>, WriteError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let mut body = Body::create(&path, format, &|| false).unwrap();
        body.longest = longest;
        let places = [[0.0; 3], [1.5, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1e-5]];
        places.iter().for_each(|at| body.vertex(*at).unwrap());
        for corners in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] {
            body.triangle(corners.map(|number: u32| Vertex { number, at: places[number as usize] })).unwrap();
        }
        let made = body.finish(&path).map(|mut file| {
            file.seek(SeekFrom::Start(0)).unwrap();
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes).unwrap();
            bytes
        });
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "no file stays behind");
        made.map_err(|error| unwritten(&path, error))
    }

    /// The text of the model in a package.
    fn model(bytes: &[u8]) -> String {
        let mut text = String::new();
        let mut zip = zip::ZipArchive::new(io::Cursor::new(bytes)).unwrap();
        zip.by_name("3D/3dmodel.model").unwrap().read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn refuses_packages_that_are_too_long_for_their_archive() {
        let whole = written(Format::ThreeMf);
        let length = model(&whole).len() as u64;
        assert_eq!(written_within(Format::ThreeMf, length).unwrap(), whole);
        let Err(WriteError::Unfit(problem)) = written_within(Format::ThreeMf, length - 1) else { panic!("it worked") };
        assert_eq!(problem.code, Code::TooLarge);
        assert!(problem.message.contains("more than 4 GiB") && problem.message.contains("3MF"), "{}", problem.message);
        assert!(problem.help.unwrap().contains("`format: Ply`"));
        // Other formats have no archive.
        for format in [Format::Stl, Format::Ply, Format::Obj] {
            assert_eq!(written_within(format, 1).unwrap(), written(format));
        }
    }

    /// A long list is refused while it is written, not only at its end.
    #[test]
    fn refuses_long_packages_before_they_fill_the_disk() {
        let folder = tempfile::tempdir().unwrap();
        let mut body = Body::create(&folder.path().join("a"), Format::ThreeMf, &|| false).unwrap();
        body.longest = 1000;
        let corners = [0, 1, 2].map(|number| Vertex { number, at: [0.0; 3] });
        let written = (0..=CHECK).try_for_each(|_| body.triangle(corners));
        let error = written.unwrap_err();
        assert!(error.get_ref().is_some_and(|inner| inner.is::<TooLong>()), "{error}");
        assert!(body.triangles <= CHECK);
    }

    #[test]
    fn stl_has_its_count_and_unit_normals() {
        let bytes = written(Format::Stl);
        assert_eq!(bytes.len(), 84 + 4 * 50);
        assert!(!bytes.starts_with(b"solid"));
        assert_eq!(u32::from_le_bytes(bytes[80..84].try_into().unwrap()), 4);
        let numbers: Vec<f32> =
            bytes[84..96].chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(numbers, [0.0, 0.0, -1.0]);
    }

    #[test]
    fn ply_has_its_counts_and_both_lists() {
        let bytes = written(Format::Ply);
        let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let header = std::str::from_utf8(&bytes[..end]).unwrap();
        assert!(
            header.contains("element vertex 0000000004\n") && header.contains("element face 0000000004\n"),
            "{header}"
        );
        assert_eq!(bytes.len() - end, 4 * 12 + 4 * 13);
    }

    #[test]
    fn obj_counts_from_1() {
        let text = String::from_utf8(written(Format::Obj)).unwrap();
        assert!(text.contains("v 0 0 0.00001\nf 1 3 2\n"), "{text}");
    }

    #[test]
    fn packages_have_three_parts_and_no_date() {
        let bytes = written(Format::ThreeMf);
        let zip = zip::ZipArchive::new(io::Cursor::new(&bytes)).unwrap();
        let names: Vec<String> = zip.file_names().map(|name| name.unwrap().into_owned()).collect();
        assert_eq!(names, ["[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"]);
        let text = model(&bytes);
        assert!(
            text.contains("<vertex x=\"1.5\" y=\"0\" z=\"0\"/>") && text.contains("v1=\"2\" v2=\"0\" v3=\"3\""),
            "{text}"
        );
        assert_eq!(bytes, written(Format::ThreeMf));
    }
}
