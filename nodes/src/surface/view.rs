//! [`View`]: a lit picture of a material on a shape.
//!
//! See [`kernel::view`](shibo_kernel::surface::view). Cost: O(pixels), about nine times that of a lit picture.
use super::surroundings::{self, Surroundings};
use glam::{DVec2, UVec2};
use shibo_kernel::surface::environment::{Environment, Scene};
use shibo_kernel::surface::view::{self, Body, Maps, Shape, ViewSpec};
use shibo_node::{CanvasFacts, Context, Fact, FilePath, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::files::FileHandle;
use shibo_value::{
    Atlas, Channel, Cost, Field, FieldSource, Given, Grid, Material, Pictures, Read, Resolution, Stop, Tile, Tiling,
    Type, Window,
};
use std::sync::Arc;

/// A shape that shows a material.
#[choice]
pub enum ViewShape {
    /// A ball.
    #[default]
    Ball,
    /// A cube that shows three of its faces.
    Cube,
    /// A plane that is seen at an angle.
    Plane,
}

/// A lit picture of a material on a shape, for galleries and sheets. Scene-linear colour. The picture covers the canvas.
///
/// A mesh is seen from the front, turned a little and from above, in its own shade; it fills the picture.
/// A material that repeats covers the ball 1.3 times from edge to edge; another one covers it once. Its relief is shown by
/// shading; the outline of the shape stays smooth. `shibo render --view ball` makes the same picture of every material of
/// a graph.
///
/// ```ron
/// "cells":   Worley(size: 6),
/// "grooves": Remap(input: "cells.border", from: (0, 0.6), to: (1, 0), clamp: true),
/// "height":  "= -0.2 * grooves",
/// "glazed":  Material(base_color: "#1d4b52", height: "height", roughness: 0.2),
/// "example": View(material: "glazed", shape: Ball),
/// ```
///
/// Elsewhere: Substance Designer *3D View*; Material Maker *3D Preview*; Blender *Material Preview*.
#[node]
pub struct View {
    /// The material.
    pub material: In<Material>,
    /// The shape.
    pub shape: ViewShape,
    /// The atlas of a mesh that shows the material in place of `shape`; the material lies on it as in an exported file.
    pub mesh: Option<In<Atlas>>,
    /// Light around the shape. With `Lamp` it is the studio, since a shape needs something to reflect.
    #[default(Surroundings::Studio)]
    pub environment: Surroundings,
    /// A panorama that lights the shape in place of `environment`: a file, twice as wide as high.
    pub panorama: Option<FilePath>,
    /// Factor on all light.
    #[schemars(range(min = 0, max = 1e3))]
    #[default(1.0)]
    pub exposure: f64,
    /// Strength of the reflection, in the colour of the material, of fibres that lie in the surface. They are those of the
    /// material's anisotropy; metal has none.
    #[schemars(range(min = 0, max = 4))]
    #[default(0.6)]
    pub fibers: f64,
}

impl Node for View {
    const OUTPUTS: &'static [Output] = &[Output::new("picture", Type::Rgb, "The lit picture, scene-linear, 0..1.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        self.panorama.iter().map(|path| ("panorama", path)).collect()
    }

    fn check_files(&self, files: &[(&'static str, FileHandle)]) -> Vec<Problem> {
        surroundings::check(files)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let material = cx.get(&self.material)?;
        let body = match &self.mesh {
            Some(mesh) => Some(Body::new(&cx.get(mesh)?)),
            None => None,
        };
        cx.check()?;
        let environment = self.environment.light(cx)?.unwrap_or_else(|| Environment::of(Scene::Studio));
        let channels: Vec<(Channel, Field)> = SHOWN
            .into_iter()
            .filter_map(|channel| material.get(channel).map(|field| (channel, field.clone())))
            .collect();
        let tiling = channels.iter().fold(Tiling::BOTH, |tiling, (_, field)| tiling.and(field.tiling()));
        let repeats = [tiling.x, tiling.y];
        let seen = Seen { channels, repeats, size: cx.size_mm(), environment, body, node: self.clone() };
        Ok(Outputs::one(Field::new(Type::Rgb, Tiling::NONE, seen)))
    }
}

/// The channels that are shown.
const SHOWN: [Channel; 12] = [
    Channel::BaseColor,
    Channel::Roughness,
    Channel::Metallic,
    Channel::Ao,
    Channel::Height,
    Channel::Normal,
    Channel::Sheen,
    Channel::Coat,
    Channel::CoatRoughness,
    Channel::Emission,
    Channel::Anisotropy,
    Channel::AnisotropyAngle,
];

/// Most texels along the longer side of the canvas that are read.
const MOST: u32 = 1536;

/// The picture; it is made whole.
struct Seen {
    channels: Vec<(Channel, Field)>,
    /// True where the material repeats.
    repeats: [bool; 2],
    /// The canvas, mm.
    size: DVec2,
    environment: Arc<Environment>,
    body: Option<Body>,
    node: View,
}

impl Seen {
    /// The pixels of the canvas on a grid.
    fn pixels(&self, grid: &Grid) -> UVec2 {
        (self.size / grid.step).round().max(DVec2::ONE).as_uvec2()
    }

    /// The grid on which the material is read, and its window.
    fn texture(&self, grid: &Grid) -> (Grid, Window) {
        let most = self.pixels(grid).max_element().min(MOST);
        let pixels = Resolution::Longer(most).of(self.size);
        let step = self.size / pixels.as_dvec2();
        (Grid { origin: DVec2::ZERO, step, period: Some(pixels), shown: None }, Window::full(pixels))
    }
}

impl FieldSource for Seen {
    fn inputs(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let Some(picture) = given.prepared() else {
            return Err(Problem::new(Code::BadValue, "a picture was not made before it was read").into());
        };
        let (width, height) = (i64::from(picture.window.width), i64::from(picture.window.height));
        let (window, area) = (out.window, out.window.len());
        // The picture begins at the corner of the canvas; a grid may begin elsewhere.
        let [left, top] = (out.grid.origin / out.grid.step).round().as_i64vec2().to_array();
        for j in 0..window.height {
            let y = (top + i64::from(window.y) + i64::from(j)).clamp(0, height - 1);
            for i in 0..window.width {
                let x = (left + i64::from(window.x) + i64::from(i)).clamp(0, width - 1);
                let (from, to) = (y * width + x, j as usize * window.width as usize + i as usize);
                for k in 0..3 {
                    out.data_mut()[k * area + to] = picture.plane(k)[usize::try_from(from).unwrap_or(0)];
                }
            }
        }
        given.check()
    }

    fn cost(&self) -> Cost {
        Cost::Pointwise
    }

    fn bytes(&self) -> usize {
        self.body.as_ref().map_or(0, Body::bytes)
    }

    fn whole(&self, grid: &Grid) -> Vec<Read<'_>> {
        let (grid, window) = self.texture(grid);
        self.channels.iter().map(|(_, field)| Read::new(field, &grid, window)).collect()
    }

    fn prepare(&self, grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        let (_, window) = self.texture(grid);
        let read = |number| pictures.read(number, window);
        let tiles = (0..self.channels.len()).map(read).collect::<Result<Vec<_>, _>>()?;
        pictures.check()?;
        let tile = |channel: Channel| {
            self.channels.iter().zip(&tiles).find(|((known, _), _)| *known == channel).map(|(_, tile)| tile)
        };
        let one = |channel: Channel| tile(channel).map_or(&[][..], |tile| tile.plane(0));
        let three = |channel: Channel| tile(channel).map(|tile| [0, 1, 2].map(|k| tile.plane(k)));
        let maps = Maps {
            size: [window.width as usize, window.height as usize],
            size_mm: self.size.to_array(),
            repeats: self.repeats,
            color: three(Channel::BaseColor).unwrap_or([&[]; 3]),
            roughness: one(Channel::Roughness),
            metallic: one(Channel::Metallic),
            occlusion: one(Channel::Ao),
            height: one(Channel::Height),
            normal: three(Channel::Normal),
            sheen: one(Channel::Sheen),
            coat: one(Channel::Coat),
            coat_roughness: one(Channel::CoatRoughness),
            emission: three(Channel::Emission).unwrap_or([&[]; 3]),
            anisotropy: [one(Channel::Anisotropy), one(Channel::AnisotropyAngle)],
        };
        let pixels = self.pixels(grid);
        #[expect(clippy::cast_possible_truncation, reason = "factors of light")]
        let spec = ViewSpec {
            shape: match (&self.body, self.node.shape) {
                (Some(body), _) => Shape::Body(body),
                (None, ViewShape::Ball) => Shape::Ball,
                (None, ViewShape::Cube) => Shape::Cube,
                (None, ViewShape::Plane) => Shape::Plane,
            },
            pixels: [pixels.x as usize, pixels.y as usize],
            environment: &self.environment,
            exposure: self.node.exposure as f32,
            fibers: self.node.fibers as f32,
        };
        let mut picture = Tile::new(*grid, Window::full(pixels), 3);
        for (k, plane) in view::view(&maps, &spec).iter().enumerate() {
            picture.plane_mut(k).copy_from_slice(plane);
        }
        Ok(Some(picture))
    }

    fn prepare_bytes(&self, grid: &Grid) -> u64 {
        let texels = u64::from(self.texture(grid).1.width) * u64::from(self.texture(grid).1.height);
        let pixels = u64::from(self.pixels(grid).x) * u64::from(self.pixels(grid).y);
        // A texel has 19 numbers, a pixel three in the rows and three in the picture.
        76 * texels + 24 * pixels
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_field, field, lumps, port, render};

    fn material() -> Material {
        let color = Field::constant(Type::Rgb, &[0.5, 0.2, 0.1]);
        Material::new([(Channel::BaseColor, color), (Channel::Height, lumps())])
    }

    #[test]
    fn shows_a_ball_before_a_backdrop() {
        let picture = render(&View { material: port(0), ..View::default() }, &[material().into()]);
        let (w, h) = (picture.width(), picture.window.height as usize);
        let at = |x: usize, y: usize| [0, 1, 2].map(|k| picture.plane(k)[y * w + x]);
        let (middle, corner) = (at(w / 2, h / 2), at(0, 0));
        assert!(middle[0] > 2.0 * middle[2], "{middle:?}");
        assert!((corner[0] - corner[2]).abs() < 1e-6 && corner[0] > 0.05, "{corner:?}");
    }

    #[test]
    fn any_window_shows_its_part() {
        for shape in [ViewShape::Ball, ViewShape::Cube, ViewShape::Plane] {
            check_field(&field(&View { material: port(0), shape, ..View::default() }, &[material().into()]));
        }
    }
}
