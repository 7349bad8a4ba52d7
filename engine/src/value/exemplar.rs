//! Exemplars.
use super::{Number, Object, Pixels, Sketch, Tiling, Type};
use glam::{DVec2, UVec2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Where the pixels of an exemplar lie.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExemplarFrame {
    /// Columns and rows.
    pub size: UVec2,
    /// The outer corner of the first pixel in mm, in the field that it was taken from.
    pub origin: DVec2,
    /// The size of a pixel in mm.
    pub pitch: DVec2,
    /// The directions in which it repeats: its opposite sides fit.
    pub periodic: Tiling,
}

/// Which neighbours of a pixel are compared.
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
    /// The offsets, without the pixel itself, by rows.
    pub fn offsets(self) -> Vec<[i32; 2]> {
        let square = |r: i32| (-r..=r).flat_map(move |y| (-r..=r).map(move |x| [x, y])).filter(|o| *o != [0, 0]);
        match self {
            Self::Diagonal4 => vec![[-1, -1], [1, -1], [-1, 1], [1, 1]],
            Self::Square3 => square(1).collect(),
            Self::Square5 => square(2).collect(),
        }
    }

    /// How far it reaches, in pixels of the level.
    pub const fn reach(self) -> i32 {
        match self {
            Self::Diagonal4 | Self::Square3 => 1,
            Self::Square5 => 2,
        }
    }
}

/// A level of an exemplar, analysed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExemplarLevel {
    /// Spacing in finest pixels.
    pub h: usize,
    /// Which neighbours are compared.
    pub hood: Neighborhood,
    /// What surrounds each pixel, as eight numbers.
    pub appearance: Vec<[f32; 8]>,
    /// From the eight numbers of each neighbour, one after another, to eight of the whole neighbourhood.
    pub matrix: Vec<[f32; 8]>,
    /// Those eight numbers of every pixel.
    pub neighborhoods: Vec<[f32; 8]>,
    /// For every pixel the number of another one that looks similar, then for every pixel that of a further one, and so on;
    /// its own number where there is none. Empty if none were searched.
    pub second: Vec<u32>,
}

/// The vectors by which an exemplar repeats.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExemplarLattice {
    /// In exemplar pixels; `None` if it does not repeat.
    pub vectors: Option<[DVec2; 2]>,
    /// How strongly, 0..1.
    pub strength: f64,
}

/// A picture to synthesise from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Exemplar {
    /// Size and place.
    pub frame: ExemplarFrame,
    /// What is shown: one plane of grey, or three of scene-linear colour.
    pub shown: Arc<Vec<f32>>,
    /// Numbers that are compared, per pixel.
    pub channels: usize,
    /// What is compared: the numbers of a pixel side by side.
    pub features: Arc<Vec<f32>>,
    /// A guide value for each pixel; empty without a guide.
    pub guide: Arc<Vec<f32>>,
    /// Whether each pixel may be shown; empty if all may.
    pub usable: Arc<Vec<bool>>,
    /// Whether levels are halved pictures instead of blurred ones.
    pub pyramid: bool,
    /// Distance from the border within which nothing is shown, in level spacings.
    pub margin: f64,
    /// Its levels from the finest, once they are analysed.
    pub levels: Arc<Vec<ExemplarLevel>>,
    /// How it repeats, once that is known.
    pub lattice: Option<ExemplarLattice>,
}

impl Exemplar {
    /// The number of pixels.
    pub fn len(&self) -> usize {
        self.frame.size.x as usize * self.frame.size.y as usize
    }

    /// Whether there is no pixel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether colour is shown, and not grey.
    pub fn is_color(&self) -> bool {
        self.shown.len() > self.len()
    }
}

/// What is shown of an exemplar, and what is known of it.
#[derive(Serialize)]
struct ExemplarData {
    size: [u32; 2],
    channels: usize,
    values: Vec<Number>,
    periodic: [bool; 2],
    /// Spacings of the levels that are analysed.
    levels: Vec<usize>,
    /// The vectors by which it repeats, in pixels, once they are known.
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

    /// What it shows.
    fn sketch(&self) -> Option<Sketch> {
        let size = self.frame.size;
        let ty = if self.is_color() { Type::Rgb } else { Type::Gray };
        Pixels::new(ty, [size.x as usize, size.y as usize], self.shown.to_vec()).map(Sketch::Pixels)
    }
}
