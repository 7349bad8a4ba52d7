//! Heights as lower envelopes, for [`Draft`](super::Draft) and [`ToolReach`](super::ToolReach).
use shibo_kernel::ground::tile;
use shibo_kernel::ground::window::WindowExt;
use shibo_kernel::surface::envelope::{Foot, Profile, lower, lower_along, range};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Halo, Stop, Tile, Type};
use std::borrow::Cow;
use std::sync::OnceLock;

/// The envelope of a height.
#[derive(Clone, Copy, Debug)]
pub(super) struct Envelope {
    /// Shape that forms the envelope.
    pub profile: Profile,
    /// Distance up to which the shape reaches, mm.
    pub reach: f64,
    /// Samples that count: all around, or only those in this direction.
    pub way: Option<[i32; 2]>,
    /// True for the upper envelope.
    pub above: bool,
    /// The parameter that determines the reach, and the largest difference between heights if it bounds the reach.
    pub named: (&'static str, Option<f64>),
}

impl Envelope {
    /// The envelope of `height`; a height that is not finite is an error at the port `input`.
    pub(super) fn of(self, height: Field) -> Field {
        let Self { reach, named, .. } = self;
        let halo = Halo::new(move |grid| Foot::reach(reach, tile::step(grid))).from_parameter(named.0);
        // Pictures have one grid; other grids compute the table again.
        let known: OnceLock<([f64; 2], Foot)> = OnceLock::new();
        Field::map(Type::Gray, [height], halo, move |out: &mut Tile, [height]: [&Tile; 1]| {
            let step = tile::step(&out.grid);
            let made = || Foot::new(self.profile, reach, step);
            let (own, foot) = known.get_or_init(|| (step, made()));
            let foot = if *own == step { Cow::Borrowed(foot) } else { Cow::Owned(made()) };
            self.fill(height, &foot, out)
        })
    }

    fn fill(self, height: &Tile, foot: &Foot, out: &mut Tile) -> Result<(), Stop> {
        let (rect, step) = (out.window, tile::step(&out.grid));
        let turned;
        let height = if self.above {
            let mut tile = height.clone();
            tile.data_mut().iter_mut().for_each(|v| *v = -*v);
            turned = tile;
            &turned
        } else {
            height
        };
        let (view, near) = (tile::view(height, 0), rect.with_halo(Foot::reach(self.reach, step)));
        let bounds = range(&view, near);
        if bounds.0.is_nan() {
            return Err(not_finite(height).into());
        }
        if let (name, Some(span)) = self.named
            && f64::from(bounds.1 - bounds.0) > span
        {
            let apart = f64::from(bounds.1) - f64::from(bounds.0);
            let message = format!("heights differ by {} mm here, and {name} is `{span}` mm", told(apart));
            let problem = Problem::new(Code::OutOfRange, message).at(name);
            let help = format!("write `{name}: {}`, or more if heights differ more elsewhere", told(apart * 1.05));
            return Err(problem.help(help).into());
        }
        match self.way {
            Some(way) => lower_along(&view, rect, foot, way, bounds, out.plane_mut(0)),
            None => lower(&view, rect, foot, bounds, out.plane_mut(0)),
        }
        if self.above {
            out.data_mut().iter_mut().for_each(|v| *v = -*v);
        }
        Ok(())
    }
}

/// A number with three digits, for messages.
fn told(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// The error for the first height that is not finite.
fn not_finite(height: &Tile) -> Problem {
    let at = height.plane(0).iter().position(|v| !v.is_finite()).unwrap_or(0);
    let (x, y) = (at % height.width(), at / height.width());
    let to = |start: i32, n: usize| start.saturating_add_unsigned(u32::try_from(n).unwrap_or(u32::MAX));
    let place = height.grid.center(to(height.window.x, x), to(height.window.y, y));
    let message = format!("the height is not a finite number at ({:.3}, {:.3}) mm", place.x, place.y);
    let help = "look for divisions by zero or overflow in the nodes before it";
    Problem::new(Code::NotFinite, message).at("input").help(help)
}
