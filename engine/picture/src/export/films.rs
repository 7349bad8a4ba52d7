//! Films for an etcher: pictures of one bit that open a mask step by step. The etched depths add up to a height.
mod depths;
mod drawing;
mod page;

use super::decl::{FieldDecl, HEIGHT, NumberForm, Numbers, Takes, count, names, number};
use super::heights::{HeightMap, Heights, Maker, Part, Stop, place, refused, told};
use super::target::{ExportTarget, Files, Options, Plan, Source, TargetInfo};
use crate::value::diagnostics::{Code, Problem};
use crate::{Format, PictureSpec, WriteError, write_bilevel};
use glam::{DVec2, UVec2};
use page::{Page, Rectangle, draw, margin_pixels};
use serde_json::json;
use std::io;
use std::path::Path;
use std::sync::Arc;

/// Choice of the depths.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Choice {
    Best,
    Even,
}

const CHOICES: [(&str, Choice); 2] = [("Best", Choice::Best), ("Even", Choice::Even)];

/// Names of the codes; true for binary numbers.
const CODES: [(&str, bool); 2] = [("Nested", false), ("Binary", true)];

const FORMATS: [(&str, Option<Format>); 3] = [("Tiff", Some(Format::Tiff)), ("Svg", None), ("Png", Some(Format::Png))];

const NUMBERED: [&str; 17] =
    ["films", "1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "11", "12", "13", "14", "15", "16"];

/// The height that stays as it is, and the depths below it.
pub(super) const DATUM: FieldDecl = FieldDecl::new(
    "datum",
    "The height that stays as it is, in mm; `Highest` is the greatest height.",
    Takes::Numbers(Numbers::or(NumberForm::One, [-1e6, 1e6], || vec!["Highest"])),
);

/// The target.
pub(super) struct Films;

impl ExportTarget for Films {
    fn info(&self) -> &'static TargetInfo {
        const {
            &TargetInfo {
                name: "Films",
                title: "films",
                doc: "Films of one bit for etching a height in steps.",
                fields: &[
                    HEIGHT,
                    count("films", "The number of films. A list of `depths` has its own number.", [1.0, 16.0], &[4.0]),
                    FieldDecl::new(
                        "depths",
                        "The depths that the films reach together, in mm: with the least error, evenly spaced, or given.",
                        Takes::Numbers(Numbers::or(NumberForm::Rising, [1e-6, 1e4], || names(&CHOICES))),
                    ),
                    FieldDecl::new(
                        "code",
                        "`Nested`: each film opens a part of the film before it. `Binary`: n films give 2ⁿ even depths.",
                        Takes::Words(|| names(&CODES)),
                    ),
                    DATUM,
                    number("margin", "The width of the margin, in mm.", [0.0, 200.0], &[10.0]),
                    FieldDecl::new("marks", "Draws marks for registration into the margin.", Takes::Truth(true)),
                    FieldDecl::new(
                        "tiles",
                        "The number of canvases across and down. The height must tile.",
                        Takes::Numbers(Numbers::new(NumberForm::Counts, [1.0, 1000.0], &[1.0, 1.0])),
                    ),
                    FieldDecl::new("mirror", "Turns the films over, left to right.", Takes::Truth(false)),
                    FieldDecl::new("format", "The format of the films.", Takes::Words(|| names(&FORMATS))),
                ],
                variants: &[],
            }
        }
    }

    fn plan(&self, _: &Options) -> Plan {
        Plan { also: &NUMBERED, ..Plan::several("json") }
    }

    fn check(&self, options: &Options) -> Option<Problem> {
        let tiles: f64 = options.numbers("tiles").unwrap_or_default().iter().product();
        if options.word("format", &FORMATS).is_none() && tiles > drawing::MOST_TILES {
            let message = format!("the drawing has {tiles} tiles; at most {} are allowed", drawing::MOST_TILES);
            let help = "write smaller `tiles`, or pictures: `format: Tiff`";
            return Some(Problem::new(Code::TooLarge, message).at("tiles").help(help));
        }
        let given = options.numbers("depths")?;
        if options.word("code", &CODES) {
            let message = "`code: Binary` has even depths, and `depths` gives others";
            return Some(Problem::new(Code::BadValue, message).at("depths").help("leave `depths` or `code` out"));
        }
        let message = format!("there are {} depths; at most 16 films are made", given.len());
        (given.len() > 16).then(|| Problem::new(Code::BadValue, message).at("depths"))
    }

    fn write(&self, source: &Source<'_>, options: &Options) -> io::Result<Files> {
        let given = options.numbers("depths").map(<[f64]>::to_vec);
        let tiles = options.numbers("tiles").unwrap_or(&[1.0, 1.0]);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole numbers within their range")]
        let (films, tiles) = (
            given.as_ref().map_or(options.number("films").unwrap_or(4.0) as usize, Vec::len),
            UVec2::new(tiles[0] as u32, tiles[1] as u32),
        );
        let maker = FilmMaker {
            stem: source.place.stem.clone(),
            films,
            given,
            choice: options.word("depths", &CHOICES),
            binary: options.word("code", &CODES),
            datum: options.number("datum"),
            margin: options.number("margin").unwrap_or(0.0),
            marks: options.is("marks"),
            tiles,
            mirror: options.is("mirror"),
            format: options.word("format", &FORMATS),
        };
        Ok(Files::Heights(Heights::of(source, Arc::new(maker))))
    }
}

