//! Plans the pictures of a render: their encoding, and the keys under which they are cached.
use super::{Failure, RenderRequest};
use crate::diagnostics::{did_you_mean, suggest};
use crate::eval::Keys;
use crate::graph::{Export, Graph, GraphOutput};
use crate::picture::{Depth, Format, texture_attributes};
use crate::value::{Channel, Key, Renders, Type, Window};
use std::path::PathBuf;

/// The part of an output that a picture shows.
#[derive(Clone, Debug)]
pub(super) enum OutputPart {
    /// The field itself.
    Field,
    /// A channel of a material.
    Channel(Channel),
    /// All channels of a material.
    All,
    /// Segments drawn as lines.
    Lines,
    /// Files for another program.
    Export(Export),
}

impl OutputPart {
    /// A distinct name for each part, used in keys.
    fn name(&self) -> String {
        match self {
            Self::Field => "field".to_owned(),
            Self::Channel(channel) => channel.name().to_owned(),
            Self::All => "all channels".to_owned(),
            Self::Lines => "lines".to_owned(),
            Self::Export(export) => export.target.target.info().name.to_ascii_lowercase(),
        }
    }
}

/// A picture to be written.
#[derive(Clone, Debug)]
pub(super) struct Planned<'g> {
    pub(super) output: &'g GraphOutput,
    pub(super) part: OutputPart,
    pub(super) path: PathBuf,
    pub(super) format: Format,
    pub(super) depth: Depth,
    pub(super) range: (f64, f64),
    pub(super) metadata: Vec<(String, String)>,
    /// True for a height in mm.
    pub(super) is_height: bool,
    /// The key of the encoded file.
    pub(super) key: Key,
}

/// A requested output, with the channel if only one was requested.
pub(super) type Wanted<'g> = (&'g GraphOutput, Option<Channel>);

/// The outputs that a request names; all outputs if it names none.
pub(super) fn wanted<'g>(graph: &'g Graph, names: &[String]) -> Result<Vec<Wanted<'g>>, Failure> {
    if names.is_empty() {
        return Ok(graph.outputs.iter().map(|output| (output, None)).collect());
    }
    names.iter().map(|name| one_wanted(graph, name)).collect()
}

fn one_wanted<'g>(graph: &'g Graph, name: &str) -> Result<Wanted<'g>, Failure> {
    if let Some(output) = graph.outputs.iter().find(|output| output.name == name) {
        return Ok((output, None));
    }
    let split = name.rsplit_once('.').and_then(|(name, channel)| {
        let output = graph.outputs.iter().find(|o| o.name == name && o.ty == Type::Material)?;
        Some((output, channel))
    });
    let Some((output, channel)) = split else {
        let names: Vec<&str> = graph.outputs.iter().map(|o| o.name.as_str()).collect();
        let help = suggest(name, "output", &names);
        return Err(Failure::Usage(format!("the graph has no output `{name}`; {help}")));
    };
    match Channel::from_name(channel) {
        Some(channel) => Ok((output, Some(channel))),
        None => {
            let near = did_you_mean(channel, Channel::ALL.iter().map(|c| c.name()));
            let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
            Err(Failure::Usage(format!("a material has no channel `{channel}`{near}")))
        }
    }
}

/// Common data of all pictures of a render.
pub(super) struct Planner<'a> {
    pub(super) graph: &'a Graph,
    pub(super) keys: &'a Keys,
    pub(super) request: &'a RenderRequest,
    pub(super) window: Window,
}

