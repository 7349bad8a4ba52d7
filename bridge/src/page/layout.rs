//! Places the boxes of a drawing in columns by their longest path, so that wires run from left to right and rarely
//! cross.

/// Number of bends above which long wires are drawn straight.
const MOST_BENDS: usize = 100_000;
/// Number of sweeps that move boxes near the boxes they are connected to.
const SWEEPS: usize = 12;

/// Position of a box or a bend.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LayoutPosition {
    /// Column from the left.
    pub column: usize,
    /// Distance from the top, in rows.
    pub row: f64,
}

/// Layout of a drawing.
#[derive(Debug)]
pub struct Layout {
    /// Positions of the boxes.
    pub places: Vec<LayoutPosition>,
    /// For each wire, its inner bends.
    pub bends: Vec<Vec<LayoutPosition>>,
    /// Number of columns.
    pub columns: usize,
    /// The lowest row.
    pub rows: f64,
}

/// Lays out `count` boxes connected by `wires`, which form no cycle; the boxes for which `last` is true go into the
/// last column.
pub fn layout(count: usize, wires: &[(usize, usize)], last: impl Fn(usize) -> bool) -> Layout {
    let columns = columns(count, wires, last);
    let rightmost = columns.iter().copied().max().unwrap_or(0);
    let mut net = Net::new(columns, wires);
    net.order();
    net.straighten();
    let place = |i: usize| LayoutPosition { column: net.columns[i], row: net.rows[i] };
    Layout {
        places: (0..count).map(place).collect(),
        bends: net.chains.iter().map(|chain| chain.iter().map(|&i| place(i)).collect()).collect(),
        columns: rightmost + 1,
        rows: net.rows.iter().copied().fold(0.0, f64::max),
    }
}

/// Column of each box: as far to the right as its readers allow, which keeps wires short. The longest path gives the
/// number of columns.
fn columns(count: usize, wires: &[(usize, usize)], last: impl Fn(usize) -> bool) -> Vec<usize> {
    let mut readers = vec![Vec::new(); count];
    let mut waiting = vec![0_usize; count];
    for &(from, to) in wires {
        readers[from].push(to);
        waiting[to] += 1;
    }
    let mut order: Vec<usize> = (0..count).filter(|&i| waiting[i] == 0).collect();
    let mut columns = vec![0_usize; count];
    let mut next = 0;
    while let Some(&i) = order.get(next) {
        next += 1;
        for &to in &readers[i] {
            columns[to] = columns[to].max(columns[i] + 1);
            waiting[to] -= 1;
            if waiting[to] == 0 {
                order.push(to);
            }
        }
    }
    let rightmost = columns.iter().copied().max().unwrap_or(0);
    (0..count).filter(|&i| last(i)).for_each(|i| columns[i] = rightmost);
    for &i in order.iter().rev() {
        // A box without readers stays where it is.
        if let Some(first) = readers[i].iter().map(|&to| columns[to]).min() {
            columns[i] = first.saturating_sub(1);
        }
    }
    columns
}

/// Boxes and bends, connected from column to column.
struct Net {
    columns: Vec<usize>,
    rows: Vec<f64>,
    /// For each wire, its bends.
    chains: Vec<Vec<usize>>,
    left: Vec<Vec<usize>>,
    right: Vec<Vec<usize>>,
    /// Items of each column, from the top.
    layers: Vec<Vec<usize>>,
}

impl Net {
    fn new(mut columns: Vec<usize>, wires: &[(usize, usize)]) -> Self {
        let long = |&(from, to): &(usize, usize)| columns[to].saturating_sub(columns[from] + 1);
        let bent = wires.iter().map(long).sum::<usize>() <= MOST_BENDS;
        let mut chains = Vec::with_capacity(wires.len());
        let mut links = Vec::new();
        for &(from, to) in wires {
            let (first, end) = (columns[from] + 1, columns[to]);
            let mut chain = Vec::new();
            let mut at = from;
            if bent {
                for column in first..end.max(first) {
                    columns.push(column);
                    chain.push(columns.len() - 1);
                    links.push((at, columns.len() - 1));
                    at = columns.len() - 1;
                }
            }
            links.push((at, to));
            chains.push(chain);
        }
        let n = columns.len();
        let (mut left, mut right) = (vec![Vec::new(); n], vec![Vec::new(); n]);
        for (from, to) in links {
            right[from].push(to);
            left[to].push(from);
        }
        let mut layers = vec![Vec::new(); columns.iter().max().map_or(0, |m| m + 1)];
        for (i, &column) in columns.iter().enumerate() {
            layers[column].push(i);
        }
        let mut net = Self { rows: vec![0.0; n], columns, chains, left, right, layers };
        net.stack();
        net
    }

