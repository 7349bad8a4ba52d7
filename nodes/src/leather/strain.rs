//! Stretch and breakage of links by a motion, as fields for colour and roughness.
use glam::{DVec2, UVec2, Vec2};
use shibo_kernel::filter::placed::{self, PlacedWindow};
use shibo_kernel::filter::sample::{Filter, Outside, Pyramid};
use shibo_kernel::leather::links::Links;
use shibo_kernel::leather::scatter::{Spread, spread};
use shibo_value::{Field, FieldSource, Given, Grid, Lattice, Read, Stop, Tile, Tiling, Type, Window};
use std::sync::{Arc, OnceLock};

/// The quantity to show.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum StrainQuantity {
    /// The length, as a share of the length at the start.
    Stretch,
    /// 1 for broken springs, 0 for others.
    Breakage,
}

/// Samples per pitch. Each value is spread over 1.5 pitches, so more samples would show no more detail.
const DETAIL: f64 = 3.0;
const REACH: f32 = 1.5;
const MOST_SAMPLES: f64 = 4096.0;

/// The mean over the links around a place, computed when the first tile needs it.
pub(super) struct Strain {
    lattice: Arc<Lattice>,
    what: StrainQuantity,
    map: OnceLock<Pyramid>,
}

impl Strain {
    /// The field of a lattice after its motion.
    pub(super) fn field(lattice: &Arc<Lattice>, what: StrainQuantity) -> Field {
        Field::new(Type::Gray, lattice.points.periodic, Self { lattice: lattice.clone(), what, map: OnceLock::new() })
    }

    fn size(&self) -> UVec2 {
        let points = &self.lattice.points;
        let pitch = f64::from(points.pitch.max(f32::MIN_POSITIVE));
        (points.size_mm / pitch * DETAIL).ceil().clamp(DVec2::splat(4.0), DVec2::splat(MOST_SAMPLES)).as_uvec2()
    }

    fn outside(&self) -> [Outside; 2] {
        let Tiling { x, y } = self.lattice.points.periodic;
        [x, y].map(|wraps| if wraps { Outside::Wrap } else { Outside::Clamp })
    }

    /// The value of each link, at its middle.
    fn values(&self) -> Vec<(Vec2, f32)> {
        let lattice = &*self.lattice;
        let (points, size) = (&lattice.points, lattice.points.size_mm.as_vec2());
        let links = Links { pairs: lattice.links.to_vec(), wraps: lattice.offsets.to_vec() };
        let alive = lattice.alive();
        let before = links.lengths(points.regular(), size);
        let value = |l: usize| {
            let [a, b] = links.ends(l, &points.positions, size);
            let value = match self.what {
                StrainQuantity::Stretch if before[l] > 0.0 => (b - a).length() / before[l],
                StrainQuantity::Stretch => 1.0,
                StrainQuantity::Breakage => f32::from(u8::from(!alive[l])),
            };
            ((a + b) * 0.5, value)
        };
        (0..links.pairs.len()).map(value).collect()
    }

    fn make(&self) -> Pyramid {
        let points = &self.lattice.points;
        let size = self.size();
        let spec = Spread {
            size,
            size_mm: points.size_mm.as_vec2(),
            radius: REACH * points.pitch,
            periodic: points.periodic == Tiling::BOTH,
            empty: if self.what == StrainQuantity::Stretch { 1.0 } else { 0.0 },
        };
        Pyramid::new(spread(&self.values(), &spec), size.x as usize, size.y as usize, self.outside())
    }
}

impl FieldSource for Strain {
    fn inputs(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    fn fill(&self, _given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        // Computed outside of the lock: it waits for other threads, which may need the map too.
        let map = match self.map.get() {
            Some(map) => map,
            None => {
                let map = self.make();
                self.map.get_or_init(|| map)
            }
        };
        let pitch = self.lattice.points.size_mm / self.size().as_dvec2();
        let (origin, step) = (out.grid.origin / pitch, out.grid.step / pitch);
        let place = PlacedWindow {
            window: out.window,
            origin: origin.to_array(),
            step: step.to_array(),
            filter: Filter::BSpline,
            outside: self.outside(),
        };
        placed::fill(map, &place, out.plane_mut(0));
        Ok(())
    }

    fn bytes(&self) -> usize {
        self.size().as_usizevec2().element_product() * 16 / 3
    }
}
