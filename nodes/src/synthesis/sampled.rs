//! A picture seen through coordinates: the core of [`SampleExemplar`](super::SampleExemplar) and
//! [`MagnifyCoords`](super::MagnifyCoords).
use glam::{DVec2, UVec2};
use shibo_kernel::synthesis::PixelPlane;
use shibo_kernel::synthesis::jacobian::{IDENTITY, Jacobian};
use shibo_kernel::synthesis::sampling::{Area, Source};
use shibo_kernel::synthesis::sheet::Sheet;
use shibo_kernel::synthesis::surface_sampling::SurfaceMap;
use shibo_kernel::synthesis::texels::Fetch;
use shibo_node::Context;
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{
    CoordMap, ExemplarFrame, Field, FieldSource, Given, Grid, Pictures, Read, Stop, Surface, Tile, Tiling, Type, Window,
};
use std::sync::{Arc, OnceLock};

/// A picture seen through coordinates.
pub(super) struct Sampled {
    coords: Arc<CoordMap>,
    input: Field,
    /// The Jacobian for interpolating between coordinates by equation (6); without it (5) is used.
    jacobian: Option<Field>,
    filter: Fetch,
    scale_heights: bool,
    /// The area and pixels of the picture, read once for all tiles.
    frame: ExemplarFrame,
    grid: Grid,
    size: UVec2,
    source: OnceLock<Source>,
}

impl Sampled {
    pub(super) fn new(
        cx: &Context<'_>,
        coords: Arc<CoordMap>,
        input: Field,
        jacobian: Option<Field>,
        filter: Fetch,
        scale_heights: bool,
        resolution: Option<u32>,
    ) -> Result<Self, Stop> {
        let native = input.native().zip(input.pixels());
        let whole = || {
            // Coordinates without a known exemplar refer to the picture itself.
            let size = native.map_or(UVec2::splat(128), |n| n.1);
            let pitch = native.map_or(cx.size_mm() / size.as_dvec2(), |n| n.0.step);
            ExemplarFrame { size, origin: DVec2::ZERO, pitch, periodic: Tiling::BOTH }
        };
        let frame = coords.exemplar.unwrap_or_else(whole);
        // A finer picture is read at its own resolution over the area of the exemplar.
        let own = native.map_or(DVec2::ONE, |n| (frame.pitch / n.0.step).round().max(DVec2::ONE));
        let times = resolution.map_or(own, |times| DVec2::splat(f64::from(times)));
        let size = (frame.size.as_dvec2() * times).as_uvec2();
        let bytes = u64::from(size.x) * u64::from(size.y) * 4 * input.channels() as u64 * 3;
        if bytes > cx.evaluator.memory() {
            let message = format!("`input` has `{}x{}` pixels over the exemplar, {} MiB", size.x, size.y, bytes >> 20);
            return Err(Problem::new(Code::TooLarge, message).at("input").help("raise --memory").into());
        }
        let grid = Grid { origin: frame.origin, step: frame.pitch / times, period: None, shown: None };
        let source = OnceLock::new();
        Ok(Self { coords, input, jacobian, filter, scale_heights, frame, grid, size, source })
    }

    pub(super) fn into_field(self) -> Field {
        let mut tiling = self.coords.periodic;
        if let Some(jacobian) = &self.jacobian {
            tiling = tiling.and(jacobian.tiling());
        }
        Field::new(self.input.ty(), tiling, self)
    }

    /// Fills a tile of a field on a surface.
    fn fill_surface(&self, surface: &Surface, source: &Source, out: &mut Tile) {
        let map = SurfaceMap {
            sheet: Sheet { atlas: &surface.atlas, finest: surface.finest, level: &surface.level },
            coords: &self.coords.coords,
            jacobians: &surface.jacobians,
            pitch: self.frame.pitch,
        };
        let (grid, window, channels) = (out.grid, out.window, out.channels());
        let n = window.len();
        let under = map.fill(source, (&grid, window), channels, out.data_mut());
        let normal = self.input.ty() == Type::Normal;
        let data = out.data_mut();
        for (p, under) in under.into_iter().enumerate() {
            match under {
                Some(under) if normal => {
                    let stored = [0, 1, 2].map(|c| data[c * n + p] * 2.0 - 1.0);
                    let turned = map.normal(under, stored);
                    (0..3).for_each(|c| data[c * n + p] = 0.5 + 0.5 * turned[c]);
                }
                Some(under) if self.scale_heights => {
                    let size = map.size(under);
                    (0..channels).for_each(|c| data[c * n + p] *= size);
                }
                None if normal => [0.5, 0.5, 1.0].into_iter().enumerate().for_each(|(c, v)| data[c * n + p] = v),
                _ => {}
            }
        }
    }