    /// Stacks the items of each column.
    fn stack(&mut self) {
        for layer in &self.layers {
            for (row, &i) in layer.iter().enumerate() {
                self.rows[i] = row as f64;
            }
        }
    }

    fn mean(&self, i: usize, neighbours: &[Vec<usize>]) -> Option<f64> {
        let near = &neighbours[i];
        (!near.is_empty()).then(|| near.iter().map(|&j| self.rows[j]).sum::<f64>() / near.len() as f64)
    }

    /// Orders each column by the mean position of connected items, from left to right and back.
    fn order(&mut self) {
        for sweep in 0..SWEEPS {
            let forth = sweep % 2 == 0;
            let mut order: Vec<usize> = (0..self.layers.len()).collect();
            if !forth {
                order.reverse();
            }
            for column in order {
                let mut layer = std::mem::take(&mut self.layers[column]);
                let wish = |&i: &usize| {
                    let neighbours = if forth { &self.left } else { &self.right };
                    self.mean(i, neighbours).unwrap_or(self.rows[i])
                };
                layer.sort_by(|a, b| wish(a).total_cmp(&wish(b)));
                layer.iter().enumerate().for_each(|(row, &i)| self.rows[i] = row as f64);
                self.layers[column] = layer;
            }
        }
    }

    /// Moves items towards the items they are connected to, as far as their neighbours in the column allow.
    fn straighten(&mut self) {
        for sweep in 0..2 * SWEEPS {
            let forth = sweep % 2 == 0;
            for k in 0..self.layers.len() {
                let column = if forth { k } else { self.layers.len() - 1 - k };
                let neighbours = if forth { &self.left } else { &self.right };
                let layer = &self.layers[column];
                let wishes: Vec<f64> =
                    layer.iter().map(|&i| self.mean(i, neighbours).unwrap_or(self.rows[i])).collect();
                let rows = spread(&wishes);
                for (&i, row) in layer.iter().zip(rows) {
                    self.rows[i] = row;
                }
            }
        }
        let top = self.rows.iter().copied().fold(f64::INFINITY, f64::min);
        if top.is_finite() {
            self.rows.iter_mut().for_each(|row| *row -= top);
        }
    }
}

/// Rows nearest to `wishes` (least squares) that keep their order and a distance of at least one. Touching groups are
/// moved together.
fn spread(wishes: &[f64]) -> Vec<f64> {
    // Groups, each with the sum of the wishes for its first row and the number of members.
    let mut groups: Vec<(f64, usize)> = Vec::new();
    for &wish in wishes {
        groups.push((wish, 1));
        while let [.., (a, n), (b, m)] = groups[..] {
            if b / m as f64 >= a / n as f64 + n as f64 {
                break;
            }
            groups.pop();
            groups.pop();
            groups.push((a + b - (n * m) as f64, n + m));
        }
    }
    groups.iter().flat_map(|&(sum, n)| (0..n).map(move |k| sum / n as f64 + k as f64)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_rows_near_their_wishes() {
        assert_eq!(spread(&[0.0, 5.0]), [0.0, 5.0]);
        assert_eq!(spread(&[2.0, 2.0]), [1.5, 2.5]);
        assert_eq!(spread(&[0.0, 0.0, 0.0]), [-1.0, 0.0, 1.0]);
    }

    #[test]
    fn wires_run_from_left_to_right() {
        // 0 → 1 → 2 → 4, 0 → 4, 3 → 2
        let wires = [(0, 1), (1, 2), (0, 4), (2, 4), (3, 2)];
        let layout = layout(5, &wires, |i| i == 4);
        assert!(wires.iter().all(|&(a, b)| layout.places[a].column < layout.places[b].column));
        assert_eq!(layout.places[3].column, 1);
        assert_eq!(layout.bends.iter().map(Vec::len).collect::<Vec<_>>(), [0, 0, 2, 0, 0]);
        let mut taken: Vec<LayoutPosition> =
            layout.places.iter().chain(layout.bends.iter().flatten()).copied().collect();
        taken.sort_by(|a, b| (a.column, a.row).partial_cmp(&(b.column, b.row)).unwrap());
        assert!(taken.windows(2).all(|w| w[0].column < w[1].column || w[1].row - w[0].row > 0.999), "{taken:?}");
    }

    #[test]
    fn lays_out_empty_graph() {
        assert_eq!(layout(0, &[], |_| false).columns, 1);
    }
}
