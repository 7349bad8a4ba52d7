//! [`ColorPattern`]: the colours of wood through a year.
//!
//! Source: Momoi & Takatera 2014, §1, §2.1 and §4.3 (rows B22, B23, B24). Beyond the source: years are found
//! automatically along a line of a picture; see [`kernel::wood::strip`](shibo_kernel::wood::strip). Cost: O(entries),
//! with a picture O(pixels of the strip).
use glam::{DVec2, UVec2};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::wood::pattern;
use shibo_kernel::wood::strip::{self, Direction, Sampled, Strip, StripError, StripSpec};
use shibo_node::{CanvasFacts, Color, Context, Fact, In, Node, Output, Outputs, Rgb, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{self as value, Field, Stop, Type, Window};

/// The years of a picture that are used.
#[choice]
pub enum Years {
    /// One year: the mean of similar years.
    #[default]
    One,
    /// All years, one after another, with their colours unchanged.
    All,
}

/// The colours of a year's growth, from the first early wood to the last late wood: from stops, or from a picture of
/// wood.
///
/// With an `image`, a strip along `line` across the rings is read; years are found automatically, best if each has ten
/// pixels or more. `VaryGrowth` with `series: FromPattern` uses their widths.
///
/// ```ron
/// "rings": ColorPattern(stops: [(0, "#c18659"), (0.6, "#bf8356"), (0.88, "#b47648"), (0.97, "#a66a40"), (1, "#b87d51")]),
/// "nodes": TrunkNodes(height: (-400, 400), count: 5, wander: 8),
/// "tree": Tree(skeleton: FitSkeleton(curve: "nodes"), thickening_speed: 4),
/// "time": TrunkTime(tree: "tree"),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "example": CutPlane(solid: "wood", preset: FlatSawn, distance: 9),
/// ```
#[node]
pub struct ColorPattern {
    /// A picture of wood; instead of `stops`.
    pub image: Option<In<Rgb>>,
    /// Line of the strip in the picture, from `(x, y)` to `(x, y)` in mm on the canvas; across its middle if not given.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub line: Option<((f64, f64), (f64, f64))>,
    /// Half width of the strip: number of pixels read on each side of the line.
    #[schemars(range(min = 0, max = 200), extend("unit" = "px"))]
    #[default(12)]
    pub strip: u32,
    /// Direction of the line relative to the growth of the tree.
    #[default(Direction::Auto)]
    pub direction: Direction,
    /// True if early wood is the darker part of the year, as in some ring-porous woods.
    pub early_dark: bool,
    /// The years that are used.
    #[default(Years::One)]
    pub years: Years,
    /// Width of a year along the line; 0 to find the years. If given, years are not searched, and even pictures without
    /// rings, such as veneer, give colours; with `years: All` the colours along the line, unchanged.
    #[schemars(range(min = 0, max = 1e6), extend("unit" = "mm"))]
    pub period: f64,
    /// Colours of wood through the year, `[(0.0, "#rrggbb"), …]`, ascending from 0 to 1; 1 to 64 stops. Colours are
    /// interpolated linearly from the last stop to the first one of the next year; two stops at the same place make a
    /// border.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    #[default(pine())]
    pub stops: Vec<(f64, Color)>,
    /// Number of entries of the table of a year.
    #[schemars(range(min = 1, max = 4096))]
    #[default(256)]
    pub entries: u32,
    /// Factor on the contrast through the year: 1 is unchanged, 0 none.
    #[schemars(range(min = 0, max = 4))]
    #[default(1.0)]
    pub contrast: f64,
}

/// Colours of a year of pine.
fn pine() -> Vec<(f64, Color)> {
    let stops = [
        (0.0, [0xEA, 0xCB, 0x98]),
        (0.45, [0xE5, 0xC0, 0x8A]),
        (0.66, [0xDA, 0xA8, 0x6C]),
        (0.84, [0xC6, 0x8B, 0x50]),
        (0.95, [0xB4, 0x74, 0x3C]),
        (0.985, [0xB9, 0x7B, 0x44]),
        (1.0, [0xDA, 0xB0, 0x7A]),
    ];
    stops.map(|(at, bytes)| (at, Color::srgb(bytes))).into()
}

impl ColorPattern {
    /// The strip of pixels along the line, at the resolution of the picture; and the size of a pixel in mm.
    fn read(&self, cx: &Context<'_>, image: &Field) -> Result<(Strip, f64), Stop> {
        let size = cx.size_mm();
        let middle = ((0.02 * size.x, 0.5 * size.y), (0.98 * size.x, 0.5 * size.y));
        let ((x0, y0), (x1, y1)) = self.line.unwrap_or(middle);
        let (a, b) = (DVec2::new(x0, y0), DVec2::new(x1, y1));
        let inside = |p: DVec2| p.cmpge(DVec2::ZERO).all() && p.cmple(size).all();
        if !(inside(a) && inside(b)) {
            let message = format!(
                "line runs from ({x0}, {y0}) to ({x1}, {y1}), outside the picture of {} × {} mm",
                size.x, size.y
            );
            return Err(Problem::new(Code::BadValue, message)
                .at("line")
                .help("give both ends in mm on the canvas")
                .into());
        }
        let grid = image.native().unwrap_or_else(|| cx.canvas.grid(UVec2::splat(1024)));
        let step = grid.step.min_element();
        let way = b - a;
        let count = way.length() / step;
        if !(24.0..=65_536.0).contains(&count) {
            let message = format!("line is {count:.0} pixels of the picture long; it must be 24 to 65536");
            return Err(Problem::new(Code::BadValue, message)
                .at("line")
                .help("draw it across at least three rings")
                .into());
        }
        let (along, aside) = (way.normalize() * step, way.normalize().perp() * step);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "24 to 65536")]
        let length = count as usize;
        let half = self.strip as usize;
        let rows = 2 * half + 1;
        let point = |row: usize, i: usize| a + along * (i as f64 + 0.5) + aside * (row as f64 - half as f64);
        let corners = [point(0, 0), point(rows - 1, 0), point(0, length - 1), point(rows - 1, length - 1)];
        let pixel = |p: DVec2| ((p - grid.origin) / grid.step).floor().as_ivec2();
        let (low, high) = corners.iter().fold((pixel(a), pixel(a)), |(l, h), c| (l.min(pixel(*c)), h.max(pixel(*c))));
        let (low, span) = (low - 2, (high - low + 5).as_uvec2());
        let window = Window { x: low.x, y: low.y, width: span.x, height: span.y };
        if window.len() as u64 * 12 > cx.evaluator.memory() {
            return Err(Problem::new(Code::TooLarge, "line spans more of the picture than memory holds")
                .at("line")
                .into());
        }
        let tile = cx.evaluator.raster(image, &grid, window)?;
        let sample = |p: DVec2| -> [f32; 3] {
            let at = (p - grid.origin) / grid.step - 0.5 - low.as_dvec2();
            let base = at.floor();
            let t = (at - base).as_vec2();
            let base = base.as_ivec2().clamp(glam::IVec2::ZERO, span.as_ivec2() - 2).as_uvec2();
            let (i, w) = (base.y as usize * tile.width() + base.x as usize, tile.width());
            std::array::from_fn(|c| {
                let v = tile.plane(c);
                let (top, bottom) = (v[i] + (v[i + 1] - v[i]) * t.x, v[i + w] + (v[i + w + 1] - v[i + w]) * t.x);
                top + (bottom - top) * t.y
            })
        };
        let pixels = (0..rows * length).map(|k| sample(point(k / length, k % length))).collect();
        Ok((Strip { pixels, length, rows }, step))
    }

    fn sampled(&self, cx: &Context<'_>, image: &Field) -> Result<Outputs, Stop> {
        let (strip, step) = self.read(cx, image)?;
        let spec = StripSpec {
            towards: self.direction,
            early_dark: self.early_dark,
            entries: self.entries as usize,
            all: self.years == Years::All,
            period: (self.period > 0.0).then(|| narrow(self.period / step)),
        };
        let Sampled { mut table, widths, years, confidence, skew } =
            strip::sample(&strip, &spec).map_err(|e| unreadable(e).at("line"))?;
        if self.period == 0.0 && self.direction == Direction::Auto && skew.abs() < 0.3 {
            let message = format!("which way the line runs is uncertain (skewness {skew:.2}); it was guessed");
            let help = "say `direction: Bark` or `direction: Pith`";
            cx.evaluator.warn(Problem::new(Code::Advice, message).at("direction").help(help));
        }
        if confidence < 0.6 {
            let message = format!(
                "it is not sure that these are years: {} of {} are alike (confidence {confidence:.2})",
                years.1, years.0
            );
            cx.evaluator
                .warn(Problem::new(Code::Advice, message).at("line").help("look for a line with clearer rings"));
        }
        pattern::contrast(&mut table, narrow(self.contrast));
        Ok(Outputs::one(value::ColorPattern { table, entries: self.entries as usize, widths }))
    }
}

