//! Reads OBJ statement by statement; errors name the first invalid line.
//!
//! One pass checks and collects the parts of surfaces: positions, UVs, normals, faces, and the names of their objects
//! and materials. Files that an OBJ names are never opened. Colours and weights of vertices are ignored.
use super::obj_text::{Statements, fault, index, keyword, name, numbers, words};
use super::polygon::{self, MOST_CORNERS};
use super::{Contents, MOST_TRIANGLES, MOST_VERTICES, Names, ReadError, Surface, wide};
use glam::{DVec3, Vec2, Vec3};
use shibo_kernel::ground::stop::Watch;
use std::rc::Rc;

/// Maximum number of changes of object, group or material.
const MOST_GROUPS: usize = 100_000;

/// Consecutive faces under the same names.
struct Group {
    name: Rc<str>,
    material: Option<Rc<str>>,
    /// Number of faces before it.
    first: usize,
}

/// A corner of a face: numbers of a position, a UV and a normal, counted from 1; 0 for none.
type Corner = [u32; 3];

/// The content of a file.
#[derive(Default)]
struct Lines {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    corners: Vec<Corner>,
    /// Number of corners of each face.
    faces: Vec<u16>,
    triangles: usize,
    groups: Vec<Group>,
    changes: usize,
    /// True if there are points or lines; and if there are curved surfaces.
    others: [bool; 2],
    /// Number of faces with fewer than three corners.
    thin: usize,
    /// The largest numbers that faces refer to, and the lines of these references.
    most: [(i64, usize); 3],
}

impl Lines {
    fn of(file: &[u8], watch: &Watch<'_>) -> Result<Self, ReadError> {
        let first = Group { name: "".into(), material: None, first: 0 };
        let mut all = Self { groups: vec![first], ..Self::default() };
        for statement in watch.over(Statements::new(file)) {
            let (number, text) = statement?;
            all.statement(number, &text)?;
        }
        all.counted(file)?;
        all.finite(file)?;
        Ok(all)
    }

    /// Numbers of positions, UVs and normals so far.
    fn counts(&self) -> [i64; 3] {
        [self.positions.len(), self.uvs.len(), self.normals.len()].map(|count| i64::try_from(count).unwrap_or(i64::MAX))
    }

    /// Refuses references to numbers that do not exist. A file without any UVs or normals may refer to some all the
    /// same, as many files do.
    fn counted(&self, file: &[u8]) -> Result<(), ReadError> {
        let counts = self.counts();
        for (k, what) in ["positions", "UVs", "normals"].into_iter().enumerate() {
            let ((most, line), count) = (self.most[k], counts[k]);
            if most > count && (k == 0 || count > 0) {
                return Err(fault_at(file, line, &format!("it refers to number {most} of {count} {what}")));
            }
        }
        Ok(())
    }

    /// Refuses positions that are not finite, if a face uses them.
    fn finite(&self, file: &[u8]) -> Result<(), ReadError> {
        if self.positions.iter().all(|p| p.is_finite()) {
            return Ok(());
        }
        let used = self.corners.iter().map(|corner| corner[0] as usize);
        let bad = used.filter(|n| self.positions.get(n - 1).is_some_and(|p| !p.is_finite())).min();
        let Some(bad) = bad else { return Ok(()) };
        let vertex = Statements::new(file).flatten().filter(|(_, text)| keyword(text) == b"v").nth(bad - 1);
        let (line, text) = vertex.unwrap_or_default();
        Err(fault(line, &text, "a face has this vertex, so its numbers must be finite"))
    }

