//! [`Relief`]: a lit picture of a surface, for viewing.
//!
//! Under the lamp: a key light, a weak fill light and a sky. Shading: Lambert and GGX (E. Heitz, 2014), with 4 % reflection at
//! normal incidence. Ambient occlusion darkens the sky and, by half, the key light; a tone curve for the screen comes
//! last. See [`kernel::relief`](shibo_kernel::surface::relief). Metal, sheen and coat of a material are shown too, and
//! with `fibers` and `anisotropy` its fibres. Cost: O(pixels).
use super::surroundings::{self, Surroundings};
use shibo_kernel::ground::tile;
use shibo_kernel::surface::display::Curve;
use shibo_kernel::surface::environment::Environment;
use shibo_kernel::surface::relief::{self, Finish, Lacquer, ReliefSpec, Surface};
use shibo_node::{
    CanvasFacts, Color, Context, Fact, FilePath, Gray, In, Node, NormalField, Output, Outputs, Rgb, choice, node,
};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::files::FileHandle;
use shibo_value::{Channel, Field, FieldSource, Given, Grid, Material, Read, Stop, Tile, Tiling, Type, Window};
use std::sync::Arc;

/// Tone curve: how light is shown on the screen.
#[choice]
pub enum Tone {
    /// Like film: channel by channel. Pale woods become a little green, dark colours lighter.
    #[default]
    Filmic,
    /// Hues are kept: in full light the base colour is shown unchanged. An `exposure` of about 0.45 is full light.
    Neutral,
    /// Unchanged; values brighter than white are cut off.
    Linear,
}

/// A lit picture, for viewing, of a surface seen from above: of a height, or of a whole material. Scene-linear colour.
///
/// Connected channels replace those of the material.
///
/// In an `environment` other than `Lamp`, and with a `panorama`, the surface reflects its surroundings, so gloss, metal
/// and coats look as they are. A white card that faces the viewer is then exactly white, so `exposure` can stay 1.
///
/// ```ron
/// "cells":   Worley(size: 2.6),
/// "grooves": Remap(input: "cells.border", from: (0, 0.4), to: (1, 0), clamp: true),
/// "bent":    Warp(input: "grooves", amount: 0.4, size: 2.5),
/// "dome":    Pillow(input: "bent", radius: 0.8),
/// "example": Relief(height: "dome", strength: 0.35),
/// ```
///
/// Elsewhere: Substance Designer *3D View*; Blender *Viewport*, *Light*; Material Maker *Preview*.
#[node]
pub struct Relief {
    /// A material that supplies the channels below, and metal, sheen and coat if it has them.
    pub material: Option<In<Material>>,
    /// Height in mm. If not given, that of the material; without both the surface is flat.
    pub height: Option<In<Gray>>,
    /// Base colour. If not given, that of the material; without both `color`.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub base_color: Option<In<Rgb>>,
    /// Roughness, 0..1. If not given, that of the material; without both 0.45.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub roughness: Option<In<Gray>>,
    /// Ambient occlusion, 1 is open. If not given, that of the material; without both 1.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub ao: Option<In<Gray>>,
    /// A normal that replaces that of the height, for example one with the tilt of fibres.
    pub normal: Option<In<NormalField>>,
    /// The colour if no base colour is given.
    #[default(Color([0.16, 0.085, 0.045]))]
    pub color: Color,
    /// Factor on the height: 1 is true to scale.
    #[schemars(range(min = -1e4, max = 1e4))]
    #[default(1.0)]
    pub strength: f64,
    /// Light around the surface. All of it but `Lamp` has its own elevation and turns with `azimuth`.
    pub environment: Surroundings,
    /// A panorama that lights the surface in place of `environment`: a picture file, twice as wide as high. The viewer
    /// faces the middle of the picture and looks down by 53°.
    pub panorama: Option<FilePath>,
    /// Longest shadow that the surface casts onto itself in an environment; 0: none. More than half the canvas' longer
    /// side counts as that half.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    #[default(2.0)]
    pub shadows: f64,
    /// Direction from which the light comes, from +x towards +y: 225° is the upper left.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    #[default(225.0)]
    pub azimuth: f64,
    /// Elevation of the lamp above the surface: 90° is from above.
    #[schemars(range(min = 1, max = 90), extend("unit" = "°"))]
    #[default(40.0)]
    pub elevation: f64,
    /// Factor on all light.
    #[schemars(range(min = 0, max = 1e3))]
    #[default(1.0)]
    pub exposure: f64,
    /// Tone curve: how light is shown on the screen. If not given, `Filmic` under the lamp and `Neutral` in an
    /// environment.
    pub tone: Option<Tone>,
    /// Strength of the reflection, in the colour of the material, of fibres that lie in the surface: about 0.6 for
    /// wood. The anisotropy of the material and its angle give the share and the direction of fibres. With a `normal`
    /// that follows their tilt, the figure of wood becomes visible.
    #[schemars(range(min = 0, max = 4))]
    pub fibers: f64,
    /// The direction of fibres in degrees, from +x towards +y. If not given, that of the material's anisotropy.
    pub angle: Option<In<Gray>>,
    /// Anisotropy of the white gloss, which is narrower along fibres than across them, as on brushed metal, satin and
    /// polished wood: a factor on the material's anisotropy, or on 1 if `angle` is given.
    #[schemars(range(min = 0, max = 1))]
    pub anisotropy: f64,
}

