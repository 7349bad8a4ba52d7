//! From a graph and options to unknowns: which parameters are fitted, the values to begin with, and a text of the graph whose canvas
//! and light are driven by parameters of their own.
use super::drawn::{drawn, ron};
use super::light::{Light, relief};
use super::photo::Photo;
use super::{Bench, Refused, Request};
use crate::{Amount, Ask, Kind, Start, Unknown, Unknowns};
use shibo_bridge::GraphText;
use shibo_bridge::compare::{CompareRequest, Gauge, compare};
use shibo_engine::session::Failure;
use shibo_graph::{Gate, Graph, GraphParam, LoadOptions, load_text};
use shibo_ide::actions::{apply, driven};
use shibo_ide::{Cx, Workspace};
use shibo_node::parse_color;
use shibo_value::diagnostics::did_you_mean;
use shibo_value::{Resolution, Type, linear_to_srgb};
use std::path::PathBuf;

/// The parameters that are added to the text.
const WIDTH: &str = "fit_width_mm";
const AZIMUTH: &str = "fit_azimuth";
const ELEVATION: &str = "fit_elevation";
/// Pixels of a side that are compared.
const SIDE: u32 = 128;

/// The unknowns of a fit, and the graph that renders them.
pub(super) struct Setup {
    pub(super) gauge: Gauge,
    pub(super) output: String,
    /// Grey values of the output count from the smallest to the largest.
    pub(super) stretched: bool,
    pub(super) path: PathBuf,
    /// The text with parameters for canvas and light.
    pub(super) text: String,
    pub(super) unknowns: Unknowns,
    pub(super) starts: Vec<Start>,
    /// The names of the starts after the first: presets.
    pub(super) presets: Vec<String>,
    /// The parameters that the preset gets: the first unknowns.
    pub(super) written: Vec<GraphParam>,
    /// Values of parameters that are no unknowns, for each combination.
    pub(super) combinations: Vec<Vec<(String, String)>>,
    /// Folders of imports.
    import_paths: Vec<PathBuf>,
    /// The files that the graph may read.
    gate: Gate,
    /// Values of the added parameters that are known, and of sub-graphs.
    known: Vec<(String, String)>,
    /// Numbers of the graph's own seed parameter, if it has one.
    seeds: Option<(f64, f64)>,
    /// Parameters that cannot be fitted, with the reason.
    pub(super) left: Vec<(String, &'static str)>,
}

impl Setup {
    pub(super) fn of(
        bench: Bench<'_>,
        (graph, file): (&Graph, &GraphText),
        photo: &Photo,
        args: &Request,
    ) -> Result<Self, Refused> {
        let output = output(args, graph)?;
        let base = match &args.start {
            None if args.set.is_empty() => graph.params.clone(),
            preset => loaded(bench, file, preset.as_deref(), &args.set)?,
        };
        let (written, left) = chosen(args, graph)?;
        let kinds: Vec<Kind> = written.iter().filter_map(kind).collect();
        let held = |params: &[GraphParam]| -> Vec<(String, String)> {
            let is_free = |param: &&GraphParam| {
                let own = !written.iter().any(|one| one.name == param.name);
                own && param.name != "seed" && param.ty != "Path"
            };
            let differs = |param: &GraphParam| param.value != param.default;
            params.iter().filter(is_free).filter(|p| differs(p)).map(|p| (p.name.clone(), p.value.clone())).collect()
        };
        // Parameters that are excluded keep the value of the start in all presets.
        let excluded = |name: &str| {
            args.fixed.iter().any(|fixed| fixed == name)
                || (!args.only.is_empty() && !args.only.iter().any(|only| only == name))
        };
        let mut starts = Vec::new();
        let mut combinations: Vec<Vec<(String, String)>> = Vec::new();
        let mut presets = Vec::new();
        let amounts = |params: &[GraphParam]| -> Vec<Amount> {
            let of = |(one, kind): (&GraphParam, &Kind)| {
                let param = params.iter().find(|param| param.name == one.name).unwrap_or(one);
                amount(param).unwrap_or(middle(*kind))
            };
            written.iter().zip(&kinds).map(of).collect()
        };
        // A preset that is replaced is no start, so a second run has the same result.
        let others = graph.presets.iter().filter(|name| **name != args.preset);
        for preset in std::iter::once(None).chain(others.map(Some)) {
            let mut params = match preset {
                None => base.clone(),
                Some(preset) => loaded(bench, file, Some(preset), &[])?,
            };
            for (param, own) in params.iter_mut().zip(&base).filter(|(param, _)| excluded(&param.name)) {
                param.value.clone_from(&own.value);
            }
            let held = held(&params);
            let combination = combinations.iter().position(|known| *known == held).unwrap_or(combinations.len());
            if combination == combinations.len() {
                combinations.push(held);
            }
            starts.push(Start { amounts: amounts(&params), combination });
            presets.extend(preset.cloned());
        }
        let discrete = graph.params.iter().find(|param| args.only.contains(&param.name) && is_discrete(param));
        if let Some(param) = discrete.filter(|_| combinations.len() < 2) {
            let name = &param.name;
            return Err(Refused::Usage(format!(
                "`{name}` has separate values, which are taken from presets, and no two presets differ in it: add presets that differ"
            )));
        }
        let unknown = |(param, kind): (&GraphParam, &Kind)| Unknown { name: param.name.clone(), kind: *kind };
        let mut unknowns: Vec<Unknown> = written.iter().zip(&kinds).map(unknown).collect();
        let pixels = photo.side().min(if args.fine { 2 * SIDE } else { SIDE });
        let seeds = graph.params.iter().find(|param| param.name == "seed").map(|p| p.range.unwrap_or((0.0, 1e6)));
        let gauge = Gauge::new(pixels as usize);
        let mut setup = Self {
            gauge,
            output,
            stretched: false,
            path: file.path.clone(),
            text: file.text.clone(),
            unknowns: Unknowns(Vec::new()),
            starts,
            presets,
            written,
            combinations,
            import_paths: bench.tools.import_paths.clone(),
            gate: bench.tools.gate.clone(),
            // Values of sub-graphs are no parameters of this file, and hold in all renders.
            known: args.set.iter().filter(|(name, _)| name.contains('.')).cloned().collect(),
            seeds,
            left,
        };
        let small = setup.small(bench, file)?;
        let picture = drawn(bench.session, &small, &setup.output, bench.cancel);
        let picture = picture.map_err(|failure| Refused::Graph(failure, small.sources.clone()))?;
        setup.stretched = picture.channels == 1;
        let mut extra = Vec::new();
        let width = match photo.width_mm {
            Some(width) => {
                setup.known.push((WIDTH.to_owned(), format!("{width}")));
                width
            }
            None => {
                let size = graph.canvas.size_mm.min_element();
                let coarser = compare(&picture, &photo.picture, &CompareRequest::default()).ok().and_then(|c| c.size);
                let width = size * coarser.map_or(1.0, |size| size.value).clamp(0.25, 4.0);
                unknowns.push(Unknown {
                    name: WIDTH.to_owned(),
                    kind: Kind::Number { low: width / 2.0, high: 2.0 * width },
                });
                extra.push(Amount::Number(width));
                width
            }
        };
        let mut world = Workspace::new(bench.tools.registry.clone(), Vec::new())
            .with_import_paths(bench.tools.import_paths.clone())
            .with_gate(bench.tools.gate.clone());
        let opened = world.open(&setup.path, file.text.as_str());
        let cx = Cx { world: &world, file: &opened };
        let lit = relief(graph, &setup.output, cx);
        let mut fields: Vec<(String, &str, String)> = Vec::new();
        let mut params = format!("\"{WIDTH}\": Number(default: {width:?})");
        if let (Some(lit), false) = (&lit, args.light == Light::Graph) {
            let drives = [("azimuth", AZIMUTH, lit.azimuth), ("elevation", ELEVATION, lit.elevation)];
            let takes = if lit.has_lamp { 2 } else { 1 };
            for (field, name, value) in drives.into_iter().take(takes) {
                fields.push((lit.node.clone(), field, format!("\"${name}\"")));
                params += &format!(", \"{name}\": Number(default: {value:?})");
                let kind = match field {
                    "azimuth" => Kind::Angle { low: 0.0, turn: 360.0 },
                    _ => Kind::Number { low: 10.0, high: 85.0 },
                };
                match args.light {
                    Light::From(azimuth, elevation) => {
                        let value = if field == "azimuth" { azimuth } else { elevation };
                        setup.known.push((name.to_owned(), format!("{value}")));
                    }
                    _ => {
                        unknowns.push(Unknown { name: name.to_owned(), kind });
                        extra.push(Amount::Number(value));
                    }
                }
            }
        } else if matches!(args.light, Light::From(..)) {
            return Err(Refused::Usage(format!(
                "the light of `{}` cannot be set: it is no `Relief` of this file; leave out the light",
                setup.output
            )));
        }
        let fields: Vec<(&str, &str, &str)> = fields.iter().map(|(a, b, c)| (a.as_str(), *b, c.as_str())).collect();
        let size = format!("\"${WIDTH}\"");
        let edits = driven(cx, &params, &[("size_mm", &size)], &fields).map_err(Refused::Unfit)?;
        setup.text = apply(&file.text, &edits);
        setup.starts.iter_mut().for_each(|start| start.amounts.extend(extra.iter().copied()));
        setup.unknowns = Unknowns(unknowns);
        Ok(setup)
    }

