//! Woven cloth: warp threads run down, weft threads across, and at each crossing one lies over the other.
//!
//! Threads have elliptic cross-sections and bend between crossings along a cubic. A *float* is the visible part of a
//! thread between two crossings where it dives under. Floats have ids and coordinates.
use super::finish::{degrees, id};
use super::fit::{Fit, Wanted};
use crate::ground::number::narrow;
use crate::ground::window::{Frame, WindowExt as _};
use glam::DVec2;
use shibo_macros::choice;
use shibo_value::Tiling;

/// The pattern of crossings.
#[choice]
pub enum Binding {
    /// Over one, under one.
    #[default]
    Plain,
    /// The warp goes over `over` and under `under` weft threads, each warp thread shifted by one relative to its
    /// neighbour: diagonal ribs.
    Twill,
    /// Like `Twill` with scattered crossings, so that there are no ribs. `over` plus `under` must be 5, or 7 or more,
    /// and one of them must be 1.
    Satin,
    /// Plain with groups of `over` threads.
    Basket,
}

/// Parameters of a cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cloth {
    /// The pattern of crossings.
    pub binding: Binding,
    /// Number of weft threads that the warp goes over.
    pub over: i64,
    /// Number of weft threads that the warp goes under.
    pub under: i64,
    /// Distances between warp threads and between weft threads, mm.
    pub pitch: DVec2,
    /// The widths of warp and weft threads, mm.
    pub width: DVec2,
    /// Height of the axis of warp and weft threads at their crests over the middle plane of the cloth, mm.
    pub crimp: DVec2,
    /// Half the thickness of warp and weft threads, mm.
    pub half: DVec2,
}

/// The step of a satin with this number of threads: at least 2 between crossings, in both directions.
pub fn satin_step(threads: i64) -> Option<i64> {
    let divisor = |mut a: i64, mut b: i64| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    (2..threads - 1).find(|step| divisor(threads, *step) == 1)
}

/// A cloth on the canvas.
#[derive(Clone, Debug)]
pub struct Woven {
    cloth: Cloth,
    step: i64,
    /// Number of crossings after which the weave repeats.
    repeat: i64,
    /// The fit with crossings as units.
    pub fit: Fit,
    /// Distances between warp threads and between weft threads, mm.
    pub pitch: [f64; 2],
    /// Directions of weft and warp.
    directions: [DVec2; 2],
}

/// The visible thread at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seen {
    /// True if it is the warp.
    warp: bool,
    /// Its height, mm.
    height: f64,
    /// Distance inside the nearest thread, mm; negative in holes.
    inside: f64,
}

/// The output plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WeavePlane {
    /// Height, mm.
    Height,
    /// 1 in the holes between threads.
    Gap,
    /// 1 where the warp is visible.
    Warp,
    /// Ids of floats.
    Ids,
    /// Angle of the thread, degrees.
    Angle,
}

impl Woven {
    /// Lays a cloth on a canvas, with its weft turned by an angle with this sine and cosine; `None` if it has too many
    /// threads or if there is no such satin.
    pub fn new(cloth: Cloth, turn: (f64, f64), canvas: (DVec2, Tiling)) -> Option<Self> {
        let threads = cloth.over + cloth.under;
        let (step, repeat, basis) = match cloth.binding {
            Binding::Plain => (1, 2, [[2.0, 0.0], [1.0, 1.0]]),
            Binding::Twill => (1, threads, [[threads as f64, 0.0], [1.0, 1.0]]),
            Binding::Satin => {
                let step = satin_step(threads)?;
                (step, threads, [[threads as f64, 0.0], [step as f64, 1.0]])
            }
            Binding::Basket => {
                let n = cloth.over as f64;
                (1, 2 * cloth.over, [[2.0 * n, 0.0], [n, n]])
            }
        };
        let pieces = u32::try_from(2 * repeat * if cloth.binding == Binding::Basket { cloth.over } else { 1 }).ok()?;
        let wanted = Wanted { units: cloth.pitch, basis: basis.map(DVec2::from), turn, pieces };
        let fit = Fit::new(&wanted, canvas)?;
        let pitch = [DVec2::X, DVec2::Y].map(|g| fit.spacing(g));
        let directions = [DVec2::X, DVec2::Y].map(|d| fit.direction(d));
        Some(Self { cloth, step, repeat, fit, pitch, directions })
    }

    /// True if the warp thread `i` lies over the weft thread `j`.
    fn warp_over(&self, i: i64, j: i64) -> bool {
        let threads = self.cloth.over + self.cloth.under;
        match self.cloth.binding {
            Binding::Plain => (i + j).rem_euclid(2) == 0,
            // Crossings repeat after (step, 1).
            Binding::Twill => (j - i).rem_euclid(threads) < self.cloth.over,
            Binding::Satin => {
                let place = (i - self.step * j).rem_euclid(threads);
                if self.cloth.under == 1 { place != 0 } else { place == 0 }
            }
            Binding::Basket => (i.div_euclid(self.cloth.over) + j.div_euclid(self.cloth.over)).rem_euclid(2) == 0,
        }
    }

