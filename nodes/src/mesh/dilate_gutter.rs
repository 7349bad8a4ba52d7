//! [`DilateGutter`]: extends a texture beyond the borders of charts.
//!
//! Fills texels ring by ring with the mean of the neighbours that are filled already, see
//! [`kernel::dilate`](shibo_kernel::mesh::dilate). Texels farther away come from a small picture of the canvas. Cost:
//! O(pixels · width) near borders.
use crate::on_atlas::{Carried, Reach};
use glam::DVec2;
use shibo_kernel::mesh::dilate::Picture;
use shibo_kernel::mesh::fields;
use shibo_node::{
    CanvasFacts, Context, Fact, FieldOrMaterial, FieldsOrMaterial, In, Node, Output, Outputs, choice, node,
};
use shibo_value::{
    Atlas, Field, FieldSource, Given, Grid, Material, Pictures, Read, Resolution, Stop, Tile, Tiling, Type, Window,
};
use std::sync::Arc;

/// Source of the values beyond a border.
#[choice]
pub enum DilateMode {
    /// From the nearest texels of the chart.
    #[default]
    Nearest,
    /// From the other chart in which the surface continues beyond the border: filters that read there see no border.
    /// This needs the whole picture; normals are rotated with their charts.
    Across,
}

/// Values of texels farther away.
#[choice]
pub enum Rest {
    /// They keep the value of the input.
    #[default]
    Keep,
    /// They get roughly the values of the nearest charts, for use in mip-maps.
    Nearest,
}

/// Extends a texture beyond the borders of its charts, so that no renderer mixes in the texels between charts.
///
/// Texels in charts, and up to two texels beyond their borders, stay unchanged. Ids are never mixed: the lowest id
/// among the neighbours is used. Of a material, each channel is a texture, and constant channels stay as they are.
///
/// ```ron
/// "ball": MeshShape(shape: Cube),
/// "atlas": MeshAtlas(mesh: "ball"),
/// "normal": BakeNormal(atlas: "atlas"),
/// "example": DilateGutter(input: "normal", atlas: "atlas", width: 16),
/// ```
///
/// Elsewhere: Substance Painter *Dilation*, *Padding*; Blender *Margin* of bakes; Houdini *UV Border Extension*.
#[node]
pub struct DilateGutter {
    /// The texture, or a material with all its channels.
    pub input: In<FieldOrMaterial>,
    /// The atlas.
    pub atlas: In<Atlas>,
    /// Source of the values beyond a border.
    #[default(DilateMode::Nearest)]
    pub mode: DilateMode,
    /// Number of texels by which charts are extended.
    #[schemars(range(min = 1, max = 256), extend("unit" = "px"))]
    #[default(8)]
    pub width: u32,
    /// Values of texels farther away.
    #[default(Rest::Keep)]
    pub rest: Rest,
}

/// Pixels along the longer side of the small picture that supplies far texels.
const SMALL: u32 = 256;

struct Dilated {
    input: Field,
    texels: Field,
    width: u32,
    rest: Rest,
    size: DVec2,
}

impl Dilated {
    /// True for ids, which must not be mixed.
    fn lowest(&self) -> bool {
        self.input.ty() == Type::Ids
    }

    fn picture(&self, input: &Tile, texels: &Tile) -> Picture {
        Picture {
            planes: (0..input.channels()).map(|channel| input.plane(channel).to_vec()).collect(),
            filled: texels.plane(0).iter().map(|texel| *texel != 0.0).collect(),
            columns: input.width(),
        }
    }

    /// The grid and window of the small picture, independent of the output's grid.
    fn small(&self) -> (Grid, Window) {
        let pixels = Resolution::Longer(SMALL).of(self.size);
        (
            Grid { origin: DVec2::ZERO, step: self.size / pixels.as_dvec2(), period: Some(pixels), shown: None },
            Window::full(pixels),
        )
    }

    /// The small picture at a place, interpolated linearly.
    fn far(small: &Tile, channel: usize, at: DVec2) -> f32 {
        let last = DVec2::new(small.width() as f64 - 1.0, small.height() as f64 - 1.0);
        let at = (at / small.grid.step - 0.5).clamp(DVec2::ZERO, last);
        let corner = at.floor();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the picture")]
        let [x, y] = [corner.x as usize, corner.y as usize];
        let (right, below) = ((x + 1).min(small.width() - 1), (y + 1).min(small.height() - 1));
        let share = (at - corner).as_vec2();
        let mix = |row: usize| {
            let row = small.row(channel, row);
            row[x] + (row[right] - row[x]) * share.x
        };
        mix(y) + (mix(below) - mix(y)) * share.y
    }
}