    fn statement(&mut self, line: usize, text: &[u8]) -> Result<(), ReadError> {
        match keyword(text) {
            b"v" => {
                // x, y, z, optionally followed by a weight or a colour.
                let found = numbers::<6>(text).filter(|(_, count)| matches!(count, 3 | 4 | 6));
                let ([x, y, z, ..], _) = found.ok_or_else(|| fault(line, text, "it must be `v x y z` in numbers"))?;
                self.positions.push(Vec3::new(x, y, z));
            }
            b"vt" => {
                let found = numbers::<3>(text).filter(|(_, count)| *count >= 1);
                let ([u, v, _], _) = found.ok_or_else(|| fault(line, text, "it must be `vt u v` in numbers"))?;
                self.uvs.push(Vec2::new(u, 1.0 - v));
            }
            b"vn" => {
                let found = numbers::<3>(text).filter(|(_, count)| *count == 3);
                let (normal, _) = found.ok_or_else(|| fault(line, text, "it must be `vn x y z` in numbers"))?;
                self.normals.push(Vec3::from_array(normal));
            }
            b"f" => self.face(line, text)?,
            b"l" | b"p" => self.others[0] = true,
            b"curv" | b"curv2" | b"surf" => self.others[1] = true,
            word @ (b"o" | b"g" | b"usemtl") => self.group(line, text, word == b"usemtl")?,
            _ => return Ok(()),
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

    /// Starts a group, after a change of material, or of object or group.
    fn group(&mut self, line: usize, text: &[u8], of_material: bool) -> Result<(), ReadError> {
        self.changes += 1;
        let new = name(text);
        let first = self.faces.len();
        let last = self.groups.last();
        let (mut name, mut material) =
            last.map_or_else(|| ("".into(), None), |group| (group.name.clone(), group.material.clone()));
        if of_material {
            if new.is_empty() {
                return Err(fault(line, text, "it must name a material"));
            }
            if material.as_ref() == Some(&new) {
                return Ok(());
            }
            material = Some(new);
        } else {
            name = new;
        }
        // Remove a group without faces.
        if last.is_some_and(|group| group.first == first) {
            self.groups.pop();
        }
        self.groups.push(Group { name, material, first });
        Ok(())
    }

    fn face(&mut self, line: usize, text: &[u8]) -> Result<(), ReadError> {
        let (counts, begin) = (self.counts(), self.corners.len());
        for word in words(text) {
            let mut corner = [0; 3];
            for (k, part) in word.split(|byte| *byte == b'/').enumerate() {
                if part.is_empty() && matches!(k, 1 | 2) {
                    continue;
                }
                let Some(index) = index(part).filter(|_| k < 3) else {
                    return Err(fault(line, text, "corners must be `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 1"));
                };
                // Negative numbers count back from the last element.
                let back = index < 0;
                let index = if back { counts[k] + 1 + index } else { index };
                if index < 1 && k > 0 && counts[k] == 0 {
                    self.most[k].1 = line;
                    self.most[k].0 = self.most[k].0.max(1);
                    continue;
                }
                if index < 1 {
                    return Err(fault(line, text, "it counts back beyond the beginning"));
                }
                // Numbers too large for any file are reported at the end.
                corner[k] = u32::try_from(index).unwrap_or(u32::MAX);
                if index > self.most[k].0 {
                    self.most[k] = (index, line);
                }
            }
            self.corners.push(corner);
            if self.corners.len() - begin > MOST_CORNERS {
                return Err(fault(line, text, &format!("a face may have {MOST_CORNERS} corners at most")));
            }
        }
        let corners = self.corners.len() - begin;
        if corners < 3 {
            self.corners.truncate(begin);
            self.thin += 1;
            return Ok(());
        }
        self.faces.push(u16::try_from(corners).unwrap_or(u16::MAX));
        self.triangles += corners - 2;
        Ok(())
    }

    /// Notes about lines that are ignored or changed.
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.thin > 0 {
            notes.push(format!("{} faces have fewer than three corners and are left out", self.thin));
        }
        let counts = self.counts();
        for (k, what) in [(1, "UVs"), (2, "normals")] {
            if counts[k] == 0 && self.most[k].0 > 0 {
                let line = self.most[k].1;
                notes.push(format!("faces refer to {what}, as in line {line}, and there are none"));
            }
        }
        notes
    }
}

/// The error for an invalid statement that begins in a line.
fn fault_at(file: &[u8], line: usize, what: &str) -> ReadError {
    let statement = Statements::new(file).flatten().find(|(number, _)| *number == line);
    fault(line, &statement.unwrap_or_default().1, what)
}

/// Checks a file.
pub(super) fn check(file: &[u8]) -> Result<(), ReadError> {
    let lines = Lines::of(file, &Watch::never())?;
    if lines.triangles == 0 { Err(ReadError::bad("it has no faces; it must be OBJ, or glTF")) } else { Ok(()) }
}

/// Reads a file.
pub(super) fn read(file: &[u8], watch: &Watch<'_>) -> Result<Contents, ReadError> {
    let lines = Lines::of(file, watch)?;
    let mut surface = Surface::default();
    let mut names = Names::default();
    let local = vec![(0, 0); lines.positions.len()];
    let mut faces = Faces { lines: &lines, local, from: 0, at: Vec::new(), watch };
    for (n, group) in lines.groups.iter().enumerate() {
        let end = lines.groups.get(n + 1).map_or(lines.faces.len(), |next| next.first);
        if group.first == end {
            continue;
        }
        let name = match (&*group.name, &group.material) {
            ("", None) => "unnamed_object".to_owned(),
            ("", Some(material)) => material.to_string(),
            (name, Some(material)) => format!("{name}/{material}"),
            (name, None) => name.to_owned(),
        };
        let number = names.part(&name)?;
        let group_number = u32::try_from(n + 1).unwrap_or(u32::MAX);
        let added =
            watch.over(group.first..end).try_for_each(|face| faces.add(&mut surface, face, (group_number, number)));
        added.ok_or_else(|| ReadError::bad("its numbers do not fit together"))?;
    }
    let others = ["lines and points", "curved surfaces"].into_iter().zip(lines.others);
    let left_out = others.filter(|(_, found)| *found).map(|(name, _)| name.to_owned()).collect();
    let (mesh, note) = surface.done(names);
    let notes = lines.notes().into_iter().chain(note).collect();
    Ok(Contents { mesh, metres: false, left_out, notes })
}

/// Makes triangles from faces.
struct Faces<'a> {
    lines: &'a Lines,
    /// For each position, the last group that used it and the number of its vertex in the mesh. Groups share no
    /// vertices at this stage.
    local: Vec<(u32, u32)>,
    /// The first corner of the next face.
    from: usize,
    at: Vec<DVec3>,
    watch: &'a Watch<'a>,
}

impl Faces<'_> {
    /// Adds a face; `None` if one of its numbers does not exist.
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
        // Use UVs only if all corners of the face have them.
        let has_uvs = (0..corners.len()).all(|n| uv(n).is_some());
        let polygon = u32::try_from(face).ok()?;
        polygon::triangles(&self.at, self.watch, |corners| {
            let uvs = has_uvs.then(|| corners.map(|n| uv(n).unwrap_or_default()));
            let normals = corners.map(|n| normal(n).unwrap_or_default());
            surface.add(corners.map(number), (part, polygon), uvs, normals);
        });
        Some(())
    }
}