    /// The visible thread at a point given in crossings.
    fn seen(&self, p: DVec2) -> Seen {
        let [warp, weft] = [self.thread(p, true), self.thread(p, false)];
        let on_warp = match (warp.0 >= 0.0, weft.0 >= 0.0) {
            (true, true) => warp.1 >= weft.1,
            (false, false) => warp.0 >= weft.0,
            (warp, _) => warp,
        };
        let top = if on_warp { warp } else { weft };
        Seen { warp: on_warp, height: top.1, inside: warp.0.max(weft.0) }
    }

    /// Distance in mm inside the warp or weft thread nearest to a point, and its height there.
    fn thread(&self, p: DVec2, warp: bool) -> (f64, f64) {
        let (across, along, k) = if warp { (p.x, p.y, 0) } else { (p.y, p.x, 1) };
        let number = across.floor();
        let half_width = 0.5 * self.cloth.width[k];
        let away = (across - number - 0.5).abs() * self.pitch[k];
        // Interpolates between the crossings before and after.
        let before = (along - 0.5).floor();
        let crest = |at: f64| {
            let [n, at] = [number, at].map(whole);
            let over = if warp { self.warp_over(n, at) } else { !self.warp_over(at, n) };
            if over { 1.0 } else { -1.0 }
        };
        let (a, b, t) = (crest(before), crest(before + 1.0), along - 0.5 - before);
        let bend = if a == b { a } else { a + (b - a) * (t * t * (3.0 - 2.0 * t)) };
        let share = (away / half_width).min(1.0);
        let round = (1.0 - share * share).sqrt();
        (half_width - away, bend * self.cloth.crimp[k] + self.cloth.half[k] * (round - 1.0))
    }

    /// The first crossing of the float at a point, and its number of crossings.
    fn float(&self, i: i64, j: i64, warp: bool) -> (i64, i64) {
        let over = |k: i64| if warp { self.warp_over(i, k) } else { !self.warp_over(k, j) };
        let at = if warp { j } else { i };
        // The thread dives under here, which can only happen next to a hole: the crossing itself is used.
        if !over(at) {
            return (at, 1);
        }
        let before = (1..self.repeat).take_while(|k| over(at - k)).count();
        let after = (1..self.repeat).take_while(|k| over(at + k)).count();
        let [before, after] = [before, after].map(|n| i64::try_from(n).unwrap_or(0));
        (at - before, before + after + 1)
    }

    /// The lattice cell of the crossing (i, j), and its index in the repeat.
    fn name(&self, i: i64, j: i64) -> ([i64; 2], i64) {
        match self.cloth.binding {
            Binding::Basket => {
                let n = self.cloth.over;
                let down = j.div_euclid(n);
                let i = i - down * n;
                ([i.div_euclid(self.repeat), down], i.rem_euclid(self.repeat) * n + j.rem_euclid(n))
            }
            _ => {
                let i = i - self.step * j;
                ([i.div_euclid(self.repeat), j], i.rem_euclid(self.repeat))
            }
        }
    }

    #[inline(always)]
    fn each(&self, frame: &Frame, mut visit: impl FnMut(usize, DVec2)) {
        let rect = frame.window;
        let mut k = 0;
        for (_, y) in (0..rect.rows()).zip(rect.y..) {
            for (_, x) in (0..rect.columns()).zip(rect.x..) {
                visit(k, self.fit.to_unit * DVec2::from(frame.center(x, y)));
                k += 1;
            }
        }
    }

    /// Fills a window. O(pixels).
    pub fn fill(&self, plane: WeavePlane, frame: &Frame, out: &mut [f32]) {
        let pixel = (frame.step[0] * frame.step[1]).sqrt();
        let angles = self.directions.map(|d| narrow(degrees(d)));
        match plane {
            WeavePlane::Height => {
                // Holes are as deep as the lowest thread.
                let c = self.cloth;
                let floor = -(c.crimp + c.half).max_element();
                self.each(frame, |k, p| {
                    let seen = self.seen(p);
                    let cover = (0.5 + seen.inside / pixel).clamp(0.0, 1.0);
                    out[k] = narrow(floor + (seen.height.max(floor) - floor) * cover);
                });
            }
            WeavePlane::Gap => {
                self.each(frame, |k, p| out[k] = narrow((0.5 - self.seen(p).inside / pixel).clamp(0.0, 1.0)))
            }
            WeavePlane::Warp => self.each(frame, |k, p| out[k] = if self.seen(p).warp { 1.0 } else { 0.0 }),
            WeavePlane::Angle => self.each(frame, |k, p| out[k] = angles[usize::from(self.seen(p).warp)]),
            WeavePlane::Ids => self.each(frame, |k, p| {
                let (i, j, warp) = (whole(p.x), whole(p.y), self.seen(p).warp);
                let (first, _) = self.float(i, j, warp);
                let (cell, number) = if warp { self.name(i, first) } else { self.name(first, j) };
                let number = 2 * number + i64::from(warp);
                out[k] = id(self.fit.id(cell, u32::try_from(number).unwrap_or(0)));
            }),
        }
    }

