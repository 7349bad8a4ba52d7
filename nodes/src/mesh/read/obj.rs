//! OBJ, read by `tobj` line by line, with the checks that it leaves to its callers.
//!
//! A look at all lines comes first: it counts what is there and finds the first line that means nothing, which `tobj` does
//! not name. Of the file only the lines that make surfaces are then handed on; other files that it names are never opened.
use super::polygon::{self, MOST_CORNERS};
use super::{Contents, MOST_TRIANGLES, MOST_VERTICES, ReadError, Surface, part, wide};
use glam::{Vec2, Vec3};
use shibo_engine::picture::caught;
use std::collections::HashMap;
use std::io::{BufRead, Read};
use tobj::{LoadOptions, Material};

/// The most changes of object, group or material.
const MOST_GROUPS: usize = 100_000;
/// The longest part of a line that is shown.
const SHOWN: usize = 60;

/// What a look at all lines found.
#[derive(Default)]
struct Look<'a> {
    positions: usize,
    uvs: usize,
    normals: usize,
    triangles: usize,
    groups: usize,
    lines: bool,
    materials: Vec<&'a str>,
    /// Whether some corners have no UVs, and no normals: `tobj` gives them those of others.
    without: [bool; 2],
    /// The largest numbers that faces refer to, and the lines where they do.
    most: [(i64, usize); 3],
}

/// The lines of a file without their ends.
fn lines(file: &[u8]) -> impl Iterator<Item = &[u8]> {
    file.split(|byte| *byte == b'\n').map(|line| line.strip_suffix(b"\r").unwrap_or(line))
}

/// The first word of a line.
fn keyword(line: &[u8]) -> &[u8] {
    let line = line.trim_ascii_start();
    &line[..line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len())]
}

/// Why a line means nothing.
fn fault(number: usize, line: &[u8], what: &str) -> ReadError {
    let text = String::from_utf8_lossy(line.trim_ascii());
    let more = if text.chars().count() > SHOWN { " …" } else { "" };
    let shown: String = text.chars().take(SHOWN).collect();
    ReadError::Bad(format!("line {number}: `{shown}{more}`: {what}"))
}

/// Whether the first `count` words are finite numbers, and there are no more than `most`.
fn numbers(text: &str, count: usize, most: usize) -> bool {
    let mut words = text.split_whitespace().skip(1);
    let finite = |word: &str| word.parse::<f32>().is_ok_and(f32::is_finite);
    let first = words.by_ref().take(count).filter(|word| finite(word)).count();
    let rest: Vec<&str> = words.take(most + 1).collect();
    first == count && rest.len() <= most - count && rest.iter().all(|word| finite(word))
}

impl<'a> Look<'a> {
    fn at(file: &'a [u8]) -> Result<Self, ReadError> {
        let mut look = Self::default();
        for (number, line) in (1..).zip(lines(file)) {
            look.line(number, line)?;
        }
        let counts = [look.positions, look.uvs, look.normals];
        for ((most, line), (count, what)) in look.most.iter().zip(counts.iter().zip(["positions", "UVs", "normals"])) {
            if *most > i64::try_from(*count).unwrap_or(i64::MAX) {
                let text = lines(file).nth(line - 1).unwrap_or_default();
                return Err(fault(*line, text, &format!("it refers to number {most} of {count} {what}")));
            }
        }
        Ok(look)
    }

