//! [`LayerTime`]: the time at which layers of sediment, or sheets of a stack, reached each point of space.
//!
//! Cost: 20 ns a point, and 20 to 110 for each fold; see [`kernel::layers`](shibo_kernel::deposits::layers).
use super::parts::{self, Triple, exact_vectors, planes, points, put, vector, vectors};
use crate::by_calendar::ByCalendar;
use glam::DVec3;
use shibo_kernel::deposits::layers::{Dunes, Fault, Fold, Layers, Sets};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::wood::solids::Code;
use shibo_kernel::wood::years::Calendar;
use shibo_node::{CanvasFacts, Context, Fact, In, Node, Output, Outputs, SolidNumber, node};
use shibo_value::diagnostics::{Code as ErrorCode, Problem};
use shibo_value::{Curve, Solid, Stop, Type};
use std::sync::Arc;

/// A row of folds as given in a graph.
#[node]
#[derive(PartialEq)]
pub struct FoldSpec {
    /// Height of a crest above a trough, measured along the normal of the layers.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    #[default(10.0)]
    pub height: f64,
    /// Distance from crest to crest.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(80.0)]
    pub wavelength: f64,
    /// Direction in the layers in which crests follow each other: 0 along x.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub direction: f64,
    /// Place of the first crest, as a share of the wavelength from `origin`. By default a place that depends on the
    /// seed.
    #[schemars(range(min = -1000, max = 1000))]
    pub phase: Option<f64>,
    /// Deviation from a sine: crests differ in height and distance, and do not run straight.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.3)]
    pub irregular: f64,
}

/// A fault as given in a graph.
#[node]
#[derive(PartialEq)]
pub struct FaultSpec {
    /// A point of the fault's plane, in mm.
    pub at: Triple,
    /// Direction of the plane's horizontal line, from x towards y. The plane descends to the right of it.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    #[default(90.0)]
    pub strike: f64,
    /// Steepness of the plane: 90 stands upright.
    #[schemars(range(min = 1, max = 90), extend("unit" = "°"))]
    #[default(65.0)]
    pub dip: f64,
    /// Height by which the side above the plane slid down; negative if it was pushed up.
    #[schemars(range(min = -1e5, max = 1e5), extend("unit" = "mm"))]
    #[default(8.0)]
    pub throw: f64,
}

/// Dunes as given in a graph.
#[node]
#[derive(PartialEq)]
pub struct DuneSpec {
    /// Thickness of a set of laminae between two borders.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(40.0)]
    pub height: f64,
    /// Distance from dune to dune: borders of sets rise by `height` over this length.
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(600.0)]
    pub length: f64,
    /// Steepness of the lee sides, on which laminae form; 20 to 34 in nature.
    #[schemars(range(min = 1, max = 80), extend("unit" = "°"))]
    #[default(24.0)]
    pub angle: f64,
    /// Direction in the layers in which dunes travel: 0 along x.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub direction: f64,
    /// Variation of thickness, steepness and direction from set to set.
    #[schemars(range(min = 0, max = 1))]
    #[default(0.6)]
    pub irregular: f64,
}

/// The time at which layers reached each point: sediment, plywood, a stack of steel. The unit of time is a layer.
///
/// Layers can be folded, then shifted by faults. `dunes` replaces even layers by cross-bedding. With `older`, this
/// node's layers start at an unconformity: the plane through `origin` cuts the older layers, which keep their own time
/// below it, and folds and faults move both. `VaryGrowth(series: Generated)` gives the layers different thicknesses.
///
/// ```ron
/// "time": LayerTime(thickness: 3, folds: [(height: 7, wavelength: 40)], faults: [(at: (4, 0, 0), throw: 5)]),
/// "uneven": VaryGrowth(time: "time", series: Generated, sigma: 0.6),
/// "layers": ColorPattern(stops: [(0, "#cda274"), (0.6, "#b98a58"), (0.9, "#8a5a3a"), (1, "#c09060")]),
/// "rock": RingColor(time: "uneven", pattern: "layers", late_variation: 0.8),
/// "example": CutPlane(solid: "rock", origin: (-16, 0, 16), v: (0, 0, -32)),
/// ```
#[node]
pub struct LayerTime {
    /// A point of the first layer's lower side, in mm.
    pub origin: Triple,
    /// Direction in which layers grow; the length of the vector has no meaning.
    #[default((0.0, 0.0, 1.0))]
    pub normal: Triple,
    /// Thickness of a layer, or of a lamina with `dunes`.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm/layer"))]
    #[default(1.0)]
    pub thickness: f64,
    /// Thicknesses of the layers, from `origin` on, instead of `thickness`; after the last one the list repeats. At
    /// most 4096.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e5, "unit" = "mm"))]
    pub series: Vec<f64>,
    /// Time at `origin`.
    #[schemars(range(min = -1e6, max = 1e6), extend("unit" = "layers"))]
    pub start: f64,
    /// Folds; they add up. At most 16.
    pub folds: Vec<FoldSpec>,
    /// Faults that shift the folded layers, the youngest last. At most 64.
    pub faults: Vec<FaultSpec>,
    /// Cross-bedding by dunes, instead of even layers.
    pub dunes: Option<DuneSpec>,
    /// Time of older layers, below the plane through `origin`.
    pub older: Option<In<SolidNumber>>,
    /// Another seed gives other folds and dunes of the same kind.
    pub seed: u64,
}

