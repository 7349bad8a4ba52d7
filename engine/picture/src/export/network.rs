//! Shading networks of MaterialX 1.39 nodes, shared by MaterialX documents and USD files.
//!
//! A canvas that tiles is read by `tiledimage` with sizes in metres; any other canvas by `image`, with coordinates
//! scaled so that 0..1 is one metre. The top left of the canvas lies at the top left of the coordinates, whose v points
//! up.
use super::bundle::{ChannelSource, ExportContext, Maps};
use super::directions::clockwise;
use crate::value::Channel;

/// The surface shader of a MaterialX document.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shading {
    /// OpenPBR Surface.
    OpenPbr,
    /// Autodesk Standard Surface.
    StandardSurface,
}

impl Shading {
    /// All of them, by name.
    pub(super) const ALL: [(&'static str, Self); 2] =
        [("OpenPbr", Self::OpenPbr), ("StandardSurface", Self::StandardSurface)];

    pub(super) const fn category(self) -> &'static str {
        match self {
            Self::OpenPbr => "open_pbr_surface",
            Self::StandardSurface => "standard_surface",
        }
    }
}

/// Value or source of an input.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum InputValue {
    /// A number, several numbers, or a word.
    Value(String),
    /// A length or several lengths, in metres.
    Metres(String),
    /// A file, and its colour space if it holds colours.
    File(String, Option<&'static str>),
    /// The output of another node.
    Node(String),
}

/// An input: its name, its type, and its value or source.
pub(super) type Input = (&'static str, &'static str, InputValue);

/// A node of a network.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Node {
    pub(super) name: String,
    pub(super) category: &'static str,
    pub(super) ty: &'static str,
    pub(super) inputs: Vec<Input>,
}

/// A network: the nodes, the inputs of the surface, and the node whose number is the height in thousandths of a metre.
#[derive(Clone, Debug)]
pub(super) struct Network {
    pub(super) shading: Shading,
    pub(super) nodes: Vec<Node>,
    pub(super) surface: Vec<Input>,
    pub(super) height: Option<String>,
}

/// Formats a number for documents.
pub(super) fn number(value: f64) -> String {
    // Six digits exceed the precision of pictures.
    let rounded = format!("{value:.6}");
    let short = rounded.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.into() }
}

fn numbers(values: &[f64]) -> String {
    values.iter().map(|value| number(*value)).collect::<Vec<_>>().join(", ")
}

struct Builder<'m, 'a> {
    maps: &'m mut Maps<'a>,
    place: &'m ExportContext,
    /// True if pictures cover the coordinates once, as those of an atlas do.
    once: bool,
    nodes: Vec<Node>,
}

/// The network of a material. `once`: its pictures cover the coordinates from 0 to 1, for any size of the canvas.
pub(super) fn network(maps: &mut Maps<'_>, place: &ExportContext, once: bool, shading: Shading) -> Network {
    let mut builder = Builder { maps, place, once, nodes: Vec::new() };
    let surface = builder.surface(shading);
    let height = match builder.maps.channel(Channel::Height) {
        Some(ChannelSource::File(file)) => Some(builder.image("height", "float", &file)),
        Some(ChannelSource::Value(_)) | None => None,
    };
    Network { shading, nodes: builder.nodes, surface, height }
}

impl Builder<'_, '_> {
    fn add(&mut self, name: &str, category: &'static str, ty: &'static str, inputs: Vec<Input>) -> String {
        self.nodes.push(Node { name: name.into(), category, ty, inputs });
        name.into()
    }

    fn image(&mut self, name: &str, ty: &'static str, file: &str) -> String {
        let colors = if file.ends_with("exr") { "lin_rec709" } else { "srgb_texture" };
        let colors = (ty == "color3").then_some(colors);
        let mut inputs = vec![("file", "filename", InputValue::File(file.into(), colors))];
        let metres = self.place.size_mm / 1000.0;
        if self.place.wraps == [true; 2] && !self.once {
            let from = 1.0 - (1.0 / metres.y).floor() * metres.y;
            inputs.push(("uvoffset", "vector2", InputValue::Value(numbers(&[0.0, from]))));
            inputs.push(("realworldimagesize", "vector2", InputValue::Metres(numbers(&metres.to_array()))));
            inputs.push(("realworldtilesize", "vector2", InputValue::Metres("1, 1".into())));
            return self.add(name, "tiledimage", ty, inputs);
        }
        if !self.once {
            inputs.push(("texcoord", "vector2", InputValue::Node(self.coordinates())));
        }
        for (input, wraps) in ["uaddressmode", "vaddressmode"].into_iter().zip(self.place.wraps) {
            inputs.push((input, "string", InputValue::Value(if wraps { "periodic" } else { "clamp" }.into())));
        }
        self.add(name, "image", ty, inputs)
    }

    /// Coordinates that map the canvas to 0..1, added once.
    fn coordinates(&mut self) -> String {
        const NAME: &str = "placed";
        if self.nodes.iter().any(|node| node.name == NAME) {
            return NAME.into();
        }
        let by = 1000.0 / self.place.size_mm;
        let from = self.add("coordinates", "texcoord", "vector2", Vec::new());
        let value = |values: [f64; 2]| InputValue::Value(numbers(&values));
        let scaled = vec![("in1", "vector2", InputValue::Node(from)), ("in2", "vector2", value(by.to_array()))];
        let scaled = self.add("scaled", "multiply", "vector2", scaled);
        let placed = vec![("in1", "vector2", InputValue::Node(scaled)), ("in2", "vector2", value([0.0, 1.0 - by.y]))];
        self.add(NAME, "add", "vector2", placed)
    }

