//! OBJ, read line by line; the first line that means nothing is named.
//!
//! One pass checks and keeps what makes surfaces: positions, UVs, normals, faces, and the names of their objects and materials.
//! Other files that are named are never opened. Colours and weights of vertices are left out.
use super::polygon::{self, MOST_CORNERS};
use super::{Contents, MOST_TRIANGLES, MOST_VERTICES, ReadError, Surface, part, wide};
use glam::{DVec3, Vec2, Vec3};
use shibo_kernel::ground::stop::Watch;
use std::collections::HashMap;

/// The most changes of object, group or material.
const MOST_GROUPS: usize = 100_000;
/// The longest part of a line that is shown.
const SHOWN: usize = 60;

/// Faces that follow each other under the same names.
struct Group<'a> {
    name: &'a str,
    material: Option<&'a str>,
    /// How many faces come before it.
    first: usize,
}

/// The corners of a face: numbers of a position, a UV and a normal, counted from 1; 0 for none.
type Corner = [u32; 3];

/// What the lines of a file say.
#[derive(Default)]
struct Lines<'a> {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    corners: Vec<Corner>,
    /// How many corners each face has.
    faces: Vec<u16>,
    triangles: usize,
    groups: Vec<Group<'a>>,
    changes: usize,
    lines: bool,
    /// Whether some corners have no UVs, and no normals.
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

/// The numbers after the keyword, at most `N`, which must be finite; and how many there are.
fn numbers<const N: usize>(text: &str) -> Option<([f32; N], usize)> {
    let (mut found, mut count) = ([0.0; N], 0);
    for word in text.split_ascii_whitespace().skip(1) {
        *found.get_mut(count)? = word.parse().ok().filter(|number: &f32| number.is_finite())?;
        count += 1;
    }
    Some((found, count))
}

/// A whole number in as many digits as indices need, which is not 0.
fn index(word: &[u8]) -> Option<i64> {
    let (back, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    let whole = !digits.is_empty() && digits.len() <= 18 && digits.iter().all(u8::is_ascii_digit);
    let value = whole.then(|| digits.iter().fold(0_i64, |sum, digit| 10 * sum + i64::from(digit - b'0')))?;
    (value != 0).then_some(if back { -value } else { value })
}

impl<'a> Lines<'a> {
    fn of(file: &'a [u8], watch: &Watch<'_>) -> Result<Self, ReadError> {
        let mut all = Self { groups: vec![Group { name: "", material: None, first: 0 }], ..Self::default() };
        for (number, line) in watch.over((1..).zip(lines(file))) {
            all.line(number, line)?;
        }
        let counts = all.counts();
        for ((most, line), (count, what)) in all.most.iter().zip(counts.iter().zip(["positions", "UVs", "normals"])) {
            if *most > *count {
                let text = lines(file).nth(line - 1).unwrap_or_default();
                return Err(fault(*line, text, &format!("it refers to number {most} of {count} {what}")));
            }
        }
        Ok(all)
    }

    /// How many positions, UVs and normals there are so far.
    fn counts(&self) -> [i64; 3] {
        [self.positions.len(), self.uvs.len(), self.normals.len()].map(|count| i64::try_from(count).unwrap_or(i64::MAX))
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
                let found = numbers::<6>(text).filter(|(_, count)| matches!(count, 3 | 4 | 6));
                let ([x, y, z, ..], _) =
                    found.ok_or_else(|| fault(number, line, "it must be `v x y z` with finite numbers"))?;
                self.positions.push(Vec3::new(x, y, z));
            }
            b"vt" => {
                let found = numbers::<3>(text).filter(|(_, count)| *count >= 2);
                let ([u, v, _], _) =
                    found.ok_or_else(|| fault(number, line, "it must be `vt u v` with finite numbers"))?;
                self.uvs.push(Vec2::new(u, 1.0 - v));
            }
            b"vn" => {
                let found = numbers::<3>(text).filter(|(_, count)| *count == 3);
                let (normal, _) =
                    found.ok_or_else(|| fault(number, line, "it must be `vn x y z` with finite numbers"))?;
                self.normals.push(Vec3::from_array(normal));
            }
            b"f" => self.face(number, line, text)?,
            b"l" | b"p" => self.lines = true,
            _ => self.group(number, line, text.trim())?,
        }
        let vertices = self.positions.len().max(self.uvs.len()).max(self.normals.len());
        if self.triangles > MOST_TRIANGLES || vertices > MOST_VERTICES || self.changes > MOST_GROUPS {
            let message = format!(
                "it has more than {MOST_TRIANGLES} triangles, {MOST_VERTICES} vertices or {MOST_GROUPS} changes of group"
            );
            return Err(ReadError::TooLarge(message));
        }
        Ok(())
    }

    /// A change of object, of group or of material.
    fn group(&mut self, number: usize, line: &[u8], text: &'a str) -> Result<(), ReadError> {
        self.changes += 1;
        let (word, name) = text.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((text, ""));
        let name = name.trim();
        let first = self.faces.len();
        let last = self.groups.last();
        let (mut named, mut material) = last.map_or(("", None), |group| (group.name, group.material));
        if word == "usemtl" {
            if name.is_empty() {
                return Err(fault(number, line, "it must name a material"));
            }
            if material == Some(name) {
                return Ok(());
            }
            material = Some(name);
        } else {
            named = name;
        }
        // What has no faces is no group.
        if last.is_some_and(|group| group.first == first) {
            self.groups.pop();
        }
        self.groups.push(Group { name: named, material, first });
        Ok(())
    }

    fn face(&mut self, number: usize, line: &[u8], text: &str) -> Result<(), ReadError> {
        let counts = self.counts();
        let mut corners = 0;
        for word in text.split_ascii_whitespace().skip(1) {
            corners += 1;
            let mut parts = 0;
            let mut corner = [0; 3];
            for (k, part) in word.as_bytes().split(|byte| *byte == b'/').enumerate() {
                parts += 1;
                if part.is_empty() && k > 0 {
                    continue;
                }
                let Some(index) = index(part).filter(|_| k < 3) else {
                    return Err(fault(
                        number,
                        line,
                        "corners must be `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 1",
                    ));
                };
                // Negative numbers count back.
                let index = if index < 0 { counts[k] + 1 + index } else { index };
                if index < 1 {
                    return Err(fault(number, line, "it counts back beyond the beginning"));
                }
                // What is too large for any file is told at the end.
                corner[k] = u32::try_from(index).unwrap_or(u32::MAX);
                if index > self.most[k].0 {
                    self.most[k] = (index, number);
                }
            }
            self.without = [self.without[0] | (corner[1] == 0), self.without[1] | (corner[2] == 0)];
            if parts > 3 || corners > MOST_CORNERS {
                return Err(fault(number, line, &format!("a face must have at most {MOST_CORNERS} corners")));
            }
            self.corners.push(corner);
        }
        if corners < 3 {
            return Err(fault(number, line, "a face needs at least 3 corners"));
        }
        self.faces.push(u16::try_from(corners).unwrap_or(u16::MAX));
        self.triangles += corners - 2;
        Ok(())
    }
}