impl Node for Relief {
    const VERSION: u32 = 4;
    const OUTPUTS: &'static [Output] = &[Output::new("picture", Type::Rgb, "The lit picture, scene-linear, 0..1.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let mut found = Vec::new();
        if self.height.is_none() && self.material.is_none() {
            let problem =
                Problem::new(Code::Advice, "neither `height` nor `material` is connected; the surface is flat");
            found.push(problem.help("write `height: \"…\"` or `material: \"…\"`"));
        }
        let plain = Self::default();
        let lamp = self.environment == Surroundings::Lamp && self.panorama.is_none();
        if !lamp && self.elevation != plain.elevation {
            let problem = Problem::new(Code::Advice, "`elevation` is that of the lamp; an environment has its own");
            found.push(problem.at("elevation").help("remove `elevation`, or write `environment: Lamp`"));
        }
        if lamp && self.shadows != plain.shadows {
            let problem = Problem::new(Code::Advice, "the lamp casts no shadows, so `shadows` has no effect");
            found.push(problem.at("shadows").help("remove `shadows`, or choose an `environment` such as `Studio`"));
        }
        found
    }

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        self.panorama.iter().map(|path| ("panorama", path)).collect()
    }

    fn check_files(&self, files: &[(&'static str, FileHandle)]) -> Vec<Problem> {
        surroundings::check(files)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let material = cx.get_opt(&self.material)?;
        let channel = |own: Option<Field>, channel: Channel, default: &[f32]| {
            let of_material = || material.as_ref().and_then(|m| m.get(channel)).cloned();
            own.or_else(of_material).unwrap_or_else(|| Field::constant(channel.ty(), default))
        };
        let height = channel(cx.get_opt(&self.height)?, Channel::Height, &[0.0]);
        let color = channel(cx.get_opt(&self.base_color)?, Channel::BaseColor, &self.color.0);
        let roughness = channel(cx.get_opt(&self.roughness)?, Channel::Roughness, &[0.45]);
        let ao = channel(cx.get_opt(&self.ao)?, Channel::Ao, &[1.0]);
        let finish = [Channel::Metallic, Channel::Sheen, Channel::Coat];
        let has = |channels: &[Channel]| {
            material.as_ref().is_some_and(|m| channels.iter().any(|channel| m.get(*channel).is_some()))
        };
        let lacquer = [Channel::CoatRoughness, Channel::CoatNormal, Channel::Emission];
        let mut inputs = vec![height, color, roughness, ao];
        let normal = cx.get_opt(&self.normal)?;
        let angle = cx.get_opt(&self.angle)?;
        let shine = self.fibers > 0.0 || self.anisotropy > 0.0;
        let lies = [normal.is_some(), shine && (angle.is_some() || has(&[Channel::Anisotropy]))];
        inputs.extend(normal);
        if lies[1] {
            // With `angle`, fibres lie in the surface everywhere, unless the material gives their share.
            let share = if angle.is_some() { 1.0 } else { 0.0 };
            inputs.push(channel(None, Channel::Anisotropy, &[share]));
            inputs.push(channel(angle, Channel::AnisotropyAngle, &[0.0]));
        }
        if has(&finish) || has(&lacquer) {
            inputs.extend(finish.map(|of| channel(None, of, &[0.0])));
        }
        if has(&lacquer) {
            inputs.push(channel(None, Channel::CoatRoughness, &[relief::COAT]));
            inputs.push(channel(None, Channel::Emission, &[0.0; 3]));
            inputs.extend(material.as_ref().and_then(|m| m.get(Channel::CoatNormal)).cloned());
        }
        let tiling = inputs.iter().fold(Tiling::BOTH, |tiling, input| tiling.and(input.tiling()));
        let environment = self.environment.light(cx)?;
        let shadows = self.shadows.min(0.5 * cx.size_mm().max_element());
        let lit = Lit { inputs, lies, environment, shadows, node: self.clone() };
        Ok(Outputs::one(Field::new(Type::Rgb, tiling, lit)))
    }
}

fn planes(tile: &Tile) -> [&[f32]; 3] {
    [tile.plane(0), tile.plane(1), tile.plane(2)]
}

/// The lit picture; only the height is read with a halo.
struct Lit {
    /// Height, colour, roughness, occlusion; then, as `lies` says, the normal, and the share and angle of fibres; for
    /// some materials also metal, sheen and coat; for some the coat's roughness, the emission, and the coat's normal.
    inputs: Vec<Field>,
    /// True if `inputs` has a normal, and if it has fibres.
    lies: [bool; 2],
    /// Light around the surface; `None` is the lamp.
    environment: Option<Arc<Environment>>,
    /// Longest shadow, mm.
    shadows: f64,
    node: Relief,
}

impl Lit {
    fn spec(&self, grid: &Grid) -> ReliefSpec<'_> {
        let tone = self.node.tone.unwrap_or(if self.environment.is_some() { Tone::Neutral } else { Tone::Filmic });
        ReliefSpec {
            step: tile::step(grid),
            strength: self.node.strength,
            azimuth: self.node.azimuth.to_radians(),
            elevation: self.node.elevation.to_radians(),
            exposure: self.node.exposure,
            curve: match tone {
                Tone::Filmic => Curve::Filmic,
                Tone::Neutral => Curve::Neutral,
                Tone::Linear => Curve::Linear,
            },
            fibers: self.node.fibers,
            anisotropy: self.node.anisotropy,
            environment: self.environment.as_deref(),
            shadows: self.shadows,
        }
    }
}

