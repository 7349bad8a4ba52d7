//! The fields of stamps.
use glam::{DVec2, UVec2, Vec2};
use shibo_kernel::ground::tile;
use shibo_kernel::scatter::atlas::Layout;
use shibo_kernel::scatter::paint::{self, Content, Overlap, Picture, Source, Target};
use shibo_kernel::scatter::set::StampSet;
use shibo_kernel::surface::layers::bounds;
use shibo_node::{AnyField, Context, Gray, In, Output, Outputs, Xy, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, FieldSource, Given, Grid, Pictures, Read, Stop, Tile, Tiling, Type, Window};
use std::sync::Arc;

/// The outputs of `TileSampler` and `Scatter`.
pub(super) const OUTPUTS: &[Output] = &[
    Output::like("result", &["input", "others"], "The stamps, on `background`."),
    Output::new("mask", Type::Gray, "How much of the place stamps cover, 0..1."),
    Output::new("ids", Type::Ids, "The number of the stamp that is seen, from 1; 0 where there is none."),
    Output::new(
        "local",
        Type::Vec2,
        "The place within that stamp from its middle, along its own axes; 0 where there is none.",
    )
    .in_unit("mm"),
];

/// Maximum number of pixels along a side of the picture of the stamp.
const MOST: u32 = 2048;

/// The quantity that a field shows.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum StampQuantity {
    Values,
    Cover,
    Ids,
    Local,
}

/// The ground under the stamps.
#[derive(Clone)]
#[expect(clippy::large_enum_variant, reason = "there is one for each field")]
pub(super) enum Ground {
    /// One value everywhere.
    Flat(f32),
    /// A field. If its height is given, it covers the stamps where it is higher.
    Field {
        values: Field,
        height: Option<Field>,
        /// Coverage by stamps: where it is 0, the ground is copied.
        cover: Field,
    },
}

/// Another stamp of a scatter.
#[node]
pub struct OtherStamp {
    /// Field to stamp; its whole canvas becomes a stamp.
    pub input: In<AnyField>,
    /// Opacity of the stamp, 0..1, over the same canvas; a full rectangle if not given.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub shape: Option<In<Gray>>,
    /// Height of the stamp, for `ByHeight`; the input itself if not given.
    pub height: Option<In<Gray>>,
    /// Width and height of the stamp at scale 1; `size` of the node if not given.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    pub size: Option<Xy>,
    /// Frequency of the stamp, relative to the first one, whose weight is 1.
    #[schemars(range(min = 0, max = 1e6))]
    #[default(1.0)]
    pub weight: f64,
}

/// The fields of a stamp.
#[derive(Clone)]
pub(super) struct StampFields {
    pub(super) input: Field,
    pub(super) shape: Option<Field>,
    pub(super) height: Option<Field>,
}

/// The fields of all stamps: those of the first one, and `others`.
pub(super) fn stamps(
    cx: &Context<'_>,
    (input, shape, height): (&In<AnyField>, &Option<In<Gray>>, &Option<In<Gray>>),
    others: &[OtherStamp],
) -> Result<Vec<StampFields>, Stop> {
    let of = |input: &In<AnyField>, shape: &Option<In<Gray>>, height: &Option<In<Gray>>| -> Result<StampFields, Stop> {
        Ok(StampFields { input: cx.get(input)?, shape: cx.get_opt(shape)?, height: cx.get_opt(height)? })
    };
    let others = others.iter().map(|other| of(&other.input, &other.shape, &other.height));
    [of(input, shape, height)].into_iter().chain(others).collect()
}

/// Data shared by all fields of one node.
#[derive(Clone)]
pub(super) struct Sown {
    /// The pictures to stamp; at least one.
    pub(super) stamps: Vec<StampFields>,
    pub(super) set: Arc<StampSet>,
    pub(super) overlap: Overlap,
    pub(super) content: Content,
    pub(super) ground: Ground,
    pub(super) size_mm: DVec2,
}

impl Sown {
    /// The outputs, which repeat as `tiling` says.
    pub(super) fn outputs(self, tiling: Tiling) -> Result<Outputs, Stop> {
        if let Some(number) = self.stamps.iter().position(|stamp| stamp.input.ty() == Type::Normal) {
            let message = "input is a normal map, which would have to be turned with the stamps";
            let help = "stamp the height, and make the normals of the result with `HeightToNormal`";
            let field = if number == 0 { "input" } else { "others" };
            return Err(Problem::new(Code::TypeMismatch, message).at(field).help(help).into());
        }
        Ok(Outputs::one(self.field(StampQuantity::Values, tiling))
            .with("mask", self.field(StampQuantity::Cover, tiling))
            .with("ids", self.field(StampQuantity::Ids, tiling))
            .with("local", self.field(StampQuantity::Local, tiling)))
    }

