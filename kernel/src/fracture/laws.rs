//! Measurements of cracks: junctions, spacing, and that they only grow.
use super::Layer;
use super::cracks::Piece;
use super::draw::Drawing;
use super::net::{Net, count, shortest};
use super::springs::{Law, Local};
use crate::ground::hash::Hash;
use crate::ground::stop::NEVER;
use glam::DVec2;
use std::collections::BTreeMap;

/// Lines that meet at corners.
struct Lines {
    size: DVec2,
    corners: Vec<DVec2>,
    at: Vec<Vec<usize>>,
}

impl Lines {
    fn new(size: DVec2, lines: &[[DVec2; 2]]) -> Self {
        let (mut numbers, mut corners, mut at) = (BTreeMap::new(), Vec::new(), Vec::<Vec<usize>>::new());
        let mut number = |p: DVec2| {
            let key = [p.x / size.x, p.y / size.y].map(|v| (((v - (v + 1e-9).floor()) * 1e8).round() + 0.0).to_bits());
            *numbers.entry(key).or_insert_with(|| {
                corners.push(p);
                corners.len() - 1
            })
        };
        let pairs: Vec<[usize; 2]> = lines.iter().map(|ends| ends.map(&mut number)).collect();
        at.resize(corners.len(), Vec::new());
        for [a, b] in pairs {
            at[a].push(b);
            at[b].push(a);
        }
        Self { size, corners, at }
    }

    fn length(&self) -> f64 {
        let to = |a: usize, b: usize| shortest(self.corners[b] - self.corners[a], self.size).length();
        (0..self.at.len()).map(|a| self.at[a].iter().map(|b| 0.5 * to(a, *b)).sum::<f64>()).sum()
    }

    /// Twice the area over the length.
    fn spacing(&self) -> f64 {
        2.0 * self.size.element_product() / self.length()
    }

    /// The direction of an arm from `low` to `high` mm along it, or to its end; `None` if it is shorter than `low`.
    fn arm(&self, mut from: usize, mut to: usize, low: f64, high: f64) -> Option<DVec2> {
        let (mut way, mut at, mut start) = (0.0, DVec2::ZERO, None);
        loop {
            let step = shortest(self.corners[to] - self.corners[from], self.size);
            let length = step.length();
            let place = |goal: f64| at + step * ((goal - way) / length.max(1e-12));
            if start.is_none() && way + length >= low {
                start = Some(place(low));
            }
            if way + length >= high {
                return Some(place(high) - start?);
            }
            (way, at) = (way + length, at + step);
            let [a, b] = self.at[to][..] else { return start.map(|start| at - start) };
            (from, to) = (to, if a == from { b } else { a });
        }
    }

    /// The share of junctions of three arms at which the largest angle is at least 150°.
    fn t_share(&self) -> f64 {
        let spacing = self.spacing();
        let (mut all, mut straight) = (0.0, 0.0);
        for corner in (0..self.at.len()).filter(|n| self.at[*n].len() == 3) {
            let arms: Vec<DVec2> =
                self.at[corner].iter().filter_map(|to| self.arm(corner, *to, 0.1 * spacing, 0.4 * spacing)).collect();
            if arms.len() < 3 {
                continue;
            }
            let mut angles: Vec<f64> = arms.iter().map(|arm| arm.y.atan2(arm.x).to_degrees()).collect();
            angles.sort_by(f64::total_cmp);
            let gaps = [angles[1] - angles[0], angles[2] - angles[1], 360.0 + angles[0] - angles[2]];
            all += 1.0;
            straight += if gaps.iter().any(|gap| (150.0..=210.0).contains(gap)) { 1.0 } else { 0.0 };
        }
        straight / all
    }
}

fn layer(side: f64, scale: f64, pitch: f64) -> Layer {
    let law = Law { scale, shrink: 1.5, noise: 0.1, anisotropy: 0.0 };
    Layer { size: DVec2::splat(side), pitch, law, strain: 0.05 }
}

fn crack(layer: &Layer, seed: u64) -> Drawing {
    layer.crack(|_| Local::default(), Hash::new(seed), NEVER).unwrap()
}

fn lines(layer: &Layer, drawing: &Drawing) -> Lines {
    let ends: Vec<[DVec2; 2]> = drawing.pieces().iter().map(|piece| piece.ends).collect();
    Lines::new(layer.size, &ends)
}

/// The cells of points that are strewn over squares, as those of `Worley`.
fn worley(seed: u64) -> Lines {
    let (hash, size) = (Hash::new(seed), DVec2::splat(40.0));
    let site = |n: u32| {
        DVec2::new(f64::from(n % 40), f64::from(n / 40))
            + DVec2::new(hash.unit(2 * u64::from(n)), hash.unit(2 * u64::from(n) + 1)) * 0.999
    };
    let net = Net::new(size, &(0..1600).map(site).collect::<Vec<_>>(), NEVER).unwrap();
    let border = |l: usize| net.ends(l).map(|corner| net.corners[corner as usize]);
    Lines::new(size, &(0..net.links.len()).map(border).collect::<Vec<_>>())
}

#[test]
fn later_cracks_meet_older_ones_at_right_angles() {
    let layer = layer(70.0, 7.0, 1.0);
    let share = |of: &dyn Fn(u64) -> Lines| (1..=3).map(|seed| of(seed).t_share()).sum::<f64>() / 3.0;
    let cracked = share(&|seed| lines(&layer, &crack(&layer, seed)));
    let cells = share(&worley);
    println!("junctions in the form of a T: cracks {cracked:.3}, Worley {cells:.3}");
    assert!(cracked >= 0.65, "{cracked}");
    assert!(cracked >= cells + 0.3, "{cracked} against {cells}");
}

