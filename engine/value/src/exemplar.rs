//! Exemplars of texture synthesis.
use super::{Number, Object, Pixels, Sketch, Tiling, Type};
use glam::{DVec2, UVec2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Positions of the pixels of an exemplar.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExemplarFrame {
    /// Columns and rows.
    pub size: UVec2,
    /// The outer corner of the first pixel in mm, in the field that the exemplar was taken from.
    pub origin: DVec2,
    /// The size of a pixel in mm.
    pub pitch: DVec2,
    /// Directions in which it tiles.
    pub periodic: Tiling,
}

/// Neighbours of a pixel that are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Neighborhood {
    /// The four neighbours along the diagonals.
    #[default]
    Diagonal4,
    /// The eight nearest neighbours.
    Square3,
    /// The 24 nearest neighbours.
    Square5,
}

impl Neighborhood {
    /// The offsets, row by row, without the pixel itself.
    pub fn offsets(self) -> Vec<[i32; 2]> {
        let square = |r: i32| (-r..=r).flat_map(move |y| (-r..=r).map(move |x| [x, y])).filter(|o| *o != [0, 0]);
        match self {
            Self::Diagonal4 => vec![[-1, -1], [1, -1], [-1, 1], [1, 1]],
            Self::Square3 => square(1).collect(),
            Self::Square5 => square(2).collect(),
        }
    }

    /// Its reach, in pixels of the level.
    pub const fn reach(self) -> i32 {
        match self {
            Self::Diagonal4 | Self::Square3 => 1,
            Self::Square5 => 2,
        }
    }
}

/// An analysed level of an exemplar.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExemplarLevel {
    /// Spacing in finest pixels.
    pub h: usize,
    /// Neighbours that are compared.
    pub hood: Neighborhood,
    /// The appearance of each pixel's surroundings, as eight numbers.
    pub appearance: Vec<[f32; 8]>,
    /// The projection from the eight numbers of each neighbour, one neighbour after another, to eight numbers of the
    /// whole neighbourhood.
    pub matrix: Vec<[f32; 8]>,
    /// The projected neighbourhood of every pixel.
    pub neighborhoods: Vec<[f32; 8]>,
    /// Index of a similar pixel for every pixel, then the index of a second one for every pixel, and so on; the pixel's
    /// own index if there is none. Empty if none were searched.
    pub second: Vec<u32>,
}

/// The periods of an exemplar.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExemplarLattice {
    /// Two vectors in exemplar pixels; `None` if it does not repeat.
    pub vectors: Option<[DVec2; 2]>,
    /// The strength of the repetition, 0..1.
    pub strength: f64,
}

/// A picture for texture synthesis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Exemplar {
    /// Size and position.
    pub frame: ExemplarFrame,
    /// The visible values: one plane of grey, or three of scene-linear colour.
    pub shown: Arc<Vec<f32>>,
    /// Number of features per pixel.
    pub channels: usize,
    /// The features that are compared, pixel-interleaved.
    pub features: Arc<Vec<f32>>,
    /// A guide value for each pixel; empty without a guide.
    pub guide: Arc<Vec<f32>>,
    /// True for each pixel that may appear in the output; empty if all may.
    pub usable: Arc<Vec<bool>>,
    /// True if levels are downsampled pictures instead of blurred ones.
    pub pyramid: bool,
    /// Width of the border that never appears in the output, in level spacings.
    pub margin: f64,
    /// Its levels from the finest, after the analysis.
    pub levels: Arc<Vec<ExemplarLevel>>,
    /// Its periods, after the analysis.
    pub lattice: Option<ExemplarLattice>,
}

impl Exemplar {
    /// The number of pixels.
    pub fn len(&self) -> usize {
        self.frame.size.x as usize * self.frame.size.y as usize
    }

    /// True if there is no pixel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// True if it shows colour, not grey.
    pub fn is_color(&self) -> bool {
        self.shown.len() > self.len()
    }
}

/// The visible values and the analysis of an exemplar.
#[derive(Serialize)]
struct ExemplarData {
    size: [u32; 2],
    channels: usize,
    values: Vec<Number>,
    periodic: [bool; 2],
    /// Spacings of the analysed levels.
    levels: Vec<usize>,
    /// The periods in pixels, after the analysis.
    #[serde(skip_serializing_if = "Option::is_none")]
    lattice: Option<[[f64; 2]; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    strength: Option<f64>,
}

impl Object for Exemplar {
    fn bytes(&self) -> usize {
        let levels = self.levels.iter().map(|l| 32 * (2 * l.appearance.len() + l.matrix.len()) + 4 * l.second.len());
        size_of::<Self>()
            + 4 * (self.shown.len() + self.features.len() + self.guide.len())
            + self.usable.len()
            + levels.sum::<usize>()
    }

    fn data(&self) -> impl Serialize {
        let (n, channels) = (self.len(), if self.is_color() { 3 } else { 1 });
        let values = (0..n).flat_map(|p| (0..channels).map(move |c| Number(self.shown[c * n + p]))).collect();
        let vectors = self.lattice.and_then(|lattice| lattice.vectors);
        ExemplarData {
            size: self.frame.size.to_array(),
            channels,
            values,
            periodic: [self.frame.periodic.x, self.frame.periodic.y],
            levels: self.levels.iter().map(|level| level.h).collect(),
            lattice: vectors.map(|v| v.map(|v| v.to_array())),
            strength: self.lattice.map(|lattice| lattice.strength),
        }
    }

    /// Its visible values.
    fn sketch(&self) -> Option<Sketch> {
        let size = self.frame.size;
        let ty = if self.is_color() { Type::Rgb } else { Type::Gray };
        Pixels::new(ty, [size.x as usize, size.y as usize], self.shown.to_vec()).map(Sketch::Pixels)
    }
}
