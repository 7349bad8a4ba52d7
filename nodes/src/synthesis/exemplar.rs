//! [`Exemplar`]: prepares a picture, or any field, for synthesis.
//!
//! Source: JP5149288B2 II and III (row C1). Beyond the source: several
//! aligned pictures with weights, guide, mask, exemplars from fields. Cost: O(pixels · channels).
use glam::{DVec2, UVec2};
use shibo_kernel::ground::math::srgb_encode;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::synthesis::{feature, seams};
use shibo_node::{AnyField, CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, Xy, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{self as value, ExemplarFrame, Field, Grid, Stop, Tile, Tiling, Type, Window};
use std::sync::Arc;

/// How coarser levels are computed.
#[choice]
pub enum Levels {
    /// Increasingly blurred, with the same number of pixels.
    #[default]
    Stack,
    /// With half the columns and rows at each level.
    Pyramid,
}

/// Directions in which an exemplar tiles: opposite sides join.
#[choice]
pub enum Periodic {
    /// The tiling of the field; for a picture, detected from its pixels.
    #[default]
    Auto,
    /// Left and right, top and bottom join.
    Yes,
    /// No sides join.
    No,
}

/// Encoding in which colours are compared.
#[choice]
pub enum Compare {
    /// Perceptual: colours are encoded by the sRGB curve, other values are unchanged.
    #[default]
    Encoded,
    /// Scene-linear, unchanged.
    Linear,
}

/// A small picture from which any amount of similar texture can be synthesised.
///
/// A picture file is used at its own pixels, any other field at `size` pixels over `size_mm` of the canvas: the height
/// of a leather or a cut of wood can be an exemplar too. Aligned pictures in `others` are compared as well, so that a
/// colour, a height and a normal map stay together; all of them can be sampled later. Their resolutions may differ:
/// pictures are aligned by their places in mm.
///
/// ```ron
/// "cells": Worley(size: 5, jitter: 0.8),
/// "input": GradientMap(input: "cells.border", stops: [(0.0, "#2a1a10"), (0.25, "#8a5a34"), (1.0, "#c99a66")]),
/// "example": Exemplar(input: "input", size: (64, 64)),
/// ```
///
/// Elsewhere: Texture synthesis; Substance Designer *Make It Tile*; GIMP *Resynthesizer*.
#[node]
pub struct Exemplar {
    /// The picture, or any field.
    pub input: In<AnyField>,
    /// Additional fields, aligned with the first, that are compared too.
    #[schemars(extend("optional" = true))]
    pub others: Vec<In<AnyField>>,
    /// Weights of the first and the other fields; 1 if not given. A field of weight 0 is not compared.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e3))]
    pub weights: Vec<f64>,
    /// Mask, at least 0.5, of features whose shape must be kept, such as cracks or joints. The distance to their edges
    /// is compared too, which keeps thin features whole.
    pub feature: Option<In<Gray>>,
    /// Weight of `feature`.
    #[schemars(range(min = 0, max = 1e3))]
    #[default(1.0)]
    pub feature_weight: f64,
    /// Guide values, 0..1: where `guide` of `Synthesize` has a value, places of the exemplar with that value are shown.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub guide: Option<In<Gray>>,
    /// Mask of the pixels that may be shown: at least 0.5. The opacity of a picture is a good mask.
    pub mask: Option<In<Gray>>,
    /// Columns and rows. By default those of the picture if the field is a picture, otherwise 128.
    #[schemars(extend("minimum" = 1.0, "maximum" = 16384.0))]
    pub size: Option<(u32, u32)>,
    /// Size of the part of the field to use. By default the picture, or the whole canvas.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e6, "unit" = "mm"))]
    pub size_mm: Option<Xy>,
    /// Upper left corner of that part.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub origin: Xy,
    /// How coarser levels are computed.
    #[default(Levels::Stack)]
    pub levels: Levels,
    /// Directions in which the exemplar tiles.
    #[default(Periodic::Auto)]
    pub periodic: Periodic,
    /// Encoding in which colours are compared.
    #[default(Compare::Encoded)]
    pub compare: Compare,
    /// Width of a border whose pixels are not shown, in pixels of the level.
    #[schemars(range(min = 0, max = 4))]
    #[default(0.25)]
    pub margin: f64,
    /// Removes shading wider than this share of the exemplar before pixels are compared; 0 keeps it.
    #[schemars(range(min = 0, max = 1))]
    pub flatten: f64,
}

/// Maximum number of pixels along a side of an exemplar.
const MOST: u32 = 16_384;

impl Exemplar {
    fn frame(&self, cx: &Context<'_>, input: &Field) -> Result<ExemplarFrame, Stop> {
        let canvas = cx.size_mm();
        let picture = input.native().zip(input.pixels()).map(|(grid, pixels)| (grid.step, pixels));
        let extent = match (self.size_mm, picture) {
            (Some(size), _) => DVec2::new(size.x, size.y),
            (None, Some((step, pixels))) => step * pixels.as_dvec2(),
            (None, None) => canvas,
        };
        let size = match (self.size, picture) {
            (Some((w, h)), _) => UVec2::new(w, h),
            (None, Some((step, _))) => {
                (extent / step).round().clamp(DVec2::ONE, DVec2::splat(f64::from(MOST) + 1.0)).as_uvec2()
            }
            (None, None) => UVec2::splat(128),
        };
        let pixels = u64::from(size.x) * u64::from(size.y);
        // Colours, features, and per level appearance, neighbourhoods, tables.
        let bytes = pixels * 4 * 12 + pixels * 100 * u64::from((size.min_element().max(4) / 4).ilog2() + 1);
        if size.max_element() > MOST || bytes > cx.evaluator.memory() {
            let message = format!(
                "the exemplar of `{}x{}` pixels needs about {} MiB to analyse; {} MiB are allowed",
                size.x,
                size.y,
                bytes >> 20,
                cx.evaluator.memory() >> 20
            );
            let help = "set `size` to fewer pixels (256 are plenty), or raise --memory";
            return Err(Problem::new(Code::TooLarge, message).at("input").help(help).into());
        }
        let (pitch, origin) = (extent / size.as_dvec2(), DVec2::new(self.origin.x, self.origin.y));
        Ok(ExemplarFrame { size, origin, pitch, periodic: Tiling::NONE })
    }

    /// The directions in which opposite sides of the exemplar join; for a picture, detected from its planes.
    fn joins(&self, cx: &Context<'_>, input: &Field, frame: &ExemplarFrame, planes: &[Vec<f32>]) -> Tiling {
        match self.periodic {
            Periodic::Yes => Tiling::BOTH,
            Periodic::No => Tiling::NONE,
            Periodic::Auto if input.pixels().is_some() => {
                let [x, y] = seams::join(&together(planes), planes.len(), frame.size.to_array().map(|n| n as usize));
                Tiling { x, y }
            }
            Periodic::Auto => {
                let extent = frame.pitch * frame.size.as_dvec2();
                let whole = |a: f64, b: f64| (a - b).abs() < 1e-9 * b;
                let tiling = input.tiling().and(cx.tiling());
                Tiling {
                    x: tiling.x && whole(extent.x, cx.size_mm().x),
                    y: tiling.y && whole(extent.y, cx.size_mm().y),
                }
            }
        }
    }

    fn read(&self, cx: &Context<'_>, field: &Field, frame: &ExemplarFrame, port: &str) -> Result<Tile, Stop> {
        let grid = Grid { origin: frame.origin, step: frame.pitch, period: None, shown: None };
        let tile = cx.evaluator.raster(field, &grid, Window::full(frame.size))?;
        if let Some(bad) = tile.data().iter().position(|v| !v.is_finite()) {
            let pixel = bad % tile.window.len();
            let (x, y) = (pixel % tile.width(), pixel / tile.width());
            let message = format!("`{port}` is not finite at pixel ({x}, {y}) of the exemplar; it must be everywhere");
            return Err(Problem::new(Code::NotFinite, message).at(port).into());
        }
        Ok(tile)
    }

    /// Warns of a picture whose place differs from that of `input`: probably a mistake.
    fn advise(cx: &Context<'_>, input: &Field, other: &Field, port: &str) {
        let place = |field: &Field| {
            let (grid, pixels) = field.native().zip(field.pixels())?;
            Some((grid.origin, grid.step * pixels.as_dvec2()))
        };
        let Some(((here, extent), (there, other))) = place(input).zip(place(other)) else { return };
        let near = 1e-6 * extent.max_element();
        if (here - there).abs().max_element() > near || (extent - other).abs().max_element() > near {
            let round = |v: DVec2| (v * 1e3).round() / 1e3;
            let size = |v: DVec2| format!("{}x{} mm", round(v).x, round(v).y);
            let at = |v: DVec2| format!("({}, {})", round(v).x, round(v).y);
            let message = format!(
                "`{port}` is a picture of {} at {}, but `input` one of {} at {}",
                size(other),
                at(there),
                size(extent),
                at(here)
            );
            let help =
                "they are aligned by place: give both the same `size_mm` and `position`, if they belong together";
            cx.evaluator.warn(Problem::new(Code::Advice, message).at(port).help(help));
        }
    }

    /// The distance to the edges of features, limited to an eighth of the exemplar, as a field to compare.
    fn distance(&self, field: &Field, tile: &Tile, joins: Tiling) -> Vec<f32> {
        let size = [tile.width(), tile.height()];
        let radius = (size[0].min(size[1]) as f64 / 8.0).max(4.0);
        let distances = feature::signed_distance(tile.plane(0), size, [joins.x, joins.y], radius);
        self.feature(field, size, distances, self.feature_weight)
    }

    /// Values with a mean of 0 and a variance of `weight`² over all channels, encoded if they are colours.
    fn feature(&self, field: &Field, size: [usize; 2], mut data: Vec<f32>, weight: f64) -> Vec<f32> {
        if self.compare == Compare::Encoded && field.ty() == Type::Rgb {
            data.iter_mut().for_each(|v| *v = srgb_encode(v.max(0.0)));
        }
        let n = size[0] * size[1];
        let mut variance = 0.0;
        for plane in data.chunks_exact_mut(n) {
            let mean = plane.iter().map(|v| f64::from(*v)).sum::<f64>() / n as f64;
            plane.iter_mut().for_each(|v| *v -= narrow(mean));
            variance += plane.iter().map(|v| f64::from(*v) * f64::from(*v)).sum::<f64>() / n as f64;
        }
        if self.flatten > 0.0 {
            data.chunks_exact_mut(n).for_each(|plane| seams::flatten(plane, size, self.flatten));
        }
        let scale = if variance > 1e-20 { weight / variance.sqrt() } else { weight };
        data.iter_mut().for_each(|v| *v *= narrow(scale));
        data
    }
}

/// Interleaves planes: the values of each pixel side by side.
fn together(planes: &[Vec<f32>]) -> Vec<f32> {
    let n = planes.first().map_or(0, Vec::len);
    (0..n).flat_map(|p| planes.iter().map(move |plane| plane[p])).collect()
}

impl Node for Exemplar {
    const VERSION: u32 = 2;
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];
    const OUTPUTS: &'static [Output] =
        &[Output::new("exemplar", Type::Exemplar, "The exemplar, ready to be analysed or synthesised from.")];

    fn makes_tile(&self, _port: &str) -> bool {
        true
    }

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.weights.len() <= 1 + self.others.len() {
            return Vec::new();
        }
        let message = format!("{} weights for {} fields", self.weights.len(), 1 + self.others.len());
        vec![
            Problem::new(Code::BadValue, message)
                .at("weights")
                .help("give one for `input` and one for each of `others`"),
        ]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let frame = self.frame(cx, &input)?;
        let shown = self.read(cx, &input, &frame, "input")?;
        let mut planes: Vec<Vec<f32>> = Vec::new();
        let weight = |k: usize| self.weights.get(k).copied().unwrap_or(1.0);
        let n = shown.window.len();
        let mut add = |field: &Field, tile: &Tile, weight: f64| {
            if weight > 0.0 {
                let size = [tile.width(), tile.height()];
                let data = self.feature(field, size, tile.data().to_vec(), weight);
                planes.extend(data.chunks_exact(n).map(<[f32]>::to_vec));
            }
        };
        add(&input, &shown, weight(0));
        for (k, other) in cx.get_all(&self.others)?.iter().enumerate() {
            Self::advise(cx, &input, other, "others");
            add(other, &self.read(cx, other, &frame, "others")?, weight(k + 1));
        }
        let mut joins = None;
        if let Some(field) = cx.get_opt(&self.feature)?
            && self.feature_weight > 0.0
        {
            Self::advise(cx, &input, &field, "feature");
            let tile = self.read(cx, &field, &frame, "feature")?;
            let alone = [tile.plane(0).to_vec()];
            let joined = self.joins(cx, &input, &frame, if planes.is_empty() { &alone } else { &planes });
            planes.push(self.distance(&field, &tile, joined));
            joins = Some(joined);
        }
        if planes.is_empty() || planes.len() > 24 {
            let message = format!("{} channels are compared; there must be 1 to 24", planes.len());
            return Err(Problem::new(Code::BadValue, message).at("weights").into());
        }
        cx.check()?;
        let joins = joins.unwrap_or_else(|| self.joins(cx, &input, &frame, &planes));
        let features = together(&planes);
        let guide = match cx.get_opt(&self.guide)? {
            Some(guide) => {
                Self::advise(cx, &input, &guide, "guide");
                self.read(cx, &guide, &frame, "guide")?.plane(0).to_vec()
            }
            None => Vec::new(),
        };
        let usable: Vec<bool> = match cx.get_opt(&self.mask)? {
            Some(mask) => {
                Self::advise(cx, &input, &mask, "mask");
                self.read(cx, &mask, &frame, "mask")?.plane(0).iter().map(|v| *v >= 0.5).collect()
            }
            None => Vec::new(),
        };
        if !usable.is_empty() && !usable.contains(&true) {
            let problem = Problem::new(Code::BadValue, "the mask leaves nothing: it is below 0.5 everywhere");
            return Err(problem.at("mask").help("it must be at least 0.5 where the exemplar may be shown").into());
        }
        let frame = ExemplarFrame { periodic: joins, ..frame };
        Ok(Outputs::one(value::Exemplar {
            frame,
            shown: Arc::new(shown.data().to_vec()),
            channels: planes.len(),
            features: Arc::new(features),
            guide: Arc::new(guide),
            usable: Arc::new(usable),
            pyramid: self.levels == Levels::Pyramid,
            margin: self.margin,
            levels: Arc::default(),
            lattice: None,
        }))
    }
}
