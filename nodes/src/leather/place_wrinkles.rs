//! [`PlaceWrinkles`]: a segment across each link.
//!
//! Source: JP4905282B2 §7, claim 1 (rows A46–A48). Beyond the source: lengths other than the link's, and a limit on the
//! length of links. Cost: O(links).
use glam::Vec2;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::leather::area;
use shibo_kernel::leather::links::Links;
use shibo_kernel::leather::segments::{self, SegmentSpec};
use shibo_node::{Context, In, Node, Output, Outputs, choice, node};
use shibo_value::{Lattice, Segments, Stop, Tiling, Type};

/// The links that get wrinkles, by the state of their springs.
#[choice]
pub enum Only {
    /// All links.
    #[default]
    All,
    /// Links whose springs hold.
    Intact,
    /// Links whose springs broke: long grooves, the veins of the hide.
    Broken,
}

/// Places a wrinkle across each link, perpendicular to the link and centred on its middle.
///
/// ```ron
/// "points": GridPoints(pitch: 4, jitter: 0.8),
/// "links": ConnectNeighbors(points: "points", neighbors: Four),
/// "wrinkles": PlaceWrinkles(lattice: "links", length_scale: 0.9),
/// "height": DrawWrinkles(segments: "wrinkles", width: 0.6, depth: 0.4),
/// "example": Relief(height: "height"),
/// ```
#[node]
pub struct PlaceWrinkles {
    /// The links.
    pub lattice: In<Lattice>,
    /// Length of a wrinkle, as a share of the length of its link. By default 1, as in the source, for the links of a
    /// grid or of hexagons, and 0.62 for other links, which just closes their cells.
    #[schemars(range(min = 0, max = 10))]
    pub length_scale: Option<f64>,
    /// The links that get a wrinkle.
    #[default(Only::All)]
    pub only: Only,
    /// Links longer than this multiple of the median length get no wrinkle; `inf` keeps all.
    #[schemars(extend("exclusiveMinimum" = 0.0, "infinite" = true))]
    #[default(f64::INFINITY)]
    pub max_length: f64,
    /// True to cut wrinkles at the canvas' edge and at the contour of the work area. Where the canvas tiles, wrinkles
    /// continue at the opposite edge instead.
    #[default(true)]
    pub clip: bool,
}

/// Closes the cells around points with about six neighbours; measurements gave the most even cells at 0.58 to 0.66.
const CELL_LENGTH: f64 = 0.62;

impl Node for PlaceWrinkles {
    const OUTPUTS: &'static [Output] = &[Output::new("segments", Type::Segments, "The wrinkles, as segments.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let lattice = cx.get(&self.lattice)?;
        let points = &lattice.points;
        let size = points.size_mm.as_vec2();
        let links = Links { pairs: lattice.links.to_vec(), wraps: lattice.offsets.to_vec() };
        let default = if lattice.regular { 1.0 } else { CELL_LENGTH };
        let spec = SegmentSpec {
            size,
            length_scale: narrow(self.length_scale.unwrap_or(default)),
            max_length: narrow(self.max_length),
        };
        let alive = lattice.alive();
        let keep = |link: usize| match self.only {
            Only::All => true,
            Only::Intact => alive[link],
            Only::Broken => !alive[link],
        };
        let mut placed = segments::place(&points.positions, &links, &spec, keep);
        if self.clip && points.periodic == Tiling::NONE {
            placed = segments::clip(&placed, Vec2::ZERO, size);
        }
        if let (true, Some(shape)) = (self.clip, &points.area) {
            placed = area::clip(&placed, shape);
        }
        let lengths = links.lengths(&points.positions, size);
        let before = links.lengths(points.regular(), size);
        let median = segments::median(&lengths).max(f32::MIN_POSITIVE);
        let of = |list: &dyn Fn(usize) -> f32| placed.iter().map(|s| list(s.link as usize)).collect::<Vec<f32>>();
        Ok(Outputs::one(Segments {
            ends: placed.iter().map(|s| s.ends).collect(),
            length_ratio: of(&|link| lengths[link] / median),
            stretch: of(&|link| if before[link] > 0.0 { lengths[link] / before[link] } else { 1.0 }),
            width: Vec::new(),
            size_mm: points.size_mm,
            periodic: points.periodic,
        }))
    }
}
