//! [`LoadMesh`]: a mesh from a file.
//!
//! OBJ and glTF, read by [`read`]; then units and axes are turned to mm and z up, corners at the same place become
//! one, triangles without area are dropped, and those of a piece are made to agree about which side is outside. Cost: about
//! 1 µs a triangle of OBJ, a third of that of glTF.
use super::read::{self, Contents, MOST_TRIANGLES, ReadError};
use glam::{DVec3, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::diagnostics::{Code, Problem, suggest};
use shibo_engine::node::{CanvasFacts, Context, Fact, FilePath, Node, Output, Outputs};
use shibo_engine::value::{Mesh, Stop, Type};
use shibo_kernel::mesh::topology;
use std::path::{Path, PathBuf};

/// What a file's unit is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum LengthUnit {
    /// Metres in glTF, as its standard says; millimetres in OBJ, which says nothing.
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

/// Which axis of a file points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum UpAxis {
    /// y, as in glTF and in most OBJ.
    #[default]
    Y,
    /// z.
    Z,
}

/// What is moved to the origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Center {
    /// Nothing.
    #[default]
    None,
    /// The middle of the box around the mesh.
    Bounds,
    /// The middle of that box's bottom.
    Base,
}

/// A mesh from an OBJ or glTF file, in mm, z up.
///
/// Its objects and materials are its parts. Materials themselves, pictures, animations, skins, cameras and lights are left
/// out. Files up to 512 MiB and 2 million triangles; glTF without compression. No other file is read than those named here.
///
/// ```ron
/// "cube": LoadMesh(path: "cube.obj", up: Z),
/// "atlas": MeshAtlas(mesh: "cube"),
/// "example": BakeNormal(atlas: "atlas"),
/// ```
///
/// Elsewhere: Blender *Import*; Houdini *File*; Substance Designer *3D scene*.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LoadMesh {
    /// The file: `.obj`, `.glb` or `.gltf`; relative to the graph file.
    pub path: FilePath,
    /// The `.bin` file beside a `.gltf` that keeps its numbers there.
    pub buffer: Option<FilePath>,
    /// The unit of its lengths.
    pub unit: LengthUnit,
    /// Which of its axes points up.
    pub up: UpAxis,
    /// Another factor on all lengths.
    #[schemars(range(min = 1e-6, max = 1e6))]
    pub scale: f64,
    /// What is moved to the origin.
    pub center: Center,
    /// The only part that is taken: the name of an object, of a mesh or of a material. By default all.
    pub part: String,
    /// Corners that are no farther apart become one. 0: only those at the same place.
    #[schemars(range(min = 0, max = 10), extend("unit" = "mm"))]
    pub weld: f64,
}

impl Default for LoadMesh {
    fn default() -> Self {
        Self {
            path: FilePath::default(),
            buffer: None,
            unit: LengthUnit::Auto,
            up: UpAxis::Y,
            scale: 1.0,
            center: Center::None,
            part: String::new(),
            weld: 0.0,
        }
    }
}

/// The farthest a vertex may lie from the origin, in mm.
const FARTHEST: f64 = 1e7;

/// What is wrong with a file, at the parameter that names it.
fn problem(path: &Path, error: &ReadError) -> Problem {
    let (code, field) = match error {
        ReadError::NotFound(_) => (Code::FileNotFound, "path"),
        ReadError::Bad(_) => (Code::BadFile, "path"),
        ReadError::TooLarge(_) => (Code::TooLarge, "path"),
        ReadError::NoBuffer(_) => (Code::MissingInput, "path"),
    };
    let problem = Problem::new(code, format!("`{}`: {error}", path.display())).at(field);
    match error {
        ReadError::NoBuffer(_) => problem.help("name that file with `buffer`, or export as `.glb`"),
        ReadError::TooLarge(_) => problem.help(format!("a mesh may have {MOST_TRIANGLES} triangles and 512 MiB")),
        _ => problem,
    }
}

