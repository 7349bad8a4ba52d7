//! [`Relief`]: a lit picture of a surface, for looking at.
//!
//! Key light, weak fill and a sky; Lambert and GGX (E. Heitz, 2014), 4 % at normal incidence; ambient occlusion darkens
//! the sky and, by half, the key light; a filmic curve comes last. See [`kernel::relief`](shibo_kernel::surface::relief). Of a
//! material metal, sheen and coat show too, but not anisotropy. Cost: O(pixels).
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::{CanvasFacts, Color, Context, Fact, Gray, In, Node, Output, Outputs, Rgb};
use shibo_engine::value::{Channel, Field, FieldSource, Given, Grid, Material, Read, Stop, Tile, Tiling, Type, Window};
use shibo_kernel::ground::tile;
use shibo_kernel::surface::relief::{self, Finish, Lacquer, ReliefSpec, Surface};

/// A lit picture of a surface seen from above: of a height, or of a whole material. Scene-linear colour, for looking at.
///
/// Channels that are connected here take the place of those of the material.
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
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Relief {
    /// A material that supplies the channels below, and metal, sheen and coat if it has them.
    pub material: Option<In<Material>>,
    /// Height in mm. Without it that of the material; without both the surface is flat.
    pub height: Option<In<Gray>>,
    /// Base colour. Without it that of the material; without both `color`.
    pub base_color: Option<In<Rgb>>,
    /// Roughness, 0..1. Without it that of the material; without both 0.45.
    pub roughness: Option<In<Gray>>,
    /// Ambient occlusion, 1 is open. Without it that of the material; without both 1.
    pub ao: Option<In<Gray>>,
    /// The colour where no base colour is given.
    pub color: Color,
    /// Factor on the height: 1 is true to scale.
    #[schemars(range(min = -1e4, max = 1e4))]
    pub strength: f64,
    /// Direction the light comes from, from +x towards +y: 225° is the upper left.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub azimuth: f64,
    /// Height of the light above the surface: 90° is from above.
    #[schemars(range(min = 1, max = 90), extend("unit" = "°"))]
    pub elevation: f64,
    /// Factor on all light.
    #[schemars(range(min = 0, max = 1e3))]
    pub exposure: f64,
}

impl Default for Relief {
    fn default() -> Self {
        Self {
            material: None,
            height: None,
            base_color: None,
            roughness: None,
            ao: None,
            color: Color([0.16, 0.085, 0.045]),
            strength: 1.0,
            azimuth: 225.0,
            elevation: 40.0,
            exposure: 1.0,
        }
    }
}

impl Node for Relief {
    const VERSION: u32 = 2;
    const OUTPUTS: &'static [Output] = &[Output::new("picture", Type::Rgb, "The lit picture, scene-linear, 0..1.")];
    const FACTS: &'static [Fact] = &[];

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.height.is_some() || self.material.is_some() {
            return Vec::new();
        }
        let problem = Problem::new(Code::Advice, "neither `height` nor `material` is connected; the surface is flat");
        vec![problem.help("write `height: \"…\"` or `material: \"…\"`")]
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
        if has(&finish) || has(&lacquer) {
            inputs.extend(finish.map(|of| channel(None, of, &[0.0])));
        }
        if has(&lacquer) {
            inputs.push(channel(None, Channel::CoatRoughness, &[relief::COAT]));
            inputs.push(channel(None, Channel::Emission, &[0.0; 3]));
            inputs.extend(material.as_ref().and_then(|m| m.get(Channel::CoatNormal)).cloned());
        }
        let tiling = inputs.iter().fold(Tiling::BOTH, |tiling, input| tiling.and(input.tiling()));
        Ok(Outputs::one(Field::new(Type::Rgb, tiling, Lit { inputs, node: self.clone() })))
    }
}

fn planes(tile: &Tile) -> [&[f32]; 3] {
    [tile.plane(0), tile.plane(1), tile.plane(2)]
}

/// The lit picture; reads only the height beyond the window.
struct Lit {
    /// Height, colour, roughness, occlusion; of some materials also metal, sheen and coat; of some the
    /// coat's roughness, the emission, and the coat's normal.
    inputs: Vec<Field>,
    node: Relief,
}

impl FieldSource for Lit {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let height = window.grow(relief::HALO, relief::HALO);
        let windows = std::iter::once(height).chain(std::iter::repeat(window));
        self.inputs.iter().zip(windows).map(|(input, window)| Read::new(input, grid, window)).collect()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (grid, window) = (out.grid, out.window);
        let tiles: Vec<&Tile> = given.tiles().collect();
        let [height, color, roughness, ao, finish @ ..] = &tiles[..] else { return Ok(()) };
        let surface = Surface {
            color: [color.plane(0), color.plane(1), color.plane(2)],
            roughness: roughness.plane(0),
            occlusion: ao.plane(0),
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
        let spec = ReliefSpec {
            step: tile::step(&grid),
            strength: self.node.strength,
            azimuth: self.node.azimuth.to_radians(),
            elevation: self.node.elevation.to_radians(),
            exposure: self.node.exposure,
        };
        relief::relief(&tile::view(height, 0), window, &surface, &spec, tile::planes3(out));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{check_field, field, lumps, port, render};

    #[test]
    fn a_material_is_lit_as_its_channels_are() {
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
    fn holds_in_any_window() {
        let node = Relief { height: Some(port(0)), ..Relief::default() };
        for (strength, exposure, elevation) in [(1.0, 1.0, 40.0), (-1e4, 1e3, 1.0), (1e4, 0.0, 90.0)] {
            check_field(&field(&Relief { strength, exposure, elevation, ..node.clone() }, &[lumps().into()]));
        }
        assert_eq!(node.advice_on(&crate::testing::canvas()), []);
        assert_eq!(Relief::default().advice_on(&crate::testing::canvas()).len(), 1);
    }
}
