//! [`BakeThickness`]: the thickness of the body behind each texel.
//!
//! Casts rays inwards in a cone about the normal, see [`kernel::rays`](shibo_kernel::mesh::rays), and takes their mean
//! length to the other side. Cost: about 0.4 µs a ray, from each texel where the value changes, and from one of up to 64
//! where it does not.
use super::cast::{Cast, TexelPoint};
use crate::values::each;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::mesh::rays::{directions, turned};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{Atlas, Stop, Tiling, Type};

/// The thickness of the body behind each texel, in mm: for light that shines through, and for thin places that wear or
/// burn through first.
///
/// Beyond charts and their gutters the value is 0.
///
/// ```ron
/// "cup": MeshShape(shape: Lathe),
/// "atlas": MeshAtlas(mesh: "cup"),
/// "thick": BakeThickness(atlas: "atlas", rays: 32, most: 30),
/// "example": Levels(input: "thick.share"),
/// ```
///
/// Elsewhere: Substance Painter *Thickness* map; Houdini *Maps Baker*; Blender *Ambient Occlusion* with *Inside*.
#[node]
pub struct BakeThickness {
    /// The atlas.
    pub atlas: In<Atlas>,
    /// Number of rays cast from each texel.
    #[schemars(range(min = 1, max = 4096))]
    #[default(64)]
    pub rays: u32,
    /// Spread of the rays: half the angle of their cone.
    #[schemars(range(min = 0, max = 89), extend("unit" = "°"))]
    #[default(60.0)]
    pub cone: f64,
    /// Upper limit of the thickness, also used for rays that never leave the body; the size of the mesh by default.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e7, "unit" = "mm"))]
    pub most: Option<f64>,
}

impl Node for BakeThickness {
    const VERSION: u32 = 2;
    const OUTPUTS: &'static [Output] = &[
        Output::new("thickness", Type::Gray, "The mean way to the other side.").in_unit("mm"),
        Output::new("share", Type::Gray, "The same as a share of `most`, 0..1."),
    ];
    const FACTS: &'static [Fact] = &[];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let cast = Cast::new(&cx.get(&self.atlas)?);
        cx.check()?;
        let most = narrow(self.most.unwrap_or(cast.size));
        let bias = narrow(1e-4 * cast.size);
        let sin = libm::sin(self.cone.to_radians());
        let directions = directions(self.rays, sin * sin);
        let close = |low: f32, high: f32| high - low <= 0.05 * high;
        let thickness = cast.field(0.0, close, move |cast: &Cast, place: &TexelPoint| {
            let origin = place.at - place.flat * bias;
            let turn = turned(-place.normal);
            let ways = directions.iter().map(|d| cast.rays.reach(origin, turn(*d), most));
            ways.sum::<f32>() / directions.len() as f32
        });
        let thickness = cx.shared_field("thickness", thickness);
        let share = each(&thickness, move |t| t / most);
        Ok(Outputs::one(thickness).with("share", share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::atlas_of;
    use crate::mesh::{MeshForm, MeshShape};
    use crate::testing::{canvas, check_field, field, port, raster, render};
    use shibo_kernel::mesh::fields;
    use shibo_value::Value;

    /// In the middle of a large slab of 12 mm a ray is 12 mm / cos long.
    #[test]
    fn slab_has_its_thickness() {
        let slab = MeshShape { shape: MeshForm::Cube, size: (400.0, 400.0, 12.0), ..MeshShape::default() };
        let inputs = [atlas_of(&slab)];
        let Value::Atlas(atlas) = &inputs[0] else { panic!() };
        for cone in [0.0, 45.0, 60.0] {
            let node = BakeThickness { atlas: port(0), rays: 256, cone, ..BakeThickness::default() };
            let tile = render(&node, &inputs);
            let sin2 = cone.to_radians().sin().powi(2);
            // The mean of 1/cos over directions with a density proportional to their cosine.
            let mean = if sin2 > 0.0 { 2.0 * (1.0 - (1.0 - sin2).sqrt()) / sin2 } else { 1.0 };
            let places = raster(&fields::places(atlas), &canvas());
            let mut found = 0;
            for k in 0..tile.window.len() {
                let [x, y, z] = [0, 1, 2].map(|c| places.plane(c)[k]);
                if x.abs() < 100.0 && y.abs() < 100.0 && z.abs() > 5.9 {
                    found += 1;
                    assert!((f64::from(tile.plane(0)[k]) / 12.0 - mean).abs() < 0.02, "{} {mean}", tile.plane(0)[k]);
                }
            }
            assert!(found > 20, "{found}");
        }
        check_field(&field(&BakeThickness { atlas: port(0), rays: 4, ..BakeThickness::default() }, &inputs));
    }
}
