//! [`SlopeMap`]: steepness and direction of the slope of a height.
//!
//! Slopes are differences over one pixel on each side, as in `HeightToNormal`. Cost: O(pixels), about 4 ns per pixel.
use shibo_kernel::filter::slopes;
use shibo_kernel::ground::math::atan2_degrees;
use shibo_kernel::ground::tile;
use shibo_node::{Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::{Buffer, Field, Halo, Stop, Tile, Type};

/// The steepness of a height, as an angle: 0 is flat, 90° is a wall.
///
/// ```ron
/// "noise": Fractal(size: 20, octaves: 3),
/// "hills": Remap(input: "noise", to: (0, 30)),
/// "example": SlopeMap(input: "hills", normalize: true),
/// ```
///
/// Elsewhere: Houdini *HeightField Mask by Feature*.
#[node]
pub struct SlopeMap {
    /// Height in mm.
    pub input: In<Gray>,
    /// True if `slope` is a share, 1 for a wall, instead of degrees.
    pub normalize: bool,
}

impl Node for SlopeMap {
    const OUTPUTS: &'static [Output] = &[
        Output::new("slope", Type::Gray, "The angle between the surface and the level; 0..1 with `normalize`.")
            .in_unit("°"),
        Output::new("direction", Type::Gray, "The direction in which it rises, -180..180, from +x towards +y.")
            .in_unit("°"),
    ];
    const FACTS: &'static [Fact] = &[];

    fn unit(&self, output: &Output) -> Option<&'static str> {
        output.unit.filter(|_| !self.normalize || output.name != "slope")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let map = |of: Box<dyn Fn(f32, f32) -> f32 + Send + Sync>| {
            Field::map(
                Type::Gray,
                [input.clone()],
                Halo::px(slopes::HALO),
                move |out: &mut Tile, [input]: [&Tile; 1]| {
                    let (rect, step) = (out.window, tile::step(&out.grid));
                    let (mut gx, mut gy) = (Buffer::zeros(rect.len()), Buffer::zeros(rect.len()));
                    slopes::slopes(&tile::view(input, 0), rect, step, &mut gx, &mut gy);
                    for (out, (x, y)) in out.plane_mut(0).iter_mut().zip(gx.iter().zip(gy.iter())) {
                        *out = of(*x, *y);
                    }
                    Ok(())
                },
            )
        };
        let scale = if self.normalize { 1.0 / 90.0 } else { 1.0 };
        let slope = move |x: f32, y: f32| {
            let (x, y) = (x.clamp(-1e15, 1e15), y.clamp(-1e15, 1e15));
            scale * atan2_degrees((x * x + y * y).sqrt(), 1.0)
        };
        Ok(Outputs::one(map(Box::new(slope))).with("direction", map(Box::new(|x, y| atan2_degrees(y, x)))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, field, lumps, outputs, port, raster, render};
    use shibo_value::{Tiling, Value};

    #[test]
    fn planes_have_their_angle() {
        // Rises by 1 to the left and by √2 downwards: in total √3, an angle of 60°.
        let plane = Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let at = grid.center(window.x + k % width, window.y + k / width).as_vec2();
                *v = 2f32.sqrt() * at.y - at.x;
            }
            Ok(())
        });
        let node = SlopeMap { input: port(0), normalize: false };
        let slope = render(&node, &[plane.clone().into()]);
        assert!(slope.data().iter().all(|v| (v - 60.0).abs() < 0.01));
        let share = render(&SlopeMap { normalize: true, ..node.clone() }, &[plane.clone().into()]);
        assert!(share.data().iter().all(|v| (v - 2.0 / 3.0).abs() < 1e-3));
        let made = outputs(&node, &[plane.into()], &canvas()).unwrap();
        let Some(Value::Field(direction)) = made.take("direction", false) else { panic!() };
        let want = 180.0 - 2f32.sqrt().atan().to_degrees();
        assert!(raster(direction, &canvas()).data().iter().all(|v| (v - want).abs() < 0.01));
    }

    #[test]
    fn holds_in_any_window() {
        check_field(&field(&SlopeMap { input: port(0), normalize: true }, &[lumps().into()]));
    }
}