#[derive(Clone, Debug)]
struct FilmMaker {
    stem: String,
    films: usize,
    given: Option<Vec<f64>>,
    choice: Choice,
    binary: bool,
    datum: Option<f64>,
    margin: f64,
    marks: bool,
    tiles: UVec2,
    mirror: bool,
    format: Option<Format>,
}

/// Depths and the films that reach them.
struct Plates {
    datum: f64,
    /// Depth of each level in mm, from 0 on.
    levels: Vec<f64>,
    /// The depth that a film adds.
    steps: Vec<f64>,
    /// The heights below which a level is the nearest one, from level 1 on; they fall.
    limits: Vec<f32>,
}

impl Maker for FilmMaker {
    fn names(&self) -> Vec<String> {
        let films = (1..=self.films).map(|number| self.name(number));
        films.chain([self.document()]).collect()
    }

    fn make(&self, map: &HeightMap, folder: &Path, stop: Stop<'_>) -> Result<Vec<Part>, WriteError> {
        self.check_tiles(map)?;
        let plates = self.plates(map)?;
        let page = Page { inner: map.size_mm * self.tiles.as_dvec2(), margin: self.margin };
        let mut parts = Vec::with_capacity(self.films + 1);
        for number in 1..=self.films {
            let path = folder.join(self.name(number));
            let mut marks = if self.marks { page.marks(number, self.films) } else { Vec::new() };
            if self.mirror {
                let width = page.size().x;
                let turned = |[a, b]: Rectangle| [DVec2::new(width - b.x, a.y), DVec2::new(width - a.x, b.y)];
                marks = marks.into_iter().map(turned).collect();
            }
            parts.push(Part::File(match self.format {
                Some(format) => self.picture(map, &plates, (number, &marks), (format, &path, stop))?,
                None => self.drawing(map, plates.limits[number - 1], (&page, &marks), (&path, stop))?,
            }));
        }
        parts.push(Part::document(&folder.join(self.document()), &self.table(map, &plates, &page))?);
        Ok(parts)
    }
}

impl FilmMaker {
    fn name(&self, number: usize) -> String {
        let extension = match self.format {
            Some(Format::Png) => "png",
            Some(_) => "tif",
            None => "svg",
        };
        format!("{}_{number}.{extension}", self.stem)
    }

    fn document(&self) -> String {
        format!("{}_films.json", self.stem)
    }

    fn check_tiles(&self, map: &HeightMap) -> Result<(), WriteError> {
        for (count, repeats, way) in [(self.tiles.x, map.wraps[0], "across"), (self.tiles.y, map.wraps[1], "down")] {
            if count > 1 && !repeats {
                let message =
                    format!("`tiles` asks for {count} canvases {way}, and the height does not tile in that direction");
                let help =
                    "make the height tile, for example with `MakeTileable`, and the canvas, or leave `tiles` out";
                return Err(refused(Code::DoesNotTile, message, help));
            }
        }
        Ok(())
    }

    /// Chooses the depths.
    fn plates(&self, map: &HeightMap) -> Result<Plates, WriteError> {
        let (datum, (lowest, least)) = (self.datum.unwrap_or(map.range().1), map.lowest());
        let most = datum - least;
        if most <= 0.0 {
            let message = format!("no height lies below the datum of {} mm: there is nothing to etch", told(datum));
            return Err(refused(Code::BadValue, message, "leave `datum` out, or write a greater one"));
        }
        let even = |count: usize| (1..=count).map(|k| most * k as f64 / count as f64).collect();
        let depths: Vec<f64> = match (&self.given, self.choice) {
            _ if self.binary => even((1 << self.films) - 1),
            (Some(given), _) => given.clone(),
            (None, Choice::Even) => even(self.films),
            (None, Choice::Best) => {
                let values = map.values.iter().map(|v| (datum - f64::from(*v)).max(0.0));
                depths::best(values, most, self.films).map_err(|found| {
                    let message = format!("the height has only {found} different depths for {} films", self.films);
                    refused(Code::BadValue, message, format!("write `films: {}`", found.max(1)))
                })?
            }
        };
        let levels: Vec<f64> = std::iter::once(0.0).chain(depths).collect();
        let (deepest, before) = (levels[levels.len() - 1], levels[levels.len() - 2]);
        if self.given.is_some() && most > deepest + 0.5 * (deepest - before) {
            let message = format!(
                "the height is {} mm deep at {}, and the films reach {} mm",
                told(most),
                place(lowest),
                told(deepest)
            );
            let help = format!("add a depth, for example {}, or write a lower `datum`", told(most));
            return Err(refused(Code::TooDeep, message, help));
        }
        let steps = if self.binary {
            (0..self.films).map(|bit| levels[1] * f64::from(1_u32 << bit)).collect()
        } else {
            levels.windows(2).map(|pair| pair[1] - pair[0]).collect()
        };
        #[expect(clippy::cast_possible_truncation, reason = "heights are f32")]
        let limits = levels.windows(2).map(|pair| (datum - 0.5 * (pair[0] + pair[1])) as f32).collect();
        Ok(Plates { datum, levels, steps, limits })
    }