    fn read(&self, tile: &Tile) -> Source {
        let Tiling { x, y } = self.frame.periodic;
        let plane = PixelPlane { w: self.size.x as usize, h: self.size.y as usize, wrap: [x, y] };
        let planes: Vec<&[f32]> = (0..tile.channels()).map(|c| tile.plane(c)).collect();
        let scale = (self.size.as_dvec2() / self.frame.size.as_dvec2()).as_vec2().to_array();
        let turned = self.jacobian.is_some() || self.coords.surface.is_some();
        let shrinks = turned || scale[0].max(scale[1]) > 1.0;
        Source::new(plane, &planes, scale, self.filter, shrinks)
    }
}

impl FieldSource for Sampled {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.jacobian.iter().map(|field| Read::new(field, grid, window)).collect()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let Some(source) = self.source.get() else {
            return Err(Problem::new(Code::BadValue, "the exemplar's picture was not prepared").into());
        };
        if let Some(surface) = &self.coords.surface {
            self.fill_surface(surface, source, out);
            return Ok(());
        }
        let each = |tile: &Tile| (0..tile.window.len()).map(|p| std::array::from_fn(|c| tile.plane(c)[p])).collect();
        let jacobians: Option<Vec<Jacobian>> = given.tiles().next().map(each);
        let (map, pitch) = (&self.coords, self.coords.pitch);
        let area = Area {
            map: &map.coords,
            plane: PixelPlane {
                w: map.size.x as usize,
                h: map.size.y as usize,
                wrap: [map.periodic.x, map.periodic.y],
            },
            spacing: f64::from(map.spacing),
            origin: ((out.grid.origin / pitch) - map.start.as_dvec2()).to_array(),
            step: (out.grid.step / pitch).to_array(),
            window: out.window,
            jacobians: jacobians.as_deref(),
            follow: self.jacobian.is_some(),
        };
        let n = out.window.len();
        let channels = out.channels();
        area.fill(source, channels, out.data_mut());
        let at = |p: usize| jacobians.as_ref().map_or(IDENTITY, |j| j[p]);
        if self.input.ty() == Type::Normal && jacobians.is_some() {
            (0..n).for_each(|p| turn(out.data_mut(), p, n, &at(p)));
        }
        if self.scale_heights && jacobians.is_some() {
            for p in 0..n {
                let scale = 1.0 / shibo_kernel::synthesis::jacobian::det(&at(p)).abs().sqrt().max(1e-4);
                (0..channels).for_each(|c| out.data_mut()[c * n + p] *= scale);
            }
        }
        Ok(())
    }

    fn whole(&self, _grid: &Grid) -> Vec<Read<'_>> {
        vec![Read::new(&self.input, &self.grid, Window::full(self.size))]
    }

    fn prepare(&self, _grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        if self.source.get().is_none() {
            let tile = pictures.read(0, Window::full(self.size))?;
            let source = self.read(&tile);
            self.source.get_or_init(|| source);
        }
        Ok(None)
    }

    fn prepare_bytes(&self, _grid: &Grid) -> u64 {
        if self.source.get().is_some() {
            0
        } else {
            self.size.element_product() as u64 * 8 * self.input.channels() as u64
        }
    }
}

/// Rotates a normal stored as ½ + ½n, y up, with its feature: slopes are multiplied by Jᵀ, normalized to scale 1.
fn turn(data: &mut [f32], p: usize, n: usize, j: &Jacobian) {
    let (x, y, z) = (data[p] * 2.0 - 1.0, 1.0 - data[n + p] * 2.0, (data[2 * n + p] * 2.0 - 1.0).max(1e-4));
    let scale = 1.0 / shibo_kernel::synthesis::jacobian::det(j).abs().sqrt().max(1e-4);
    let slope = [x / z, y / z];
    let turned = [(j[0] * slope[0] + j[2] * slope[1]) * scale, (j[1] * slope[0] + j[3] * slope[1]) * scale];
    let length = (turned[0] * turned[0] + turned[1] * turned[1] + 1.0).sqrt();
    data[p] = 0.5 + 0.5 * turned[0] / length;
    data[n + p] = 0.5 - 0.5 * turned[1] / length;
    data[2 * n + p] = 0.5 + 0.5 / length;
}