impl LayerTime {
    fn layers(&self, hash: Hash) -> Layers {
        let fold = |(n, fold): (usize, &FoldSpec)| Fold {
            height: fold.height,
            wavelength: fold.wavelength,
            direction: fold.direction,
            phase: fold.phase.unwrap_or_else(|| hash.with(1000 + n as u64).unit(0)),
            irregular: fold.irregular,
        };
        let fault = |f: &FaultSpec| Fault { at: vector(f.at), strike: f.strike, dip: f.dip, throw: f.throw };
        let folds: Vec<Fold> = self.folds.iter().enumerate().map(fold).collect();
        let faults: Vec<Fault> = self.faults.iter().map(fault).collect();
        Layers::new(vector(self.origin), vector(self.normal), &folds, &faults, hash)
    }

    fn sets(&self, hash: Hash) -> Option<Sets> {
        let dunes = self.dunes.as_ref()?;
        let dunes = Dunes {
            height: dunes.height,
            length: dunes.length,
            angle: dunes.angle,
            direction: dunes.direction,
            irregular: dunes.irregular,
        };
        Some(Sets::new(dunes, hash.with(2000)))
    }

    /// Mean thickness of a layer.
    fn mean(&self) -> f64 {
        if self.series.is_empty() { self.thickness } else { self.series.iter().sum::<f64>() / self.series.len() as f64 }
    }

    /// Time from the place in the layers, before the calendar.
    fn even(&self, sets: Option<Arc<Sets>>) -> Code {
        let (mean, start) = (self.mean(), self.start);
        let time = move |place: DVec3| match &sets {
            Some(sets) => start + sets.at(place).travelled / sets.step(mean),
            None => start + place.y / mean,
        };
        let exact = time.clone();
        Code::of_inputs(move |_, inputs, out| {
            out[0].iter_mut().zip(vectors(&inputs[0])).for_each(|(out, place)| *out = narrow(time(place)));
        })
        .with_exact(move |_, inputs| exact_vectors(&inputs[0]).map(&exact).collect())
        .kept()
    }

    /// Applies the thicknesses of `series` to the even time.
    fn by_series(&self, even: Solid) -> Solid {
        if self.series.len() < 2 {
            return even;
        }
        let (calendar, start) = (Calendar::new(&self.series), self.start);
        let points: Vec<DVec3> = calendar.points().map(|(time, layer)| DVec3::new(time, layer, 0.0)).collect();
        let at = move |time: f64| start + calendar.at(time - start);
        let exact = at.clone();
        let code = Code::of_inputs(move |_, inputs, out| {
            out[0].iter_mut().zip(inputs[0].plane(0)).for_each(|(out, t)| *out = narrow(at(f64::from(*t))));
        })
        .with_exact(move |_, inputs| inputs[0].iter().map(|t| exact(*t)).collect())
        .kept();
        let time = Solid::new(Type::Solid, vec![even.clone()], code);
        // The calendar of a note starts at 0.
        if start == 0.0 { time.noted(ByCalendar { even, years: Curve { points } }) } else { time }
    }
}