    fn line(&mut self, number: usize, line: &'a [u8]) -> Result<(), ReadError> {
        let word = keyword(line);
        if !matches!(word, b"v" | b"vt" | b"vn" | b"f" | b"l" | b"p" | b"o" | b"g" | b"usemtl") {
            return Ok(());
        }
        let text = std::str::from_utf8(line).map_err(|_| fault(number, line, "it is not UTF-8"))?;
        match word {
            b"v" => {
                // x, y, z, and a weight or a colour.
                let count = text.split_whitespace().take(9).count() - 1;
                if !numbers(text, 3, 7) || !matches!(count, 3 | 4 | 6) {
                    return Err(fault(number, line, "it must be `v x y z` with finite numbers"));
                }
                self.positions += 1;
            }
            b"vt" => {
                if !numbers(text, 2, 3) {
                    return Err(fault(number, line, "it must be `vt u v` with finite numbers"));
                }
                self.uvs += 1;
            }
            b"vn" => {
                if !numbers(text, 3, 3) {
                    return Err(fault(number, line, "it must be `vn x y z` with finite numbers"));
                }
                self.normals += 1;
            }
            b"f" => self.face(number, line, text)?,
            b"l" | b"p" => self.lines = true,
            _ => {
                self.groups += 1;
                if word == b"usemtl" {
                    let name = text.split_once(' ').unwrap_or_default().1.trim();
                    if name.is_empty() {
                        return Err(fault(number, line, "it must name a material"));
                    }
                    self.materials.push(name);
                }
            }
        }
        let vertices = self.positions.max(self.uvs).max(self.normals);
        if self.triangles > MOST_TRIANGLES || vertices > MOST_VERTICES || self.groups > MOST_GROUPS {
            let message = format!(
                "it has more than {MOST_TRIANGLES} triangles, {MOST_VERTICES} vertices or {MOST_GROUPS} changes of group"
            );
            return Err(ReadError::TooLarge(message));
        }
        Ok(())
    }

    fn face(&mut self, number: usize, line: &[u8], text: &str) -> Result<(), ReadError> {
        let counts = [self.positions, self.uvs, self.normals];
        let mut corners = 0;
        for word in text.split_whitespace().skip(1) {
            corners += 1;
            let mut parts = 0;
            let mut has = [false; 3];
            for (k, index) in word.split('/').enumerate() {
                parts += 1;
                if index.is_empty() && k > 0 {
                    continue;
                }
                let index = index.parse::<i64>().ok().filter(|index| *index != 0 && k < 3);
                let Some(index) = index else {
                    return Err(fault(
                        number,
                        line,
                        "corners must be `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 1",
                    ));
                };
                if index.saturating_neg() > i64::try_from(counts[k]).unwrap_or(i64::MAX) {
                    return Err(fault(number, line, "it counts back beyond the beginning"));
                }
                has[k] = true;
                if index > self.most[k].0 {
                    self.most[k] = (index, number);
                }
            }
            self.without = [self.without[0] | !has[1], self.without[1] | !has[2]];
            if parts > 3 || corners > MOST_CORNERS {
                return Err(fault(number, line, &format!("a face must have at most {MOST_CORNERS} corners")));
            }
        }
        if corners < 3 {
            return Err(fault(number, line, "a face needs at least 3 corners"));
        }
        self.triangles += corners - 2;
        Ok(())
    }
}

/// Looks through a file.
pub(super) fn check(file: &[u8]) -> Result<(), ReadError> {
    let look = Look::at(file)?;
    if look.triangles == 0 { Err(ReadError::bad("it has no faces; it must be OBJ, or glTF")) } else { Ok(()) }
}

/// The lines of a file that make surfaces, as `tobj` reads them, after one that stands for its materials. Colours of vertices
/// are left out.
struct Surfaces<'a> {
    rest: &'a [u8],
    line: &'a [u8],
    end: &'a [u8],
}

/// A vertex without its colour, if it has one.
fn uncolored(line: &[u8]) -> Option<&[u8]> {
    let starts = |at: &usize| !line[*at].is_ascii_whitespace() && (*at == 0 || line[at - 1].is_ascii_whitespace());
    let mut words = (0..line.len()).filter(starts);
    (keyword(line) == b"v").then(|| words.nth(4))?.filter(|_| words.next().is_some()).map(|at| &line[..at])
}

impl<'a> Surfaces<'a> {
    const fn new(file: &'a [u8]) -> Self {
        Self { rest: file, line: b"mtllib here\n", end: b"" }
    }

    fn next(&mut self) {
        if self.line.is_empty() {
            self.line = std::mem::take(&mut self.end);
        }
        while self.line.is_empty() && !self.rest.is_empty() {
            let end = self.rest.iter().position(|byte| *byte == b'\n').map_or(self.rest.len(), |at| at + 1);
            let (line, rest) = self.rest.split_at(end);
            self.rest = rest;
            if matches!(keyword(line), b"v" | b"vt" | b"vn" | b"f" | b"o" | b"g" | b"usemtl") {
                self.line = line;
                if let Some(colored) = uncolored(line) {
                    (self.line, self.end) = (colored, b"\n");
                }
            }
        }
    }
}

