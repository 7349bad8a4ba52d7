//! Cheap nodes that count how often they are computed.
#![allow(dead_code, reason = "each test program uses a part of it")]
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_node::registry::{Family, Kind, Registry};
use shibo_node::{AnySolid, Context, Gray, In, Node, Output, Outputs};
use shibo_value::{
    Cost, Cut, Field, FieldSource, Given, Grid, Halo, Key, Patch, Pictures, Planes, Points, Read, Solid, SolidSource,
    Stop, Tile, Tiling, Type, Wants, Window,
};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

macro_rules! node {
    ($(#[$doc:meta])* $name:ident { $($(#[$field:meta])* $port:ident: $ty:ty,)* } -> $out:expr, |$this:ident, $cx:ident| $body:expr) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub(crate) struct $name { $($(#[$field])* pub(crate) $port: $ty,)* }

        impl Node for $name {
            const OUTPUTS: &'static [Output] = &[$out];

            fn evaluate(&self, $cx: &Context<'_>) -> Result<Outputs, Stop> {
                let $this = self;
                $body
            }
        }
    };
}

const VALUE: Output = Output::new("value", Type::Gray, "A value.");

node!(
    /// x + y in pixels of the canvas, times a factor.
    Ramp {
        /// Factor.
        factor: f64,
    } -> VALUE,
    |this, _cx| {
        let factor = this.factor as f32;
        Ok(Outputs::one(Field::generate(Type::Gray, Tiling::BOTH, move |out, _| {
            let window = out.window;
            let size = out.grid.period.unwrap_or(glam::UVec2::splat(1 << 20)).as_ivec2();
            for (row, y) in (0..out.height()).zip(window.y..) {
                let value = |x: i32| factor * (x.rem_euclid(size.x) + y.rem_euclid(size.y)) as f32;
                out.row_mut(0, row).iter_mut().zip(window.x..).for_each(|(v, x)| *v = value(x));
            }
            Ok(())
        })))
    }
);

node!(
    /// Point-wise: one, plus twice the mean of its inputs.
    Plus {
        /// One.
        a: In<Gray>,
        /// Other.
        b: Option<In<Gray>>,
    } -> VALUE,
    |this, cx| {
        let a = cx.get(&this.a)?;
        let b = cx.get_opt(&this.b)?.unwrap_or_else(|| a.clone());
        Ok(Outputs::one(Field::map(Type::Gray, [a, b], Halo::NONE, |out: &mut Tile, [a, b]: [&Tile; 2]| {
            let means = a.plane(0).iter().zip(b.plane(0)).map(|(a, b)| 0.5 * (a + b));
            out.plane_mut(0).iter_mut().zip(means).for_each(|(v, mean)| *v = mean + 1.0);
            Ok(())
        })))
    }
);

node!(
    /// The mean of a pixel and its left and right neighbours.
    Smooth {
        /// Input.
        input: In<Gray>,
    } -> VALUE,
    |this, cx| Ok(Outputs::one(Field::map(Type::Gray, [cx.get(&this.input)?], Halo::px(1), |out, [input]| {
        for row in 0..out.height() {
            let from = input.row(0, row + 1);
            let means = from.windows(3).map(|w| (w[0] + w[1] + w[2]) / 3.0);
            out.row_mut(0, row).iter_mut().zip(means).for_each(|(v, mean)| *v = mean);
        }
        Ok(())
    })))
);

/// A field sampled at positions that another field shifts, in pixels.
struct Shifted {
    input: Field,
    by: Field,
    most: i32,
}

impl FieldSource for Shifted {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.by, grid, window)]
    }

    fn later(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.input, grid, window.grow(self.most, self.most))]
    }

    fn narrow(&self, given: &Given<'_>, _grid: &Grid, window: Window) -> Vec<Window> {
        let by = given.tile(0).plane(0);
        let clamp = |v: f32| (v as i32).clamp(-self.most, self.most);
        let low = by.iter().map(|v| clamp(*v)).min().unwrap_or(0);
        let high = by.iter().map(|v| clamp(*v)).max().unwrap_or(0);
        vec![Window { x: window.x + low, width: window.width + high.abs_diff(low), ..window }]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (by, input) = (given.tile(0), given.tile(1));
        let window = out.window;
        for row in 0..out.height() {
            for column in 0..out.width() {
                let shift = (by.row(0, row)[column] as i32).clamp(-self.most, self.most);
                let at = window.x + column as i32 + shift - input.window.x;
                out.row_mut(0, row)[column] = input.row(0, row)[at as usize];
            }
        }
        Ok(())
    }
}

node!(
    /// Shifts its input by the values of another field.
    Shift {
        /// Input.
        input: In<Gray>,
        /// Shift to the right in pixels.
        by: In<Gray>,
        /// Largest shift.
        most: u32,
    } -> VALUE,
    |this, cx| {
        let shifted = Shifted { input: cx.get(&this.input)?, by: cx.get(&this.by)?, most: this.most as i32 };
        Ok(Outputs::one(Field::new(Type::Gray, Tiling::BOTH, shifted)))
    }
);

/// The difference from the mean of the whole picture.
struct FromMean(Field);

