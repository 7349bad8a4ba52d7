//! Distances from the margins of colonies, by two-pass sweeps over the eight neighbours.
use super::Plan;
use crate::ground::number::narrow;
use glam::I64Vec2;

/// Rounds of two sweeps; the second one carries distances across the seams.
const ROUNDS: usize = 2;

/// Distance in mm of each cell from the margin of its colony at a moment: the front, or another colony. Cells beyond
/// the front have half a cell below 0, so that the distance is about 0 at the front when it is read between cells.
/// O(n).
pub fn margin(plan: &Plan, (times, owners): (&[f32], &[u32]), amount: f64) -> Vec<f32> {
    let amount = narrow(amount);
    let size = plan.cell;
    let (h, far) = (narrow(size.min_element()), narrow(2.0 * (plan.counts.as_dvec2() * size).length()));
    let steps: [(I64Vec2, f32); 4] = [
        (I64Vec2::NEG_X, narrow(size.x)),
        (I64Vec2::NEG_Y, narrow(size.y)),
        (I64Vec2::NEG_ONE, narrow(size.length())),
        (I64Vec2::new(1, -1), narrow(size.length())),
    ];
    let mut edges: Vec<f32> = (0..plan.len())
        .map(|cell| {
            if times[cell] > amount {
                return -0.5 * h;
            }
            let mut least = far;
            for (by, length) in steps.iter().flat_map(|(by, length)| [(*by, *length), (-*by, *length)]) {
                let Some(beside) = plan.beside(cell, by) else { continue };
                if times[beside] > amount {
                    least = least.min(length * (amount - times[cell]) / (times[beside] - times[cell]));
                } else if owners[beside] != owners[cell] {
                    least = least.min(0.5 * length);
                }
            }
            least
        })
        .collect();
    for _ in 0..ROUNDS {
        for backwards in [false, true] {
            for n in 0..plan.len() {
                let cell = if backwards { plan.len() - 1 - n } else { n };
                if edges[cell] <= 0.0 {
                    continue;
                }
                for (by, length) in steps {
                    if let Some(beside) = plan.beside(cell, if backwards { -by } else { by }) {
                        let near = edges[beside].max(0.0) + length;
                        edges[cell] = edges[cell].min(near);
                    }
                }
            }
        }
    }
    edges
}