impl FieldSource for Dilated {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let reach = self.width.cast_signed();
        [&self.input, &self.texels].map(|field| Read::new(field, grid, window.grow(reach, reach))).into()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (input, texels) = (given.tile(0), given.tile(1));
        if texels.plane(0).iter().all(|texel| *texel > 0.0) {
            out.copy_from(input, 0, 0);
            return Ok(());
        }
        let mut picture = self.picture(input, texels);
        picture.rings(self.width as usize, self.lowest());
        given.check()?;
        let (grid, window, reach) = (out.grid, out.window, self.width as usize);
        for (channel, plane) in picture.planes.iter().enumerate() {
            for (row, y) in (0..out.height()).zip(window.y..) {
                let start = (row + reach) * picture.columns + reach;
                let filled = &picture.filled[start..start + out.width()];
                let from = plane[start..start + out.width()].iter().zip(filled).zip(window.x..);
                for (value, ((from, filled), x)) in out.row_mut(channel, row).iter_mut().zip(from) {
                    *value = match given.prepared() {
                        // Ids are not interpolated.
                        Some(small) if !filled && self.lowest() => Self::far(
                            small,
                            channel,
                            (grid.center(x, y) / small.grid.step).floor() * small.grid.step + 0.5 * small.grid.step,
                        ),
                        Some(small) if !filled => Self::far(small, channel, grid.center(x, y)),
                        _ => *from,
                    };
                }
            }
        }
        Ok(())
    }

    fn whole(&self, _grid: &Grid) -> Vec<Read<'_>> {
        if self.rest == Rest::Keep {
            return Vec::new();
        }
        let (grid, window) = self.small();
        [&self.input, &self.texels].map(|field| Read::new(field, &grid, window)).into()
    }

    fn prepare(&self, _grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        if self.rest == Rest::Keep {
            return Ok(None);
        }
        let (grid, window) = self.small();
        let (input, texels) = (pictures.read(0, window)?, pictures.read(1, window)?);
        let mut picture = self.picture(&input, &texels);
        picture.fill_all(self.lowest());
        let mut out = Tile::new(grid, window, input.channels());
        for (channel, plane) in picture.planes.iter().enumerate() {
            out.plane_mut(channel).copy_from_slice(plane);
        }
        Ok(Some(out))
    }

    fn prepare_bytes(&self, _grid: &Grid) -> u64 {
        u64::from(self.rest == Rest::Nearest) * 16 * (self.input.channels() as u64 + 1) * u64::from(SMALL * SMALL)
    }
}

/// A texture with filled texels around the charts of an atlas, near ones exactly. Exported files use it.
pub fn filled(input: &Field, atlas: &Arc<Atlas>) -> Field {
    if input.as_constant().is_some() {
        return input.clone();
    }
    let texels = fields::texels(atlas);
    let source = Dilated { input: input.clone(), texels, width: 8, rest: Rest::Nearest, size: atlas.size_mm };
    Field::new(input.ty(), Tiling::NONE, source).overwriting()
}

impl Node for DilateGutter {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The texture, carried on.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let atlas = cx.get(&self.atlas)?;
        let material = match cx.get(&self.input)? {
            FieldsOrMaterial::Field(field) => return Ok(Outputs::one(self.dilated(cx, "rest", field, &atlas))),
            FieldsOrMaterial::Material(material) => material,
        };
        let channels = material.channels().iter().map(|(channel, field)| match field.as_constant() {
            Some(_) => (*channel, field.clone()),
            None => (*channel, self.dilated(cx, &format!("rest {}", channel.name()), field.clone(), &atlas)),
        });
        Ok(Outputs::one(Material::new(channels)))
    }
}

