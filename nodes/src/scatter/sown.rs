//! The fields of stamps.
use glam::{DVec2, UVec2, Vec2};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::{Output, Outputs};
use shibo_engine::value::{Field, FieldSource, Given, Grid, Pictures, Read, Stop, Tile, Tiling, Type, Window};
use shibo_kernel::ground::tile;
use shibo_kernel::scatter::atlas::Layout;
use shibo_kernel::scatter::paint::{self, Overlap, Source, Target};
use shibo_kernel::scatter::set::StampSet;
use std::sync::Arc;

/// The outputs of `TileSampler` and `Scatter`.
pub(super) const OUTPUTS: &[Output] = &[
    Output::like("result", &["input"], "The stamps, on `background`."),
    Output::new("mask", Type::Gray, "How much of the place stamps cover, 0..1."),
    Output::new("ids", Type::Ids, "The number of the stamp that is seen, from 1; 0 where there is none."),
    Output::new(
        "local",
        Type::Vec2,
        "The place within that stamp from its middle, along its own axes; 0 where there is none.",
    )
    .in_unit("mm"),
];

/// The most pixels along a side at which the stamp is read.
const MOST: u32 = 2048;

/// What is shown.
#[derive(Clone, Copy, PartialEq, Eq)]
enum What {
    Values,
    Cover,
    Ids,
    Local,
}

/// What all fields of one node share.
#[derive(Clone)]
pub(super) struct Sown {
    pub(super) input: Field,
    pub(super) shape: Option<Field>,
    pub(super) height: Option<Field>,
    pub(super) set: Arc<StampSet>,
    pub(super) overlap: Overlap,
    pub(super) background: f32,
    pub(super) size_mm: DVec2,
}

impl Sown {
    /// The outputs, which repeat as `tiling` says.
    pub(super) fn outputs(self, tiling: Tiling) -> Result<Outputs, Stop> {
        if self.input.ty() == Type::Normal {
            let message = "input is a normal map, which would have to be turned with the stamps";
            let help = "stamp the height, and make the normals of the result with `HeightToNormal`";
            return Err(Problem::new(Code::TypeMismatch, message).at("input").help(help).into());
        }
        let largest = self.set.stamps().iter().fold(Vec2::ZERO, |most, stamp| most.max(stamp.half));
        let field = |ty: Type, what: What| Field::new(ty, tiling, Shown { sown: self.clone(), what, largest });
        Ok(Outputs::one(field(self.input.ty(), What::Values))
            .with("mask", field(Type::Gray, What::Cover))
            .with("ids", field(Type::Ids, What::Ids))
            .with("local", field(Type::Vec2, What::Local)))
    }
}

struct Shown {
    sown: Sown,
    what: What,
    /// Half the size of the largest stamp, mm.
    largest: Vec2,
}

impl Shown {
    /// Whether the content, the shape and the height are read.
    fn parts(&self) -> [Option<&Field>; 3] {
        let Sown { input, shape, height, overlap, .. } = &self.sown;
        let by_height = *overlap == Overlap::ByHeight && self.what != What::Cover;
        let height = height.as_ref().filter(|_| by_height);
        let content = match self.what {
            What::Values => true,
            What::Cover => false,
            What::Ids | What::Local => *overlap != Overlap::Over,
        };
        [Some(input).filter(|_| content), shape.as_ref(), height]
    }

    /// The grid on which the stamp is read: as many pixels as the largest has on `grid`.
    fn stamp_grid(&self, grid: &Grid) -> (Grid, UVec2) {
        let pixels = UVec2::from(paint::resolution(self.largest, tile::step(grid), MOST));
        let step = self.sown.size_mm / pixels.as_dvec2();
        (Grid { origin: DVec2::ZERO, step, period: Some(pixels) }, pixels)
    }
}

impl FieldSource for Shown {
    fn inputs(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    fn whole(&self, grid: &Grid) -> Vec<Read<'_>> {
        let (grid, pixels) = self.stamp_grid(grid);
        self.parts().into_iter().flatten().map(|field| Read::new(field, &grid, Window::full(pixels))).collect()
    }

    fn prepare(&self, grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        let (stamp_grid, pixels) = self.stamp_grid(grid);
        let parts = self.parts();
        let channels = parts.iter().flatten().map(|field| field.channels()).sum();
        if channels == 0 {
            return Ok(None);
        }
        let layout = Layout::new(pixels.x as usize, pixels.y as usize);
        let width = u32::try_from(layout.len()).unwrap_or(u32::MAX);
        let mut prepared = Tile::new(stamp_grid, Window { x: 0, y: 0, width, height: 1 }, channels);
        let mut planes = prepared.planes_mut().into_iter();
        for number in 0..parts.iter().flatten().count() {
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
        let channels: usize = self.parts().iter().flatten().map(|field| field.channels()).sum();
        // The picture, its halves, and both laid out.
        u64::from(pixels.x + 2) * u64::from(pixels.y + 2) * channels as u64 * 24
    }

    fn bytes(&self) -> usize {
        size_of_val(self.sown.set.stamps()) * 5 / 4
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (_, pixels) = self.stamp_grid(&out.grid);
        let parts = self.parts();
        let nothing_read = parts.iter().all(Option::is_none);
        // Without anything to read only the outlines count.
        let layout = if nothing_read { Layout::new(1, 1) } else { Layout::new(pixels.x as usize, pixels.y as usize) };
        let mut next = 0;
        let mut planes = |field: Option<&Field>| -> Vec<&[f32]> {
            let (Some(field), Some(prepared)) = (field, given.prepared()) else { return Vec::new() };
            let from = next;
            next += field.channels();
            (from..next).map(|channel| prepared.plane(channel)).collect()
        };
        let values = planes(parts[0]);
        let (shape, height) = (planes(parts[1]).first().copied(), planes(parts[2]).first().copied());
        let source = Source { layout: &layout, values, shape, height };
        let (frame, Sown { set, overlap, background, .. }) = (tile::frame(out), &self.sown);
        let stop = || given.check().is_err();
        let how = (&**set, &source, *overlap);
        if self.what == What::Values {
            out.data_mut().fill(*background);
        }
        let mut planes = out.planes_mut();
        match self.what {
            What::Values => paint::paint(&stop, how, &frame, Target::Values(planes)),
            What::Cover => paint::paint(&stop, how, &frame, Target::Cover(&mut *planes[0])),
            What::Ids => paint::paint(&stop, how, &frame, Target::Ids(&mut *planes[0])),
            What::Local => {
                if let [along, across] = &mut planes[..] {
                    paint::paint(&stop, how, &frame, Target::Local([along, across]));
                }
            }
        }
        given.check()
    }
}