/// `older` at the points before faults and folds.
fn moved(older: &Solid, place: Solid, layers: Arc<Layers>) -> Solid {
    let exact = layers.clone();
    let code = Code::of_inputs(move |_, inputs, out| {
        vectors(&inputs[0]).enumerate().for_each(|(i, place)| put(out, i, layers.original(place)));
    })
    .with_exact(move |_, inputs| {
        planes(&exact_vectors(&inputs[0]).map(|place| exact.original(place)).collect::<Vec<_>>())
    });
    older.moved(code.solid(Type::SolidVector, vec![place]), false)
}

/// `newer` above the plane and `older` below it.
fn above(place: Solid, newer: Solid, older: Solid) -> Solid {
    let code = Code::of_inputs(|_, inputs, out| {
        let sides = inputs[1].plane(0).iter().zip(inputs[2].plane(0));
        for ((out, height), (newer, older)) in out[0].iter_mut().zip(inputs[0].plane(1)).zip(sides) {
            *out = if *height >= 0.0 { *newer } else { *older };
        }
    })
    .with_exact(|_, inputs| {
        let sides = inputs[1].iter().zip(&inputs[2]);
        let heights = exact_vectors(&inputs[0]);
        heights.zip(sides).map(|(place, (newer, older))| if place.y >= 0.0 { *newer } else { *older }).collect()
    });
    code.kept().solid(Type::Solid, vec![place, newer, older])
}

impl Node for LayerTime {
    const OUTPUTS: &'static [Output] = &[
        Output::new("time", Type::Solid, "Time at which a layer reached the point.").in_unit("layers"),
        Output::new(
            "place",
            Type::SolidVector,
            "Place in the layers before folds and faults: x across 0°, y the height above `origin`, z along 0°. Details \
             and the `fiber` of other nodes follow the layers with it.",
        )
        .in_unit("mm"),
        Output::new("bed", Type::Solid, "Number of the set of laminae with `dunes`; otherwise of the layer."),
        Output::new("newer", Type::Solid, "1 in this node's layers, 0 in those of `older`."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        let many = |count: usize, most: usize, field: &str| {
            let message = format!("{field} has {count} entries; at most {most} are allowed");
            (count > most).then(|| Problem::new(ErrorCode::BadValue, message).at(field))
        };
        let bad = self.series.iter().find(|v| !(v.is_finite() && **v > 0.0 && **v <= 1e5)).map(|v| {
            let message = format!("series has the thickness `{v}`; each must be above 0 and at most 100000 mm");
            Problem::new(ErrorCode::OutOfRange, message).at("series")
        });
        let faults = (0..).zip(&self.faults).filter_map(|(n, f)| parts::place(f.at, &format!("faults.{n}.at")));
        let others = [
            parts::place(self.origin, "origin"),
            parts::direction(self.normal, "normal"),
            many(self.folds.len(), 16, "folds"),
            many(self.faults.len(), 64, "faults"),
            many(self.series.len(), 4096, "series"),
            bad,
        ];
        others.into_iter().flatten().chain(faults).collect()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let hash = Hash::new(cx.seed(self.seed));
        let older = cx.get_opt(&self.older)?;
        let layers = Arc::new(self.layers(hash));
        let sets = self.sets(hash).map(Arc::new);
        let (single, double) = (layers.clone(), layers.clone());
        let place = Code::of_place(move |patch, _, out| {
            points(patch).enumerate().for_each(|(i, p)| put(out, i, single.place(p)));
        })
        .with_exact(move |at, _| planes(&at.iter().map(|p| double.place(*p)).collect::<Vec<_>>()));
        let place = place.solid(Type::SolidVector, Vec::new());
        let newer = self.by_series(self.even(sets.clone()).solid(Type::Solid, vec![place.clone()]));
        let time = match older {
            Some(older) => above(place.clone(), newer.clone(), moved(&older, place.clone(), layers)),
            None => newer.clone(),
        };
        let bed = match sets {
            Some(sets) => Code::of_inputs(move |_, inputs, out| {
                out[0].iter_mut().zip(vectors(&inputs[0])).for_each(|(out, p)| *out = narrow(sets.at(p).set));
            })
            .solid(Type::Solid, vec![place.clone()]),
            None => Code::of_inputs(|_, inputs, out| {
                out[0].iter_mut().zip(inputs[0].plane(0)).for_each(|(out, t)| *out = t.floor());
            })
            .solid(Type::Solid, vec![newer]),
        };
        let is_newer = Code::of_inputs(|_, inputs, out| {
            out[0].iter_mut().zip(inputs[0].plane(1)).for_each(|(out, h)| *out = f32::from(u8::from(*h >= 0.0)));
        });
        let is_newer = match self.older {
            Some(_) => is_newer.solid(Type::Solid, vec![place.clone()]),
            None => Solid::constant(Type::Solid, &[1.0]),
        };
        Ok(Outputs::one(time).with("place", place).with("bed", bed).with("newer", is_newer))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, outputs, port};
    use shibo_value::Value;

