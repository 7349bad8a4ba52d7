//! Colours of wood over a year of growth.
use super::{Number, Object, Pixels, Sketch, Type, data};
use serde::{Deserialize, Serialize};

/// The colours of wood over a year, from early to late wood, for one or several years.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColorPattern {
    /// Scene-linear colours, [`entries`](Self::entries) for each year.
    pub table: Vec<[f32; 3]>,
    /// The number of entries of a year.
    pub entries: usize,
    /// The relative widths of the years that it was sampled from; empty if it was not sampled.
    pub widths: Vec<f32>,
}

#[derive(Serialize)]
struct ColorPatternData {
    entries: usize,
    table: Vec<[Number; 3]>,
    widths: Vec<Number>,
}

/// Least width of the strip that shows a pattern, in pixels.
const STRIP: usize = 960;

impl Object for ColorPattern {
    fn bytes(&self) -> usize {
        size_of::<Self>() + self.table.len() * 12 + self.widths.len() * 4
    }

    fn data(&self) -> impl Serialize {
        ColorPatternData {
            entries: self.entries,
            table: self.table.iter().map(|color| color.map(Number)).collect(),
            widths: data::numbers(&self.widths),
        }
    }

    /// The years side by side, from early to late wood.
    fn sketch(&self) -> Option<Sketch> {
        let entries = self.table.len();
        let wide = STRIP.div_ceil(entries.max(1)).max(1);
        let size = [entries * wide, (entries * wide / 6).max(1)];
        let plane = |c: usize| {
            let line: Vec<f32> = self.table.iter().flat_map(|color| std::iter::repeat_n(color[c], wide)).collect();
            line.repeat(size[1])
        };
        Pixels::new(Type::Rgb, size, (0..3).flat_map(plane).collect()).map(Sketch::Pixels)
    }
}
