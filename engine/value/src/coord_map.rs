//! Coordinates in an exemplar, the result of a synthesis.
use super::object::Renders;
use super::surface::SeamData;
use super::{ExemplarFrame, Field, Number, Object, Pixels, Sketch, Surface, Tile, Tiling, Type};
use glam::{DVec2, IVec2, UVec2};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// For each pixel of an output, a position in an exemplar.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CoordMap {
    /// Columns and rows.
    pub size: UVec2,
    /// Index of the first column and row; pixel (0, 0) has its corner at the canvas' corner.
    pub start: IVec2,
    /// The size of a pixel in mm.
    pub pitch: DVec2,
    /// The directions in which it repeats.
    pub periodic: Tiling,
    /// Size of a pixel in pixels of the finest level, in x and in y.
    pub spacing: u32,
    /// Positions in exemplar pixels, row by row: the centre of pixel `i` is at `i + ½`.
    pub coords: Arc<Vec<[f32; 2]>>,
    /// The exemplar, if it is known.
    pub exemplar: Option<ExemplarFrame>,
    /// Fraction of pixels whose right and lower neighbours are also neighbours in the exemplar; 0 if it was not
    /// computed.
    pub coherence: f32,
    /// The effective number of exemplar pixels in use (the exponential of the entropy of their use), as a fraction of
    /// the possible maximum; 0 if it was not computed.
    pub coverage: f32,
    /// The surface of the synthesis, if it is not the plane. Coordinates outside of its charts have no meaning.
    pub surface: Option<Arc<Surface>>,
}

impl CoordMap {
    /// The metadata name for the size of the exemplar, as `128 96`.
    pub const EXEMPLAR: &'static str = "shibo:exemplar";

    /// The coordinates as a field of vectors, times `scale`: those of the map's pixel, extrapolated from its centre in
    /// the plane; 0 outside of the charts of a surface.
    pub fn to_field(self: &Arc<Self>, scale: DVec2) -> Field {
        let map = Arc::clone(self);
        Field::generate(Type::Vec2, self.periodic, move |out, _| {
            map.fill(scale, out);
            Ok(())
        })
    }

    fn fill(&self, scale: DVec2, out: &mut Tile) {
        let (grid, window, n) = (out.grid, out.window, out.window.len());
        let (size, spacing) = (self.size.as_ivec2(), f64::from(self.spacing));
        let bring = |k: i32, n: i32, repeats: bool| if repeats { k.rem_euclid(n) } else { k.clamp(0, n - 1) };
        for p in 0..n {
            let step = IVec2::new(
                i32::try_from(p % window.width as usize).unwrap_or(0),
                i32::try_from(p / window.width as usize).unwrap_or(0),
            );
            let place = grid.center(window.x + step.x, window.y + step.y) / self.pitch;
            let cell = (place + 1e-6).floor();
            let rest = (place - cell - 0.5) * spacing;
            let at = cell.as_ivec2() - self.start;
            let (x, y) = (bring(at.x, size.x, self.periodic.x), bring(at.y, size.y, self.periodic.y));
            let index = usize::try_from(y * size.x + x).unwrap_or(0);
            let known = self.coords.get(index).copied().filter(|at| !at[0].is_nan());
            let [u, v] = known.unwrap_or_default();
            // At the centres of the map's own pixels the coordinates are exact, without rounding errors.
            let goes_on = known.is_some() && self.surface.is_none() && rest.abs().max_element() >= 1e-4;
            let rest = if goes_on { rest } else { DVec2::ZERO };
            #[expect(clippy::cast_possible_truncation, reason = "a field holds f32")]
            let [u, v] = [(f64::from(u) + rest.x) * scale.x, (f64::from(v) + rest.y) * scale.y].map(|v| v as f32);
            (out.data_mut()[p], out.data_mut()[n + p]) = (u, v);
        }
    }
}

