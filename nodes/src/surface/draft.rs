//! [`Draft`]: heights without slopes that are too steep to release.
//!
//! The result is the lower envelope of cones, h′(x) = min over y of h(y) + s·|x − y|: the largest height under h whose
//! steps between any two samples are at most s (a Lipschitz regularisation; J.-B. Hiriart-Urruty, "Extension of
//! Lipschitz functions", 1980). It is exact, see [`kernel::envelope`](shibo_kernel::surface::envelope). Cost: about
//! 0.1 µs a pixel of the tile with its halo of `span` / tan(`steepest`); one-way pulls O(halo) per pixel, eight pixels at
//! a time.
use super::lowered::Envelope;
use crate::bounds::told;
use crate::values::pairs;
use shibo_kernel::surface::envelope::Profile;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Stop, Type};

/// Direction in which the tool or the mould is pulled off.
#[choice]
pub enum Pull {
    /// Upwards, away from the base: slopes in all directions are limited
    #[default]
    All,
    /// To the right: only rises towards the left are limited
    Right,
    /// To the left: only rises towards the right are limited
    Left,
    /// To the top of the picture: only rises towards the bottom are limited
    Up,
    /// To the bottom of the picture: only rises towards the top are limited
    Down,
}

impl Pull {
    /// The direction in which the samples lie that limit a sample; `None` for all directions.
    fn way(self) -> Option<[i32; 2]> {
        match self {
            Self::All => None,
            Self::Right => Some([1, 0]),
            Self::Left => Some([-1, 0]),
            Self::Up => Some([0, -1]),
            Self::Down => Some([0, 1]),
        }
    }
}

/// The side of the given height on which the result lies.
#[choice]
pub enum Keep {
    /// Below: steep places lose material
    #[default]
    Below,
    /// Above: steep places gain material
    Above,
}

/// Limits the slopes of a height, so that a mould, a stamp or a roll lets go of the material: draft.
///
/// Steps between any two samples are at most tan(`steepest`) of their distance, and no higher height below the given one
/// has that property. Places that are flat enough stay as they are. For injection moulds a common rule is a draft of
/// 1.5° for each 0.025 mm of depth, so `steepest` is 90° minus that.
///
/// ```ron
/// "noise": Perlin(size: 8),
/// "hills": Remap(input: "noise", from: (0.3, 0.7), to: (0, 4), clamp: true),
/// "released": Draft(input: "hills", steepest: 35, span: 4),
/// "example": Relief(height: "released"),
/// ```
///
/// Elsewhere: SolidWorks *Draft* and *Draft Analysis*; ZBrush *Draft Analysis*.
#[node]
pub struct Draft {
    /// Height in mm.
    pub input: In<Gray>,
    /// Steepest slope against the base, 0° for a plain. With `pull` to one side it is the draft of the wall.
    #[schemars(range(min = 0.1, max = 89.9), extend("unit" = "°"))]
    #[default(60.0)]
    pub steepest: f64,
    /// Direction in which the mould is pulled off.
    #[default(Pull::All)]
    pub pull: Pull,
    /// The side of the given height on which the result lies.
    #[default(Keep::Below)]
    pub keep: Keep,
    /// Bound of the difference between heights. It determines how far the node reads: `span` / tan(`steepest`), which is
    /// at most half the canvas' longer side. Heights that differ more are an error.
    #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(1.0)]
    pub span: f64,
}

impl Draft {
    fn slope(&self) -> f64 {
        libm::tan(self.steepest.to_radians())
    }
}

