//! [`DrawMeshWrinkles`]: grooves across the links of a surface.
//!
//! Source: JP4905282B2 §7 for the plane; here each groove lies in the tangent plane at the middle of its link. See
//! [`kernel::mesh::grooves`](shibo_kernel::mesh::grooves). Cost: O(texels · grooves around each).
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::mesh::bake::{self, Texels};
use shibo_kernel::mesh::fields;
use shibo_kernel::mesh::grooves::{Groove, Grooves, across};
use shibo_kernel::strokes::{Combine, CrossSection, StrokeStyle};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, Range, choice, node};
use shibo_value::{Atlas, Cost, Field, FieldSource, Given, Grid, Read, Stop, SurfaceNet, Tile, Tiling, Type, Window};
use std::sync::{Arc, OnceLock};

/// The links of a surface that get a groove.
#[choice]
pub enum MeshLinks {
    /// All links.
    #[default]
    All,
    /// Links whose springs hold.
    Intact,
    /// Links whose springs broke.
    Broken,
}

/// Property that decides which grooves of a surface are wide and deep.
#[choice]
pub enum MeshVaryBy {
    /// Random.
    #[default]
    Random,
    /// The length of the link: long links make wide and deep grooves.
    Length,
    /// The stretch of the link by the motion.
    Stretch,
}

/// Draws a groove across the middle of each link of a surface: wrinkles without seams, independent of the charts.
///
/// ```ron
/// "ball": MeshShape(shape: Sphere),
/// "atlas": MeshAtlas(mesh: "ball"),
/// "points": MeshPoints(atlas: "atlas", pitch: 4),
/// "links": ConnectMeshPoints(net: "points"),
/// "example": DrawMeshWrinkles(net: "links", atlas: "atlas", width: (0.5, 1.2), depth: 0.4, taper: 0.4),
/// ```
///
/// No other program has this; drawing strokes in Substance Painter comes closest.
#[node]
pub struct DrawMeshWrinkles {
    /// The points and links.
    pub net: In<SurfaceNet>,
    /// The atlas on which to draw.
    pub atlas: In<Atlas>,
    /// The links that get a groove.
    #[default(MeshLinks::All)]
    pub only: MeshLinks,
    /// Length of a groove, as a share of the length of its link; 0.62 just closes the cells.
    #[schemars(range(min = 0, max = 10))]
    #[default(0.62)]
    pub length_scale: f64,
    /// Width of the narrowest and of the widest groove.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    #[default(Range::new(0.15, 0.35))]
    pub width: Range,
    /// Depth of the shallowest and of the deepest groove.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e4, "unit" = "mm"))]
    #[default(Range::new(0.1, 0.1))]
    pub depth: Range,
    /// Property that decides which grooves are wide and deep.
    #[default(MeshVaryBy::Random)]
    pub vary_by: MeshVaryBy,
    /// Weight of `vary_by`, 0 to 1; the rest is random.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.6)]
    pub mix: f64,
    /// The cross-section.
    #[default(CrossSection::Gaussian)]
    pub profile: CrossSection,
    /// Standard deviation of the `Gaussian` cross-section, as a share of the width.
    #[schemars(range(min = 0.02, max = 1))]
    #[default(0.25)]
    pub sigma: f64,
    /// Narrowing of a groove at its ends, 0..1.
    #[schemars(range(min = 0, max = 1))]
    pub taper: f64,
    /// Minimum width in texels; narrower grooves are drawn this wide, and fade.
    #[schemars(range(min = 0, max = 100), extend("unit" = "px"))]
    #[default(1.0)]
    pub min_width: f64,
    /// How grooves that overlap are combined.
    #[default(Combine::Max)]
    pub combine: Combine,
    /// Another seed gives the same grooves other widths and depths.
    pub seed: u64,
}

impl DrawMeshWrinkles {
    fn style(&self) -> StrokeStyle {
        StrokeStyle {
            profile: self.profile.with_sigma(narrow(self.sigma)),
            taper: narrow(self.taper),
            tip: narrow(self.taper),
            round_caps: true,
            min_width: narrow(self.min_width),
            fade: true,
            antialias: true,
            combine: self.combine,
        }
    }