    /// Pixels of a side that are compared.
    pub(super) fn side(&self) -> u32 {
        u32::try_from(self.gauge.side()).unwrap_or(SIDE)
    }

    /// The graph as it is, at the resolution of the comparison.
    fn small(&self, bench: Bench<'_>, file: &GraphText) -> Result<Graph, Refused> {
        let resolution = Some(Resolution::Longer(2 * self.side()));
        let (import_paths, gate) = (self.import_paths.clone(), self.gate.clone());
        let options = LoadOptions { resolution, import_paths, gate, ..LoadOptions::default() };
        read(bench, file, &options)
    }

    /// The options to load the text at some values.
    pub(super) fn options(&self, ask: &Ask, resolution: Resolution) -> LoadOptions {
        let mut set = self.known.clone();
        set.extend(self.combinations.get(ask.combination).into_iter().flatten().cloned());
        let value = |(unknown, amount): (&Unknown, &Amount)| (unknown.name.clone(), ron(*amount));
        set.extend(self.unknowns.0.iter().zip(&ask.amounts).map(value));
        let seed = match self.seeds {
            Some((low, high)) => low.ceil() + f64::from(ask.seed) % (high.floor() - low.ceil() + 1.0).max(1.0),
            None => f64::from(ask.seed),
        };
        set.push(("seed".to_owned(), format!("{seed}")));
        LoadOptions {
            set,
            resolution: Some(resolution),
            import_paths: self.import_paths.clone(),
            gate: self.gate.clone(),
            ..LoadOptions::default()
        }
    }

