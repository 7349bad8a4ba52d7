//! Outputs for other programs, as written and as checked.
use super::document::{OutputDecl, choice};
use super::part::{Entry, Shape, SyntaxValue};
use super::read::{self, mismatch, shorten};
use super::remedy::write_luminance;
use super::report::Report;
use super::scope::{Target, Unit};
use crate::diagnostics::Code;
use crate::export::{Colors, Program, Shading, SimpleShape};
use crate::graph::{Export, ExportMesh};
use crate::value::{Atlas, Carried, Type};
use petgraph::graph::NodeIndex;

/// The words for outputs of other programs.
pub(super) const KINDS: [&str; 6] = ["Gltf", "Obj", "MaterialX", "Usd", "Preset", "Pack"];

/// The colours of a packed picture, as fields.
const COLORS: [&str; 4] = ["r", "g", "b", "a"];

/// The export of an output, as written.
#[derive(Debug)]
pub(super) enum ExportDecl {
    Gltf {
        embed: bool,
        colors: Colors,
    },
    Obj(Colors),
    MaterialX(Shading),
    Usd {
        packed: bool,
        colors: Colors,
    },
    Preset(Program),
    /// The references to its fields.
    Pack([Option<SyntaxValue>; 4]),
}

/// The mesh of an exported file, as written.
#[derive(Debug)]
pub(super) enum MeshDecl {
    /// A shape that needs no mesh.
    Simple(SimpleShape),
    /// A reference to an atlas.
    Node(SyntaxValue),
}

/// Reads an export such as `Gltf(material: "node", mesh: "atlas")`.
pub(super) fn read(decl: &mut OutputDecl, word: &SyntaxValue, body: &SyntaxValue, report: &mut Report) {
    let kind = word.str();
    let known: &[&str] = match kind {
        "Gltf" => &["material", "mesh", "embed", "colors", "quality"],
        "Usd" => &["material", "mesh", "packed", "colors", "quality"],
        "Obj" => &["material", "mesh", "colors", "quality"],
        "MaterialX" => &["material", "shading"],
        "Preset" => &["material", "target"],
        _ => &COLORS,
    };
    let Some(fields) = read::fields(body, &format!("`{kind}`"), known, report) else { return };
    if kind == "Pack" {
        let mut given =
            |color| read::get(&fields, color).filter(|part| read::text(part, color, report).is_some()).cloned();
        let given = COLORS.map(&mut given);
        decl.from = given.iter().flatten().next().cloned();
        if fields.is_empty() {
            let help = "write `r: \"node\"`, `g`, `b` and `a`, all or some of them";
            report.push(word.error(Code::MissingInput, "`Pack` has no field").help(help));
        }
        decl.export = Some(ExportDecl::Pack(given));
        return;
    }
    decl.from = read::get(&fields, "material").filter(|from| read::text(from, "material", report).is_some()).cloned();
    if read::get(&fields, "material").is_none() {
        let help = "write `material: \"node\"`";
        report.push(word.error(Code::MissingInput, format!("`{kind}` has no `material`")).help(help));
    }
    decl.export = match kind {
        "Gltf" => {
            let embed = truth(&fields, "embed", true, report);
            Some(ExportDecl::Gltf { embed, colors: colors(&fields, report) })
        }
        "Obj" => Some(ExportDecl::Obj(colors(&fields, report))),
        "Usd" => {
            let packed = truth(&fields, "packed", false, report);
            Some(ExportDecl::Usd { packed, colors: colors(&fields, report) })
        }
        "MaterialX" => {
            let shading = read::get(&fields, "shading");
            let shading =
                shading.map_or(Some(Shading::default()), |part| choice(part, "shading", &Shading::ALL, report));
            shading.map(ExportDecl::MaterialX)
        }
        _ => match read::get(&fields, "target") {
            Some(part) => choice(part, "target", &Program::ALL, report).map(ExportDecl::Preset),
            None => {
                let names: Vec<&str> = Program::ALL.iter().map(|(name, _)| *name).collect();
                let help = format!("write `target: Blender`; targets are {}", names.join(", "));
                report.push(word.error(Code::MissingInput, "`Preset` has no `target`").help(help));
                None
            }
        },
    };
    // Consequences of an error are not reported.
    if decl.export.is_none() {
        decl.from = None;
    }
    if matches!(kind, "Gltf" | "Obj" | "Usd") {
        decl.mesh = Some(MeshDecl::Simple(SimpleShape::Plane));
        if let Some(mesh) = read::get(&fields, "mesh") {
            match mesh.shape() {
                Shape::Text(_) => decl.mesh = Some(MeshDecl::Node(mesh.clone())),
                Shape::Word(_) => {
                    decl.mesh = choice(mesh, "mesh", &SimpleShape::ALL, report).map(MeshDecl::Simple);
                }
                _ => report.push(mismatch(
                    mesh,
                    "`mesh`",
                    "`Plane`, `Sphere`, `Cylinder`, `Cube` or an atlas: `mesh: \"atlas\"`",
                )),
            }
        }
    }
}

/// Reads a field that is `true` or `false`.
fn truth(fields: &[Entry], name: &str, default: bool, report: &mut Report) -> bool {
    let words = [("true", true), ("false", false)];
    read::get(fields, name).and_then(|part| choice(part, name, &words, report)).unwrap_or(default)
}

