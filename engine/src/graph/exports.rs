//! Outputs for other programs, as written and as checked.
use super::args::at;
use super::document::{OutputDecl, choice};
use super::part::{Entry, Shape, SyntaxValue};
use super::read::{self, mismatch, shorten};
use super::remedy::write_luminance;
use super::report::Report;
use super::scope::{Target, Unit};
use crate::diagnostics::Code;
use crate::export::{ExportTarget, FieldDecl, OptionValue, Options, SimpleShape, Takes};
use crate::graph::{Export, ExportMesh};
use crate::value::{Atlas, Carried, Type};
use petgraph::graph::NodeIndex;
use std::sync::Arc;

/// The export of an output, as written.
#[derive(Debug)]
pub(super) struct ExportDecl {
    /// The word.
    kind: &'static str,
    /// The target with its options; `None` after an error.
    target: Option<Arc<dyn ExportTarget>>,
    /// The references to single fields, by the names of the target's fields.
    fields: Vec<(&'static str, SyntaxValue)>,
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
pub(super) fn read(
    decl: &mut OutputDecl,
    word: &SyntaxValue,
    target: &dyn ExportTarget,
    body: &SyntaxValue,
    report: &mut Report,
) {
    let (kind, declared) = (target.name(), target.fields());
    let known: Vec<&str> = declared.iter().map(|field| field.name).collect();
    let Some(fields) = read::fields(body, &format!("`{kind}`"), &known, report) else { return };
    let (mut options, mut good) = (Options::default(), true);
    let mut export = ExportDecl { kind, target: None, fields: Vec::new() };
    decl.mesh = target.has_mesh().then_some(MeshDecl::Simple(SimpleShape::Plane));
    for FieldDecl { name, takes, .. } in declared {
        let Some(part) = read::get(&fields, name) else { continue };
        match takes {
            Takes::Material | Takes::Gray => {
                let Some(_) = read::text(part, name, report) else { continue };
                decl.from.get_or_insert_with(|| part.clone());
                if let Takes::Gray = takes {
                    export.fields.push((name, part.clone()));
                }
            }
            Takes::Mesh => decl.mesh = mesh(part, report),
            _ => match option(part, name, *takes, report) {
                Some(value) => options.0.push((name, value)),
                None => good = false,
            },
        }
    }
    check_source(word, kind, declared, &fields, report);
    // Consequences of an error are not reported.
    match target.with(&options) {
        _ if !good => {}
        Ok(target) => export.target = Some(target),
        Err(problem) => {
            let place = problem.field.as_deref().and_then(|field| read::get(&fields, field)).unwrap_or(word);
            report.push(at(place, &problem));
        }
    }
    decl.export = Some(export);
}

/// Checks that the material, or one of the fields, is given.
fn check_source(word: &SyntaxValue, kind: &str, declared: &[FieldDecl], given: &[Entry], report: &mut Report) {
    let sources = declared.iter().filter(|field| matches!(field.takes, Takes::Material | Takes::Gray));
    let names: Vec<&str> = sources.map(|field| field.name).collect();
    let Some((first, others)) =
        names.split_first().filter(|_| !names.iter().any(|name| read::get(given, name).is_some()))
    else {
        return;
    };
    let (message, more) = match others {
        [] => (format!("`{kind}` has no `{first}`"), String::new()),
        _ => (format!("`{kind}` has no field"), format!(", `{}`, all or some of them", others.join("`, `"))),
    };
    report.push(word.error(Code::MissingInput, message).help(format!("write `{first}: \"node\"`{more}")));
}

/// The value of an option; reports errors.
fn option(part: &SyntaxValue, name: &str, takes: Takes, report: &mut Report) -> Option<OptionValue> {
    match takes {
        Takes::Whole(least, most) => {
            let given = if let Shape::Number(given) = part.shape() { given } else { f64::NAN };
            let whole = (least..=most).find(|whole| (given - f64::from(*whole)).abs() <= 0.5);
            let whole = whole.filter(|_| (f64::from(least)..=f64::from(most)).contains(&given));
            if whole.is_none() {
                report.push(mismatch(part, &format!("`{name}`"), &format!("a number from {least} to {most}")));
            }
            whole.map(OptionValue::Whole)
        }
        Takes::Truth => choice(part, name, &[("true", true), ("false", false)], report).map(OptionValue::Truth),
        _ => {
            let words: Vec<_> = takes.words().into_iter().map(|word| (word, word)).collect();
            choice(part, name, &words, report).map(OptionValue::Word)
        }
    }
}

/// The mesh of an export; `None` after an error.
fn mesh(part: &SyntaxValue, report: &mut Report) -> Option<MeshDecl> {
    match part.shape() {
        Shape::Text(_) => Some(MeshDecl::Node(part.clone())),
        Shape::Word(_) => choice(part, "mesh", &SimpleShape::ALL, report).map(MeshDecl::Simple),
        _ => {
            let wanted = "`Plane`, `Sphere`, `Cylinder`, `Cube` or an atlas: `mesh: \"atlas\"`";
            report.push(mismatch(part, "`mesh`", wanted));
            None
        }
    }
}

impl Unit<'_> {
    /// The export of an output of type `ty`, if any; reports errors.
    pub(super) fn export(&mut self, decl: &OutputDecl, from: &SyntaxValue, ty: Type) -> Result<Option<Export>, ()> {
        let Some(export) = &decl.export else { return Ok(None) };
        let mut fields = Vec::new();
        for (name, part) in &export.fields {
            fields.push((*name, self.packed(export.kind, part)?));
        }
        if fields.is_empty() && ty != Type::Material {
            let kind = export.kind;
            let message = format!("`{kind}` takes a material; `{}` is {ty}", shorten(from.str().trim_matches('"')));
            let help = "connect a `Material`, which names the fields that are its channels";
            self.report.push(from.error(Code::TypeMismatch, message).help(help));
            return Err(());
        }
        let target = export.target.clone().ok_or(())?;
        Ok(Some(Export { target, fields }))
    }

    /// A grey field of a packed picture.
    fn packed(&mut self, kind: &str, part: &SyntaxValue) -> Result<(NodeIndex, usize), ()> {
        let help = |ty| match ty {
            Type::Rgb => format!("{} as a node of its own, and name that", write_luminance(&shorten(part.str()))),
            _ => "take it apart with `SplitChannels`, or use an output that is Gray".to_owned(),
        };
        self.node_of(part, Type::Gray, &format!("`{kind}` takes fields of one number each"), help)
    }

    /// The mesh of an output for another program; reports errors.
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