impl Read for Surfaces<'_> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let count = self.fill_buf()?.len().min(out.len());
        out[..count].copy_from_slice(&self.line[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for Surfaces<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        self.next();
        Ok(self.line)
    }

    fn consume(&mut self, amount: usize) {
        self.line = &self.line[amount..];
    }
}

/// Reads a file.
pub(super) fn read(file: &[u8]) -> Result<Contents, ReadError> {
    let look = Look::at(file)?;
    let mut names: Vec<&str> = look.materials.clone();
    names.sort_unstable();
    names.dedup();
    let materials = |_: &std::path::Path| {
        let known = names.iter().enumerate().map(|(n, name)| ((*name).to_owned(), n)).collect();
        Ok((names.iter().map(|name| Material { name: (*name).to_owned(), ..Material::default() }).collect(), known))
    };
    let options = LoadOptions { triangulate: false, single_index: false, ..LoadOptions::default() };
    let load = || tobj::load_obj_buf(&mut Surfaces::new(file), &options, materials);
    let gave_up = || ReadError::bad("its numbers do not fit together");
    let (models, _) = caught(load).ok_or_else(gave_up)?.map_err(|error| ReadError::bad(error.to_string()))?;
    let mut surface = Surface::default();
    let (mut known, mut polygon) = (HashMap::new(), 0);
    for model in models {
        let material = model.mesh.material_id.and_then(|n| names.get(n));
        let name = match (model.name.as_str(), material) {
            ("unnamed_object", Some(material)) => (*material).to_owned(),
            (name, Some(material)) => format!("{name}/{material}"),
            (name, None) => name.to_owned(),
        };
        let number = part(&mut surface.mesh.part_names, &mut known, &name)?;
        add(&mut surface, &model.mesh, number, &mut polygon).ok_or_else(gave_up)?;
    }
    surface.bare_uvs |= look.without[0];
    surface.bare_normals |= look.without[1];
    let left_out = if look.lines { vec!["lines and points".to_owned()] } else { Vec::new() };
    Ok(Contents { mesh: surface.done(), metres: false, left_out })
}

/// Adds the faces of a model; `None` if a number in it leads nowhere.
fn add(surface: &mut Surface, model: &tobj::Mesh, part: u16, polygon: &mut u32) -> Option<()> {
    let first = u32::try_from(surface.mesh.positions.len()).ok()?;
    let (places, _) = model.positions.as_chunks::<3>();
    surface.mesh.positions.extend(places.iter().map(|p| Vec3::from_array(*p)));
    let (uvs, normals) = (model.texcoords.as_chunks::<2>().0, model.normals.as_chunks::<3>().0);
    // Without counts all faces are triangles.
    let triangles = vec![3; if model.face_arities.is_empty() { model.indices.len() / 3 } else { 0 }];
    let mut from = 0;
    for count in model.face_arities.iter().chain(&triangles) {
        let face = from..from + *count as usize;
        from = face.end;
        let corners = model.indices.get(face.clone())?;
        let at: Option<Vec<_>> =
            corners.iter().map(|v| places.get(*v as usize).map(|p| wide(Vec3::from_array(*p)))).collect();
        let uv = |n: usize| {
            let [u, v] = *uvs.get(*model.texcoord_indices.get(face.start + n)? as usize)?;
            Some(Vec2::new(u, 1.0 - v))
        };
        let normal =
            |n: usize| normals.get(*model.normal_indices.get(face.start + n)? as usize).map(|n| Vec3::from_array(*n));
        polygon::triangles(&at?, |[a, b, c]| {
            let uvs = uv(a).zip(uv(b)).zip(uv(c)).map(|((a, b), c)| [a, b, c]);
            let normals = normal(a).zip(normal(b)).zip(normal(c)).map(|((a, b), c)| [a, b, c]);
            surface.add([a, b, c].map(|n| first + corners[n]), (part, *polygon), uvs, normals);
        });
        *polygon += 1;
    }
    Some(())
}