    /// Sets the pixels of a row that a film opens to 1.
    fn open(&self, plates: &Plates, number: usize, heights: &[f32], out: &mut [u8]) {
        if self.binary {
            for (out, v) in out.iter_mut().zip(heights) {
                let level = plates.limits.partition_point(|limit| *limit >= *v);
                *out = u8::from(level >> (number - 1) & 1 == 1);
            }
        } else {
            let limit = plates.limits[number - 1];
            out.iter_mut().zip(heights).for_each(|(out, v)| *out = u8::from(*v <= limit));
        }
    }

    fn picture(
        &self,
        map: &HeightMap,
        plates: &Plates,
        (number, marks): (usize, &[Rectangle]),
        (format, path, stop): (Format, &Path, Stop<'_>),
    ) -> Result<crate::AtomicFile, WriteError> {
        let margin = margin_pixels(self.margin, map.pixel);
        let inner = map.size.checked_mul(self.tiles).filter(|inner| inner.max_element() < 1 << 30);
        let Some(inner) = inner else {
            let message = "the films have more than 2^30 pixels a side";
            return Err(refused(Code::TooLarge, message, "write a smaller `tiles`, or lower the resolution"));
        };
        let size = inner + 2 * margin;
        let mut spec = PictureSpec::bilevel((size.x, size.y), format, map.pixel.as_vec2().to_array());
        (spec.metadata, spec.compression) = (map.metadata.clone(), map.compression);
        write_bilevel::write(path, &spec, stop, |y, row| {
            if let Some(y) = y.checked_sub(margin.y).filter(|y| *y < inner.y) {
                let inside = &mut row[margin.x as usize..][..inner.x as usize];
                let (first, others) = inside.split_at_mut(map.size.x as usize);
                self.open(plates, number, map.row(y % map.size.y), first);
                if self.mirror {
                    first.reverse();
                }
                others.chunks_mut(map.size.x as usize).for_each(|other| other.copy_from_slice(first));
            }
            marks.iter().for_each(|mark| draw(mark, y, map.pixel, row));
        })
    }

    /// The depths, how far the etched depth differs from the height, and the marks.
    fn table(&self, map: &HeightMap, plates: &Plates, page: &Page) -> String {
        let (mut worst, mut squares) = (0.0_f64, 0.0);
        for v in &map.values {
            let level = plates.limits.partition_point(|limit| *limit >= *v);
            let off = plates.levels[level] - (plates.datum - f64::from(*v)).max(0.0);
            worst = worst.max(off.abs());
            squares += off * off;
        }
        let rounded = |v: f64| (v * 1e6).round() / 1e6;
        let round = |list: &[f64]| list.iter().map(|v| rounded(*v)).collect::<Vec<_>>();
        let films: Vec<_> = (1..=self.films)
            .map(|number| json!({ "file": self.name(number), "step_mm": rounded(plates.steps[number - 1]) }))
            .collect();
        let size = page.size();
        let crosses = if self.marks && self.margin > 0.0 { page.crosses().to_vec() } else { Vec::new() };
        let crosses: Vec<_> = crosses.iter().map(|at| round(&at.to_array())).collect();
        let table = json!({
            "code": if self.binary { "Binary" } else { "Nested" },
            "datum_mm": rounded(plates.datum),
            "depths_mm": round(&plates.levels),
            "films": films,
            "greatest_error_mm": rounded(worst),
            "rms_error_mm": rounded((squares / map.values.len().max(1) as f64).sqrt()),
            "page_mm": round(&size.to_array()),
            "margin_mm": self.margin,
            "mirror": self.mirror,
            "crosses_mm": crosses,
        });
        format!("{table:#}\n")
    }
}

#[cfg(test)]
mod tests;
