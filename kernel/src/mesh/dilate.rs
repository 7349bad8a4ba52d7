//! Continues charts beyond their borders, so that filters and reduced pictures never read the empty space between them.

/// Planes of a picture, with marks of the filled pixels.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The values, by rows.
    pub planes: Vec<Vec<f32>>,
    /// Marks of the filled pixels.
    pub filled: Vec<bool>,
    /// Pixels per row.
    pub columns: usize,
}

impl Picture {
    /// The eight neighbours of a pixel, those of the row above first.
    fn around(&self, k: usize) -> impl Iterator<Item = usize> {
        let (columns, rows) = (self.columns, self.filled.len() / self.columns.max(1));
        let (x, y) = (k % columns, k / columns);
        let at = move |n: usize| (x + n % 3, y + n / 3);
        let within = move |(x, y): &(usize, usize)| (1..=columns).contains(x) && (1..=rows).contains(y);
        (0..9).filter(|n| *n != 4).map(at).filter(within).map(move |(x, y)| (y - 1) * columns + x - 1)
    }

    /// Fills rings of pixels around the filled ones, one after another: with the mean of the neighbours filled before,
    /// or with the `lowest` of them for ids, which must not be averaged.
    ///
    /// A pixel depends on those up to `width` pixels around it. O(pixels + filled ones).
    pub fn rings(&mut self, width: usize, lowest: bool) {
        let mut edge: Vec<usize> = (0..self.filled.len()).filter(|k| self.on_edge(*k)).collect();
        for _ in 0..width {
            let values: Vec<Vec<f32>> = edge.iter().map(|k| self.value(*k, lowest)).collect();
            for (k, value) in edge.iter().zip(&values) {
                self.filled[*k] = true;
                self.planes.iter_mut().zip(value).for_each(|(plane, value)| plane[*k] = *value);
            }
            let mut next: Vec<usize> = edge.iter().flat_map(|k| self.around(*k)).filter(|k| !self.filled[*k]).collect();
            next.sort_unstable();
            next.dedup();
            edge = next;
        }
    }

    /// Returns whether an empty pixel has a filled neighbour.
    fn on_edge(&self, k: usize) -> bool {
        !self.filled[k] && self.around(k).any(|n| self.filled[n])
    }

    /// The value of a pixel from its filled neighbours.
    fn value(&self, k: usize, lowest: bool) -> Vec<f32> {
        let of = |plane: &Vec<f32>| {
            let values = self.around(k).filter(|n| self.filled[*n]).map(|n| plane[n]);
            if lowest {
                return values.fold(f32::INFINITY, f32::min);
            }
            let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
            sum / count
        };
        self.planes.iter().map(of).collect()
    }

    /// Halves the picture: the mean (or lowest value) of the filled pixels of each four.
    fn halved(&self, lowest: bool) -> Self {
        let rows = self.filled.len() / self.columns;
        let (columns, halves) = (self.columns.div_ceil(2), rows.div_ceil(2));
        let mut out = Self { planes: vec![Vec::new(); self.planes.len()], filled: Vec::new(), columns };
        for k in 0..columns * halves {
            let (x, y) = (2 * (k % columns), 2 * (k / columns));
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| (x + dx, y + dy));
            let four = four.into_iter().filter(|(x, y)| *x < self.columns && *y < rows);
            let full: Vec<usize> = four.map(|(x, y)| y * self.columns + x).filter(|n| self.filled[*n]).collect();
            out.filled.push(!full.is_empty());
            for (plane, of) in out.planes.iter_mut().zip(&self.planes) {
                let values = full.iter().map(|n| of[*n]);
                plane.push(match full.len() {
                    0 => 0.0,
                    _ if lowest => values.fold(f32::INFINITY, f32::min),
                    count => values.sum::<f32>() / count as f32,
                });
            }
        }
        out
    }

    /// Fills all empty pixels from a pyramid of reduced pictures. If no pixel is filled, nothing changes. O(pixels).
    pub fn fill_all(&mut self, lowest: bool) {
        if self.filled.len() < 2 || !self.filled.contains(&false) {
            return;
        }
        // From fine to coarse, and back.
        let mut levels = vec![self.halved(lowest)];
        while let Some(last) = levels.last().filter(|last| last.filled.len() > 1 && last.filled.contains(&false)) {
            let next = last.halved(lowest);
            levels.push(next);
        }
        while let Some(coarse) = levels.pop() {
            levels.last_mut().unwrap_or(&mut *self).take(&coarse);
        }
    }

    /// Fills empty pixels from a picture of half the size.
    fn take(&mut self, coarse: &Self) {
        for k in (0..self.filled.len()).filter(|k| !self.filled[*k]).collect::<Vec<_>>() {
            let from = k / self.columns / 2 * coarse.columns + k % self.columns / 2;
            if coarse.filled[from] {
                self.filled[k] = true;
                self.planes.iter_mut().zip(&coarse.planes).for_each(|(plane, of)| plane[k] = of[from]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(rows: &[&str]) -> Picture {
        let letters: Vec<char> = rows.iter().flat_map(|row| row.chars()).collect();
        let value = |c: &char| c.to_digit(10).map_or(0.0, |d| d as f32);
        Picture {
            planes: vec![letters.iter().map(value).collect()],
            filled: letters.iter().map(char::is_ascii_digit).collect(),
            columns: rows[0].len(),
        }
    }

    #[test]
    fn rings_grow_pixel_by_pixel() {
        let start = picture(&[".......", ".......", ".......", "...8...", ".......", ".......", "......."]);
        for width in 0..4 {
            let mut grown = start.clone();
            grown.rings(width, false);
            for (k, filled) in grown.filled.iter().enumerate() {
                let near = (k % 7).abs_diff(3).max((k / 7).abs_diff(3)) <= width;
                assert_eq!(*filled, near);
                assert_eq!(grown.planes[0][k], if near { 8.0 } else { 0.0 });
            }
        }
        let mut two = picture(&["2...6"]);
        two.rings(1, false);
        assert_eq!(two.planes[0], [2.0, 2.0, 0.0, 6.0, 6.0]);
        two.rings(1, false);
        assert_eq!(two.planes[0], [2.0, 2.0, 4.0, 6.0, 6.0]);
        let mut ids = picture(&["2.6"]);
        ids.rings(1, true);
        assert_eq!(ids.planes[0], [2.0, 2.0, 6.0]);
    }

    #[test]
    fn everything_is_filled() {
        for rows in [&["3....", ".....", "....."][..], &["...", "...", "...", "..4", "..."], &["5"], &["12", "34"]] {
            let start = picture(rows);
            let mut all = start.clone();
            all.fill_all(false);
            assert!(all.filled.iter().all(|filled| *filled), "{rows:?}");
            let kept = start.filled.iter().zip(&start.planes[0]).zip(&all.planes[0]);
            assert!(kept.into_iter().all(|((filled, a), b)| !filled || a == b));
            assert!(all.planes[0].iter().all(|v| (1.0..=5.0).contains(v)));
        }
        let mut none = picture(&["...", "..."]);
        none.fill_all(false);
        assert!(!none.filled.contains(&true));
    }
}
