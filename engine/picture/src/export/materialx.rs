//! Materials as MaterialX 1.39 documents.
use super::bundle::{Bundle, ExportContext, Maps};
use super::decl::{FieldDecl, MATERIAL, Takes, names};
use super::names::identifier;
use super::network::{Input, InputValue, Network, Shading, network};
use super::target::{ExportTarget, Files, OptionValue, Options, Plan, Source, TargetInfo};
use crate::value::Material;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, Event};
use std::io;

/// The target.
pub(super) struct MaterialX;

impl ExportTarget for MaterialX {
    fn info(&self) -> &'static TargetInfo {
        const {
            &TargetInfo {
                name: "MaterialX",
                title: "MaterialX",
                doc: "A material as a MaterialX document.",
                fields: &[
                    MATERIAL,
                    FieldDecl::new("shading", "The surface shader.", Takes::Words(|| names(&Shading::ALL))),
                ],
                variants: &[
                    ("materialx", "A MaterialX document, `open_pbr_surface`", &[]),
                    (
                        "materialx-standard",
                        "A MaterialX document, `standard_surface`",
                        &[("shading", OptionValue::Word("StandardSurface"))],
                    ),
                ],
            }
        }
    }

    fn plan(&self, _: &Options) -> Plan {
        Plan::several("mtlx")
    }

    fn write(&self, source: &Source<'_>, options: &Options) -> io::Result<Files> {
        let shading = options.word("shading", &Shading::ALL);
        materialx(source.material, &source.place, shading).map(Files::Bundle)
    }
}

/// A document and its pictures. Heights in the document are mm, with a scale to metres.
///
/// # Errors
/// Cannot happen in practice: the document is written to memory.
fn materialx(material: &Material, place: &ExportContext, shading: Shading) -> io::Result<Bundle> {
    let mut maps = Maps::new(material, &place.stem);
    let network = network(&mut maps, place, false, shading);
    let text = document(&network, &identifier(&place.stem))?;
    Ok(maps.bundle(vec![(format!("{}.mtlx", place.stem), text)]))
}

type Attributes<'a> = [(&'a str, &'a str)];

struct Xml(Writer<Vec<u8>>);

impl Xml {
    fn open(&mut self, tag: &str, attributes: &Attributes<'_>) -> io::Result<()> {
        self.0.write_event(Event::Start(BytesStart::new(tag).with_attributes(attributes.iter().copied())))
    }

    fn close(&mut self, tag: &str) -> io::Result<()> {
        self.0.write_event(Event::End(BytesEnd::new(tag)))
    }

    fn empty(&mut self, tag: &str, attributes: &Attributes<'_>) -> io::Result<()> {
        self.0.write_event(Event::Empty(BytesStart::new(tag).with_attributes(attributes.iter().copied())))
    }

    /// Writes an input inside the node graph.
    fn input(&mut self, (name, ty, given): &Input) -> io::Result<()> {
        let head = [("name", *name), ("type", *ty)];
        match given {
            InputValue::Value(value) => self.empty("input", &[&head[..], &[("value", value)]].concat()),
            InputValue::Metres(value) => {
                let unit = [("value", value.as_str()), ("unittype", "distance"), ("unit", "meter")];
                self.empty("input", &[&head[..], &unit].concat())
            }
            InputValue::File(file, None) => self.empty("input", &[&head[..], &[("value", file)]].concat()),
            InputValue::File(file, Some(space)) => {
                self.empty("input", &[&head[..], &[("value", file.as_str()), ("colorspace", *space)]].concat())
            }
            InputValue::Node(node) => self.empty("input", &[&head[..], &[("nodename", node)]].concat()),
        }
    }
}

/// The text of a document.
fn document(network: &Network, name: &str) -> io::Result<String> {
    let mut xml = Xml(Writer::new_with_indent(Vec::new(), b' ', 2));
    xml.0.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    xml.open("materialx", &[("version", "1.39"), ("colorspace", "lin_rec709")])?;
    let graph = format!("{name}_maps");
    let outputs: Vec<(&str, &str)> = network
        .surface
        .iter()
        .filter_map(|(_, ty, given)| if let InputValue::Node(node) = given { Some((node.as_str(), *ty)) } else { None })
        .chain(network.height.as_deref().map(|node| (node, "float")))
        .collect();
    let out = |node: &str| format!("{node}_out");
    if !network.nodes.is_empty() {
        xml.open("nodegraph", &[("name", &graph)])?;
        for node in &network.nodes {
            let head = [("name", node.name.as_str()), ("type", node.ty)];
            if node.inputs.is_empty() {
                xml.empty(node.category, &head)?;
                continue;
            }
            xml.open(node.category, &head)?;
            node.inputs.iter().try_for_each(|input| xml.input(input))?;
            xml.close(node.category)?;
        }
        for (node, ty) in &outputs {
            xml.empty("output", &[("name", &out(node)), ("type", ty), ("nodename", node)])?;
        }
        xml.close("nodegraph")?;
    }
    let connect = |xml: &mut Xml, input: &Input| match input {
        (name, ty, InputValue::Node(node)) => {
            xml.empty("input", &[("name", name), ("type", ty), ("nodegraph", &graph), ("output", &out(node))])
        }
        other => xml.input(other),
    };
    let [surface, relief] = ["surface", "displacement"].map(|part| format!("{name}_{part}"));
    let category = network.shading.category();
    xml.open(category, &[("name", &surface), ("type", "surfaceshader")])?;
    network.surface.iter().try_for_each(|input| connect(&mut xml, input))?;
    xml.close(category)?;
    if let Some(height) = &network.height {
        xml.open("displacement", &[("name", &relief), ("type", "displacementshader")])?;
        connect(&mut xml, &("displacement", "float", InputValue::Node(height.clone())))?;
        xml.input(&("scale", "float", InputValue::Value("0.001".into())))?;
        xml.close("displacement")?;
    }
    xml.open("surfacematerial", &[("name", name), ("type", "material")])?;
    xml.input(&("surfaceshader", "surfaceshader", InputValue::Node(surface)))?;
    if network.height.is_some() {
        xml.input(&("displacementshader", "displacementshader", InputValue::Node(relief)))?;
    }
    xml.close("surfacematerial")?;
    xml.close("materialx")?;
    let mut text = String::from_utf8(xml.0.into_inner()).map_err(io::Error::other)?;
    text.push('\n');
    Ok(text)
}
