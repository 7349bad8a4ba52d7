//! A roll: the relief round an axis, with flat ends, solid or with a bore.
use super::builder::{Builder, Figures, Lay, Receiver, Vertex, surface};
use super::heights::{Heights, single};
use super::tiles::Tiles;
use std::f64::consts::{PI, TAU};
use std::io;

/// A roll with a relief.
#[derive(Debug)]
pub struct Roll<'a> {
    /// The heights, closed from left to right: [`Heights::round`].
    pub heights: &'a Heights<'a>,
    /// The triangles of the relief.
    pub tiles: &'a Tiles,
    /// The number of repeats round the roll and along it.
    pub repeats: [usize; 2],
    /// The diameter of the bore in mm; 0 for a solid roll.
    pub bore: f64,
    /// The largest distance of the bore's chords from its circle, in mm.
    pub error: f64,
    /// The slope in degrees above which facets count as too steep.
    pub steepest: f64,
}

impl Roll<'_> {
    /// Number of triangles of the roll.
    pub fn triangles(&self) -> u64 {
        let [around, along] = self.repeats.map(|count| count as u64);
        let [top, bottom, ..] = self.tiles.rims();
        let bore = if self.bore > 0.0 { 4 * self.bore_points() as u64 } else { 0 };
        around * along * self.tiles.triangles() + around * (top + bottom) + bore
    }

    /// The radius at height 0, in mm.
    pub fn radius(&self) -> f64 {
        self.repeats[0] as f64 * self.heights.size_mm()[0] / TAU
    }

    /// The length in mm.
    pub fn length(&self) -> f64 {
        self.repeats[1] as f64 * self.heights.size_mm()[1]
    }

    /// Hands the roll out. Its axis is z, from 0. Seen from outside, it looks like the picture with its top at the
    /// upper end.
    ///
    /// # Errors
    /// Those of the receiver.
    pub fn build(&self, receiver: &mut dyn Receiver) -> io::Result<Figures> {
        let mut builder = Builder::new(receiver, self.steepest);
        let [wide, high] = self.heights.size().map(|count| count - 1);
        let columns = wide * self.repeats[0];
        let (radius, length, height) = (self.radius(), self.length(), self.heights.size_mm()[1]);
        let turn = |column: f64| (column + 0.5 * self.heights.finer() as f64) * TAU / columns as f64;
        let turns: Vec<(f64, f64)> = (0..columns).map(|column| libm::sincos(turn(column as f64))).collect();
        let place = |column: usize, row: usize, z: f32| {
            let tile = (row / high).min(self.repeats[1] - 1);
            let r = radius + f64::from(z);
            let (sin, cos) = turns[column % columns];
            let down = tile as f64 * height + self.heights.place(0, row - tile * high)[1];
            [single(r * cos), single(r * sin), single(length - down)]
        };
        let up = |at: [f64; 3]| [at[0], at[1], 0.0];
        let lay = Lay { repeats: self.repeats, closed: true, place: &place, up: &up };
        let rims = surface(self.tiles, &lay, &mut builder)?;
        // The last vertex of a rim is the first one once more.
        let ring = |rim: &[(usize, Vertex)]| rim.iter().filter(|(at, _)| *at < columns).copied().collect::<Vec<_>>();
        let (top, bottom) = (ring(&rims.top), ring(&rims.bottom));
        if self.bore <= 0.0 {
            for (ring, z, upper) in [(&top, length, true), (&bottom, 0.0, false)] {
                let middle = builder.vertex([0.0, 0.0, single(z)])?;
                for (at, (_, vertex)) in ring.iter().enumerate() {
                    let beside = ring[(at + 1) % ring.len()].1;
                    let (a, b) = if upper { (*vertex, beside) } else { (beside, *vertex) };
                    builder.triangle([middle, a, b])?;
                }
            }
            return Ok(builder.finish());
        }
        let count = self.bore_points();
        let mut circle = |z: f64| {
            let one = |at: usize| {
                let (sin, cos) = libm::sincos(turn(at as f64 * columns as f64 / count as f64));
                builder.vertex([single(0.5 * self.bore * cos), single(0.5 * self.bore * sin), single(z)])
            };
            (0..count).map(one).collect::<io::Result<Vec<Vertex>>>()
        };
        let (upper, lower) = (circle(length)?, circle(0.0)?);
        end(&mut builder, &top, &upper, columns, true)?;
        end(&mut builder, &bottom, &lower, columns, false)?;
        for at in 0..count {
            let beside = (at + 1) % count;
            builder.triangle([lower[at], upper[at], upper[beside]])?;
            builder.triangle([lower[at], upper[beside], lower[beside]])?;
        }
        Ok(builder.finish())
    }

    /// Number of vertices round the bore.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the number is between 24 and 100,000")]
    fn bore_points(&self) -> usize {
        let cosine = (1.0 - 2.0 * self.error / self.bore).clamp(-1.0, 1.0 - 1e-12);
        (PI / libm::acos(cosine)).ceil().clamp(24.0, 1e5) as usize
    }
}

/// The strip between the rim of an end and the circle of the bore. Both start at the same angle.
fn end(
    builder: &mut Builder<'_>,
    rim: &[(usize, Vertex)],
    circle: &[Vertex],
    columns: usize,
    upper: bool,
) -> io::Result<()> {
    let (mut outer, mut inner) = (0, 0);
    while outer < rim.len() || inner < circle.len() {
        let next = rim.get(outer + 1).map_or(columns, |(column, _)| *column);
        // Angles as products of whole numbers.
        let outwards = inner >= circle.len() || (outer < rim.len() && next * circle.len() <= (inner + 1) * columns);
        let (out, within) = (rim[outer % rim.len()].1, circle[inner % circle.len()]);
        let third = if outwards {
            outer += 1;
            rim[outer % rim.len()].1
        } else {
            inner += 1;
            circle[inner % circle.len()]
        };
        builder.triangle(if upper { [out, third, within] } else { [out, within, third] })?;
    }
    Ok(())
}
