//! Finds the readers of each value, and an order in which each value follows its inputs.
use super::plan::{Holder, Plan, Value, value_of};
use super::words::Base;
use std::collections::HashMap;

impl Plan<'_, '_> {
    /// The values, each after those that it reads. Values on a cycle keep their nodes.
    pub(super) fn order(&mut self) -> Vec<usize> {
        let mut order = Vec::with_capacity(self.values.len());
        let mut state = vec![0_u8; self.values.len()];
        for root in 0..self.values.len() {
            let mut stack = vec![root];
            while let Some(&top) = stack.last() {
                if state[top] == 0 {
                    state[top] = 1;
                    for read in self.values[top].formula.clone().names() {
                        match read.base {
                            Base::Value(inner) if state[inner] == 0 => stack.push(inner),
                            Base::Value(inner) if state[inner] == 1 => self.values[inner].pinned = true,
                            _ => {}
                        }
                    }
                } else {
                    stack.pop();
                    if state[top] == 1 {
                        state[top] = 2;
                        order.push(top);
                    }
                }
            }
        }
        order
    }

    /// Finds the values that something reads. Outputs that nothing reads are dropped, except one.
    pub(super) fn mark_read(&mut self) {
        let mut read = vec![false; self.values.len()];
        for holder in self.holders() {
            for name in self.formula(holder).names() {
                if let Base::Value(index) = name.base {
                    read[index] = true;
                }
            }
        }
        for values in self.of_entry.values() {
            let any = values.iter().any(|value| read[*value]);
            for (first, value) in values.iter().enumerate() {
                self.values[*value].read = read[*value];
                self.values[*value].gone = !read[*value] && (any || first > 0);
            }
        }
    }

    /// Finds the users of each value; a user is listed once for each use.
    pub(super) fn count(&mut self) {
        // Names that stand for other names are written nowhere any more, except in places that do not take a formula.
        let users = self.users(|value| value.gone || (value.formula.is_atom() && !value.pinned && value.read));
        for (value, users) in self.values.iter_mut().zip(users) {
            value.gone |= value.read && users.is_empty();
        }
        let users = self.users(|value| value.gone);
        for (value, users) in self.values.iter_mut().zip(users) {
            value.users = users;
        }
    }

    /// The users of each value, without those that are left out.
    fn users(&self, left_out: impl Fn(&Value) -> bool) -> Vec<Vec<Holder>> {
        let mut users: Vec<Vec<Holder>> = vec![Vec::new(); self.values.len()];
        for holder in self.holders() {
            if matches!(holder, Holder::Value(index) if left_out(&self.values[index])) {
                continue;
            }
            for index in self.formula(holder).names().filter_map(value_of) {
                users[index].push(holder);
            }
        }
        users
    }

    /// Measures the lines that have places.
    pub(super) fn measure(&mut self) {
        let mut widths: HashMap<usize, (usize, usize)> = HashMap::new();
        for place in &self.places {
            let width = self.place_text(&place.formula, place.holds).chars().count();
            let (around, inside) = widths.entry(place.line).or_insert((usize::MAX, 0));
            // Each place counts the others as a part of its line.
            *around = place.around.min(*around);
            *inside = inside.saturating_add(width);
        }
        let total = |(around, inside): (usize, usize)| around.saturating_add(inside);
        self.widths = widths.into_iter().map(|(line, width)| (line, total(width))).collect();
    }
}