impl Planner<'_> {
    /// The common beginning of the names of an output's files.
    pub(super) fn stem(&self, output: &GraphOutput) -> String {
        format!("{}{}", self.request.prefix, output.name)
    }

    /// Plans the picture of a part of an output; `key` identifies its content.
    pub(super) fn picture<'g>(
        &self,
        output: &'g GraphOutput,
        part: OutputPart,
        key: Key,
    ) -> Result<Planned<'g>, Failure> {
        let (stem, ty, channel) = match &part {
            OutputPart::Channel(channel) => {
                (format!("{}_{}", output.name, channel.name()), channel.ty(), Some(*channel))
            }
            OutputPart::Field | OutputPart::All | OutputPart::Lines | OutputPart::Export(_) => {
                (output.name.clone(), output.ty, None)
            }
        };
        let (extension, (format, depth)) = if let OutputPart::Export(export) = &part {
            self.check_whole(&stem)?;
            (export.target.plan().extension, (Format::Png, Depth::U8))
        } else {
            let encoding = self.encoding(output, ty, channel, &stem)?;
            (encoding.0.extension(), encoding)
        };
        let range = output.range.unwrap_or((0.0, 1.0));
        let mut planned = Planned {
            output,
            part,
            path: self.request.dir.join(format!("{}{stem}.{extension}", self.request.prefix)),
            format,
            depth,
            range,
            metadata: Vec::new(),
            is_height: false,
            key,
        };
        planned.is_height = self.is_height(&planned);
        planned.metadata = self.metadata(&planned);
        planned.key = self.file_key(&planned, pixels(ty));
        Ok(planned)
    }

    /// Refuses to put a region of a picture on a mesh.
    fn check_whole(&self, stem: &str) -> Result<(), Failure> {
        let size = self.graph.canvas.resolution;
        if self.window == Window::full(size) {
            return Ok(());
        }
        let message =
            format!("`{stem}` is made for another program, with whole pictures; leave --region out, or name a channel");
        Err(Failure::Usage(format!("{message} with --output")))
    }

    /// Format and depth from the command line, from the graph file, or as suits the type.
    fn encoding(
        &self,
        output: &GraphOutput,
        ty: Type,
        channel: Option<Channel>,
        stem: &str,
    ) -> Result<(Format, Depth), Failure> {
        let stated = self.request.format.or(output.format);
        if ty.renders() == Some(Renders::Lines) {
            return match stated {
                None | Some(Format::Svg) => Ok((Format::Svg, Depth::F32)),
                Some(other) => Err(Failure::Usage(format!(
                    "`{stem}` is made of segments, which {other} cannot hold; say `--format svg`, or draw them with a node"
                ))),
            };
        }
        if stated == Some(Format::Svg) {
            let message =
                format!("`{stem}` is a {ty}; SVG holds segments only. Name an output of segments with --output");
            return Err(Failure::Usage(message));
        }
        let pixels = pixels(ty);
        let exr_only = matches!(pixels, Type::Vec2 | Type::Jacobian | Type::Material);
        // Heights in mm and angles in degrees do not lie within 0..1.
        let floats = exr_only || matches!(channel, Some(Channel::Height | Channel::AnisotropyAngle));
        let stated = self.request.format.or(if self.request.depth.is_none() { output.format } else { None });
        let depth = self.request.depth.or(if self.request.format.is_none() { output.depth } else { None });
        let format = stated.unwrap_or(match depth {
            Some(Depth::F16 | Depth::F32) => Format::Exr,
            Some(Depth::U8 | Depth::U16) => output.format.filter(|f| *f != Format::Exr).unwrap_or(Format::Png),
            None if floats || output.storage.mip => Format::Exr,
            None => Format::Png,
        });
        let fine = matches!(pixels, Type::Gray | Type::Normal | Type::Ids);
        let mask = channel.is_some_and(|c| c.ty() == Type::Gray && c != Channel::Height);
        let depth = depth.unwrap_or(match format {
            Format::Exr => Depth::F32,
            Format::Tiff => Depth::U16,
            Format::Png if fine && !mask => Depth::U16,
            Format::Png | Format::Jpeg(_) | Format::Svg => Depth::U8,
        });
        if exr_only && format != Format::Exr {
            return Err(Failure::Usage(format!("`{stem}` is a {ty}, which only EXR can hold; say `--format exr`")));
        }
        if !format.depths().contains(&depth) {
            let depths: Vec<String> = format.depths().iter().map(ToString::to_string).collect();
            let message = format!("`{stem}`: {format} cannot hold {depth} samples; it holds {}", depths.join(" or "));
            return Err(Failure::Usage(message));
        }
        Ok((format, depth))
    }

    /// True if a file holds heights in mm.
    fn is_height(&self, planned: &Planned<'_>) -> bool {
        let Planned { output, part, .. } = planned;
        let node = &self.graph.nodes[output.node].node;
        match part {
            OutputPart::Channel(channel) => *channel == Channel::Height,
            OutputPart::Field if output.ty == Type::Gray => {
                let unit = node.outputs().get(output.output).and_then(|own| node.unit(own));
                // A formula has no unit. A range that fits its values is asked for heights.
                unit.map_or(output.storage.fit, |unit| unit == "mm")
            }
            OutputPart::Export(export) => export.target.target.info().has_height(),
            _ => false,
        }
    }

    fn metadata(&self, planned: &Planned<'_>) -> Vec<(String, String)> {
        let canvas = &self.graph.canvas;
        let params: Vec<String> = self.graph.params.iter().map(|p| format!("{}: {}", p.name, p.value)).collect();
        let mut metadata = vec![
            ("Software".into(), concat!("Shibo ", env!("CARGO_PKG_VERSION")).into()),
            ("shibo:graph".into(), planned.key.to_string()),
            ("shibo:output".into(), planned.output.name.clone()),
            ("shibo:seed".into(), canvas.seed.to_string()),
            ("shibo:size_mm".into(), format!("{} {}", canvas.size_mm.x, canvas.size_mm.y)),
            ("shibo:parameters".into(), params.join(", ")),
        ];
        if planned.is_height {
            let pixel = canvas.size_mm / canvas.resolution.as_dvec2();
            metadata.push(("shibo:pixel_mm".into(), format!("{} {}", pixel.x, pixel.y)));
            let is_picture = !matches!(planned.part, OutputPart::Export(_));
            if is_picture && planned.depth.is_integer() && !planned.output.storage.fit {
                metadata.push(("shibo:height_mm".into(), format!("{} {}", planned.range.0, planned.range.1)));
            }
        }
        if planned.output.storage.mip {
            metadata.extend(texture_attributes([canvas.tile.x, canvas.tile.y]));
        }
        metadata
    }

    /// The key of the encoded file, derived from everything its bytes depend on.
    fn file_key(&self, planned: &Planned<'_>, ty: Type) -> Key {
        let Window { x, y, width, height } = self.window;
        let resolution = self.graph.canvas.resolution;
        let range = [planned.range.0, planned.range.1].map(|end| end.to_bits().to_le_bytes());
        let pixels = [resolution.x, resolution.y, x.cast_unsigned(), y.cast_unsigned(), width, height];
        let pixels: Vec<u8> = pixels.into_iter().flat_map(u32::to_le_bytes).collect();
        let request = self.request;
        let storage = planned.output.storage;
        let flags =
            [request.dither, request.best_compression, storage.mip, storage.widen_roughness, storage.normal_down];
        let how = [planned.depth as u8, storage.color_space.map_or(0, |space| space as u8 + 1)];
        let how: Vec<u8> = how.into_iter().chain(flags.map(u8::from)).collect();
        let part = planned.part.name();
        let mut parts: Vec<&[u8]> = vec![planned.key.as_bytes(), part.as_bytes(), ty.name().as_bytes()];
        parts.extend([planned.format.extension().as_bytes(), range.as_flattened(), &pixels, &how]);
        if storage.fit {
            parts.push(b"fit");
        }
        parts.extend(planned.metadata.iter().flat_map(|(name, value)| [name.as_bytes(), value.as_bytes()]));
        Key::of("file", &parts)
    }
}

/// Channels and keys, 17 bytes each.
pub(super) fn encode_channels(channels: &[(Channel, Key)]) -> Vec<u8> {
    let index = |channel: &Channel| Channel::ALL.iter().position(|c| c == channel).and_then(|i| u8::try_from(i).ok());
    channels.iter().flat_map(|(c, key)| index(c).into_iter().chain(*key.as_bytes())).collect()
}

pub(super) fn decode_channels(bytes: &[u8]) -> Option<Vec<(Channel, Key)>> {
    let (entries, rest) = bytes.as_chunks::<17>();
    let entry = |bytes: &[u8; 17]| {
        let (index, key) = bytes.split_first()?;
        Some((*Channel::ALL.get(usize::from(*index))?, Key::from_bytes(key.try_into().ok()?)))
    };
    entries.iter().map(entry).collect::<Option<Vec<_>>>().filter(|_| rest.is_empty())
}

/// The type of the field that is rendered for a value of type `ty`.
fn pixels(ty: Type) -> Type {
    match ty.renders() {
        Some(Renders::Field(field)) => field,
        _ => ty,
    }
}