    fn solid(node: &LayerTime, inputs: &[Value], name: &str) -> Solid {
        let outputs = outputs(node, inputs, &canvas()).unwrap();
        match outputs.take(name, name == "time") {
            Some(Value::Solid(solid)) => solid.clone(),
            other => panic!("{other:?}"),
        }
    }

    fn times(node: &LayerTime, points: &[DVec3]) -> Vec<f64> {
        solid(node, &[], "time").at(points)
    }

    #[test]
    fn series_give_layers_their_thicknesses() {
        let node = LayerTime { series: vec![1.0, 3.0, 2.0], ..LayerTime::default() };
        let at = [0.0, 0.5, 1.0, 2.5, 4.0, 6.0, 7.0, -2.0].map(|z| DVec3::new(3.0, 4.0, z));
        let want = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, -1.0];
        for (got, want) in times(&node, &at).iter().zip(want) {
            assert!((got - want).abs() < 1e-9, "{got} instead of {want}");
        }
        // Nodes that read the time find its calendar.
        assert!(ByCalendar::of(&solid(&node, &[], "time")).is_some());
        let later = LayerTime { start: 10.0, ..node };
        assert!((times(&later, &at)[3] - 11.5).abs() < 1e-9);
    }

    #[test]
    fn time_rises_with_the_height_above_the_layers() {
        let dunes = Some(DuneSpec { irregular: 0.0, ..DuneSpec::default() });
        let folds = vec![FoldSpec { height: 20.0, irregular: 1.0, ..FoldSpec::default() }];
        for dunes in [None, dunes] {
            let node = LayerTime { dunes, folds: folds.clone(), normal: (1.0, 0.0, 1.0), ..LayerTime::default() };
            let way = DVec3::new(1.0, 0.0, 1.0).normalize();
            let at: Vec<DVec3> = (0..2000).map(|n| DVec3::new(5.0, 9.0, -7.0) + way * f64::from(n) * 0.1).collect();
            let times = times(&node, &at);
            assert!(times.windows(2).all(|pair| pair[1] > pair[0] - 1e-9));
        }
    }

    #[test]
    fn older_layers_end_at_the_plane_of_the_newer_ones() {
        let older = LayerTime { normal: (1.0, 0.0, 1.0), thickness: 2.0, ..LayerTime::default() };
        let below: Value = solid(&older, &[], "time").into();
        let faults = vec![FaultSpec { dip: 90.0, throw: 5.0, ..FaultSpec::default() }];
        let node = LayerTime { older: Some(port(0)), start: 100.0, faults, ..LayerTime::default() };
        let (time, newer) = (solid(&node, std::slice::from_ref(&below), "time"), solid(&node, &[below], "newer"));
        // The upright fault moved the side x > 0 down by 5 mm, the cut and the older layers with it.
        let at = [(-9.0, 1.0), (-9.0, -1.0), (9.0, -4.0), (9.0, -6.0)].map(|(x, z)| DVec3::new(x, 0.0, z));
        assert_eq!(newer.at(&at), [1.0, 0.0, 1.0, 0.0]);
        let slope = |x: f64, z: f64| 0.5 * (x + z) * 0.5f64.sqrt();
        for (got, want) in time.at(&at).iter().zip([101.0, slope(-9.0, -1.0), 101.0, slope(9.0, -1.0)]) {
            assert!((got - want).abs() < 1e-9, "{got} instead of {want}");
        }
    }

    #[test]
    fn seeds_move_folds_and_dunes() {
        let folded = LayerTime { folds: vec![FoldSpec::default()], ..LayerTime::default() };
        let dunes = LayerTime { dunes: Some(DuneSpec::default()), ..LayerTime::default() };
        let at: Vec<DVec3> = (0..50).map(|n| DVec3::new(f64::from(n) * 7.0, 3.0, f64::from(n))).collect();
        for node in [folded, dunes] {
            assert_ne!(times(&node, &at), times(&LayerTime { seed: 1, ..node.clone() }, &at));
        }
    }
}