    /// Fills a window with coordinates within floats: mm from the middle, along the thread and across it.
    pub fn local(&self, frame: &Frame, [along, across]: [&mut [f32]; 2]) {
        self.each(frame, |k, p| {
            let (i, j, warp) = (whole(p.x), whole(p.y), self.seen(p).warp);
            let (first, count) = self.float(i, j, warp);
            let middle = first as f64 + 0.5 * count as f64;
            let center = if warp { DVec2::new(i as f64 + 0.5, middle) } else { DVec2::new(middle, j as f64 + 0.5) };
            let away = self.fit.from_unit * (p - center);
            let direction = self.directions[usize::from(warp)];
            along[k] = narrow(direction.dot(away));
            across[k] = narrow(direction.perp_dot(away));
        });
    }
}

#[expect(clippy::cast_possible_truncation, reason = "far fewer threads than 2^63")]
fn whole(x: f64) -> i64 {
    x.floor() as i64
}

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "small numbers of a test")]
mod tests {
    use super::*;
    use shibo_value::Window;
    use std::collections::{BTreeMap, BTreeSet};

    fn woven(binding: Binding, over: i64, under: i64) -> Woven {
        let cloth = Cloth {
            binding,
            over,
            under,
            pitch: DVec2::splat(1.0),
            width: DVec2::splat(0.8),
            crimp: DVec2::splat(0.2),
            half: DVec2::splat(0.2),
        };
        Woven::new(cloth, (0.0, 1.0), (DVec2::splat(40.0), Tiling::BOTH)).unwrap()
    }

    #[test]
    fn threads_cross_as_they_should() {
        let draft = |cloth: &Woven, n: i64| -> Vec<String> {
            (0..n).map(|j| (0..n).map(|i| if cloth.warp_over(i, j) { 'x' } else { '.' }).collect()).collect()
        };
        assert_eq!(draft(&woven(Binding::Plain, 1, 1), 2), ["x.", ".x"]);
        assert_eq!(draft(&woven(Binding::Twill, 2, 2), 4), ["x..x", "xx..", ".xx.", "..xx"]);
        assert_eq!(draft(&woven(Binding::Basket, 2, 2), 4), ["xx..", "xx..", "..xx", "..xx"]);
        let satin = draft(&woven(Binding::Satin, 4, 1), 5);
        assert_eq!(satin, [".xxxx", "xx.xx", "xxxx.", "x.xxx", "xxx.x"]);
        // No two crossings of a satin are adjacent.
        assert_eq!([4, 5, 6, 7, 8].map(satin_step), [None, Some(2), None, Some(2), Some(3)]);
    }

    #[test]
    fn heights_are_those_of_threads() {
        let cloth = woven(Binding::Plain, 1, 1);
        // On the crest of a warp thread, in the middle of a weft thread, and in a hole.
        assert!((cloth.seen(DVec2::new(0.5, 0.5)).height - 0.2).abs() < 1e-12);
        let weft = cloth.seen(DVec2::new(1.5, 0.5));
        assert!(!weft.warp && (weft.height - 0.2).abs() < 1e-12);
        assert!((cloth.seen(DVec2::new(1.02, 1.03)).inside + 0.07).abs() < 1e-12);
        // Halfway between crossings the height is 0.
        assert!(cloth.thread(DVec2::new(0.5, 1.0), true).1.abs() < 1e-12);
    }

    #[test]
    fn floats_have_ids_and_coordinates() {
        for (binding, over, under) in
            [(Binding::Plain, 1, 1), (Binding::Twill, 3, 1), (Binding::Satin, 4, 1), (Binding::Basket, 2, 2)]
        {
            let cloth = woven(binding, over, under);
            let frame = Frame::new(Window::of(0, 0, 160, 160), [0.25, 0.25]);
            let [mut ids, mut x, mut y, mut angle] = [(); 4].map(|()| vec![0.0; 160 * 160]);
            cloth.fill(WeavePlane::Ids, &frame, &mut ids);
            cloth.fill(WeavePlane::Angle, &frame, &mut angle);
            cloth.local(&frame, [&mut x, &mut y]);
            let mut middles: BTreeMap<u32, BTreeSet<[i32; 2]>> = BTreeMap::new();
            for k in 0..160 * 160 {
                let at = DVec2::new((k % 160) as f64 + 0.5, (k / 160) as f64 + 0.5) * 0.25;
                let turn = DVec2::from_angle(f64::from(angle[k]).to_radians());
                let middle = at - turn * f64::from(x[k]) - turn.perp() * f64::from(y[k]);
                let middle = (middle + 1e-6).rem_euclid(DVec2::splat(40.0));
                let middle = (middle * 100.0).round().as_ivec2().to_array();
                assert!(x[k].abs() <= 0.5 * over.max(under) as f32 && y[k].abs() <= 0.5, "{binding:?}");
                middles.entry(ids[k] as u32).or_default().insert(middle);
            }
            assert!(middles.values().all(|m| m.len() == 1), "{binding:?}: {middles:?}");
        }
    }
}