/// Positions in an exemplar, row by row.
#[derive(Serialize)]
struct CoordMapData {
    size: [u32; 2],
    start: [i32; 2],
    /// The spacing in finest pixels.
    spacing: u32,
    /// Fractions, set after a complete synthesis.
    coherence: Number,
    coverage: Number,
    /// The visibility of chart borders, on a surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    seam: Option<SeamData>,
    /// `null` outside of charts.
    coords: Vec<Option<[Number; 2]>>,
}

impl Object for CoordMap {
    const RENDERS: Option<Renders> = Some(Renders::Field(Type::Vec2));

    /// The coordinates in pixels, with the size of the exemplar as metadata, see [`EXEMPLAR`](Self::EXEMPLAR).
    fn rendered(self: &Arc<Self>) -> Option<(Field, Vec<(String, String)>)> {
        let told = self.exemplar.map(|frame| (Self::EXEMPLAR.to_owned(), format!("{} {}", frame.size.x, frame.size.y)));
        Some((self.to_field(DVec2::ONE), told.into_iter().collect()))
    }

    fn bytes(&self) -> usize {
        size_of::<Self>() + 8 * self.coords.len() + self.surface.as_ref().map_or(0, |surface| surface.bytes())
    }

    fn data(&self) -> impl Serialize {
        CoordMapData {
            size: self.size.to_array(),
            start: self.start.to_array(),
            spacing: self.spacing,
            coherence: Number(self.coherence),
            coverage: Number(self.coverage),
            seam: self.surface.as_ref().and_then(|surface| surface.seam).map(SeamData::from),
            coords: self.coords.iter().map(|c| (!c[0].is_nan()).then(|| c.map(Number))).collect(),
        }
    }

    /// Position of each pixel in the exemplar as a colour: (0, 0) is black, (1, 0) red, (0, 1) green, (1, 1) yellow.
    /// Within a patch colours change smoothly; between patches they jump.
    fn sketch(&self) -> Option<Sketch> {
        let finite = || self.coords.iter().filter(|c| c[0].is_finite() && c[1].is_finite());
        let frame = self.exemplar.map(|frame| frame.size.as_vec2().to_array());
        let most = |axis: usize| finite().map(|c| c[axis].abs()).fold(1.0, f32::max);
        let size = frame.unwrap_or_else(|| [most(0), most(1)]);
        let shown = |v: f32| if v.is_nan() { 0.0 } else { v.rem_euclid(1.0) };
        let plane = |axis: usize| self.coords.iter().map(move |c| shown(c[axis] / size[axis].max(1.0)));
        let blue = std::iter::repeat_n(0.0, self.coords.len());
        let planes = plane(0).chain(plane(1)).chain(blue).collect();
        Pixels::new(Type::Normal, [self.size.x as usize, self.size.y as usize], planes).map(Sketch::Pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_run_from_black_to_red_green_and_yellow() {
        let frame =
            ExemplarFrame { size: UVec2::new(8, 4), origin: DVec2::ZERO, pitch: DVec2::ONE, periodic: Tiling::NONE };
        let coords = vec![[0.0, 0.0], [7.992, 0.0], [0.0, 3.996], [7.992, 3.996], [4.0, 1.0], [12.0, 5.0]];
        let map = CoordMap {
            size: UVec2::new(6, 1),
            start: IVec2::ZERO,
            pitch: DVec2::ONE,
            periodic: Tiling::NONE,
            spacing: 1,
            coords: Arc::new(coords),
            exemplar: Some(frame),
            coherence: 0.0,
            coverage: 0.0,
            surface: None,
        };
        let Some(Sketch::Pixels(pixels)) = map.sketch() else { panic!("no picture") };
        assert_eq!((pixels.ty(), pixels.size()), (Type::Normal, [6, 1]));
        let wanted = [[0.0, 0.999, 0.0, 0.999, 0.5, 0.5], [0.0, 0.0, 0.999, 0.999, 0.25, 0.25], [0.0; 6]];
        for (plane, wanted) in pixels.planes().zip(wanted) {
            for (value, wanted) in plane.iter().zip(wanted) {
                assert!((value - wanted).abs() < 1e-5, "{plane:?}");
            }
        }
    }
}