    /// The field of one quantity, which repeats as `tiling` says.
    pub(super) fn field(&self, what: StampQuantity, tiling: Tiling) -> Field {
        let ty = match what {
            StampQuantity::Values => tile::widest(self.stamps.iter().map(|stamp| &stamp.input)),
            StampQuantity::Cover => Type::Gray,
            StampQuantity::Ids => Type::Ids,
            StampQuantity::Local => Type::Vec2,
        };
        let largest = self.set.stamps().iter().fold(Vec2::ZERO, |most, stamp| most.max(stamp.half));
        Field::new(ty, tiling, Shown { sown: self.clone(), what, largest })
    }
}

struct Shown {
    sown: Sown,
    what: StampQuantity,
    /// Half the size of the largest stamp, mm.
    largest: Vec2,
}

impl Shown {
    /// The content, the shape and the height of each stamp, if they are read.
    fn parts(&self) -> Vec<[Option<&Field>; 3]> {
        let overlap = self.sown.overlap;
        let by_height = overlap == Overlap::ByHeight && self.what != StampQuantity::Cover;
        let content = match self.what {
            StampQuantity::Values => true,
            StampQuantity::Cover => false,
            StampQuantity::Ids | StampQuantity::Local => overlap != Overlap::Over,
        };
        let stamps = self.sown.stamps.iter().map(|stamp| {
            let height = stamp.height.as_ref().filter(|_| by_height);
            [Some(&stamp.input).filter(|_| content), stamp.shape.as_ref(), height]
        });
        stamps.collect()
    }

    /// All fields of stamps that are read.
    fn read(&self) -> Vec<&Field> {
        self.parts().into_iter().flatten().flatten().collect()
    }

    /// The grid on which the stamp is read: as many pixels as the largest stamp has on `grid`.
    fn stamp_grid(&self, grid: &Grid) -> (Grid, UVec2) {
        let pixels = UVec2::from(paint::resolution(self.largest, tile::step(grid), MOST));
        let step = self.sown.size_mm / pixels.as_dvec2();
        (Grid { origin: DVec2::ZERO, step, period: Some(pixels), shown: None }, pixels)
    }
}

impl Shown {
    /// The fields for the ground under the stamps: the coverage by stamps, and then the values and the height of the
    /// ground, if they are used.
    fn under(&self) -> (Option<&Field>, Vec<&Field>) {
        match &self.sown.ground {
            Ground::Field { values, height, cover } if self.what != StampQuantity::Cover => {
                let values = Some(values).filter(|_| self.what == StampQuantity::Values);
                let height = height.as_ref().filter(|_| self.sown.overlap == Overlap::ByHeight);
                (Some(cover), values.into_iter().chain(height).collect())
            }
            _ => (None, Vec::new()),
        }
    }

    /// True if the ground may show through stamps that cover it fully.
    fn through(&self) -> bool {
        self.sown.overlap != Overlap::Over
    }

    /// Fills in the ground, except where stamps are certain to hide it. Returns true if stamps touch the tile.
    fn lay(&self, given: &Given<'_>, out: &mut Tile) -> bool {
        let cover = match (&self.sown.ground, self.under().0) {
            (Ground::Field { .. }, Some(_)) => given.tile(0).plane(0),
            (Ground::Flat(value), _) if self.what == StampQuantity::Values => {
                out.data_mut().fill(*value);
                return true;
            }
            _ => return true,
        };
        let touched = cover.iter().any(|cover| *cover > 0.0);
        if self.what != StampQuantity::Values {
            return touched;
        }
        let values = given.tile(1);
        for (k, plane) in out.planes_mut().into_iter().enumerate() {
            if values.window.is_empty() {
                plane.fill(0.0);
                continue;
            }
            plane.copy_from_slice(tile::channel(values, k));
            if !self.through() {
                let hidden = plane.iter_mut().zip(cover).filter(|(_, cover)| **cover >= 1.0);
                hidden.for_each(|(out, _)| *out = 0.0);
            }
        }
        touched
    }
}