impl FieldSource for FromMean {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.0, grid, window)]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let mean = given.prepared().expect("prepared before tiles").data()[0];
        out.plane_mut(0).iter_mut().zip(given.tile(0).plane(0)).for_each(|(v, input)| *v = input - mean);
        Ok(())
    }

    fn whole(&self, grid: &Grid) -> Vec<Read<'_>> {
        vec![Read::new(&self.0, grid, Window::full(grid.period.unwrap_or_default()))]
    }

    fn prepare(&self, grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        let whole = Window::full(grid.period.unwrap_or_default());
        let mut sum = 0.0;
        for y in 0..whole.bottom() {
            let row = pictures.read(0, Window { y, height: 1, ..whole })?;
            sum += row.data().iter().map(|v| f64::from(*v)).sum::<f64>();
        }
        let mut mean = Tile::new(*grid, Window { x: 0, y: 0, width: 1, height: 1 }, 1);
        mean.data_mut()[0] = (sum / whole.len() as f64) as f32;
        Ok(Some(mean))
    }
}

node!(
    /// The difference from the mean of the whole picture.
    Centre {
        /// Input.
        input: In<Gray>,
    } -> VALUE,
    |this, cx| Ok(Outputs::one(Field::new(Type::Gray, Tiling::BOTH, FromMean(cx.get(&this.input)?))))
);

/// Number of runs of the code of solids.
pub(crate) static SOLIDS: AtomicU64 = AtomicU64::new(0);

/// One plus the mean of the inputs; x if there are none.
struct Code;

impl SolidSource for Code {
    fn fill(&self, patch: &Patch<'_>, inputs: &[Planes<'_>], out: &mut [&mut [f32]]) {
        SOLIDS.fetch_add(1, Ordering::Relaxed);
        for (i, v) in out[0].iter_mut().enumerate() {
            let sum: f32 = inputs.iter().map(|input| input.plane(0)[i]).sum();
            *v = if inputs.is_empty() { patch.place[0][i] } else { sum / inputs.len() as f32 + 1.0 };
        }
    }

    fn wants(&self) -> Wants {
        Wants { place: true, quads: false, rounded: false }
    }

    fn cost(&self) -> Cost {
        Cost::Pointwise
    }
}

node!(
    /// A solid made of solids.
    Block {
        /// One.
        a: Option<In<AnySolid>>,
        /// Other.
        b: Option<In<AnySolid>>,
    } -> Output::new("solid", Type::Solid, "A solid."),
    |this, cx| {
        let inputs = [cx.get_opt(&this.a)?, cx.get_opt(&this.b)?];
        Ok(Outputs::one(Solid::new(Type::Solid, inputs.into_iter().flatten().collect(), Code)))
    }
);

node!(
    /// The plane z = 0.
    Slice {
        /// Solid to cut.
        solid: In<AnySolid>,
    } -> VALUE,
    |this, cx| {
        let place = Field::generate(Type::Rgb, Tiling::NONE, |out: &mut Tile, _| {
            let (grid, window, width) = (out.grid, out.window, out.width());
            for k in 0..window.len() {
                let at = grid.center(window.x + (k % width) as i32, window.y + (k / width) as i32);
                out.plane_mut(0)[k] = at.x as f32;
                out.plane_mut(1)[k] = at.y as f32;
            }
            Ok(())
        });
        let cut = Cut::new(Key::of("slice", &[]), place, |grid| grid.step.x);
        Ok(Outputs::one(cx.cut(&cx.get(&this.solid)?, &cut)))
    }
);

static DONE: Mutex<bool> = Mutex::new(false);
static TOLD: Condvar = Condvar::new();

node!(
    /// Points, made immediately.
    Seed {
        /// Read first.
        after: Option<In<Points>>,
        /// Whether to wake the `Wait` node.
        tells: bool,
    } -> Output::new("points", Type::Points, "Points."),
    |this, cx| {
        let _ = cx.get_opt(&this.after)?;
        if this.tells {
            *DONE.lock().unwrap_or_else(PoisonError::into_inner) = true;
            TOLD.notify_all();
        }
        Ok(Outputs::one(Points::default()))
    }
);

node!(
    /// Points that are made only after a `Seed` with `tells` has run.
    Wait {
        /// Unused.
        number: u32,
    } -> Output::new("points", Type::Points, "Points."),
    |_this, _cx| {
        let done = DONE.lock().unwrap_or_else(PoisonError::into_inner);
        let (done, _) = TOLD.wait_timeout_while(done, Duration::from_secs(60), |done| !*done).unwrap();
        assert!(*done, "a node waits for one that it does not read");
        Ok(Outputs::one(Points::default()))
    }
);

node!(
    /// Number of points in both sets.
    Both {
        /// One.
        a: In<Points>,
        /// Other.
        b: In<Points>,
    } -> VALUE,
    |this, cx| {
        let count = cx.get(&this.a)?.positions.len() + cx.get(&this.b)?.positions.len();
        Ok(Outputs::one(Field::constant(Type::Gray, &[count as f32])))
    }
);

/// A registry of these nodes.
pub(crate) fn registry() -> Registry {
    let kinds = vec![
        Kind::of::<Ramp>(),
        Kind::of::<Plus>(),
        Kind::of::<Smooth>(),
        Kind::of::<Shift>(),
        Kind::of::<Centre>(),
        Kind::of::<Block>(),
        Kind::of::<Slice>(),
        Kind::of::<Seed>(),
        Kind::of::<Wait>(),
        Kind::of::<Both>(),
    ];
    Registry::new([Family { name: "Test", doc: "For tests.", kinds }])
}