impl DilateGutter {
    /// The field beyond the borders of its charts, too. `rest` is the name of its part for `DilateMode::Across`.
    fn dilated(&self, cx: &Context<'_>, rest: &str, input: Field, atlas: &Arc<Atlas>) -> Field {
        let (ty, atlas) = (input.ty(), Arc::clone(atlas));
        if self.mode == DilateMode::Across && self.rest == Rest::Keep {
            let source = Carried { input, atlas, reach: Reach::Pixels(self.width) };
            return Field::new(ty, Tiling::NONE, source);
        }
        let source =
            Dilated { input, texels: fields::texels(&atlas), width: self.width, rest: self.rest, size: cx.size_mm() };
        let dilated = Field::new(ty, Tiling::NONE, source).overwriting();
        if self.mode == DilateMode::Across {
            let input = cx.shared_field(rest, dilated);
            let source = Carried { input, atlas, reach: Reach::Pixels(self.width) };
            return Field::new(ty, Tiling::NONE, source);
        }
        dilated
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::atlas_of;
    use crate::mesh::{BakeParts, BakePosition, MeshForm, MeshShape, Parts};
    use crate::testing::{canvas, check_field, field, port, raster, render};
    use shibo_value::Value;

    fn node(width: u32, rest: Rest) -> DilateGutter {
        DilateGutter { input: port(0), atlas: port(1), width, rest, ..DilateGutter::default() }
    }

    fn inputs() -> [Value; 2] {
        let atlas = atlas_of(&MeshShape { shape: MeshForm::Cube, ..MeshShape::default() });
        let places = field(&BakePosition { atlas: port(0), ..BakePosition::default() }, std::slice::from_ref(&atlas));
        [places.into(), atlas]
    }

    #[test]
    fn holds_in_any_window() {
        for rest in [Rest::Keep, Rest::Nearest] {
            for width in [1, 5] {
                check_field(&field(&node(width, rest), &inputs()));
            }
        }
    }

    /// Texels in charts stay unchanged, and with `rest: Nearest` no texel is left empty.
    #[test]
    fn keeps_texels_in_charts() {
        let inputs = inputs();
        let Value::Field(before) = &inputs[0] else { panic!() };
        let Value::Atlas(atlas) = &inputs[1] else { panic!() };
        let (before, texels) = (raster(before, &canvas()), raster(&fields::texels(atlas), &canvas()));
        let [narrow, wide, all] =
            [(1, Rest::Keep), (3, Rest::Keep), (1, Rest::Nearest)].map(|(w, rest)| render(&node(w, rest), &inputs));
        let empty = |tile: &Tile| (0..tile.window.len()).filter(|k| (0..3).all(|c| tile.plane(c)[*k] == 0.0)).count();
        assert!(empty(&before) > empty(&narrow) && empty(&narrow) > empty(&wide) && empty(&wide) > 0);
        assert_eq!(empty(&all), 0);
        for k in (0..before.window.len()).filter(|k| texels.plane(0)[*k] != 0.0) {
            for tile in [&narrow, &wide, &all] {
                assert!((0..3).all(|c| tile.plane(c)[k] == before.plane(c)[k]));
            }
        }
    }

    /// With `Across`, texels beyond a border show the surface beyond it.
    #[test]
    fn continues_surface_across_borders() {
        let inputs = inputs();
        let across = DilateGutter { mode: DilateMode::Across, ..node(2, Rest::Keep) };
        let (Value::Field(before), Value::Atlas(atlas)) = (&inputs[0], &inputs[1]) else { panic!() };
        let (before, texels) = (raster(before, &canvas()), raster(&fields::texels(atlas), &canvas()));
        let after = render(&across, &inputs);
        let mut changed = 0;
        for k in 0..after.window.len() {
            let (own, place) = (texels.plane(0)[k] > 0.0, [0, 1, 2].map(|c| f64::from(after.plane(c)[k])));
            if own {
                assert!((0..3).all(|c| after.plane(c)[k] == before.plane(c)[k]));
            } else if texels.plane(0)[k] < 0.0 {
                // The place lies on the cube's surface, which an extended triangle would leave.
                let most = place.iter().fold(0.0f64, |most, v| most.max(v.abs()));
                assert!((20.0..=30.01).contains(&most), "{place:?}");
                changed += usize::from((0..3).any(|c| after.plane(c)[k] != before.plane(c)[k]));
            }
        }
        assert!(changed > 50, "{changed}");
        check_field(&field(&across, &inputs));
        check_field(&field(&DilateGutter { rest: Rest::Nearest, ..across }, &inputs));
    }

    #[test]
    fn numbers_are_not_mixed() {
        let atlas = inputs()[1].clone();
        let ids = field(&BakeParts { atlas: port(0), by: Parts::Chart }, std::slice::from_ref(&atlas));
        for rest in [Rest::Keep, Rest::Nearest] {
            let tile = render(&node(4, rest), &[ids.clone().into(), atlas.clone()]);
            assert!(tile.data().iter().all(|id| id.fract() == 0.0 && (0.0..=6.0).contains(id)));
        }
    }
}