    fn grooves(&self, cx: &Context<'_>, net: &SurfaceNet) -> Vec<Groove> {
        let hash = Hash::new(cx.seed(self.seed));
        let now: Vec<f64> = (0..net.links.len()).map(|link| net.span(link).length()).collect();
        let mut sorted = now.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(1.0).max(f64::MIN_POSITIVE);
        // Maps 0.55 of the usual value to 0 (narrowest) and 1.45 to 1 (widest).
        let spread = |ratio: f64| ((ratio - 0.55) / 0.9).clamp(0.0, 1.0);
        let decided = |link: usize| match self.vary_by {
            MeshVaryBy::Random => None,
            MeshVaryBy::Length => Some(spread(now[link] / median)),
            MeshVaryBy::Stretch => Some(spread(now[link] / f64::from(net.lengths[link]).max(f64::MIN_POSITIVE))),
        };
        let wanted = |link: &usize| match self.only {
            MeshLinks::All => true,
            MeshLinks::Intact => !net.is_broken(*link),
            MeshLinks::Broken => net.is_broken(*link),
        };
        let groove = |link: usize| {
            let draw = |k: u64| {
                let chance = hash.unit(2 * link as u64 + k);
                decided(link).map_or(chance, |by| self.mix * by + (1.0 - self.mix) * chance)
            };
            let size = [self.width.at(draw(0)), self.depth.at(draw(1))].map(narrow);
            let ends = net.links[link];
            let (places, normals) = (ends.map(|n| net.positions[n as usize]), ends.map(|n| net.normals[n as usize]));
            across(places, normals, self.length_scale, size)
        };
        (0..net.links.len()).filter(wanted).filter_map(groove).collect()
    }
}

impl Node for DrawMeshWrinkles {
    const OUTPUTS: &'static [Output] = &[
        Output::new("height", Type::Gray, "Height: 0 on the hills, minus the depth in the grooves.").in_unit("mm"),
        Output::new("mask", Type::Gray, "The cross-section alone: 1 in the middle of a groove, 0 on the hills."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (net, atlas) = (cx.get(&self.net)?, cx.get(&self.atlas)?);
        let list = Arc::new(Lazy { list: self.grooves(cx, &net), style: self.style(), sorted: OnceLock::new() });
        let texels = fields::texels(&atlas);
        let drawn = |mask| {
            let drawn = Drawn { grooves: list.clone(), atlas: atlas.clone(), texels: texels.clone(), mask };
            Field::new(Type::Gray, Tiling::NONE, drawn).overwriting()
        };
        Ok(Outputs::one(drawn(false)).with("mask", drawn(true)))
    }
}

/// Grooves that are sorted when the first tile is filled.
struct Lazy {
    list: Vec<Groove>,
    style: StrokeStyle,
    /// The sorted grooves, and the largest texel for which they are sorted.
    sorted: OnceLock<(f32, Grooves)>,
}

struct Drawn {
    grooves: Arc<Lazy>,
    atlas: Arc<Atlas>,
    texels: Field,
    mask: bool,
}

impl Drawn {
    /// The mean distance between neighbouring texels on the surface, in mm.
    fn pixel(&self, grid: &Grid) -> f32 {
        narrow((grid.step.x * grid.step.y).sqrt() * self.atlas.scale())
    }
}

impl FieldSource for Drawn {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.texels, grid, window)]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (grid, window) = (out.grid, out.window);
        let texels = Texels { atlas: &self.atlas, grid: &grid, window, values: given.tile(0).plane(0) };
        let planes = bake::places_and_normals(&texels);
        given.check()?;
        let pixel = self.pixel(&grid);
        let lazy = &*self.grooves;
        let sort = |pixel| (pixel, Grooves::new(lazy.list.clone(), lazy.style, pixel));
        let sorted = lazy.sorted.get_or_init(|| sort(pixel));
        let own;
        // A coarser picture draws wider grooves, so they are sorted again for it.
        let grooves = if sorted.0 >= pixel {
            &sorted.1
        } else {
            own = sort(pixel).1;
            &own
        };
        let [places, normals] = planes.each_ref().map(|of| of.each_ref().map(Vec::as_slice));
        grooves.fill(places, normals, (pixel, self.mask), out.plane_mut(0));
        let values = texels.values.iter().zip(out.plane_mut(0));
        let mask = self.mask;
        values.for_each(|(texel, out)| {
            let value = if *texel == 0.0 { 0.0 } else { *out };
            *out = if mask { value } else { -value };
        });
        Ok(())
    }

    fn cost(&self) -> Cost {
        Cost::Local
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.grooves.list) + self.grooves.sorted.get().map_or(0, |(_, sorted)| sorted.bytes())
    }
}
