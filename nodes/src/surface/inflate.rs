//! [`Inflate`]: domes that pressure raises over the regions of a mask.
//!
//! Solves Poisson's equation over the whole picture, once per resolution; see
//! [`kernel::inflate`](shibo_kernel::surface::inflate). Unlike domes made of distances, these have no creases along the
//! middle of a region. Cost: about 0.25 µs a pixel, and 64 bytes of memory a pixel while it is solved.
use glam::{DVec2, UVec2};
use shibo_kernel::filter::sample::{Filter, Outside, Sampler};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::region::flood;
use shibo_kernel::surface::inflate::{PIXEL_BYTES, membrane};
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Canvas, Field, FieldSource, Given, Grid, Halo, Pictures, Read, Stop, Tile, Tiling, Type, Window};

/// The form of domes.
#[choice]
pub enum DomeProfile {
    /// Round at the rim: a disc becomes half a ball. Drops, cushions, beads.
    #[default]
    Round,
    /// A film under pressure: the rim has a slope, and wide regions rise with the square of their width. Blisters,
    /// quilts.
    Film,
}

/// Blows up the regions of a mask to domes: drops, padding, pebbles, beads, embossed letters.
///
/// A whole-picture operation. Each region is a film held at its border, and pressure raises it. The domes are smooth
/// everywhere: they have no creases, and parts of any width flow into each other. Heights in mm do not depend on the
/// resolution. The edge of a canvas that does not tile is no border. A mask that covers the whole canvas has no border,
/// and stays flat.
///
/// ```ron
/// "drops": Worley(size: 9),
/// "mask": "= 3.4 - drops.f1",
/// "height": Inflate(input: "mask", threshold: 0, pressure: 0.7),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Substance Designer *Bevel Smooth*; ZBrush *Inflate*; Illustrator *Inflate*; Photoshop *Bevel and Emboss*;
/// puff, pillow emboss.
#[node]
pub struct Inflate {
    /// The mask; a region is where it is above the threshold. Its edge lies between pixels, so a soft or a signed mask
    /// gives the most exact domes.
    pub input: In<Gray>,
    /// The value at a region's edge.
    #[schemars(range(min = -1e6, max = 1e6))]
    #[default(0.5)]
    pub threshold: f64,
    /// The form of domes.
    #[default(DomeProfile::Round)]
    pub profile: DomeProfile,
    /// The pressure. `Round`: factor on heights; with 1 a disc becomes half a ball. `Film`: a disc rises by a quarter
    /// of the pressure times the square of its radius in mm.
    #[schemars(range(min = -1e6, max = 1e6))]
    #[default(1.0)]
    pub pressure: f64,
}

/// The film over a mask, in mm².
struct Film {
    input: Field,
    /// The canvas, mm.
    size: DVec2,
    threshold: f32,
    /// True if each region is divided by its largest value.
    shares: bool,
}

impl Film {
    /// The grid of the canvas, with pixels of the size of those of `grid`.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to the pixels of a canvas")]
    fn canvas(&self, grid: &Grid) -> (Grid, UVec2) {
        let side = |n: f64| n.round().clamp(1.0, f64::from(Canvas::MAX_RESOLUTION)) as u32;
        let pixels = grid.period.unwrap_or_else(|| {
            let pixels = self.size / grid.step;
            UVec2::new(side(pixels.x), side(pixels.y))
        });
        (Grid { origin: DVec2::ZERO, step: self.size / pixels.as_dvec2(), period: Some(pixels), shown: None }, pixels)
    }

    fn wrap(&self) -> [bool; 2] {
        let Tiling { x, y } = self.input.tiling();
        [x, y]
    }
}

/// Divides each region by its largest value.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "numbers of regions, from 1 on")]
fn divide(film: &mut [f32], width: usize, wrap: [bool; 2]) {
    let mask: Vec<f32> = film.iter().map(|h| if *h > 0.0 { 1.0 } else { 0.0 }).collect();
    let mut ids = vec![0.0; film.len()];
    let count = flood::label(&mask, width, wrap, &mut ids);
    let mut tops = vec![0.0_f32; count + 1];
    for (h, id) in film.iter().zip(&ids) {
        let top = &mut tops[(*id as usize).min(count)];
        *top = top.max(*h);
    }
    for (h, id) in film.iter_mut().zip(&ids) {
        let top = tops[(*id as usize).min(count)];
        *h = if top > 0.0 { *h / top } else { 0.0 };
    }
}

impl FieldSource for Film {
    fn inputs(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let Some(film) = given.prepared() else { return Ok(()) };
        let view = tile::view(film, 0);
        let outside = self.wrap().map(|wrap| if wrap { Outside::Wrap } else { Outside::Clamp });
        let same = out.grid.origin == DVec2::ZERO && out.grid.step == film.grid.step;
        let filter = if same { Filter::Nearest } else { Filter::CatmullRom };
        let sampler = Sampler::new(view, filter, outside);
        let (grid, window, width) = (out.grid, out.window, out.width());
        for (row, y) in (window.y..window.bottom()).enumerate() {
            given.check()?;
            let at = |x: i32| (grid.center(x, y) / film.grid.step).as_vec2();
            let line = &mut out.plane_mut(0)[row * width..(row + 1) * width];
            line.iter_mut().zip(window.x..).for_each(|(out, x)| *out = sampler.at(at(x).x, at(x).y).max(0.0));
        }
        Ok(())
    }