/// Looks through a file.
pub(super) fn check(file: &[u8]) -> Result<(), ReadError> {
    let lines = Lines::of(file, &Watch::never())?;
    if lines.triangles == 0 { Err(ReadError::bad("it has no faces; it must be OBJ, or glTF")) } else { Ok(()) }
}

/// Reads a file.
pub(super) fn read(file: &[u8], watch: &Watch<'_>) -> Result<Contents, ReadError> {
    let lines = Lines::of(file, watch)?;
    let mut surface = Surface::default();
    let mut known = HashMap::new();
    let mut faces = Faces { lines: &lines, local: vec![(0, 0); lines.positions.len()], from: 0, at: Vec::new() };
    for (n, group) in lines.groups.iter().enumerate() {
        let end = lines.groups.get(n + 1).map_or(lines.faces.len(), |next| next.first);
        if group.first == end {
            continue;
        }
        let name = match (group.name, group.material) {
            ("", None) => "unnamed_object".to_owned(),
            ("", Some(material)) => material.to_owned(),
            (name, Some(material)) => format!("{name}/{material}"),
            (name, None) => name.to_owned(),
        };
        let number = part(&mut surface.mesh.part_names, &mut known, &name)?;
        let group_number = u32::try_from(n + 1).unwrap_or(u32::MAX);
        let added =
            watch.over(group.first..end).try_for_each(|face| faces.add(&mut surface, face, (group_number, number)));
        added.ok_or_else(|| ReadError::bad("its numbers do not fit together"))?;
    }
    surface.bare_uvs |= lines.without[0];
    surface.bare_normals |= lines.without[1];
    let left_out = if lines.lines { vec!["lines and points".to_owned()] } else { Vec::new() };
    Ok(Contents { mesh: surface.done(watch), metres: false, left_out })
}

/// Makes triangles of faces.
struct Faces<'a> {
    lines: &'a Lines<'a>,
    /// For each position the last group that used it, and its number in the mesh: groups share no vertices yet.
    local: Vec<(u32, u32)>,
    /// The first corner of the next face.
    from: usize,
    at: Vec<DVec3>,
}

impl Faces<'_> {
    /// Adds a face; `None` if a number in it leads nowhere.
    fn add(&mut self, surface: &mut Surface, face: usize, (group, part): (u32, u16)) -> Option<()> {
        let lines = self.lines;
        let from = self.from;
        self.from += usize::from(*lines.faces.get(face)?);
        let corners = lines.corners.get(from..self.from)?;
        self.at.clear();
        for [position, ..] in corners {
            let position = (*position as usize).checked_sub(1)?;
            let (place, local) = (lines.positions.get(position)?, self.local.get_mut(position)?);
            if local.0 != group {
                *local = (group, u32::try_from(surface.mesh.positions.len()).ok()?);
                surface.mesh.positions.push(*place);
            }
            self.at.push(wide(*place));
        }
        let number = |n: usize| self.local[corners[n][0] as usize - 1].1;
        let uv = |n: usize| lines.uvs.get((corners[n][1] as usize).wrapping_sub(1)).copied();
        let normal = |n: usize| lines.normals.get((corners[n][2] as usize).wrapping_sub(1)).copied();
        let polygon = u32::try_from(face).ok()?;
        polygon::triangles(&self.at, |[a, b, c]| {
            let uvs = uv(a).zip(uv(b)).zip(uv(c)).map(|((a, b), c)| [a, b, c]);
            let normals = normal(a).zip(normal(b)).zip(normal(c)).map(|((a, b), c)| [a, b, c]);
            surface.add([a, b, c].map(number), (part, polygon), uvs, normals);
        });
        Some(())
    }
}