impl Node for Draft {
    const OUTPUTS: &'static [Output] = &[
        Output::new("height", Type::Gray, "The height with limited slopes.").in_unit("mm"),
        Output::new("removed", Type::Gray, "The difference from the given height, at least 0.").in_unit("mm"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let (reach, most) = (self.span / self.slope(), 0.5 * canvas.size_mm().max_element());
        if reach <= most {
            return Vec::new();
        }
        let message = format!(
            "with steepest `{}`° and span `{}` mm, slopes are {} mm long; they must be at most half the canvas' longer side, {most} mm",
            self.steepest,
            self.span,
            told(reach)
        );
        let help = format!(
            "write `span: {}` if heights differ by no more, or `steepest: {}`",
            told(most * self.slope()),
            told(libm::atan(self.span / most).to_degrees() * 1.001)
        );
        vec![Problem::new(Code::OutOfRange, message).at("span").help(help)]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let envelope = Envelope {
            profile: Profile::Cone(self.slope()),
            reach: self.span / self.slope(),
            way: self.pull.way(),
            above: self.keep == Keep::Above,
            named: ("span", Some(self.span)),
        };
        let height = cx.shared_field("height", envelope.of(input.clone()));
        let removed = pairs([&input, &height], |before, after| (before - after).abs());
        Ok(Outputs::one(height).with("removed", removed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, check_field, field, lumps, port, raster, render};
    use shibo_value::Value;

    fn node(steepest: f64) -> Draft {
        Draft { input: port(0), steepest, ..Draft::default() }
    }

    /// The envelope on the torus of the canvas, by comparison of all pairs of its 64 × 64 samples.
    fn brute(input: &[f32], slope: f64, way: Option<[i32; 2]>) -> Vec<f64> {
        let at = |k: i32| {
            let lifted = |n: i32| {
                let [dx, dy] = [n % 64 - k % 64, n / 64 - k / 64];
                let nearest = |d: i32| d - 64 * (d + 32).div_euclid(64);
                let distance = match way {
                    None => f64::hypot(f64::from(nearest(dx)), f64::from(nearest(dy))),
                    Some([0, y]) if dx == 0 => f64::from((dy * y).rem_euclid(64)),
                    Some([x, 0]) if dy == 0 => f64::from((dx * x).rem_euclid(64)),
                    Some(_) => f64::INFINITY,
                };
                f64::from(input[n as usize]) + slope * distance * 0.5
            };
            (0..4096).map(lifted).fold(f64::INFINITY, f64::min)
        };
        (0..4096).map(at).collect()
    }

    #[test]
    fn is_the_largest_height_below_with_the_slope() {
        let input = raster(&lumps(), &canvas());
        for steepest in [4.0, 10.0, 25.0, 50.0, 80.0] {
            let got = render(&node(steepest), &[lumps().into()]);
            let wanted = brute(input.data(), steepest.to_radians().tan(), None);
            for ((got, wanted), before) in got.data().iter().zip(&wanted).zip(input.data()) {
                assert!((f64::from(*got) - wanted).abs() < 1e-6 && got <= before, "{steepest}: {got} {wanted}");
            }
            let again = field(&node(steepest), &[field(&node(steepest), &[lumps().into()]).into()]);
            let again = raster(&again, &canvas());
            assert!(again.data().iter().zip(got.data()).all(|(a, b)| (a - b).abs() < 1e-6), "{steepest}");
        }
    }

    #[test]
    fn limits_rises_against_the_pull_alone() {
        let input = raster(&lumps(), &canvas());
        for pull in [Pull::Right, Pull::Left, Pull::Up, Pull::Down] {
            let got = render(&Draft { pull, ..node(10.0) }, &[lumps().into()]);
            let wanted = brute(input.data(), 10f64.to_radians().tan(), pull.way());
            let all = got.data().iter().zip(&wanted).all(|(got, wanted)| (f64::from(*got) - wanted).abs() < 1e-6);
            assert!(all, "{pull:?}");
        }
    }

    #[test]
    fn keeps_the_height_below_the_result_if_told() {
        let above = Draft { keep: Keep::Above, ..node(10.0) };
        let turned: Value = crate::values::each(&lumps(), |v| -v).into();
        let (above, below) = (render(&above, &[lumps().into()]), render(&node(10.0), &[turned]));
        assert!(above.data().iter().zip(below.data()).all(|(a, b)| *a == -*b));
    }

    #[test]
    fn holds_in_any_window() {
        for (steepest, pull) in [(5.0, Pull::All), (45.0, Pull::All), (8.0, Pull::Up), (8.0, Pull::Right)] {
            check_field(&field(&Draft { pull, ..node(steepest) }, &[lumps().into()]));
        }
    }

    #[test]
    fn refuses_heights_beyond_the_span_and_long_slopes() {
        let failed = |node: &Draft, input: Value| {
            let made = field(node, &[input]);
            match crate::testing::tried(&made, &canvas()) {
                Err(Stop::Failed(problem)) => (problem.code, problem.field.clone().unwrap_or_default()),
                other => panic!("{other:?}"),
            }
        };
        let narrow = Draft { span: 0.4, ..node(45.0) };
        assert_eq!(failed(&narrow, lumps().into()), (Code::OutOfRange, "span".to_owned()));
        let bad: Value = crate::values::each(&lumps(), |v| if v > 0.9 { f32::NAN } else { v }).into();
        assert_eq!(failed(&node(45.0), bad), (Code::NotFinite, "input".to_owned()));
        let refused = |node: Draft| node.check_on(&canvas()).first().and_then(|p| p.field.clone());
        assert_eq!(refused(node(3.0)).as_deref(), Some("span"));
        assert_eq!((refused(node(5.0)), refused(Draft { span: 0.05, ..node(1.0) })), (None, None));
    }
}
