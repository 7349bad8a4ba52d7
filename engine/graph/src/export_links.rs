//! Links outputs for other programs: finds the nodes that they name.
use super::linker::{Flat, Linker, Port, Slot, Target};
use super::output_decl::{MeshDecl, OutputDecl};
use super::part::{Shape, SyntaxValue};
use super::read::shorten;
use super::remedy::write_luminance;
use crate::diagnostics::Code;
use crate::node::{Arg, MaterialInputs};
use crate::registry::Internal;
use crate::value::{Accepts, Atlas, Carried, Channel, Mesh, Type};
use crate::{Export, ExportMesh};
use petgraph::graph::NodeIndex;
use std::borrow::Cow;

impl Linker<'_> {
    /// The export of an output of type `ty` of a node, if any; reports errors.
    pub(super) fn export(
        &mut self,
        decl: &OutputDecl,
        from: &SyntaxValue,
        (flat, ty): (usize, Type),
    ) -> Result<Option<Export>, ()> {
        let Some(export) = &decl.export else { return Ok(None) };
        let kind = export.target.target.info().name;
        let mut fields = Vec::new();
        for (name, part) in &export.fields {
            fields.push((*name, self.packed(kind, part)?));
        }
        if export.target.target.info().has_height() {
            self.check_height(from, (flat, ty), kind)?;
        } else if export.target.target.info().has_body() {
            self.check_body(from, ty, kind)?;
        } else if fields.is_empty() && ty != Type::Material {
            let message = format!("`{kind}` takes a material; `{}` is {ty}", shorten(from.str().trim_matches('"')));
            let help = match ty {
                Type::SolidMaterial => {
                    "cut it with `CutPlane`, `CutSurface` or `Board`, or give the mesh as an atlas: `mesh: \"atlas\"`"
                }
                _ => "connect a `Material`, which names the fields that are its channels",
            };
            self.report.push(from.error(Code::TypeMismatch, message).help(help));
            return Err(());
        }
        if !export.good {
            return Err(());
        }
        Ok(Some(Export { target: export.target.clone(), fields, places: export.places.clone() }))
    }

    /// Checks that an output is a mesh or has one; reports an error.
    fn check_body(&mut self, from: &SyntaxValue, ty: Type, kind: &str) -> Result<(), ()> {
        if [Mesh::TYPE, Atlas::TYPE].contains(&ty) {
            return Ok(());
        }
        let message = format!("`{kind}` takes a mesh; `{}` is {ty}", shorten(from.str().trim_matches('"')));
        let help = "name a node that makes a mesh or an atlas; `DisplaceMesh` gives a height to a mesh";
        self.report.push(from.error(Code::TypeMismatch, message).help(help));
        Err(())
    }

    /// Checks that an output is a height, or a material that has one; reports an error.
    fn check_height(&mut self, from: &SyntaxValue, (flat, ty): (usize, Type), kind: &str) -> Result<(), ()> {
        let name = shorten(from.str().trim_matches('"'));
        let (message, help): (String, Cow<'_, str>) = match ty {
            Type::Gray => return Ok(()),
            // The channels of a faulty material are unknown.
            Type::Material if self.flats[flat].channels.is_none_or(|all| all.has(Channel::Height)) => return Ok(()),
            Type::Material => {
                let help = "give the material the channel `height`, in mm, or name a field";
                (format!("`{kind}` takes a height; the material `{name}` has none"), help.into())
            }
            Type::Rgb => {
                let help = format!(
                    "write `height: \"= 2 * luminance({name})\"`, in which white is 2 mm high; `{name}.r` is a channel"
                );
                (format!("`{kind}` takes a height in mm; `{name}` is {ty}"), help.into())
            }
            _ => {
                let help = "name a field of one number per pixel, in mm, or a material with a height";
                (format!("`{kind}` takes a height in mm; `{name}` is {ty}"), help.into())
            }
        };
        self.report.push(from.error(Code::TypeMismatch, message).help(help));
        Err(())
    }

    /// A node that cuts the material in space of an output along the mesh of its export. `None` if the mesh is not an
    /// atlas.
    pub(super) fn cut_on_mesh(
        &mut self,
        from: &SyntaxValue,
        (flat, output): (usize, usize),
        mesh: Option<ExportMesh>,
    ) -> Option<usize> {
        let Some(ExportMesh::Atlas { node, output: atlas }) = mesh else { return None };
        let ports = [("atlas", Arg::Slot(0)), ("solid", Arg::Slot(1))];
        let (kind, built) = self.registry.internal(Internal::CutOnMesh, &ports)?;
        let built = built.ok()?;
        let name = format!("{}:on its mesh", self.flats[flat].name);
        let mut cut = Flat::new(0, name, from.clone(), kind.to_owned(), None, Cow::Borrowed(&[]));
        let inputs =
            [("atlas", Accepts::One(Atlas::TYPE), node.index(), atlas), ("solid", Accepts::InSpace, flat, output)];
        for (port, wants, flat, output) in inputs {
            let mut slot = Slot::unresolved(Port::Node(port.to_owned()), wants, from.clone());
            slot.target = Target::Out { flat, output };
            cut.slots.push(slot);
        }
        let channels = self.flats[flat].channels;
        cut.channels = channels.map(|channels| built.channels(&MaterialInputs::new(&[("solid", channels)])));
        (cut.node, cut.outputs, cut.resolved, cut.shown) = (Some(built), vec![Some(Type::Material)], true, true);
        Some(self.add_flat(cut))
    }

    /// A grey field of a packed picture.
    fn packed(&mut self, kind: &str, part: &SyntaxValue) -> Result<(NodeIndex, usize), ()> {
        let help = |ty| match ty {
            Type::Rgb => write_luminance(&shorten(part.str().trim_matches('"'))),
            Type::Vec2 | Type::Normal => {
                format!("write `\"{}.x\"` for a component", shorten(part.str().trim_matches('"')))
            }
            _ => "use an output that is Gray".to_owned(),
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
