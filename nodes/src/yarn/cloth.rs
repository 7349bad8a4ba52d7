//! [`Cloth`]: woven cloth of yarns, by a draft.
//!
//! See [`kernel::cloth`](shibo_kernel::yarn::cloth). Cost: O(crossings + pixels), by tiles.
use super::parts::{self, ACROSS, ALONG, CROWN, DIRECTION, FIBER, HEIGHT, MASK, Make, THREAD};
use crate::fitted;
use glam::DVec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::yarn::cloth::{POINTS, Woven};
use shibo_kernel::yarn::draft::{Draft, sequence};
use shibo_kernel::yarn::lines::fit;
use shibo_kernel::yarn::section::Yarn;
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, Xy, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Stop, Tiling, Type};

/// Woven cloth of yarns with plies, twist and fibres, by a draft.
///
/// `draft` is a name (`plain`, `basket`, `twill 2/1`, `twill 2/2`, `herringbone`, `satin`, `sateen`) or a picture: rows of
/// `x`, where the warp lies on top, and `.`, where the weft does, separated by `/`. With `threading`, `tie_up` and
/// `treadling` the draft of a loom replaces it. `warp_colors` and `weft_colors` give each thread a letter, and `color` is
/// the number of that letter: stripes, checks and tartans.
///
/// `Weave` is the faster node for straps, basketry and cloth from afar: its threads are smooth, and it lies at any angle.
/// This node draws the yarns themselves, and its threads run along x and y.
///
/// ```ron
/// "cloth": Cloth(draft: "herringbone", pitch: (2.5, 2), warp_colors: "a", weft_colors: "b"),
/// "wool": "= mix(#c9b793, #4a3d33, if(cloth.color == 2, 1, 0)) * (0.4 + 0.6 * cloth.crown) * (0.7 + 0.6 * cloth.fiber)",
/// "example": Relief(height: "cloth", base_color: "wool", environment: Studio),
/// ```
///
/// Elsewhere: Substance Designer *Weave Generator*; weaving drafts (WIF); twill, tweed, burlap, tartan, plaid, linen.
#[node]
#[derive(PartialEq)]
pub struct Cloth {
    /// The draft: its name, or rows of `x` and `.`. At most 256 × 256.
    #[default("plain".into())]
    pub draft: String,
    /// The shaft of each warp thread, such as `12344321`: digits 1 to 9 and letters a to f.
    pub threading: String,
    /// The shafts that each treadle lifts, separated by `/`, such as `12/23/34/41`.
    pub tie_up: String,
    /// The treadle of each weft thread, such as `1234`.
    pub treadling: String,
    /// Distance of warp threads, and of weft threads.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    #[default(Xy::new(1.0, 1.0))]
    pub pitch: Xy,
    /// Width of warp and of weft threads, at most 1.4 times their distance; by default 0.92 of it.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    pub width: Option<Xy>,
    /// Thickness of warp and of weft threads, at most twice their width; by default 0.65 of the width. Threads that
    /// were pressed or beaten are flat.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    pub thickness: Option<Xy>,
    /// Form of threads of one ply: 0 an ellipse, 1 a strip with round edges, as of cane or leather.
    #[schemars(range(min = 0, max = 1))]
    pub flat: f64,
    /// Share of the bending that the warp takes: 0.5 if both bend equally, 0 if only the weft bends, around a straight
    /// warp.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.5)]
    pub crimp: f64,
    /// Number of plies of the yarns; 1 for single yarns.
    #[schemars(range(min = 1, max = 12))]
    #[default(2)]
    pub plies: u32,
    /// Length of one turn of warp and of weft yarns; a negative length winds the other way, 0 does not wind. By default
    /// four times the width.
    #[schemars(extend("minimum" = -1e5, "maximum" = 1e5, "unit" = "mm"))]
    pub twist: Option<Xy>,
    /// Width of visible bundles of fibres; 0 for smooth yarns. By default a sixteenth of the width.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "mm"))]
    pub fiber: Option<f64>,
    /// Variation of the thickness along the threads.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.3)]
    pub slub: f64,
    /// Unevenness of the cloth: threads do not run straight, nor at equal distances.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.4)]
    pub irregular: f64,
    /// Colours of the warp threads: a letter from a to z for each; the sequence repeats. At most 256.
    #[default("a".into())]
    pub warp_colors: String,
    /// Colours of the weft threads.
    #[default("b".into())]
    pub weft_colors: String,
    /// Another seed gives other unevenness.
    pub seed: u64,
}

