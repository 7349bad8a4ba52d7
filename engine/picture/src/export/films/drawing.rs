//! A film as areas, in mm.
use super::super::heights::{HeightMap, Stop, file_of, refused};
use super::super::lines::{Line, outlines, write_path};
use super::FilmMaker;
use super::page::{Page, Rectangle};
use crate::value::diagnostics::Code;
use crate::{AtomicFile, WriteError, write_svg};
use glam::DVec2;
use std::io::{self, Write};
use std::path::Path;

/// The most tiles of a drawing: a line of about 50 bytes each.
pub(super) const MOST_TILES: f64 = 100_000.0;

impl FilmMaker {
    /// The areas at most as high as `limit`, as a file without its name. Several tiles share one path.
    pub(super) fn drawing(
        &self,
        map: &HeightMap,
        limit: f32,
        (page, marks): (&Page, &[Rectangle]),
        (path, stop): (&Path, Stop<'_>),
    ) -> Result<AtomicFile, WriteError> {
        if self.binary {
            let message = "`code: Binary` writes pictures, because its films are not areas below a height";
            return Err(refused(Code::BadValue, message, "write `format: Tiff`"));
        }
        let areas = outlines(map, f64::from(limit), stop)?.ok_or(io::ErrorKind::Interrupted);
        let areas = areas.map_err(|error| WriteError::at(path, error.into()))?;
        file_of(path, |out| self.draw(map, &areas, (page, marks), (out, stop)))
    }

    fn draw(
        &self,
        map: &HeightMap,
        areas: &[Line],
        (page, marks): (&Page, &[Rectangle]),
        (out, stop): (&mut dyn Write, Stop<'_>),
    ) -> io::Result<()> {
        out.write_all(write_svg::opened(DVec2::ZERO, page.size()).as_bytes())?;
        let is_alone = self.tiles.element_product() == 1;
        if !is_alone {
            out.write_all(b"<defs><path id=\"tile\" d=\"")?;
            write_path(out, areas)?;
            out.write_all(b"\"/></defs>\n")?;
        }
        let (m, w) = (self.margin, page.inner.x);
        let turn =
            if self.mirror { format!("translate({} {m}) scale(-1 1)", m + w) } else { format!("translate({m} {m})") };
        // Programs older than SVG 2 know `xlink:href` only, and the others know it too.
        let link = if is_alone { "" } else { " xmlns:xlink=\"http://www.w3.org/1999/xlink\"" };
        writeln!(out, "<g{link} transform=\"{turn}\" fill=\"black\" fill-rule=\"evenodd\">")?;
        if is_alone {
            out.write_all(b"<path transform=\"translate(0 0)\" d=\"")?;
            write_path(out, areas)?;
            out.write_all(b"\"/>\n")?;
        } else {
            for y in 0..self.tiles.y {
                if stop() {
                    return Err(io::ErrorKind::Interrupted.into());
                }
                for x in 0..self.tiles.x {
                    let at = DVec2::new(f64::from(x), f64::from(y)) * map.size_mm;
                    writeln!(out, "<use xlink:href=\"#tile\" x=\"{}\" y=\"{}\"/>", at.x, at.y)?;
                }
            }
        }
        out.write_all(b"</g>\n<g fill=\"black\">\n")?;
        for [low, high] in marks {
            let size = *high - *low;
            writeln!(
                out,
                "<rect x=\"{:.3}\" y=\"{:.3}\" width=\"{:.3}\" height=\"{:.3}\"/>",
                low.x, low.y, size.x, size.y
            )?;
        }
        out.write_all(b"</g>\n</svg>\n")
    }
}
