//! [`LoadMesh`]: a mesh from a file.
//!
//! Files are read by [`read`]. Then units and axes are converted to mm and z up, corners at the same place are merged,
//! triangles without area are dropped, and the triangles of each piece are oriented alike. Cost: about 1 µs a triangle
//! of OBJ, a third of that of glTF.
use super::read::{self, Contents, MOST_TRIANGLES, ReadError};
use glam::{DVec3, Vec3};
use shibo_kernel::ground::stop::{Watch, unwind_when};
use shibo_kernel::mesh::topology;
use shibo_node::{CanvasFacts, Context, Fact, FilePath, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem, suggest};
use shibo_value::files::FileHandle;
use shibo_value::{Mesh, Stop, Type};

mod gaps;

/// Unit of a file.
#[choice]
pub enum LengthUnit {
    /// Metres in glTF, as its standard defines; millimetres in OBJ, which defines no unit.
    #[default]
    Auto,
    /// Millimetres.
    Mm,
    /// Centimetres.
    Cm,
    /// Metres.
    M,
    /// Inches.
    Inch,
}

/// The axis of a file that points up.
#[choice]
pub enum UpAxis {
    /// y, as in glTF and in most OBJ.
    #[default]
    Y,
    /// z.
    Z,
}

/// The point of a mesh that is moved to the origin.
#[choice]
pub enum Center {
    /// None: the mesh stays in place.
    #[default]
    None,
    /// The middle of the bounding box.
    Bounds,
    /// The middle of the bottom of the bounding box.
    Base,
}

/// A mesh from an OBJ or glTF file, in mm, z up.
///
/// Objects and materials of the file become parts. The materials themselves, pictures, animations, skins, cameras and
/// lights are ignored. Files may have up to 512 MiB and 2 million triangles; glTF 2.0 must be uncompressed. All
/// instances of a glTF (`EXT_mesh_gpu_instancing`) are made, and `KHR_texture_transform` moves UVs, unless a texture
/// only repeats. Only the files named here are read.
///
/// If only some faces have UVs, the others get no place in the picture. Corners without a normal get the normal of the
/// surface around them. A warning counts such faces.
///
/// ```ron
/// "cube": LoadMesh(path: "cube.obj", up: Z),
/// "atlas": MeshAtlas(mesh: "cube"),
/// "example": BakeNormal(atlas: "atlas"),
/// ```
///
/// Elsewhere: Blender *Import*; Houdini *File*; Substance Designer *3D scene*.
#[node]
pub struct LoadMesh {
    /// The file: `.obj`, `.glb` or `.gltf`; relative to the graph file.
    pub path: FilePath,
    /// The `.bin` file beside a `.gltf`, if its numbers are stored there.
    pub buffer: Option<FilePath>,
    /// The unit of lengths in the file.
    #[default(LengthUnit::Auto)]
    pub unit: LengthUnit,
    /// The axis of the file that points up.
    #[default(UpAxis::Y)]
    pub up: UpAxis,
    /// Additional factor on all lengths.
    #[schemars(range(min = 1e-6, max = 1e6))]
    #[default(1.0)]
    pub scale: f64,
    /// The point of the mesh that is moved to the origin.
    #[default(Center::None)]
    pub center: Center,
    /// The set of UVs to use, if a glTF has several: the number of `TEXCOORD_0`, `TEXCOORD_1`, …
    #[schemars(range(max = 15))]
    pub uv_set: u32,
    /// The only part to load: the name of an object, a mesh or a material. By default all parts.
    pub part: String,
    /// Corners at most this far apart are merged. 0 merges only corners at the same place.
    #[schemars(range(min = 0, max = 10), extend("unit" = "mm"))]
    pub weld: f64,
}

/// Largest distance of a vertex from the origin, in mm.
const FARTHEST: f64 = 1e7;

