//! The height of a plate that curls up at its free edges.
//!
//! A membrane under even pressure, held at the cracks, is a dome over each plate: the square of the distance from the
//! middle, turned over, without the ridges of a distance field. The curl is 1 minus the dome. Small plates curl less.
use super::cracks::Cracks;
use super::net::Net;
use super::springs::Break;
use glam::DVec2;

/// Over-relaxation.
const OVER: f64 = 1.8;

/// Largest number of rounds.
const ROUNDS: usize = 400;

/// The dome over a round plate as wide as the usual distance of cracks, for a scale of 1 mm.
const USUAL: f64 = 0.2;

/// Height at a point, and its slope.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Curl {
    /// Height, 0..1.
    pub height: f64,
    /// Slope in 1 / mm.
    pub slope: DVec2,
}

/// The dome over each point.
fn domes(net: &Net, broken: &Break, scale: f64) -> Vec<f64> {
    let mut domes = vec![0.0; net.sites.len()];
    let conductance = |half: u32| {
        let link = &net.links[half as usize / 2];
        let whole = link.border / link.along.length().max(1e-12);
        // A crack lies halfway between two points.
        if broken.order[half as usize / 2] == u32::MAX { (whole, true) } else { (2.0 * whole, false) }
    };
    let sums: Vec<f64> = (0..domes.len()).map(|s| net.from(s).iter().map(|h| conductance(*h).0).sum()).collect();
    let enough = 1e-5 * USUAL * scale * scale;
    for _ in 0..ROUNDS {
        let mut most = 0_f64;
        for site in 0..domes.len() {
            let mut flow = net.area[site];
            for half in net.from(site) {
                let (conductance, whole) = conductance(*half);
                if whole {
                    flow += conductance * domes[net.end(*half) as usize];
                }
            }
            let change = OVER * (flow / sums[site].max(1e-12) - domes[site]);
            domes[site] += change;
            most = most.max(change.abs());
        }
        if most < enough {
            break;
        }
    }
    domes
}

/// The curl at each point.
pub fn curl(net: &Net, broken: &Break, cracks: &Cracks, scale: f64) -> Vec<Curl> {
    if broken.count == 0 {
        return vec![Curl::default(); net.sites.len()];
    }
    let domes = domes(net, broken, scale);
    let mut tops = vec![0_f64; cracks.count() as usize + 1];
    let mut sides = vec![false; tops.len()];
    for (site, (plate, dome)) in cracks.plates.iter().zip(&domes).enumerate() {
        let plate = *plate as usize;
        tops[plate] = tops[plate].max(*dome);
        sides[plate] |= net.from(site).iter().any(|half| broken.order[*half as usize / 2] != u32::MAX);
    }
    let usual = USUAL * scale * scale;
    // Height at the edge of each plate.
    let edges: Vec<f64> =
        tops.iter().zip(&sides).map(|(top, free)| if *free { (top / usual).sqrt().min(1.0) } else { 0.0 }).collect();
    let height = |site: usize| {
        let plate = cracks.plates[site] as usize;
        edges[plate] * (1.0 - domes[site] / tops[plate].max(1e-12)).clamp(0.0, 1.0)
    };
    let heights: Vec<f64> = (0..domes.len()).map(height).collect();
    let slope = |site: usize| {
        // Least squares over the neighbours, and over the free edges.
        let (mut xx, mut xy, mut yy, mut right) = (0.0, 0.0, 0.0, DVec2::ZERO);
        for half in net.from(site) {
            let whole = broken.order[*half as usize / 2] == u32::MAX;
            let to = if whole { net.along(*half) } else { 0.5 * net.along(*half) };
            let there = if whole { heights[net.end(*half) as usize] } else { edges[cracks.plates[site] as usize] };
            let weight = 1.0 / to.length_squared().max(1e-12);
            (xx, xy, yy) = (xx + weight * to.x * to.x, xy + weight * to.x * to.y, yy + weight * to.y * to.y);
            right += to * (weight * (there - heights[site]));
        }
        let det = xx * yy - xy * xy;
        let slope = DVec2::new(yy * right.x - xy * right.y, xx * right.y - xy * right.x) / det;
        if slope.is_finite() { slope } else { DVec2::ZERO }
    };
    (0..heights.len()).map(|site| Curl { height: heights[site], slope: slope(site) }).collect()
}