/// The parameters of a cloth that are read from texts.
struct Texts {
    draft: Draft,
    colors: [Vec<u32>; 2],
}

impl Cloth {
    fn texts(&self) -> Result<Texts, Problem> {
        let of = |field: &'static str| move |message: String| Problem::new(Code::BadValue, message).at(field);
        let loom = [("threading", &self.threading), ("tie_up", &self.tie_up), ("treadling", &self.treadling)];
        let draft = if loom.iter().all(|(_, text)| text.trim().is_empty()) {
            Draft::read(&self.draft).map_err(of("draft"))?
        } else {
            if let Some((field, _)) = loom.iter().find(|(_, text)| text.trim().is_empty()) {
                let message = format!("{field} is empty; threading, tie_up and treadling are given together");
                return Err(Problem::new(Code::BadValue, message).at(*field).help("for example \"1234\""));
            }
            Draft::of_loom(&self.threading, &self.tie_up, &self.treadling).map_err(|message| {
                // The message begins with the name of the parameter.
                let field = loom.iter().map(|(field, _)| *field).find(|field| message.starts_with(field));
                of(field.unwrap_or("threading"))(message)
            })?
        };
        let colors = [("warp_colors", &self.warp_colors), ("weft_colors", &self.weft_colors)];
        let [warp, weft] = colors.map(|(field, text)| sequence(field, text).map_err(of(field)));
        Ok(Texts { draft, colors: [warp?, weft?] })
    }

    fn woven(&self, texts: &Texts, size: DVec2) -> Woven {
        // Colours repeat with the canvas, too.
        let repeat = |draft: u32, colors: usize| lcm(draft, u32::try_from(colors).unwrap_or(1));
        let across = [repeat(texts.draft.warp, texts.colors[0].len()), repeat(texts.draft.weft, texts.colors[1].len())];
        let counts = [fit(size.x, self.pitch.x, across[0]), fit(size.y, self.pitch.y, across[1])];
        let widths = self.widths(size / DVec2::new(f64::from(counts[0]), f64::from(counts[1])));
        Woven {
            draft: texts.draft.clone(),
            counts,
            size,
            thickness: self.thickness.map_or_else(|| widths.map(|w| 0.65 * w), |t| [t.x, t.y]),
            crimp: self.crimp,
            irregular: self.irregular,
        }
    }

    /// Widths of warp and weft at these distances.
    fn widths(&self, pitch: DVec2) -> [f64; 2] {
        self.width.map_or([0.92 * pitch.x, 0.92 * pitch.y], |w| [w.x, w.y])
    }

    fn yarns(&self, woven: &Woven) -> [Yarn; 2] {
        let widths = self.widths(woven.pitch());
        let twists = self.twist.map(|t| [t.x, t.y]);
        [0, 1].map(|k| {
            let Self { plies, fiber, slub, flat, .. } = *self;
            let twist = twists.map(|t| t[k]);
            Make { width: widths[k], thickness: woven.thickness[k], flat, plies, twist, fiber, slub }.yarn()
        })
    }
}

/// The least common multiple; both are at most 256.
fn lcm(a: u32, b: u32) -> u32 {
    let (mut x, mut y) = (a, b);
    while y != 0 {
        (x, y) = (y, x % y);
    }
    a / x.max(1) * b
}

impl Node for Cloth {
    const OUTPUTS: &'static [Output] = &[
        HEIGHT,
        MASK,
        THREAD,
        ALONG,
        ACROSS,
        DIRECTION,
        CROWN,
        FIBER,
        Output::new("warp", Type::Gray, "1 where a warp thread shows, 0 where a weft thread or none does."),
        Output::new("color", Type::Ids, "The colour of the thread: 1 for a, 2 for b; 0 where there is none."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let texts = match self.texts() {
            Ok(texts) => texts,
            Err(problem) => return vec![problem],
        };
        let woven = self.woven(&texts, canvas.size_mm());
        let crossings = f64::from(woven.counts[0]) * f64::from(woven.counts[1]);
        let each = 2.0 * f64::from(POINTS);
        let pitch = woven.pitch();
        let (widths, thicknesses) = (self.widths(pitch), woven.thickness);
        let most = "1.4 times the distance of threads";
        let of = |k: usize| {
            [
                parts::at_most("width", widths[k], 1.4 * pitch[k], most),
                parts::at_most("thickness", thicknesses[k], 2.0 * widths[k], "twice the width"),
            ]
        };
        let many = parts::too_many("crossings", crossings * each, each, "pitch");
        many.into_iter().chain([of(0), of(1)].concat().into_iter().flatten().take(1)).collect()
    }

