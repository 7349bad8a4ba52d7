//! [`BakeOcclusion`]: the share of the sky that each texel sees.
//!
//! Casts rays about the normal with a density proportional to their cosine, see
//! [`kernel::rays`](shibo_kernel::mesh::rays). All points use the same directions, rotated by the normal alone, so
//! charts agree at their borders. Cost: about 0.4 µs a ray, from each texel where the
//! value changes, and from one of up to 64 where it does not.
use super::cast::{Cast, TexelPoint};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::mesh::rays::{directions, turned};
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{Atlas, Stop, Tiling, Type};

/// Ambient occlusion of a surface by its own shape, at each texel: 1 where nothing blocks light, 0 in a closed corner.
///
/// Beyond charts and their gutters the value is 1.
///
/// ```ron
/// "cup": MeshShape(shape: Lathe),
/// "atlas": MeshAtlas(mesh: "cup"),
/// "example": BakeOcclusion(atlas: "atlas", rays: 32),
/// ```
///
/// Elsewhere: Substance Painter *Ambient Occlusion* map; Blender *Ambient Occlusion* bake; Houdini *Maps Baker*.
#[node]
pub struct BakeOcclusion {
    /// The atlas.
    pub atlas: In<Atlas>,
    /// Number of rays cast from each texel; more rays give a smoother result.
    #[schemars(range(min = 1, max = 4096))]
    #[default(64)]
    pub rays: u32,
    /// Farthest distance of a surface that blocks light; half the size of the mesh by default.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e6, "unit" = "mm"))]
    pub distance: Option<f64>,
    /// Distance from the surface at which rays start, as a share of the mesh's size.
    #[schemars(range(min = 0, max = 0.1))]
    #[default(1e-4)]
    pub bias: f64,
    /// Height of a floor that blocks light too; no floor if not given.
    #[schemars(extend("minimum" = -1e7, "maximum" = 1e7, "unit" = "mm"))]
    pub ground: Option<f64>,
}

impl Node for BakeOcclusion {
    const VERSION: u32 = 2;
    const OUTPUTS: &'static [Output] = &[Output::new("occlusion", Type::Gray, "The share of rays that escape.")];
    const FACTS: &'static [Fact] = &[];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let cast = Cast::new(&cx.get(&self.atlas)?);
        cx.check()?;
        let distance = narrow(self.distance.unwrap_or(0.5 * cast.size));
        let (bias, ground) = (narrow(self.bias * cast.size), self.ground.map(narrow));
        let directions = directions(self.rays, 1.0);
        let share = move |cast: &Cast, place: &TexelPoint| {
            let origin = place.at + place.flat * bias;
            let turn = turned(place.normal);
            let (mut free, mut all) = (0u16, 0u16);
            // Skip directions behind the triangle itself.
            for d in directions.iter().map(|d| turn(*d)).filter(|d| d.dot(place.flat) > 0.0) {
                let floor = ground.map_or(f32::INFINITY, |ground| (ground - origin.z) / d.z);
                let open = !(floor > 0.0 && floor < distance) && cast.rays.escapes(origin, d, distance);
                (free, all) = (free + u16::from(open), all + 1);
            }
            if all > 0 { f32::from(free) / f32::from(all) } else { 1.0 }
        };
        // Neighbours with the same sky differ by about one ray.
        let close = 0.02_f32.max(1.5 / self.rays as f32);
        Ok(Outputs::one(cast.field(1.0, move |low, high| high - low <= close, share)))
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

    /// A ball on a floor sees the share ½(1 + cos) of the sky; cos is the cosine of the angle between its normal and
    /// up.
    #[test]
    fn a_ball_on_a_floor_sees_a_part_of_the_sky() {
        let inputs = [atlas_of(&MeshShape { shape: MeshForm::Sphere, segments: 96, ..MeshShape::default() })];
        let Value::Atlas(atlas) = &inputs[0] else { panic!() };
        let node = BakeOcclusion {
            atlas: port(0),
            rays: 256,
            distance: Some(1e6),
            ground: Some(-30.0),
            ..BakeOcclusion::default()
        };
        let tile = render(&node, &inputs);
        let (places, texels) = (raster(&fields::places(atlas), &canvas()), raster(&fields::texels(atlas), &canvas()));
        let mut worst: f32 = 0.0;
        for k in (0..tile.window.len()).filter(|k| texels.plane(0)[*k] > 0.0) {
            let want = 0.5 * (1.0 + places.plane(2)[k] / 30.0);
            worst = worst.max((tile.plane(0)[k] - want).abs());
        }
        // The error of 256 evenly spread directions is less than twice the standard deviation of as many random ones.
        assert!(worst < 2.0 * 0.5 / 16.0, "{worst}");
        check_field(&field(&BakeOcclusion { atlas: port(0), rays: 8, ..BakeOcclusion::default() }, &inputs));
    }

    #[test]
    fn a_convex_body_is_open_and_a_hollow_one_is_not() {
        let open = |shape| {
            let inputs = [atlas_of(&MeshShape { shape, ..MeshShape::default() })];
            let tile = render(&BakeOcclusion { atlas: port(0), ..BakeOcclusion::default() }, &inputs);
            tile.data().iter().fold(1.0, |least: f32, v| least.min(*v))
        };
        let [cube, bowl, ring] = [MeshForm::Cube, MeshForm::Lathe, MeshForm::Torus].map(open);
        assert!(cube > 0.99 && bowl < 0.9 && ring < 0.95, "{cube} {bowl} {ring}");
    }
}