impl FieldSource for Shown {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.under().0.into_iter().map(|cover| Read::new(cover, grid, window)).collect()
    }

    fn later(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.under().1.into_iter().map(|field| Read::new(field, grid, window)).collect()
    }

    fn narrow(&self, given: &Given<'_>, _grid: &Grid, window: Window) -> Vec<Window> {
        if self.under().1.is_empty() {
            return Vec::new();
        }
        let (low, high) = bounds(given.tile(0).data());
        let values = self.what == StampQuantity::Values;
        let part = |wanted: bool| if wanted { window } else { Window { width: 0, height: 0, ..window } };
        let height = self.under().1.len() - usize::from(values);
        let of_values = values.then(|| part(self.through() || low < 1.0));
        of_values.into_iter().chain((0..height).map(|_| part(high > 0.0))).collect()
    }

    fn whole(&self, grid: &Grid) -> Vec<Read<'_>> {
        let (grid, pixels) = self.stamp_grid(grid);
        self.read().into_iter().map(|field| Read::new(field, &grid, Window::full(pixels))).collect()
    }

    fn prepare(&self, grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        let (stamp_grid, pixels) = self.stamp_grid(grid);
        let parts = self.read();
        let channels = parts.iter().map(|field| field.channels()).sum();
        if channels == 0 {
            return Ok(None);
        }
        let layout = Layout::new(pixels.x as usize, pixels.y as usize);
        let width = u32::try_from(layout.len()).unwrap_or(u32::MAX);
        let mut prepared = Tile::new(stamp_grid, Window { x: 0, y: 0, width, height: 1 }, channels);
        let mut planes = prepared.planes_mut().into_iter();
        for number in 0..parts.len() {
            let picture = pictures.read(number, Window::full(pixels))?;
            for channel in 0..picture.channels() {
                pictures.check()?;
                let data = picture.plane(channel).iter().map(|v| if v.is_finite() { *v } else { 0.0 }).collect();
                if let Some(plane) = planes.next() {
                    layout.build(data, plane);
                }
            }
        }
        Ok(Some(prepared))
    }

    fn prepare_bytes(&self, grid: &Grid) -> u64 {
        let (_, pixels) = self.stamp_grid(grid);
        let channels: usize = self.read().iter().map(|field| field.channels()).sum();
        // The picture, its pyramid, and both in the layout of the kernel.
        u64::from(pixels.x + 2) * u64::from(pixels.y + 2) * channels as u64 * 24
    }

    fn bytes(&self) -> usize {
        size_of_val(self.sown.set.stamps()) * 5 / 4
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (_, pixels) = self.stamp_grid(&out.grid);
        let parts = self.parts();
        let nothing_read = parts.iter().flatten().all(Option::is_none);
        // If no field is read, only the outlines count.
        let layout = if nothing_read { Layout::new(1, 1) } else { Layout::new(pixels.x as usize, pixels.y as usize) };
        let mut next = 0;
        let mut planes = |field: Option<&Field>| -> Vec<&[f32]> {
            let (Some(field), Some(prepared)) = (field, given.prepared()) else { return Vec::new() };
            let from = next;
            next += field.channels();
            (from..next).map(|channel| prepared.plane(channel)).collect()
        };
        let channels = if self.what == StampQuantity::Values { out.channels() } else { 1 };
        let mut pictures = Vec::with_capacity(parts.len());
        for [content, shape, height] in &parts {
            let mut values = planes(*content);
            // A grey stamp among colours.
            if let [only] = values[..] {
                values = vec![only; channels];
            }
            let (shape, height) = (planes(*shape).first().copied(), planes(*height).first().copied());
            pictures.push(Picture { values, shape, height });
        }
        let (frame, Sown { set, overlap, content, .. }) = (tile::frame(out), &self.sown);
        if !self.lay(given, out) {
            return given.check();
        }
        let under = self.under().1.len();
        let ground = (under > usize::from(self.what == StampQuantity::Values)).then(|| given.tile(under).plane(0));
        let source = Source { layout: &layout, pictures, content: *content, ground };
        let stop = || given.check().is_err();
        let how = (&**set, &source, *overlap);
        let mut planes = out.planes_mut();
        match self.what {
            StampQuantity::Values => paint::paint(&stop, how, &frame, Target::Values(planes)),
            StampQuantity::Cover => paint::paint(&stop, how, &frame, Target::Cover(&mut *planes[0])),
            StampQuantity::Ids => paint::paint(&stop, how, &frame, Target::Ids(&mut *planes[0])),
            StampQuantity::Local => {
                if let [along, across] = &mut planes[..] {
                    paint::paint(&stop, how, &frame, Target::Local([along, across]));
                }
            }
        }
        given.check()
    }
}