/// `colors: Jpeg, quality: 90`.
fn colors(fields: &[Entry], report: &mut Report) -> Colors {
    let jpeg = read::get(fields, "colors").and_then(|part| choice(part, "colors", &Colors::ALL, report));
    let jpeg = jpeg.unwrap_or_default();
    let mut quality = Colors::QUALITY;
    if let Some(part) = read::get(fields, "quality") {
        let given = if let Shape::Number(given) = part.shape() { given } else { f64::NAN };
        match (1..=100)
            .find(|whole| (given - f64::from(*whole)).abs() <= 0.5)
            .filter(|_| (1.0..=100.0).contains(&given))
        {
            Some(whole) => quality = whole,
            None => report.push(mismatch(part, "`quality`", "a number from 1 to 100")),
        }
        if !jpeg {
            let error = part.error(Code::BadValue, "`quality` is that of JPEG, and `colors` are PNG");
            report.push(error.help("write `colors: Jpeg`, or leave `quality` out"));
        }
    }
    if jpeg { Colors::Jpeg(quality) } else { Colors::Png }
}

impl ExportDecl {
    /// The word used in graph files.
    fn kind(&self) -> &'static str {
        match self {
            Self::Gltf { .. } => "Gltf",
            Self::Obj(_) => "Obj",
            Self::MaterialX(_) => "MaterialX",
            Self::Usd { .. } => "Usd",
            Self::Preset(_) => "Preset",
            Self::Pack(_) => "Pack",
        }
    }
}

impl Unit<'_> {
    /// The export of an output of type `ty`, if any; reports errors.
    pub(super) fn export(&mut self, decl: &OutputDecl, from: &SyntaxValue, ty: Type) -> Result<Option<Export>, ()> {
        let Some(export) = &decl.export else { return Ok(None) };
        if let ExportDecl::Pack(parts) = export {
            let mut fields = [None; 4];
            for (field, part) in fields.iter_mut().zip(parts) {
                *field = part.as_ref().map(|part| self.packed(part)).transpose()?;
            }
            return Ok(Some(Export::Pack(fields)));
        }
        if ty != Type::Material {
            let kind = export.kind();
            let message = format!("`{kind}` takes a material; `{}` is {ty}", shorten(from.str().trim_matches('"')));
            let help = "connect a `Material`, which names the fields that are its channels";
            self.report.push(from.error(Code::TypeMismatch, message).help(help));
            return Err(());
        }
        Ok(Some(match export {
            ExportDecl::Obj(colors) => Export::Obj(*colors),
            ExportDecl::MaterialX(shading) => Export::MaterialX(*shading),
            ExportDecl::Usd { packed, colors } => Export::Usd { packed: *packed, colors: *colors },
            ExportDecl::Preset(program) => Export::Preset(*program),
            ExportDecl::Gltf { embed, colors } => Export::Gltf { embed: *embed, colors: *colors },
            ExportDecl::Pack(_) => return Err(()),
        }))
    }

    /// A grey field of a packed picture.
    fn packed(&mut self, part: &SyntaxValue) -> Result<(NodeIndex, usize), ()> {
        let help = |ty| match ty {
            Type::Rgb => format!("{} as a node of its own, and name that", write_luminance(&shorten(part.str()))),
            _ => "take it apart with `SplitChannels`, or use an output that is Gray".to_owned(),
        };
        self.node_of(part, Type::Gray, "`Pack` takes fields of one number each", help)
    }

    /// The mesh of a `Gltf`, `Obj` or `Usd` output; reports errors.
    pub(super) fn export_mesh(&mut self, decl: &OutputDecl) -> Result<Option<ExportMesh>, ()> {
        let Some(mesh) = &decl.mesh else { return Ok(None) };
        let part = match mesh {
            MeshDecl::Simple(shape) => return Ok(Some(ExportMesh::Simple(*shape))),
            MeshDecl::Node(part) => part,
        };
        let help = "lay a mesh out with `MeshAtlas(mesh: …)`, or write `mesh: Plane`";
        let (node, output) = self.node_of(part, Atlas::TYPE, "`mesh` must be an atlas", |_| help.to_owned())?;
        Ok(Some(ExportMesh::Atlas { node, output }))
    }

    /// The node and output that a reference means; they must have the type `wanted`. Reports an error otherwise, with
    /// the help for the actual type.
    fn node_of(
        &mut self,
        part: &SyntaxValue,
        wanted: Type,
        rule: &str,
        help: impl FnOnce(Type) -> String,
    ) -> Result<(NodeIndex, usize), ()> {
        let Shape::Text(reference) = part.shape() else { return Err(()) };
        let meaning = self.resolve(0, part, &reference);
        let Some(ty) = self.type_of(&meaning.target) else { return Err(()) };
        match meaning.target {
            Target::Out { flat, output } if ty == wanted => Ok((NodeIndex::new(flat), output)),
            _ => {
                let message = format!("{rule}; `{}` is {ty}", shorten(&reference));
                self.report.push(part.error(Code::TypeMismatch, message).help(help(ty)));
                Err(())
            }
        }
    }
}