    /// The places of the unknowns that are not written: width, azimuth, elevation.
    pub(super) fn hidden(&self) -> [Option<usize>; 3] {
        [WIDTH, AZIMUTH, ELEVATION].map(|name| self.unknowns.0.iter().position(|unknown| unknown.name == name))
    }
}

/// The parameters at a preset and further values.
fn loaded(
    bench: Bench<'_>,
    file: &GraphText,
    preset: Option<&str>,
    set: &[(String, String)],
) -> Result<Vec<GraphParam>, Refused> {
    let options = LoadOptions {
        preset: preset.map(ToOwned::to_owned),
        set: set.to_vec(),
        import_paths: bench.tools.import_paths.clone(),
        gate: bench.tools.gate.clone(),
        ..LoadOptions::default()
    };
    read(bench, file, &options).map(|graph| graph.params)
}

/// Loads the graph with options.
fn read(bench: Bench<'_>, file: &GraphText, options: &LoadOptions) -> Result<Graph, Refused> {
    let loaded = load_text(&file.path, &file.text, bench.session.registry(), options);
    loaded.graph.ok_or(Refused::Graph(Failure::Errors(loaded.diagnostics), loaded.sources))
}

/// The output that is compared.
fn output(args: &Request, graph: &Graph) -> Result<String, Refused> {
    let names: Vec<&str> = graph.outputs.iter().map(|output| output.name.as_str()).collect();
    if let Some(name) = &args.output {
        let first = name.split('.').next().unwrap_or_default();
        if !names.contains(&name.as_str()) && !names.contains(&first) {
            let near = did_you_mean(first, names.iter().copied());
            let help = near.map_or(format!("it has {}", names.join(", ")), |near| format!("did you mean `{near}`?"));
            return Err(Refused::Usage(format!("the graph has no output `{name}`; {help}")));
        }
        return Ok(name.clone());
    }
    if names.contains(&"lit") {
        return Ok("lit".to_owned());
    }
    let of = |ty: Type| graph.outputs.iter().find(|output| output.ty == ty).map(|output| output.name.clone());
    of(Type::Material)
        .map(|name| format!("{name}.base_color"))
        .or_else(|| of(Type::Rgb))
        .or_else(|| of(Type::Gray))
        .ok_or_else(|| Refused::Unfit("the graph has no output that is a picture: give it one".to_owned()))
}

/// Parameters that are not fitted, each with the reason.
type Left = Vec<(String, &'static str)>;

/// The fitted parameters, and the others.
fn chosen(args: &Request, graph: &Graph) -> Result<(Vec<GraphParam>, Left), Refused> {
    let names: Vec<&str> = graph.params.iter().map(|param| param.name.as_str()).collect();
    for name in args.only.iter().chain(&args.fixed) {
        if !names.contains(&name.as_str()) {
            let near = did_you_mean(name, names.iter().copied());
            let help = near.map_or(format!("it has {}", names.join(", ")), |near| format!("did you mean `{near}`?"));
            return Err(Refused::Usage(format!("the graph has no parameter `{name}`; {help}")));
        }
    }
    let (mut chosen, mut left) = (Vec::new(), Vec::new());
    let wanted = |name: &String| args.only.contains(name) || (args.only.is_empty() && !args.fixed.contains(name));
    let colors = graph.params.iter().any(|param| wanted(&param.name) && param.ty == "Color");
    for param in graph.params.iter().filter(|param| wanted(&param.name) && param.name != "seed") {
        if is_discrete(param) {
            left.push((param.name.clone(), "taken from a preset"));
        } else if param.name == "exposure" && colors && args.only.is_empty() {
            left.push((param.name.clone(), "held, because colours have the same effect"));
        } else if kind(param).is_none() || amount(param).is_none() {
            left.push((param.name.clone(), "held, because it has no range"));
        } else {
            chosen.push(param.clone());
        }
    }
    let discrete = args.only.iter().any(|name| left.iter().any(|(one, _)| one == name));
    if chosen.is_empty() && !discrete {
        return Err(Refused::Usage(
            "nothing is left to fit: the graph needs parameters with ranges, or colours".to_owned(),
        ));
    }
    Ok((chosen, left))
}

/// Returns true if the values of a parameter are separate.
fn is_discrete(param: &GraphParam) -> bool {
    ["Integer", "Bool", "Choice"].contains(&param.ty)
}

/// The kind of unknown that a parameter is.
fn kind(param: &GraphParam) -> Option<Kind> {
    if param.ty == "Color" {
        return Some(Kind::Color);
    }
    let (low, high) = param.range.filter(|(low, high)| param.ty == "Number" && low.is_finite() && high.is_finite())?;
    let turn = high - low;
    let degrees = param.unit.as_deref() == Some("°") && (turn == 180.0 || turn == 360.0);
    Some(if degrees { Kind::Angle { low, turn } } else { Kind::Number { low, high } })
}

/// The value of a parameter, if it is written as one.
pub(super) fn amount(param: &GraphParam) -> Option<Amount> {
    let text = param.value.trim();
    if param.ty != "Color" {
        return text.parse().ok().filter(|value: &f64| value.is_finite()).map(Amount::Number);
    }
    let linear: [f32; 3] = match text.strip_prefix('"') {
        Some(color) => parse_color(color.strip_suffix('"')?)?,
        None => {
            let numbers: Option<Vec<f32>> =
                text.trim_matches(['(', ')']).split(',').map(|number| number.trim().parse().ok()).collect();
            numbers?.try_into().ok()?
        }
    };
    Some(Amount::Color(linear.map(|channel| f64::from(linear_to_srgb(channel)).clamp(0.0, 1.0))))
}

fn middle(kind: Kind) -> Amount {
    match kind {
        Kind::Color => Amount::Color([0.5; 3]),
        Kind::Angle { low, turn } => Amount::Number(low + 0.5 * turn),
        Kind::Number { low, high } => Amount::Number(0.5 * (low + high)),
    }
}