/// The problem for a file that cannot be read, at the parameter that names it.
fn problem(path: &FileHandle, error: &ReadError) -> Problem {
    let (code, field) = match error {
        ReadError::NotFound(_) => (Code::FileNotFound, "path"),
        ReadError::Bad(_) => (Code::BadFile, "path"),
        ReadError::TooLarge(_) => (Code::TooLarge, "path"),
        ReadError::NoBuffer(_) => (Code::MissingInput, "path"),
        ReadError::NoUvs(_) => (Code::BadValue, "uv_set"),
    };
    let problem = Problem::new(code, format!("`{}`: {error}", path.display())).at(field);
    match error {
        ReadError::NoBuffer(_) => problem.help("name that file with `buffer`, or export as `.glb`"),
        ReadError::TooLarge(_) => problem.help(format!("a mesh may have {MOST_TRIANGLES} triangles and 512 MiB")),
        _ => problem,
    }
}

/// The file of a parameter.
fn file<'a>(files: &'a [(&'static str, FileHandle)], name: &str) -> Option<&'a FileHandle> {
    files.iter().find(|(field, _)| *field == name).map(|(_, file)| file)
}

impl LoadMesh {
    /// Millimetres of one unit of the file.
    fn unit_mm(&self, metres: bool) -> f64 {
        let unit = match self.unit {
            LengthUnit::Auto if metres => 1000.0,
            LengthUnit::Auto | LengthUnit::Mm => 1.0,
            LengthUnit::Cm => 10.0,
            LengthUnit::M => 1000.0,
            LengthUnit::Inch => 25.4,
        };
        unit * self.scale
    }

    /// Keeps only the triangles of the selected part.
    fn keep_part(&self, mesh: &mut Mesh) -> Result<(), Problem> {
        if self.part.is_empty() {
            return Ok(());
        }
        let wanted = |name: &String| *name == self.part || name.split('/').any(|word| word == self.part);
        let chosen: Vec<bool> = mesh.part_names.iter().map(wanted).collect();
        if !chosen.iter().any(|chosen| *chosen) {
            let mut words: Vec<&str> = mesh.part_names.iter().flat_map(|name| name.split('/')).collect();
            words.sort_unstable();
            words.dedup();
            let message = format!("the file has no part `{}`", self.part);
            return Err(Problem::new(Code::BadValue, message).at("part").help(suggest(&self.part, "part", &words)));
        }
        topology::keep(mesh, |n, mesh| chosen.get(usize::from(mesh.parts[n])).copied().unwrap_or(false));
        // Renumber the parts.
        let mut count = 0;
        let number = |chosen: &bool| {
            let number = count;
            count += u16::from(*chosen);
            number
        };
        let numbers: Vec<u16> = chosen.iter().map(number).collect();
        mesh.parts.iter_mut().for_each(|part| *part = numbers[usize::from(*part)]);
        let mut chosen = chosen.iter();
        mesh.part_names.retain(|_| chosen.next().is_some_and(|chosen| *chosen));
        Ok(())
    }

    /// Converts units and axes, and moves the mesh to the origin.
    fn place(&self, mesh: &mut Mesh, metres: bool, watch: &Watch<'_>) -> Result<(), Problem> {
        let (unit, up) = (self.unit_mm(metres), self.up);
        let turn = |p: DVec3| if up == UpAxis::Y { DVec3::new(p.x, -p.z, p.y) } else { p };
        for (n, p) in watch.over(mesh.positions.iter_mut().enumerate()) {
            let at = turn(p.as_dvec3()) * unit;
            if !at.is_finite() || at.abs().max_element() > FARTHEST {
                let message =
                    format!("vertex {n} lies at ({}, {}, {}) mm; it must lie within ±{FARTHEST:e}", at.x, at.y, at.z);
                return Err(Problem::new(Code::BadFile, message).at("path").help("look at `unit` and `scale`"));
            }
            *p = at.as_vec3();
        }
        watch.over(&mut mesh.normals).flatten().for_each(|n| *n = turn(n.as_dvec3()).as_vec3());
        let [low, high] = mesh.bounds();
        let middle = 0.5 * (low + high);
        let origin = match self.center {
            Center::None => return Ok(()),
            Center::Bounds => middle,
            Center::Base => DVec3::new(middle.x, middle.y, low.z),
        };
        mesh.positions.iter_mut().for_each(|p: &mut Vec3| *p = (p.as_dvec3() - origin).as_vec3());
        Ok(())
    }

    /// The mesh made from the contents of a file, and warnings about it.
    pub(super) fn made(&self, contents: Contents, watch: &Watch<'_>) -> Result<(Mesh, Vec<Problem>), Problem> {
        let Contents { mut mesh, metres, left_out, notes } = contents;
        let mut advice = Vec::new();
        let mut tell = |message: String| advice.push(Problem::new(Code::Advice, message).at("path"));
        notes.into_iter().for_each(&mut tell);
        self.keep_part(&mut mesh)?;
        // Drop vertices without a triangle, which may lie anywhere.
        topology::keep(&mut mesh, |_, _| true);
        self.place(&mut mesh, metres, watch)?;
        let dropped = topology::weld(&mut mesh, self.weld, watch);
        if mesh.triangles.is_empty() {
            let message = "none of its triangles has an area";
            return Err(Problem::new(Code::BadFile, message).at("path"));
        }
        if dropped > 0 {
            tell(format!("{dropped} triangles have no area and are left out"));
        }
        topology::orient(&mut mesh, watch);
        let found = topology::watched(&mesh.triangles, watch);
        if found.crowded > 0 {
            tell(format!("{} edges have more than two triangles; the surface ends there", found.crowded));
        }
        if found.twisted > 0 {
            tell("a piece has no outside, as a Möbius strip; the surface is cut where its sides meet".into());
        }
        if !left_out.is_empty() {
            tell(format!("left out: {}", left_out.join(", ")));
        }
        advice.extend(gaps::uvs(&mut mesh));
        advice.extend(gaps::normals(&mut mesh, watch));
        advice.extend(size_advice(&mesh));
        Ok((mesh, advice))
    }
}

/// Advice about a mesh that seems to have another unit.
fn size_advice(mesh: &Mesh) -> Option<Problem> {
    let [low, high] = mesh.bounds();
    let largest = (high - low).max_element();
    let help = match largest {
        ..1.0 => "is the file in metres? `unit: M`",
        20_000.0.. => "is it in millimetres? `unit: Mm`",
        _ => return None,
    };
    let message = format!("its largest side is {largest:.4} mm");
    Some(Problem::new(Code::Advice, message).at("unit").help(help))
}

impl Node for LoadMesh {
    const OUTPUTS: &'static [Output] = &[Output::new("mesh", Type::Mesh, "The mesh.")];
    const FACTS: &'static [Fact] = &[];
    const VERSION: u32 = 2;

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        Vec::new()
    }

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        let buffer = self.buffer.iter().map(|buffer| ("buffer", buffer));
        std::iter::once(("path", &self.path)).chain(buffer).collect()
    }

    /// Checks the files without making a mesh.
    fn check_files(&self, files: &[(&'static str, FileHandle)]) -> Vec<Problem> {
        let Some(path) = file(files, "path") else { return Vec::new() };
        let found = read::check(path, file(files, "buffer"), self.uv_set);
        found.err().map(|error| problem(path, &error)).into_iter().collect()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let missing = || Problem::new(Code::MissingInput, "`path` is not given; it must name a mesh").at("path");
        let path = cx.file("path").ok_or_else(missing)?;
        let (buffer, until) = (cx.file("buffer"), || cx.check().is_err());
        let made = unwind_when(&until, |watch| {
            let contents = read::read(path, buffer, self.uv_set, watch).map_err(|error| problem(path, &error))?;
            self.made(contents, watch)
        });
        let (mesh, advice) = made.ok_or(Stop::Cancelled)??;
        advice.into_iter().for_each(|problem| cx.evaluator.warn(problem));
        Ok(Outputs::one(mesh))
    }
}

#[cfg(test)]
mod tests;