impl FieldSource for Lit {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let halo = self.spec(grid).halo();
        let height = window.grow(halo, halo);
        let windows = std::iter::once(height).chain(std::iter::repeat(window));
        self.inputs.iter().zip(windows).map(|(input, window)| Read::new(input, grid, window)).collect()
    }

    fn reaches_by(&self) -> Option<&'static str> {
        Some("shadows")
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (grid, window) = (out.grid, out.window);
        let tiles: Vec<&Tile> = given.tiles().collect();
        let [height, color, roughness, ao, further @ ..] = &tiles[..] else { return Ok(()) };
        let (normal, further) = further.split_at(usize::from(self.lies[0]));
        let (fibers, finish) = further.split_at(2 * usize::from(self.lies[1]));
        let surface = Surface {
            color: [color.plane(0), color.plane(1), color.plane(2)],
            roughness: roughness.plane(0),
            occlusion: ao.plane(0),
            normal: normal.first().map(|normal| planes(normal)),
            fibers: match fibers {
                [share, angle] => Some([share.plane(0), angle.plane(0)]),
                _ => None,
            },
            finish: match finish {
                [metallic, sheen, coat, lacquer @ ..] => Some(Finish {
                    metallic: metallic.plane(0),
                    sheen: sheen.plane(0),
                    coat: coat.plane(0),
                    lacquer: match lacquer {
                        [roughness, emission, normal @ ..] => Some(Lacquer {
                            roughness: roughness.plane(0),
                            emission: planes(emission),
                            normal: normal.first().map(|normal| planes(normal)),
                        }),
                        _ => None,
                    },
                }),
                _ => None,
            },
        };
        let spec = self.spec(&grid);
        relief::relief(&tile::view(height, 0), window, &surface, &spec, tile::planes3(out));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{check_field, field, lumps, port, render};
    use shibo_value::Value;

    #[test]
    fn lights_material_like_its_channels() {
        let (height, rough) = (lumps(), Field::constant(Type::Gray, &[0.2]));
        let wired = Relief { height: Some(port(0)), roughness: Some(port(1)), ..Relief::default() };
        let channels = [(Channel::Height, height.clone()), (Channel::Roughness, rough.clone())];
        let whole = Relief { material: Some(port(0)), ..Relief::default() };
        let a = render(&wired, &[height.into(), rough.into()]);
        let b = render(&whole, &[Material::new(channels).into()]);
        assert_eq!(a, b);
        assert!(a.data().iter().all(|v| (0.0..=1.0).contains(v)));
    }

    #[test]
    fn takes_fibres_from_the_material() {
        let wood = |angle: f32| {
            let channels = [(Channel::Anisotropy, 1.0), (Channel::AnisotropyAngle, angle)];
            Value::from(Material::new(channels.map(|(c, v)| (c, Field::constant(Type::Gray, &[v])))))
        };
        let lit = |fibers: f64, angle: f32| {
            let node = Relief { material: Some(port(0)), fibers, tone: Some(Tone::Neutral), ..Relief::default() };
            render(&node, &[wood(angle)])
        };
        assert_eq!(lit(0.0, 45.0), lit(0.0, 135.0));
        assert!(lit(0.6, 135.0).data()[0] > 1.1 * lit(0.6, 45.0).data()[0]);
        let level = Field::constant(Type::Normal, &[0.5, 0.5, 1.0]);
        let node = Relief { height: Some(port(0)), normal: Some(port(1)), ..Relief::default() };
        let flat = Relief { height: Some(port(0)), ..Relief::default() };
        let flat = render(&flat, &[Field::constant(Type::Gray, &[0.0]).into()]);
        assert_eq!(render(&node, &[lumps().into(), level.into()]), flat);
        check_field(&field(
            &Relief { tone: Some(Tone::Linear), ..node },
            &[lumps().into(), Field::constant(Type::Normal, &[0.4, 0.6, 0.9]).into()],
        ));
    }

    #[test]
    fn gloss_follows_the_angle() {
        let lit = |anisotropy: f64, angle: f32| {
            let node = Relief { height: Some(port(0)), angle: Some(port(1)), anisotropy, ..Relief::default() };
            render(&node, &[lumps().into(), Field::constant(Type::Gray, &[angle]).into()])
        };
        assert_eq!(lit(0.0, 0.0), lit(0.0, 90.0));
        assert_ne!(lit(0.9, 0.0), lit(0.9, 90.0));
        // A material without anisotropy has no fibres.
        let plain = Relief { height: Some(port(0)), ..Relief::default() };
        let node = Relief { anisotropy: 0.9, ..plain.clone() };
        assert_eq!(render(&node, &[lumps().into()]), render(&plain, &[lumps().into()]));
        let node = Relief { angle: Some(port(1)), anisotropy: 0.9, ..plain };
        check_field(&field(&node, &[lumps().into(), lumps().into()]));
    }

    #[test]
    fn environments_hold_in_any_window() {
        for environment in [Surroundings::Studio, Surroundings::Overcast, Surroundings::Window, Surroundings::Sky] {
            for shadows in [0.0, 3.0] {
                let node = Relief { height: Some(port(0)), environment, shadows, ..Relief::default() };
                check_field(&field(&node, &[lumps().into()]));
            }
        }
        let node = Relief { height: Some(port(0)), environment: Surroundings::Studio, ..Relief::default() };
        assert_ne!(
            render(&node, &[lumps().into()]),
            render(&Relief { shadows: 0.0, ..node.clone() }, &[lumps().into()])
        );
        assert_eq!(Relief { elevation: 60.0, ..node }.advice_on(&crate::testing::canvas()).len(), 1);
    }

    #[test]
    fn holds_in_any_window() {
        let node = Relief { height: Some(port(0)), ..Relief::default() };
        for (strength, exposure, elevation) in [(1.0, 1.0, 40.0), (-1e4, 1e3, 1.0), (1e4, 0.0, 90.0)] {
            check_field(&field(&Relief { strength, exposure, elevation, ..node.clone() }, &[lumps().into()]));
        }
        assert_eq!(node.advice_on(&crate::testing::canvas()), []);
        assert_eq!(Relief::default().advice_on(&crate::testing::canvas()).len(), 1);
    }
}