#[test]
fn spacing_is_proportional_to_the_scale() {
    // The pitch is always a seventh of the scale; the area differs, so other points break.
    let spacing = |scale: f64, side: f64| {
        let layer = layer(side, scale, scale / 7.0);
        (1..=2).map(|seed| lines(&layer, &crack(&layer, seed)).spacing() / scale).sum::<f64>() / 2.0
    };
    let found = [spacing(1.0, 11.0), spacing(2.0, 19.0), spacing(8.0, 80.0)];
    println!("spacing over scale: {found:.3?}");
    let (least, most) = found.iter().fold((f64::INFINITY, 0_f64), |(low, high), v| (low.min(*v), high.max(*v)));
    assert!(most / least < 1.1, "{found:?}");
}

#[test]
fn more_points_change_the_spacing_little() {
    let spacing = |pitch: f64| {
        let layer = layer(48.0, 7.0, pitch);
        (1..=2).map(|seed| lines(&layer, &crack(&layer, seed)).spacing()).sum::<f64>() / 2.0
    };
    let (coarse, fine) = (spacing(1.0), spacing(1.0 / 3f64.sqrt()));
    println!(
        "spacing {coarse:.2} with {:.0} points, {fine:.2} with three times as many",
        count(DVec2::splat(48.0), 1.0)
    );
    assert!((fine / coarse - 1.0).abs() <= 0.15, "{coarse} {fine}");
}

#[test]
fn more_shrinkage_heals_no_crack() {
    let base = layer(50.0, 6.0, 1.0);
    let mut before: Vec<Piece> = Vec::new();
    for shrink in [0.5, 1.05, 1.2, 1.5, 2.0, 3.0] {
        let layer = Layer { law: Law { shrink, ..base.law }, ..base };
        let drawing = crack(&layer, 4);
        let has = |link: u32| drawing.pieces().iter().any(|piece| piece.link == link);
        assert!(before.iter().all(|piece| has(piece.link)), "{shrink}");
        assert!(drawing.pieces().len() >= before.len());
        before = drawing.pieces().to_vec();
        assert_eq!(before.is_empty(), shrink < 0.9, "{shrink}");
    }
}

#[test]
fn plates_are_closed() {
    let layer = layer(60.0, 6.0, 1.0);
    let drawing = crack(&layer, 2);
    // A way that crosses no crack between plates stays on its plate.
    let (mut start, mut crossed, mut steps) = (0, 0, 0);
    for n in 0..20_000_u32 {
        let p = DVec2::new(f64::from(n % 200) * 0.3, f64::from(n / 200) * 0.6);
        let q = p + DVec2::new(0.05, 0.03);
        let clear = drawing.edge(p, &mut start) > 0.06 && drawing.edge(q, &mut start) > 0.06;
        if clear {
            steps += 1;
            crossed += u32::from(drawing.plate(p).number != drawing.plate(q).number);
        }
    }
    assert!(steps > 15_000 && crossed == 0, "{crossed} of {steps}");
    let count = drawing.plates().iter().max().unwrap();
    println!("{count} plates");
    assert!((15..80).contains(count), "{count}");
}

#[test]
fn plates_curl_at_their_edges() {
    let layer = layer(60.0, 6.0, 1.0);
    let drawing = crack(&layer, 2);
    let (mut sums, mut counts, mut start) = ([0.0; 2], [0.0; 2], 0);
    for n in 0..5_000_u32 {
        let p = DVec2::new(f64::from(n % 70) * 0.83, f64::from(n / 70) * 0.83);
        let (edge, curl) = (drawing.edge(p, &mut start), drawing.plate(p).curl);
        assert!((0.0..=1.0).contains(&curl));
        let place = usize::from(edge > 3.5);
        if !(0.5..=3.5).contains(&edge) {
            sums[place] += curl;
            counts[place] += 1.0;
        }
    }
    let (rim, middle) = (sums[0] / counts[0], sums[1] / counts[1]);
    println!("curl {rim:.2} at edges, {middle:.2} in the middle");
    assert!(rim > 0.6 && middle < 0.35, "{rim} {middle}");
}

#[test]
fn plates_come_off_from_their_edges() {
    let layer = layer(60.0, 6.0, 1.0);
    let share = |adhesion: f64| {
        let local = Local { adhesion, ..Local::default() };
        let drawing = layer.crack(|_| local, Hash::new(2), NEVER).unwrap();
        let (mut all, mut rim, mut start) = (0.0, [0.0; 2], 0);
        for n in 0..5_000_u32 {
            let p = DVec2::new(f64::from(n % 70) * 0.83, f64::from(n / 70) * 0.83);
            let (edge, peel) = (drawing.edge(p, &mut start), drawing.plate(p).peel);
            all += peel / 5000.0;
            rim[usize::from(edge > 3.0)] += peel;
        }
        (all, rim)
    };
    let found: Vec<f64> = [0.6, 0.8, 1.0, 1.2, 1.4, 3.0].iter().map(|adhesion| share(*adhesion).0).collect();
    println!("share that comes off: {found:.3?}");
    assert!(found.windows(2).all(|pair| pair[0] >= pair[1]) && found[0] > 0.1 && found[5] == 0.0, "{found:?}");
}

#[test]
fn anisotropic_stress_gives_long_cracks() {
    let mut layer = layer(60.0, 6.0, 1.0);
    layer.law.anisotropy = 0.5;
    let drawing = crack(&layer, 2);
    let along = drawing.pieces().iter().fold(DVec2::ZERO, |sum, piece| sum + (piece.ends[1] - piece.ends[0]).abs());
    assert!(along.x > 1.8 * along.y, "{along}");
}