    /// A channel as an input of the given name, if the material has the channel.
    fn input(&mut self, channel: Channel, name: &'static str, ty: &'static str) -> Option<Input> {
        let given = match self.maps.channel(channel)? {
            ChannelSource::Value(values) => InputValue::Value(numbers(&values)),
            ChannelSource::File(file) => InputValue::Node(self.image(channel.name(), ty, &file)),
        };
        Some((name, ty, given))
    }

    fn normal(&mut self, channel: Channel, name: &'static str) -> Option<Input> {
        let ChannelSource::File(file) = self.maps.channel(channel)? else { return None };
        let image = self.image(channel.name(), "vector3", &file);
        let inputs = vec![("in", "vector3", InputValue::Node(image))];
        let made = self.add(&format!("{}_map", channel.name()), "normalmap", "vector3", inputs);
        Some((name, "vector3", InputValue::Node(made)))
    }

    /// Angle by which the tangent is turned towards the direction in which highlights are long: in degrees, or in
    /// turns.
    fn angle(&mut self, in_turns: bool) -> Option<InputValue> {
        let unit = if in_turns { 1.0 / 360.0 } else { 1.0 };
        Some(match self.maps.channel(Channel::AnisotropyAngle)? {
            ChannelSource::Value(values) => InputValue::Value(number(clockwise(values[0]) * unit)),
            ChannelSource::File(file) => {
                let image = self.image("anisotropy_angle", "float", &file);
                let mut turn = |name: &str, category, from, by: f64| {
                    let by = InputValue::Value(number(by));
                    self.add(
                        name,
                        category,
                        "float",
                        vec![("in1", "float", InputValue::Node(from)), ("in2", "float", by)],
                    )
                };
                let clockwise = turn("turn", "add", image, clockwise(0.0));
                InputValue::Node(if in_turns { turn("turns", "multiply", clockwise, unit) } else { clockwise })
            }
        })
    }

    fn tangent(&mut self) -> Option<Input> {
        let angle = self.angle(false)?;
        let space = || vec![("space", "string", InputValue::Value("world".into()))];
        let tangent = self.add("tangent_world", "tangent", "vector3", space());
        let axis = self.add("normal_world", "normal", "vector3", space());
        let inputs = vec![
            ("in", "vector3", InputValue::Node(tangent)),
            ("amount", "float", angle),
            ("axis", "vector3", InputValue::Node(axis)),
        ];
        let turned = self.add("tangent_turned", "rotate3d", "vector3", inputs);
        Some(("geometry_tangent", "vector3", InputValue::Node(turned)))
    }

    fn surface(&mut self, shading: Shading) -> Vec<Input> {
        let open = shading == Shading::OpenPbr;
        let word = |pbr: &'static str, standard: &'static str| if open { pbr } else { standard };
        let mut inputs = Vec::new();
        let plain = [
            (Channel::BaseColor, "base_color", "color3"),
            (Channel::Metallic, word("base_metalness", "metalness"), "float"),
            (Channel::Roughness, "specular_roughness", "float"),
            (Channel::Specular, word("specular_weight", "specular"), "float"),
            (Channel::Ior, word("specular_ior", "specular_IOR"), "float"),
            (Channel::Anisotropy, word("specular_roughness_anisotropy", "specular_anisotropy"), "float"),
            (Channel::Coat, word("coat_weight", "coat"), "float"),
            (Channel::CoatRoughness, "coat_roughness", "float"),
            (Channel::Sheen, word("fuzz_weight", "sheen"), "float"),
            (Channel::Subsurface, word("subsurface_weight", "subsurface"), "float"),
            (Channel::Emission, "emission_color", "color3"),
        ];
        for (channel, name, ty) in plain {
            inputs.extend(self.input(channel, name, ty));
        }
        if inputs.iter().any(|input| input.0 == "emission_color") {
            inputs.push((word("emission_luminance", "emission"), "float", InputValue::Value("1".into())));
        }
        inputs.extend(self.normal(Channel::Normal, word("geometry_normal", "normal")));
        inputs.extend(self.normal(Channel::CoatNormal, word("geometry_coat_normal", "coat_normal")));
        if open {
            inputs.extend(self.input(Channel::Opacity, "geometry_opacity", "float"));
            inputs.extend(self.tangent());
        } else {
            match self.input(Channel::Opacity, "opacity", "float") {
                Some((name, _, InputValue::Node(node))) => {
                    let gray = vec![("in", "float", InputValue::Node(node))];
                    let color = self.add("opacity_color", "convert", "color3", gray);
                    inputs.push((name, "color3", InputValue::Node(color)));
                }
                Some((name, _, InputValue::Value(value))) => {
                    inputs.push((name, "color3", InputValue::Value(format!("{value}, {value}, {value}"))));
                }
                _ => {}
            }
            if let Some(angle) = self.angle(true) {
                inputs.push(("specular_rotation", "float", angle));
            }
        }
        inputs
    }
}