/// The file at a parameter.
fn file<'a>(files: &'a [(&'static str, PathBuf)], name: &str) -> Option<&'a Path> {
    files.iter().find(|(field, _)| *field == name).map(|(_, path)| path.as_path())
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

    /// Keeps the triangles of the part that is wanted.
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
        // Parts are numbered anew.
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

    /// Turns units and axes, and moves the mesh to the origin.
    fn place(&self, mesh: &mut Mesh, metres: bool) -> Result<(), Problem> {
        let (unit, up) = (self.unit_mm(metres), self.up);
        let turn = |p: DVec3| if up == UpAxis::Y { DVec3::new(p.x, -p.z, p.y) } else { p };
        for (n, p) in mesh.positions.iter_mut().enumerate() {
            let at = turn(p.as_dvec3()) * unit;
            if !at.is_finite() || at.abs().max_element() > FARTHEST {
                let message =
                    format!("vertex {n} lies at ({}, {}, {}) mm; it must lie within ±{FARTHEST:e}", at.x, at.y, at.z);
                return Err(Problem::new(Code::BadFile, message).at("path").help("look at `unit` and `scale`"));
            }
            *p = at.as_vec3();
        }
        mesh.normals.iter_mut().flatten().for_each(|n| *n = turn(n.as_dvec3()).as_vec3());
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

    /// The mesh that the contents of a file make, and what is worth knowing about it.
    pub(super) fn made(&self, contents: Contents) -> Result<(Mesh, Vec<Problem>), Problem> {
        let Contents { mut mesh, metres, left_out } = contents;
        let mut advice = Vec::new();
        let mut tell = |message: String| advice.push(Problem::new(Code::Advice, message).at("path"));
        self.keep_part(&mut mesh)?;
        self.place(&mut mesh, metres)?;
        let dropped = topology::weld(&mut mesh, self.weld);
        if mesh.triangles.is_empty() {
            let message = "none of its triangles has an area";
            return Err(Problem::new(Code::BadFile, message).at("path"));
        }
        if dropped > 0 {
            tell(format!("{dropped} triangles have no area and are left out"));
        }
        topology::orient(&mut mesh);
        let found = topology::topology(&mesh.triangles);
        if found.crowded > 0 {
            tell(format!("{} edges have more than two triangles; the surface ends there", found.crowded));
        }
        if found.twisted > 0 {
            tell("a piece has no outside, as a Möbius strip; the surface is cut where its sides meet".into());
        }
        if !left_out.is_empty() {
            tell(format!("{} are left out", left_out.join(", ")));
        }
        advice.extend(size_advice(&mesh));
        Ok((mesh, advice))
    }
}

/// Advice about a mesh whose unit seems to be another one.
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

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        Vec::new()
    }

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        let buffer = self.buffer.iter().map(|buffer| ("buffer", buffer));
        std::iter::once(("path", &self.path)).chain(buffer).collect()
    }

    /// Looks through the files without making a mesh of them.
    fn check_files(&self, files: &[(&'static str, PathBuf)]) -> Vec<Problem> {
        let Some(path) = file(files, "path") else { return Vec::new() };
        let found = read::check(path, file(files, "buffer"));
        found.err().map(|error| problem(path, &error)).into_iter().collect()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let missing = || Problem::new(Code::MissingInput, "`path` is not given; it must name a mesh").at("path");
        let path = cx.file("path").ok_or_else(missing)?;
        let contents = read::read(path, cx.file("buffer")).map_err(|error| problem(path, &error))?;
        cx.check()?;
        let (mesh, advice) = self.made(contents)?;
        advice.into_iter().for_each(|problem| cx.evaluator.warn(problem));
        Ok(Outputs::one(mesh))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, canvas};
    use shibo_engine::node::{Call, DynNode};
    use shibo_engine::value::Value;
    use std::sync::Arc;

    fn data(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/meshes").join(name)
    }

    fn load(node: &LoadMesh, path: &Path) -> Result<Arc<Mesh>, Problem> {
        let files = [("path", path.to_owned())];
        let canvas = canvas();
        let call = Call { kind: "LoadMesh", canvas: &canvas, inputs: &[], files: &files, evaluator: &Plain };
        match DynNode::evaluate(node, &call) {
            Ok(outputs) => match outputs.take("mesh", true) {
                Some(Value::Mesh(mesh)) => Ok(mesh.clone()),
                other => panic!("{other:?}"),
            },
            Err(Stop::Failed(problem)) => Err(*problem),
            Err(stop) => panic!("{stop:?}"),
        }
    }

    fn bounds(node: &LoadMesh, name: &str) -> [[f64; 3]; 2] {
        load(node, &data(name)).unwrap().bounds().map(|corner| corner.to_array())
    }

    #[test]
    fn files_are_read() {
        for (name, triangles, vertices) in [
            ("cube.obj", 12, 8),
            ("plane_one.obj", 512, 289),
            ("plane_cut.obj", 512, 289),
            ("plane_wild.obj", 512, 289),
            ("sphere.obj", 1280, 642),
            ("open_strip.obj", 64, 51),
            ("moebius.obj", 256, 160),
        ] {
            let node = LoadMesh { up: UpAxis::Z, ..LoadMesh::default() };
            let mesh = load(&node, &data(name)).unwrap();
            assert_eq!(mesh.triangles.len(), triangles, "{name}");
            assert!(name == "moebius.obj" || mesh.positions.len() == vertices, "{name} {}", mesh.positions.len());
            assert!(mesh.polygons.is_empty() && mesh.parts.iter().all(|part| *part == 0));
            assert!(Node::check_files(&node, &[("path", data(name))]).is_empty());
        }
    }

    #[test]
    fn units_and_axes_are_turned() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("corner.obj");
        std::fs::write(&path, text).unwrap();
        let size = |node: LoadMesh| load(&node, &path).unwrap().bounds().map(|corner| corner.to_array());
        assert_eq!(size(LoadMesh { up: UpAxis::Z, ..LoadMesh::default() }), [[0.0; 3], [1.0, 2.0, 3.0]]);
        assert_eq!(size(LoadMesh::default()), [[0.0, -3.0, 0.0], [1.0, 0.0, 2.0]]);
        let inches = LoadMesh { unit: LengthUnit::Inch, up: UpAxis::Z, scale: 2.0, ..LoadMesh::default() };
        assert_eq!(size(inches)[1].map(|x| (x * 10.0).round()), [508.0, 1016.0, 1524.0]);
        let centered = LoadMesh { up: UpAxis::Z, center: Center::Bounds, ..LoadMesh::default() };
        assert_eq!(size(centered.clone()), [[-0.5, -1.0, -1.5], [0.5, 1.0, 1.5]]);
        assert_eq!(size(LoadMesh { center: Center::Base, ..centered }), [[-0.5, -1.0, 0.0], [0.5, 1.0, 3.0]]);
        // Turned by 90°, and so seen from the same side.
        let mesh = load(&LoadMesh::default(), &path).unwrap();
        let volume: f64 = (0..4).map(|n| mesh.cross(n).dot(mesh.corners(n)[0])).sum();
        assert!(volume > 0.0);
        assert_eq!(bounds(&LoadMesh { up: UpAxis::Z, ..LoadMesh::default() }, "cube.obj"), [[-30.0; 3], [30.0; 3]]);
    }

    #[test]
    fn one_part_can_be_taken() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\no arm\nusemtl wood\nf 1 3 2\nf 1 2 4\nusemtl brass\nf 1 4 3\no leg\nf 2 3 4\n";
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("chair.obj");
        std::fs::write(&path, text).unwrap();
        let of = |part: &str| load(&LoadMesh { part: part.into(), ..LoadMesh::default() }, &path);
        let all = of("").unwrap();
        assert_eq!(all.part_names, ["arm/wood", "arm/brass", "leg/brass"]);
        assert_eq!(all.parts, [0, 0, 1, 2]);
        for (part, count, names) in [("arm", 3, 2), ("brass", 2, 2), ("arm/wood", 2, 1), ("leg", 1, 1)] {
            let mesh = of(part).unwrap();
            assert_eq!((mesh.triangles.len(), mesh.part_names.len()), (count, names), "{part}");
            assert!(mesh.parts.iter().all(|n| usize::from(*n) < names));
        }
        let problem = of("arn").unwrap_err();
        assert_eq!((problem.code, problem.field.as_deref()), (Code::BadValue, Some("part")));
        assert!(problem.help.unwrap().contains("arm"));
    }

    #[test]
    fn what_is_no_mesh_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        let refused = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            let problem = load(&LoadMesh::default(), &path).unwrap_err();
            let checked = Node::check_files(&LoadMesh::default(), &[("path", path.clone())]);
            (problem, checked.len())
        };
        for (bytes, words) in [
            (&b"v 0 0 0\nv 1 0 0\nv 0 x 0\nf 1 2 3\n"[..], "line 3: `v 0 x 0`"),
            (b"v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", "finite"),
            (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "line 4: `f 1 2 4`"),
            (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "at least 3"),
            (b"# nothing\n", "no "),
            (b"", "no "),
            (&[0x89, b'P', b'N', b'G', 0, 0, 0], "neither OBJ nor glTF"),
            (b"glTF\x02\x00\x00\x00\xff\x00\x00\x00", "truncated"),
            (b"{\"asset\": 3}", "no glTF"),
        ] {
            let (problem, checked) = refused(bytes);
            assert_eq!((problem.code, problem.field.as_deref()), (Code::BadFile, Some("path")), "{words}");
            assert!(problem.message.contains(words), "{}", problem.message);
            assert_eq!(checked, 1, "{words}");
        }
        let flat = b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n";
        assert!(refused(flat).0.message.contains("area"));
        let far = b"v 0 0 0\nv 1e8 0 0\nv 0 1 0\nf 1 2 3\n";
        assert!(refused(far).0.message.contains("within"));
        let none = load(&LoadMesh::default(), &folder.path().join("none.obj")).unwrap_err();
        assert_eq!(none.code, Code::FileNotFound);
        assert_eq!(load(&LoadMesh::default(), folder.path()).unwrap_err().code, Code::BadFile);
    }

    #[test]
    fn advice_is_given() {
        let node = LoadMesh { up: UpAxis::Z, ..LoadMesh::default() };
        let of = |name: &str, node: &LoadMesh| {
            let contents = read::read(&data(name), None).unwrap();
            let advice: Vec<String> = node.made(contents).unwrap().1.into_iter().map(|p| p.message).collect();
            advice.join("; ")
        };
        assert_eq!(of("cube.obj", &node), "");
        assert!(of("moebius.obj", &node).contains("Möbius"));
        assert!(of("cube.obj", &LoadMesh { scale: 1e-3, ..node.clone() }).contains("largest side"));
        assert!(of("cube.obj", &LoadMesh { unit: LengthUnit::M, ..node }).contains("largest side"));
    }
}
