//! Cuts: surfaces through solids. Each pixel of the canvas is mapped to a point in space.
use super::{Field, FieldId, Grid, Key, Solid, Tiling};
use std::fmt;
use std::sync::Arc;

type Spacing = Arc<dyn Fn(&Grid) -> f64 + Send + Sync>;

/// A surface in space: a map from the canvas to points in space.
#[derive(Clone)]
pub struct Cut {
    place: Field,
    key: Option<Key>,
    level: bool,
    flat: Option<[[f32; 3]; 2]>,
    pieces: Option<PieceMap>,
    metric: Option<Field>,
    rounded: Option<Field>,
    spacing: Spacing,
}

/// The pieces of a cut, each taken from another part of the solid. The surface is discontinuous at their borders.
#[derive(Clone)]
pub struct PieceMap {
    /// Id of the piece at each point of the canvas.
    pub ids: Field,
    /// The orientation of the pieces, if all of them are plane.
    pub planes: Option<PiecePlanes>,
    /// True if id 0 means a hole: all values are 0 there and are not computed.
    pub holes: bool,
}

/// The orientation of plane pieces on the canvas and in space.
#[derive(Clone)]
pub struct PiecePlanes {
    /// The cosine and the sine of the angle of each piece's x axis on the canvas, from +x towards +y.
    pub turned: Field,
    /// The unit vectors of a piece's x and y axes in space.
    pub axes: PieceAxes,
}

/// Maps the id of a piece to the unit vectors of its axes in space.
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
    /// cuts; fields of a cut without a key are not shared. `spacing` gives an upper bound, in mm, of the distance
    /// between the points of neighbouring pixels of a grid.
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

    /// Adds pieces. Points of different pieces are not neighbours.
    #[must_use]
    pub fn with_pieces(mut self, pieces: PieceMap) -> Self {
        self.pieces = Some(pieces);
        self
    }

    /// Adds a metric, for a surface with stretched pixels: three channels as in [`Patch`](super::Patch). `spacing` is
    /// then the width of footprints.
    #[must_use]
    pub fn with_metric(mut self, metric: Field) -> Self {
        self.metric = Some(metric);
        self
    }

    /// Adds the normals of a rounded surface: three channels as in [`Patch::rounded`](super::Patch::rounded).
    #[must_use]
    pub fn with_rounded(mut self, rounded: Field) -> Self {
        self.rounded = Some(rounded);
        self
    }

    /// Promises, if `level`, that z is the same for all points of a row of pixels.
    #[must_use]
    pub fn with_level_rows(mut self, level: bool) -> Self {
        self.level = level;
        self
    }

    /// Promises that the cut is a plane, in which these unit vectors point to the right and down in pictures.
    #[must_use]
    pub fn with_flat(mut self, right: [f32; 3], down: [f32; 3]) -> Self {
        self.flat = Some([right, down]);
        self
    }

    /// This cut with each point moved by the `SolidVector` `by`; `place` is the cut through `by`.
    #[must_use]
    pub(super) fn moved(&self, by: &Solid, place: Field, keeps_z: bool) -> Self {
        let key = self.key.zip(by.key()).map(|(own, by)| Key::of("moved cut", &[own.as_bytes(), by.as_bytes()]));
        // The movement may bend plane pieces.
        let pieces = self.pieces.clone().map(|pieces| PieceMap { planes: None, ..pieces });
        // The movement is assumed to keep lengths, as a rotation does.
        let (metric, rounded, spacing) = (self.metric.clone(), self.rounded.clone(), self.spacing.clone());
        Self { place, key, level: self.level && keeps_z, flat: None, pieces, metric, rounded, spacing }
    }

    /// The points, in the three channels of a field.
    pub fn place(&self) -> &Field {
        &self.place
    }

    /// Its key; `None` if points are moved by a solid without a key.
    pub fn key(&self) -> Option<Key> {
        self.key
    }

    /// The identity of the cut.
    pub(super) fn id(&self) -> FieldId {
        self.key.map_or_else(|| self.place.id(), FieldId::Key)
    }

    /// Directions in which it repeats with the canvas.
    pub fn tiling(&self) -> Tiling {
        self.place.tiling()
    }

    /// True if z is the same for all points of a row of pixels.
    pub fn level(&self) -> bool {
        self.level
    }

    /// The unit vectors that point to the right and down, if the cut is a plane.
    pub fn flat(&self) -> Option<[[f32; 3]; 2]> {
        self.flat
    }

    /// Its pieces, if there are several.
    pub fn pieces(&self) -> Option<&PieceMap> {
        self.pieces.as_ref()
    }

    /// The metric, if pixels are stretched.
    pub fn metric(&self) -> Option<&Field> {
        self.metric.as_ref()
    }

    /// The normals of the rounded surface, if there are any.
    pub fn rounded(&self) -> Option<&Field> {
        self.rounded.as_ref()
    }

    /// An upper bound, in mm, of the distance between the points of neighbouring pixels.
    #[expect(clippy::cast_possible_truncation, reason = "a bound in mm")]
    pub fn pixel(&self, grid: &Grid) -> f32 {
        (self.spacing)(grid) as f32
    }
}