/// The problem for a strip that cannot be read.
fn unreadable(error: StripError) -> Problem {
    let (message, help) = match error {
        StripError::Short => ("the line is too short to hold years", "draw it across at least three rings"),
        StripError::Flat => ("all is of one colour along the line", "choose a line across rings"),
        StripError::NoRings => (
            "no years stand out along the line",
            "choose a line straight across rings, with ten pixels or more for each",
        ),
        StripError::Unlike(confidence) => {
            let message = format!(
                "what was found along the line are not years: they are not like each other (confidence {confidence:.2})"
            );
            return Problem::new(Code::BadValue, message)
                .help("choose a line straight across rings, with ten pixels or more for each");
        }
    };
    Problem::new(Code::BadValue, message).help(help)
}

impl Node for ColorPattern {
    const VERSION: u32 = 3;
    const OUTPUTS: &'static [Output] = &[Output::new("pattern", Type::ColorPattern, "The colours, entry by entry.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let problem = |code, message: String| vec![Problem::new(code, message).at("stops")];
        match self.stops.len() {
            0 => return problem(Code::BadValue, "stops is empty; there must be at least one stop".to_owned()),
            n if n > 64 => return problem(Code::TooLarge, format!("stops has {n} entries; at most 64 are allowed")),
            _ => {}
        }
        match self.stops.windows(2).position(|pair| pair[1].0 < pair[0].0) {
            Some(i) => {
                let (before, at) = (self.stops[i].0, self.stops[i + 1].0);
                let message =
                    format!("stop {} is at `{at}`; it must not lie before stop {}, at `{before}`", i + 2, i + 1);
                problem(Code::BadValue, message)
            }
            None => Vec::new(),
        }
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        if let Some(image) = cx.get_opt(&self.image)? {
            return self.sampled(cx, &image);
        }
        let stops: Vec<_> = self.stops.iter().map(|(at, color)| (*at, color.0)).collect();
        let entries = self.entries as usize;
        let mut table = pattern::table(&stops, entries);
        pattern::contrast(&mut table, narrow(self.contrast));
        Ok(Outputs::one(value::ColorPattern { table, entries, widths: Vec::new() }))
    }
}