    fn whole(&self, grid: &Grid) -> Vec<Read<'_>> {
        let (grid, pixels) = self.canvas(grid);
        vec![Read::new(&self.input, &grid, Window::full(pixels))]
    }

    fn prepare(&self, grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        let (grid, pixels) = self.canvas(grid);
        let mask = pictures.read(0, Window::full(pixels))?;
        pictures.check()?;
        let stopped = || pictures.check().is_err();
        let step = tile::step(&grid);
        let film = membrane(mask.plane(0), mask.width(), self.threshold, step, self.wrap(), &stopped);
        pictures.check()?;
        let mut out = Tile::new(grid, Window::full(pixels), 1);
        if let Some(mut film) = film {
            if self.shares {
                divide(&mut film, mask.width(), self.wrap());
            }
            out.plane_mut(0).copy_from_slice(&film);
        }
        Ok(Some(out))
    }

    fn prepare_bytes(&self, grid: &Grid) -> u64 {
        let pixels = self.canvas(grid).1;
        PIXEL_BYTES * u64::from(pixels.x) * u64::from(pixels.y)
    }
}

impl Node for Inflate {
    const OUTPUTS: &'static [Output] = &[
        Output::new("height", Type::Gray, "Height of the domes; 0 outside of the mask.").in_unit("mm"),
        Output::new("dome", Type::Gray, "Height as a share of the top of its region, 0..1."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn whole_bytes(&self, pixels: UVec2, _canvas: &CanvasFacts) -> u64 {
        PIXEL_BYTES * u64::from(pixels.x) * u64::from(pixels.y)
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.pressure != 0.0 {
            return Vec::new();
        }
        vec![Problem::new(Code::Advice, "with `pressure: 0` the height is 0 everywhere").at("pressure")]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let (size, tiling, threshold) = (cx.size_mm(), input.tiling(), narrow(self.threshold));
        let film = |shares| Field::new(Type::Gray, tiling, Film { input: input.clone(), size, threshold, shares });
        let (pressure, round) = (narrow(self.pressure), self.profile == DomeProfile::Round);
        let formed = |film: Field, factor: f32, inner: f32| {
            Field::map(Type::Gray, [film], Halo::NONE, move |out: &mut Tile, [film]: [&Tile; 1]| {
                for (out, film) in out.plane_mut(0).iter_mut().zip(film.plane(0)) {
                    *out = factor * if round { (inner * film).sqrt() } else { *film };
                }
                Ok(())
            })
        };
        // −Δh = 1 over a disc is (r² − ρ²) / 4, so the root of 4 h is half a ball.
        let height = formed(cx.shared_field("film", film(false)), pressure, 4.0);
        Ok(Outputs::one(height).with("dome", formed(cx.shared_field("shares", film(true)), 1.0, 1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, part};
    use crate::testing::{canvas, lumps, port};

    fn node() -> Inflate {
        Inflate { input: port(0), ..Inflate::default() }
    }

    /// Discs of 6 mm and 3 mm, the larger one over the corner of the canvas; the distance from their edges in mm.
    fn discs(tiling: Tiling) -> Field {
        Field::generate(Type::Gray, tiling, |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let at = grid.center(window.x + k % width, window.y + k / width);
                let away = |center: DVec2| {
                    let away = at - center;
                    (away - 32.0 * (away / 32.0).round()).length()
                };
                *v = narrow(0.5 + (6.0 - away(DVec2::ZERO)).max(3.0 - away(DVec2::splat(16.0))));
            }
            Ok(())
        })
    }

    #[test]
    fn domes_conform() {
        for profile in [DomeProfile::Round, DomeProfile::Film] {
            conforms(&Inflate { profile, pressure: -2.0, ..node() }, &[lumps().into()]);
            conforms(&Inflate { profile, ..node() }, &[gray().into()]);
            conforms(&Inflate { profile, threshold: -5.0, ..node() }, &[gray().into()]);
            conforms(&Inflate { profile, threshold: 5.0, ..node() }, &[gray().into()]);
        }
    }

    #[test]
    fn discs_become_half_balls_or_films_at_any_resolution() {
        let inputs = [discs(Tiling::BOTH).into()];
        for side in [64_u32, 256] {
            let canvas = Canvas { resolution: UVec2::splat(side), ..canvas() };
            let tops = |profile, output| {
                let made = field(&Inflate { profile, pressure: 0.5, ..node() }, &inputs, output);
                let whole = part(&made, &canvas, 0, 0, side, side);
                [whole.row(0, 0)[0], whole.row(0, side as usize / 2)[side as usize / 2]]
            };
            let near = |got: [f32; 2], want: [f32; 2], part: f32| {
                assert!(got.iter().zip(want).all(|(a, b)| (a / b - 1.0).abs() < part), "{side}: {got:?} {want:?}");
            };
            near(tops(DomeProfile::Round, "height"), [3.0, 1.5], 0.015);
            near(tops(DomeProfile::Film, "height"), [4.5, 1.125], 0.03);
            near(tops(DomeProfile::Film, "dome"), [1.0, 1.0], 0.001);
            near(tops(DomeProfile::Round, "dome"), [1.0, 1.0], 0.001);
        }
    }
}
