//! Solids built from closures, and what solid nodes of several families share.
use super::trunk::{Places, Rows};
use crate::ground::real::Real;
use glam::DVec3;
use shibo_engine::value::{Cost, Patch, Planes, Solid, SolidSource, Type, Wants};

type Fill = Box<dyn Fn(&Patch<'_>, &[Planes<'_>], &mut [&mut [f32]]) + Send + Sync>;
type Exact = Box<dyn Fn(&[DVec3], &[Vec<f64>]) -> Vec<f64> + Send + Sync>;

/// The code of a solid.
pub struct Code {
    fill: Fill,
    exact: Option<Exact>,
    wants: Wants,
    cost: Cost,
    bytes: usize,
}

impl Code {
    /// Code that reads the points.
    pub fn of_place(fill: impl Fn(&Patch<'_>, &[Planes<'_>], &mut [&mut [f32]]) + Send + Sync + 'static) -> Self {
        let wants = Wants { place: true, quads: false };
        Self { fill: Box::new(fill), exact: None, wants, cost: Cost::Local, bytes: 0 }
    }

    /// Code that is cheap and reads the inputs alone.
    pub fn of_inputs(fill: impl Fn(&Patch<'_>, &[Planes<'_>], &mut [&mut [f32]]) + Send + Sync + 'static) -> Self {
        let wants = Wants { place: false, quads: false };
        Self { wants, cost: Cost::Pointwise, ..Self::of_place(fill) }
    }

    /// The same in double precision, too.
    #[must_use]
    pub fn with_exact(mut self, exact: impl Fn(&[DVec3], &[Vec<f64>]) -> Vec<f64> + Send + Sync + 'static) -> Self {
        self.exact = Some(Box::new(exact));
        self
    }

    /// The same, evaluated in whole quads.
    #[must_use]
    pub fn with_quads(mut self) -> Self {
        self.wants.quads = true;
        self
    }

    /// The same for code whose values usually have one reader only: not kept.
    #[must_use]
    pub fn passing(mut self) -> Self {
        self.cost = Cost::Pointwise;
        self
    }

    /// The same, with its tiles kept.
    #[must_use]
    pub fn kept(mut self) -> Self {
        self.cost = Cost::Local;
        self
    }

    /// The same with the memory it holds.
    #[must_use]
    pub fn holding(mut self, bytes: usize) -> Self {
        self.bytes = bytes;
        self
    }

    /// The solid.
    pub fn solid(self, ty: Type, inputs: Vec<Solid>) -> Solid {
        Solid::new(ty, inputs, self)
    }
}

impl SolidSource for Code {
    fn fill(&self, patch: &Patch<'_>, inputs: &[Planes<'_>], out: &mut [&mut [f32]]) {
        (self.fill)(patch, inputs, out);
    }

    fn exact(&self, at: &[DVec3], inputs: &[Vec<f64>]) -> Option<Vec<f64>> {
        self.exact.as_ref().map(|exact| exact(at, inputs))
    }

    fn wants(&self) -> Wants {
        self.wants
    }

    fn cost(&self) -> Cost {
        self.cost
    }

    fn bytes(&self) -> usize {
        self.bytes
    }
}

/// The points of a patch.
pub fn places<'a>(patch: &Patch<'a>) -> Places<'a, f32> {
    let [x, y, z] = patch.place;
    let rows = if patch.level { Rows::Level(patch.columns) } else { Rows::Of(patch.columns) };
    Places { x, y, z, rows }
}

/// Calls `body` with points in columns.
pub fn columns<T>(points: &[DVec3], body: impl FnOnce(&Places<'_, f64>) -> T) -> T {
    let axis = |a: usize| points.iter().map(|p| f64::of(p[a])).collect::<Vec<_>>();
    let (x, y, z) = (axis(0), axis(1), axis(2));
    body(&Places { x: &x, y: &y, z: &z, rows: Rows::Any })
}

/// How far a number changes within a pixel, in the two directions of a quad: the size of its differences there, for all
/// points of a patch of whole quads; 0 for single points.
pub fn spans(values: &[f32], patch: &Patch<'_>) -> [Vec<f32>; 2] {
    let n = patch.columns;
    let (mut across, mut down) = (vec![0.0; values.len()], vec![0.0; values.len()]);
    if patch.pixel <= 0.0 || n == 0 {
        return [across, down];
    }
    for (values, across) in values.as_chunks::<2>().0.iter().zip(across.as_chunks_mut::<2>().0) {
        *across = [(values[1] - values[0]).abs(); 2];
    }
    for (values, down) in values.chunks_exact(2 * n).zip(down.chunks_exact_mut(2 * n)) {
        let ((upper, lower), (up, low)) = (values.split_at(n), down.split_at_mut(n));
        for ((a, b), (up, low)) in upper.iter().zip(lower).zip(up.iter_mut().zip(low)) {
            let span = (b - a).abs();
            (*up, *low) = (span, span);
        }
    }
    [across, down]
}

/// A solid that is the same everywhere.
pub fn constant(value: f32) -> Solid {
    Code::of_inputs(move |_, _, out| out.iter_mut().for_each(|plane| plane.fill(value)))
        .with_exact(move |at, _| vec![f64::from(value); at.len()])
        .solid(Type::Solid, Vec::new())
}
