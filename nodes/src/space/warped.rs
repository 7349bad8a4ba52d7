//! A field seen through displacements: what [`Warp`](super::Warp) makes.
use shibo_engine::value::{Field, FieldSource, Grid, Reader, Stop, Tile, Window};
use shibo_kernel::filter::warp::{self, WarpSpec};
use shibo_kernel::ground::tile;
use shibo_kernel::ground::window::Rect;
use shibo_kernel::noise::fractal::Noise;

/// What moves the pixels.
pub(super) enum Displacement {
    /// Noise, scaled from 0..1 to ±amount.
    Noise(Box<[Noise; 2]>),
    /// Fields, scaled in the same way.
    Gray([Field; 2]),
    /// Millimetres.
    Vector(Field),
}

impl Displacement {
    /// The fields that are read.
    pub(super) fn fields(&self) -> &[Field] {
        match self {
            Self::Noise(_) => &[],
            Self::Gray(fields) => fields,
            Self::Vector(field) => std::slice::from_ref(field),
        }
    }
}

/// A field seen through displacements.
pub(super) struct Warped {
    pub(super) input: Field,
    pub(super) by: Displacement,
    /// What 0 and 1 stand for, mm.
    pub(super) amount: f64,
    /// Longest displacement, mm.
    pub(super) limit: f64,
}

/// A tile whose displacements lead to more pixels than this is done in parts.
const MOST_PIXELS: usize = 1 << 22;

impl Warped {
    /// Displacements in mm for every pixel of a tile.
    fn displacements(&self, reader: &dyn Reader, out: &Tile) -> Result<[Vec<f32>; 2], Stop> {
        let (grid, window) = (out.grid, out.window);
        #[expect(clippy::cast_possible_truncation, reason = "displacements need no more than f32")]
        let amount = self.amount as f32;
        let scale = |mut plane: Vec<f32>| {
            plane.iter_mut().for_each(|v| *v = (*v * 2.0 - 1.0) * amount);
            plane
        };
        Ok(match &self.by {
            Displacement::Vector(by) => {
                let by = reader.read(by, &grid, window)?;
                [by.plane(0).to_vec(), by.plane(1).to_vec()]
            }
            Displacement::Gray([x, y]) => {
                let (x, y) = (reader.read(x, &grid, window)?, reader.read(y, &grid, window)?);
                [scale(x.plane(0).to_vec()), scale(y.plane(0).to_vec())]
            }
            Displacement::Noise(noise) => {
                let frame = tile::frame(out);
                [&noise[0], &noise[1]].map(|noise| {
                    let mut plane = vec![0.0; window.len()];
                    noise.fill(&frame, &mut plane);
                    scale(plane)
                })
            }
        })
    }

    /// Warps one tile, or in parts if what it reads is large.
    fn warp(&self, reader: &dyn Reader, by: [&[f32]; 2], out: &mut Tile) -> Result<(), Stop> {
        let spec = WarpSpec { step: tile::step(&out.grid), limit: [self.limit; 2] };
        let rect = tile::rect(out.window);
        let read = spec.reads(rect, by);
        if read.area() > MOST_PIXELS && rect.area() > 1 {
            return self.halves(reader, by, out);
        }
        let input = reader.read(&self.input, &out.grid, window(read))?;
        let views: Vec<_> = (0..out.channels()).map(|channel| tile::view(&input, channel)).collect();
        warp::warp(&views, rect, by, &spec, &mut out.planes_mut());
        Ok(())
    }

    fn halves(&self, reader: &dyn Reader, by: [&[f32]; 2], out: &mut Tile) -> Result<(), Stop> {
        let whole = out.window;
        let (w, h) = (whole.width, whole.height);
        let (first, second) = if w > h {
            (Window { width: w / 2, ..whole }, Window { x: whole.x + (w / 2).cast_signed(), width: w - w / 2, ..whole })
        } else {
            (
                Window { height: h / 2, ..whole },
                Window { y: whole.y + (h / 2).cast_signed(), height: h - h / 2, ..whole },
            )
        };
        for part in [first, second] {
            reader.check()?;
            let cut = |plane: &[f32]| -> Vec<f32> {
                let skip = part.x.abs_diff(whole.x) as usize;
                let rows = plane.chunks_exact(w as usize).skip(part.y.abs_diff(whole.y) as usize);
                let rows = rows.take(part.height as usize);
                rows.flat_map(|row| &row[skip..skip + part.width as usize]).copied().collect()
            };
            let mut tile = Tile::new(out.grid, part, out.channels());
            self.warp(reader, [&cut(by[0]), &cut(by[1])], &mut tile)?;
            out.copy_from(&tile, 0, 0);
        }
        Ok(())
    }
}

fn window(rect: Rect) -> Window {
    let size = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    Window { x: rect.x0, y: rect.y0, width: size(rect.w), height: size(rect.h) }
}

impl FieldSource for Warped {
    fn fill(&self, reader: &dyn Reader, out: &mut Tile) -> Result<(), Stop> {
        let [x, y] = self.displacements(reader, out)?;
        self.warp(reader, [&x, &y], out)
    }

    fn reads(&self, grid: &Grid) -> Vec<(&Field, Grid)> {
        std::iter::once(&self.input).chain(self.by.fields()).map(|field| (field, *grid)).collect()
    }

    fn span(&self, grid: &Grid, at: Window) -> Option<Window> {
        let spec = WarpSpec { step: tile::step(grid), limit: [self.limit; 2] };
        Some(window(spec.reach(tile::rect(at))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_field, lumps};
    use shibo_engine::value::{Tiling, Type};
    use shibo_kernel::ground::hash::Hash;
    use shibo_kernel::noise::cells;
    use shibo_kernel::noise::fractal::NoiseSpec;

    #[test]
    fn parts_make_the_whole() {
        let noise = [0, 1].map(|k| {
            let spec = NoiseSpec::fbm(3.0, 3);
            let noise = Noise::new(&spec, &cells::canvas(glam::DVec2::splat(32.0), Tiling::BOTH), Hash::new(k));
            Field::generate(Type::Gray, Tiling::BOTH, move |out, _| {
                noise.fill(&tile::frame(out), out.plane_mut(0));
                Ok(())
            })
        });
        let warped = Warped { input: lumps(), by: Displacement::Gray(noise), amount: 4.0, limit: 4.0 };
        let field = Field::new(Type::Gray, Tiling::BOTH, Parts(warped));
        check_field(&field);
    }

    /// Fills tiles once as they are and once in halves.
    struct Parts(Warped);

    impl FieldSource for Parts {
        fn fill(&self, reader: &dyn Reader, out: &mut Tile) -> Result<(), Stop> {
            let mut halves = out.clone();
            let [x, y] = self.0.displacements(reader, out)?;
            self.0.warp(reader, [&x, &y], out)?;
            self.0.halves(reader, [&x, &y], &mut halves)?;
            assert_eq!(*out, halves);
            Ok(())
        }

        fn reads(&self, grid: &Grid) -> Vec<(&Field, Grid)> {
            self.0.reads(grid)
        }
    }
}