    fn advice(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let Ok(texts) = self.texts() else { return Vec::new() };
        let wanted = DVec2::new(self.pitch.x, self.pitch.y);
        let laid = self.woven(&texts, canvas.size_mm()).pitch();
        fitted::advice(("pitch", "distances of threads"), [wanted, laid], [0.0, 0.0], fitted::FITS)
    }

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::BOTH
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let texts = self.texts()?;
        let woven = self.woven(&texts, cx.size_mm());
        let hash = Hash::new(cx.seed(self.seed));
        let parts = parts::outputs(cx, &woven.lines(hash), &self.yarns(&woven), hash.with(9))?;
        let warp = woven.counts[0];
        let is_warp = parts.of_thread(Type::Gray, move |thread| {
            f32::from(u8::from(thread > 0.0 && f64::from(thread) <= f64::from(warp)))
        });
        let colors = texts.colors;
        let color = parts.of_thread(Type::Ids, move |thread| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number below 2^24")]
            let Some(number) = (thread as usize).checked_sub(1) else { return 0.0 };
            let (system, number) = if number < warp as usize { (0, number) } else { (1, number - warp as usize) };
            let color = colors[system].get(number % colors[system].len().max(1)).copied().unwrap_or(0);
            f32::from(u8::try_from(color + 1).unwrap_or(0))
        });
        Ok(parts.outputs().with("warp", is_warp).with("color", color))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::testing::{OnCanvas as _, canvas};

    fn cloth(draft: &str) -> Cloth {
        Cloth { draft: draft.into(), pitch: Xy::new(2.0, 2.0), ..Cloth::default() }
    }

    #[test]
    fn cloth_conforms() {
        conforms(&Cloth { irregular: 1.0, ..cloth("herringbone") }, &[]);
        conforms(&Cloth { plies: 1, flat: 1.0, twist: Some(Xy::new(0.0, 0.0)), ..cloth("xx../..xx") }, &[]);
    }

    #[test]
    fn threads_have_numbers_and_colors() {
        let node = Cloth { warp_colors: "ab".into(), weft_colors: "c".into(), ..cloth("plain") };
        let tile = |name: &str| part(&field(&node, &[], name), &canvas(), 0, 0, 64, 64);
        let (threads, colors, warp) = (tile("thread"), tile("color"), tile("warp"));
        // Sixteen threads each way.
        assert_eq!(threads.data().iter().copied().fold(0.0, f32::max), 32.0);
        for ((thread, color), warp) in threads.data().iter().zip(colors.data()).zip(warp.data()) {
            let want = match *thread {
                0.0 => 0.0,
                t if t > 16.0 => 3.0,
                t => 2.0 - t % 2.0,
            };
            assert_eq!((*color, *warp), (want, f32::from(u8::from(want == 1.0 || want == 2.0))));
        }
    }

    #[test]
    fn looms_have_drafts() {
        let loom = Cloth {
            threading: "1234".into(),
            tie_up: "12/23/34/41".into(),
            treadling: "1234".into(),
            ..cloth("plain")
        };
        assert_eq!(loom.texts().unwrap().draft, Draft::read("xx../.xx./..xx/x..x").unwrap());
        let refused = |node: Cloth| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        assert_eq!(refused(loom.clone()), None);
        assert_eq!(refused(Cloth { tie_up: String::new(), ..loom.clone() }).as_deref(), Some("tie_up"));
        assert_eq!(refused(Cloth { treadling: "5".into(), ..loom }).as_deref(), Some("treadling"));
    }

    #[test]
    fn refuses_invalid_cloth() {
        let refused = |node: Cloth| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        assert_eq!(refused(cloth("x?")).as_deref(), Some("draft"));
        assert_eq!(refused(Cloth { warp_colors: "a1".into(), ..cloth("plain") }).as_deref(), Some("warp_colors"));
        assert_eq!(refused(Cloth { pitch: Xy::new(0.01, 0.01), ..cloth("plain") }).as_deref(), Some("pitch"));
        assert_eq!(refused(Cloth { width: Some(Xy::new(3.0, 1.0)), ..cloth("plain") }).as_deref(), Some("width"));
    }
}
