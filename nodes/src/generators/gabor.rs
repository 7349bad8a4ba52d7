//! [`Gabor`]: noise of short wave packets along a direction.
//!
//! Source: A. Lagae et al., "Procedural noise using sparse Gabor convolution" (2009);
//! [`kernel::gabor`](shibo_kernel::noise::gabor) lists the differences. The halo of a tile of angles is the radius of a
//! packet. Cost: O(pixels), about 60 ns.
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::tile;
use shibo_kernel::noise::gabor::{self as kernel, GaborSpec};
use shibo_node::{CanvasFacts, Context, Direction, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Halo, Stop, Tile, Tiling, Type};

/// Short stripes of one width, in a direction that may differ from place to place: grain, brushed metal, ripples, pores
/// along fibres.
///
/// The noise is a sum of many wave packets: each is a few parallel stripes that fade out on all sides. `wavelength` is
/// the distance from one stripe to the next. `bandwidth` sets how many stripes a packet has: about five at 0.25, which
/// gives trains of even waves as in ripples of sand; fewer than two at 1; at 2 it is a noise that merely favours the
/// direction. `aspect` makes each stripe longer, and `spread` turns packets at random, so that stripes cross. Values
/// lie in 0..1 with mean ½ and deviation 0.155; multiply the noise by a depth in mm for a height. On a tiling canvas the
/// noise repeats.
///
/// Good starting points: brushed metal `wavelength: 0.15, aspect: 12, spread: 1`; ripples `wavelength: 6, bandwidth:
/// 0.5, aspect: 2, spread: 8`; pores of wood `wavelength: 0.4, aspect: 10`, then `Threshold`. Connect `direction` to make
/// stripes follow a path (`FlowFromPaths`), eddies (`Curl`) or the slope of a field (`VectorField`).
///
/// ```ron
/// "eddies": Curl(size: 22),
/// "example": Gabor(wavelength: 1.6, direction: "eddies", aspect: 3),
/// ```
///
/// Elsewhere: Blender *Gabor Texture*; Substance Designer *Anisotropic Noise*, *Directional Noise*.
#[node]
pub struct Gabor {
    /// Direction of the stripes, in degrees from +x towards +y or as vectors, read at the middle of each packet;
    /// `angle` is added.
    pub direction: Option<In<Direction>>,
    /// Distance between stripes.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(2.0)]
    pub wavelength: f64,
    /// Range of wavelengths, in octaves, at half strength.
    #[schemars(range(min = 0.1, max = 3))]
    #[default(1.0)]
    pub bandwidth: f64,
    /// Length of packets along the stripes, as a multiple of their width across.
    #[schemars(range(min = 0.1, max = 20))]
    #[default(1.0)]
    pub aspect: f64,
    /// Direction of the stripes, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Largest random rotation of each packet, either way; with 90 the noise has no direction.
    #[schemars(range(min = 0, max = 90), extend("unit" = "°"))]
    pub spread: f64,
    /// Another seed gives another pattern of the same kind.
    pub seed: u64,
}

impl Gabor {
    fn spec(&self) -> GaborSpec {
        let Self { wavelength, bandwidth, aspect, angle, spread, .. } = *self;
        GaborSpec { wavelength, bandwidth, aspect, angle, spread }
    }
}

impl Node for Gabor {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "The noise, 0..1.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let (reach, most) = (self.spec().reach(), 0.5 * canvas.size_mm().max_element());
        if reach <= most {
            return Vec::new();
        }
        let message = format!(
            "wavelength, bandwidth and aspect make packets of {:.4} mm; they must be at most as long as the canvas, {} mm",
            2.0 * reach,
            2.0 * most
        );
        let problem = Problem::new(Code::OutOfRange, message).at("wavelength");
        vec![problem.help("make the wavelength or the aspect smaller, or the bandwidth larger")]
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let direction = cx.get_opt(&self.direction)?;
        let known = direction.as_ref().and_then(|field| field.as_constant()).map_or(0.0, |angle| f64::from(angle[0]));
        let spec = GaborSpec { angle: self.angle + known, ..self.spec() };
        let noise = kernel::Gabor::new(&spec, (cx.size_mm(), cx.tiling()), Hash::new(cx.seed(self.seed)));
        let field = match direction.filter(|field| field.as_constant().is_none()) {
            None => Field::generate(Type::Gray, cx.tiling(), move |out, given| {
                noise.fill(&tile::frame(out), None, out.plane_mut(0));
                given.check()
            }),
            Some(direction) => {
                let tiling = cx.tiling().and(direction.tiling());
                let reach = noise.clone();
                let halo = Halo::new(move |grid| reach.halo(tile::step(grid))).from_parameter("size");
                let fill = move |out: &mut Tile, [angles]: [&Tile; 1]| {
                    noise.fill(&tile::frame(out), Some(&tile::view(angles, 0)), out.plane_mut(0));
                    Ok(())
                };
                Field::map(Type::Gray, [direction], halo, fill).tiled(tiling)
            }
        };
        Ok(Outputs::one(field))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, gray};
    use crate::testing::{OnCanvas as _, canvas, lumps, port, render};

    #[test]
    fn conforms_with_and_without_a_field() {
        for (wavelength, bandwidth, aspect, spread) in
            [(2.0, 1.0, 1.0, 0.0), (1.5, 0.4, 0.3, 90.0), (3.0, 3.0, 4.0, 10.0), (1e-300, 1.0, 1.0, 0.0)]
        {
            let node = Gabor { wavelength, bandwidth, aspect, spread, ..Gabor::default() };
            conforms(&node, &[]);
            conforms(&Gabor { direction: Some(port(0)), ..node.clone() }, &[lumps().into()]);
            conforms(&Gabor { direction: Some(port(0)), ..node }, &[gray().into()]);
        }
        let wild = Field::constant(Type::Gray, &[f32::MAX]);
        conforms(&Gabor { direction: Some(port(0)), ..Gabor::default() }, &[wild.into()]);
    }

    #[test]
    fn stripes_run_along_the_direction() {
        let vector = Field::constant(Type::Vec2, &[0.0, -3.0]);
        let stripes = render(&Gabor { direction: Some(port(0)), ..Gabor::default() }, &[vector.to_angle().into()]);
        let unlike = |dx: usize, dy: usize| {
            let at = |x: usize, y: usize| stripes.row(0, y)[x];
            (0..63 * 63).map(|k| (at(k % 63 + dx, k / 63 + dy) - at(k % 63, k / 63)).powi(2)).sum::<f32>()
        };
        assert!(unlike(1, 0) > 5.0 * unlike(0, 1), "upright: {} {}", unlike(1, 0), unlike(0, 1));
    }

    #[test]
    fn packets_as_long_as_the_canvas_are_refused() {
        assert_eq!(Gabor::default().check_on(&canvas()), []);
        assert_eq!(
            Gabor { aspect: 20.0, ..Gabor::default() }.check_on(&canvas())[0].field.as_deref(),
            Some("wavelength")
        );
    }
}
