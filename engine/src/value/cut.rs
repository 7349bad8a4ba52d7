//! Cuts: surfaces through solids, each pixel of the canvas a point in space.
use super::{Field, FieldId, Grid, Key, Solid, Tiling};
use std::fmt;
use std::sync::Arc;

type Spacing = Arc<dyn Fn(&Grid) -> f64 + Send + Sync>;

/// A surface in space: where in it each point of the canvas lies.
#[derive(Clone)]
pub struct Cut {
    place: Field,
    key: Option<Key>,
    level: bool,
    flat: Option<[[f32; 3]; 2]>,
    pieces: Option<Pieces>,
    metric: Option<Field>,
    rounded: Option<Field>,
    spacing: Spacing,
}

/// The pieces that a cut is made of, each cut from another place: the surface breaks off at their borders.
#[derive(Clone)]
pub struct Pieces {
    /// The number of the piece at each point of the canvas.
    pub ids: Field,
    /// How the pieces lie, if each of them is plane.
    pub planes: Option<PiecePlanes>,
    /// Whether there is nothing to cut where the number is 0: all values are 0 there, and no time is spent on them.
    pub holes: bool,
}

/// How plane pieces lie on the canvas and in space.
#[derive(Clone)]
pub struct PiecePlanes {
    /// The cosine and the sine of the angle of each piece's own x axis on the canvas, from +x towards +y.
    pub turned: Field,
    /// The directions of length 1 of a piece's own x and y axes in space.
    pub axes: PieceAxes,
}

/// The directions of length 1 in space of the axes of the piece with a number.
#[derive(Clone)]
pub struct PieceAxes(pub Arc<dyn Fn(f32) -> [[f32; 3]; 2] + Send + Sync>);

impl fmt::Debug for PieceAxes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PieceAxes").finish_non_exhaustive()
    }
}

impl fmt::Debug for Cut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cut").field("key", &self.key).field("level", &self.level).finish_non_exhaustive()
    }
}

impl Cut {
    /// A cut with the x, y and z of each point of the canvas in the three channels of `place`. Equal keys mean equal
    /// cuts; what a cut without one shows is not shared. `spacing` gives an upper bound, in mm, of the distance between
    /// the points of neighbouring pixels of a grid.
    pub fn new(
        key: impl Into<Option<Key>>,
        place: Field,
        spacing: impl Fn(&Grid) -> f64 + Send + Sync + 'static,
    ) -> Self {
        Self {
            place,
            key: key.into(),
            level: false,
            flat: None,
            pieces: None,
            metric: None,
            rounded: None,
            spacing: Arc::new(spacing),
        }
    }

    /// The same, made of pieces. Points of different pieces are not neighbours.
    #[must_use]
    pub fn with_pieces(mut self, pieces: Pieces) -> Self {
        self.pieces = Some(pieces);
        self
    }

    /// The same on a surface whose pixels are stretched: three channels hold the metric of [`Patch`](super::Patch). `spacing` is then the width of footprints.
    #[must_use]
    pub fn with_metric(mut self, metric: Field) -> Self {
        self.metric = Some(metric);
        self
    }

    /// The same on a surface that is taken as round: three channels hold what [`Patch::rounded`](super::Patch::rounded) tells.
    #[must_use]
    pub fn with_rounded(mut self, rounded: Field) -> Self {
        self.rounded = Some(rounded);
        self
    }

    /// The same with the promise that z is the same for all points of a row of pixels, if `level`.
    #[must_use]
    pub fn with_level_rows(mut self, level: bool) -> Self {
        self.level = level;
        self
    }

    /// The same with the promise that it is a plane, and that these directions of length 1 run to the right and down in its
    /// pictures.
    #[must_use]
    pub fn with_flat(mut self, right: [f32; 3], down: [f32; 3]) -> Self {
        self.flat = Some([right, down]);
        self
    }

    /// This cut with each point moved to where the `SolidVector` `by` says; `place` is the cut through `by`.
    #[must_use]
    pub(super) fn moved(&self, by: &Solid, place: Field, keeps_z: bool) -> Self {
        let key = self.key.zip(by.key()).map(|(own, by)| Key::of("moved cut", &[own.as_bytes(), by.as_bytes()]));
        // Pieces that were plane are so no longer.
        let pieces = self.pieces.clone().map(|pieces| Pieces { planes: None, ..pieces });
        // What moves points is taken to keep lengths, as turning does.
        let (metric, rounded, spacing) = (self.metric.clone(), self.rounded.clone(), self.spacing.clone());
        Self { place, key, level: self.level && keeps_z, flat: None, pieces, metric, rounded, spacing }
    }

    /// The points, in the three channels of a field.
    pub fn place(&self) -> &Field {
        &self.place
    }

    /// Its key; `None` where points are moved by a solid without one.
    pub fn key(&self) -> Option<Key> {
        self.key
    }

    /// The identity of the cut.
    pub(super) fn id(&self) -> FieldId {
        self.key.map_or_else(|| self.place.id(), FieldId::Key)
    }

    /// Where it repeats with the canvas.
    pub fn tiling(&self) -> Tiling {
        self.place.tiling()
    }

    /// Whether z is the same for all points of a row of pixels.
    pub fn level(&self) -> bool {
        self.level
    }

    /// The directions of length 1 that run to the right and down, if it is a plane.
    pub fn flat(&self) -> Option<[[f32; 3]; 2]> {
        self.flat
    }

    /// The pieces that it is made of, if it is not one.
    pub fn pieces(&self) -> Option<&Pieces> {
        self.pieces.as_ref()
    }

    /// How lengths follow from ways in pixels, if these are stretched.
    pub fn metric(&self) -> Option<&Field> {
        self.metric.as_ref()
    }

    /// The normals of a rounded surface, if it is taken as one.
    pub fn rounded(&self) -> Option<&Field> {
        self.rounded.as_ref()
    }

    /// An upper bound, in mm, of the distance between the points of neighbouring pixels.
    #[expect(clippy::cast_possible_truncation, reason = "a bound in mm")]
    pub fn pixel(&self, grid: &Grid) -> f32 {
        (self.spacing)(grid) as f32
    }
}
