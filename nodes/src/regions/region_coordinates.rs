//! [`RegionCoordinates`]: coordinates within every piece.
//!
//! Bounding boxes, second moments and extents of whole pieces, see [`kernel::axes`](shibo_kernel::region::axes). Cost:
//! O(pixels), and the numbers once more for each output.
use super::per_piece::{PerPiece, of_pieces};
use glam::{DVec2, UVec2};
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::region::axes::{self, Picture};
use shibo_kernel::region::pieces::{Pieces, reaches};
use shibo_node::{CanvasFacts, Context, Fact, IdsField, In, Node, Output, Outputs, choice, node};
use shibo_value::{Field, Stop, Tile, Tiling, Type};

/// Direction of the x axis of a piece.
#[choice]
pub enum PieceAxis {
    /// To the right on the canvas.
    #[default]
    Canvas,
    /// Along the long side of the piece: the axis of its smallest second moment of area.
    Length,
}

/// Gives, for every piece, the position within the piece, its angle, its area, and its place on the canvas.
///
/// A whole-picture operation. Axes run along the canvas or along each piece, and are turned by `angle` and at random:
/// so veneers, stones or leaves each get a direction. `CutPlane` takes `local`, `ids` and `angle` as inputs. Where the
/// numbers tile, a piece that crosses the border is one piece.
///
/// ```ron
/// "cells": Worley(size: 7),
/// "own": RegionCoordinates(ids: "cells.ids", axis: Length),
/// "example": "= 0.5 + 0.5 * sin(180 * own.local.x) * cos(60 * own.local.y)",
/// ```
///
/// Elsewhere: Substance Designer *Flood Fill to Position*, *Flood Fill to BBox Size*, *Flood Fill Mapper*; Material
/// Maker *Fill to UV*, *Fill to Position*, *Fill to Size*.
#[node]
pub struct RegionCoordinates {
    /// The numbers of the pieces.
    pub ids: In<IdsField>,
    /// Direction of the x axis of a piece.
    pub axis: PieceAxis,
    /// Rotation of axes from there, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Largest random rotation of axes, either way.
    #[schemars(range(min = 0, max = 180), extend("unit" = "°"))]
    pub vary: f64,
    /// Another seed gives other rotations.
    pub seed: u64,
}

/// Pieces, and the directions of their axes.
#[derive(Clone)]
pub(super) struct Coordinates {
    pub(super) ids: Field,
    /// The canvas, mm.
    pub(super) size: DVec2,
    pub(super) axis: PieceAxis,
    /// Degrees.
    pub(super) angle: f64,
    pub(super) vary: f64,
    pub(super) hash: Hash,
}

impl Default for Coordinates {
    fn default() -> Self {
        let ids = Field::constant(Type::Ids, &[0.0]);
        Self { ids, size: DVec2::ONE, axis: PieceAxis::Canvas, angle: 0.0, vary: 0.0, hash: Hash::new(0) }
    }
}

/// The hash of a piece.
#[expect(clippy::cast_possible_truncation, reason = "numbers of pieces are whole")]
pub(super) fn hash_of(hash: Hash, id: f32) -> Hash {
    hash.with((id.round() as i64).cast_unsigned())
}

/// Measurements of a piece: its middle, half its length and width along its own axes, the cosine and sine of their
/// angle, the angle in degrees, its area.
type Known = [f32; 8];

impl Coordinates {
    fn measure(&self, picture: &Picture<'_>, pieces: &Pieces) -> Vec<Known> {
        let reaches = reaches(pieces, picture.ids, picture.width, picture.wrap);
        let middles = picture.middles(&reaches);
        let mut angles = vec![0.0; middles.len()];
        if self.axis == PieceAxis::Length {
            angles = picture.long_sides(pieces, &middles);
        }
        for (angle, id) in angles.iter_mut().zip(&pieces.ids) {
            let chance = 2.0 * hash_of(self.hash, *id).unit(0) - 1.0;
            *angle += (self.angle + self.vary * chance).to_radians();
        }
        let extents = if angles.iter().all(|angle| *angle == 0.0) {
            let sides = reaches[0].iter().zip(&reaches[1]);
            let sides = sides.map(|(x, y)| 0.5 * DVec2::new(x.length as f64, y.length as f64) * picture.step);
            sides.map(|half| [-half.x, half.x, -half.y, half.y]).collect()
        } else {
            picture.extents(pieces, &middles, &angles)
        };
        let pixel = picture.step.element_product();
        let known = middles.iter().zip(&angles).zip(&extents).zip(&pieces.area);
        known
            .map(|(((middle, angle), [left, right, top, bottom]), area)| {
                let (cos, sin) = (libm::cos(*angle), libm::sin(*angle));
                let (x, y) = (0.5 * (left + right), 0.5 * (top + bottom));
                let own = *middle + DVec2::new(cos * x - sin * y, sin * x + cos * y);
                let half = 0.5 * DVec2::new(right - left, bottom - top);
                let degrees = (angle.to_degrees() + 180.0).rem_euclid(360.0) - 180.0;
                [own.x, own.y, half.x, half.y, cos, sin, degrees, *area as f64 * pixel].map(narrow)
            })
            .collect()
    }

    /// A field computed from the measurements of the piece, and from the place relative to its middle along its own
    /// axes, in mm.
    fn each(&self, ty: Type, value: impl Fn(&Known, DVec2) -> [f32; 3] + Send + Sync + 'static) -> Field {
        let (own, period) = (self.clone(), self.period());
        let per_piece = PerPiece {
            ids: self.ids.clone(),
            input: None,
            size: self.size,
            measure: move |picture: &Picture<'_>, pieces: &Pieces, _: Option<&Tile>| own.measure(picture, pieces),
            value: move |known: &Known, at: DVec2| {
                let [x, y, _, _, cos, sin, ..] = known.map(f64::from);
                let away = axes::nearest(at - DVec2::new(x, y), period);
                value(known, DVec2::new(cos * away.x + sin * away.y, cos * away.y - sin * away.x))
            },
        };
        per_piece.field(ty)
    }

    fn period(&self) -> DVec2 {
        let Tiling { x, y } = self.ids.tiling();
        DVec2::new(if x { self.size.x } else { 0.0 }, if y { self.size.y } else { 0.0 })
    }

    pub(super) fn local(&self) -> Field {
        self.each(Type::Vec2, |_, at| [narrow(at.x), narrow(at.y), 0.0])
    }

    /// The place over the piece's length and width, from 0 to 1.
    pub(super) fn unit(&self, ty: Type) -> Field {
        self.each(ty, |known, at| {
            let share = |at: f64, half: f32| narrow((0.5 + 0.5 * at / f64::from(half).max(1e-12)).clamp(0.0, 1.0));
            [share(at.x, known[2]), share(at.y, known[3]), 0.0]
        })
    }

    pub(super) fn area(&self) -> Field {
        self.each(Type::Gray, |known, _| [known[7]; 3])
    }

    fn turned(&self) -> Field {
        self.each(Type::Gray, |known, _| [known[6]; 3])
    }

    pub(super) fn center(&self) -> Field {
        let wrapped = |at: f32, period: f64| if period > 0.0 { at.rem_euclid(narrow(period)) } else { at };
        let period = self.period();
        self.each(Type::Vec2, move |known, _| [wrapped(known[0], period.x), wrapped(known[1], period.y), 0.0])
    }

    pub(super) fn extent(&self) -> Field {
        self.each(Type::Vec2, |known, _| [2.0 * known[2], 2.0 * known[3], 0.0])
    }
}

impl Node for RegionCoordinates {
    const OUTPUTS: &'static [Output] = &[
        Output::new("local", Type::Vec2, "The place within the piece, from its middle, along its own axes.")
            .in_unit("mm"),
        Output::new("uv", Type::Vec2, "The same from 0 to 1 over its length and width."),
        Output::new("angle", Type::Gray, "The angle of its x axis, from +x towards +y.").in_unit("°"),
        Output::new("size", Type::Gray, "Its area.").in_unit("mm²"),
        Output::new("center", Type::Vec2, "Where its middle lies.").in_unit("mm"),
        Output::new("box", Type::Vec2, "Its length and width along its own axes.").in_unit("mm"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn whole_bytes(&self, pixels: UVec2, _canvas: &CanvasFacts) -> u64 {
        of_pieces(pixels, 1)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let hash = Hash::new(cx.seed(self.seed));
        let (ids, size) = (cx.get(&self.ids)?, cx.size_mm());
        let own = Coordinates { ids, size, axis: self.axis, angle: self.angle, vary: self.vary, hash };
        Ok(Outputs::one(own.local())
            .with("uv", own.unit(Type::Vec2))
            .with("angle", own.turned())
            .with("size", own.area())
            .with("center", own.center())
            .with("box", own.extent()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::stand_in::slabs;
    use super::*;
    use crate::conform::{conforms, field, part};
    use crate::testing::{canvas, port};

    #[test]
    fn every_axis_conforms() {
        let node = RegionCoordinates { ids: port(0), ..RegionCoordinates::default() };
        conforms(&node, &[slabs().into()]);
        let turned = RegionCoordinates { axis: PieceAxis::Length, angle: 20.0, vary: 60.0, ..node };
        conforms(&turned, &[slabs().into()]);
    }

    #[test]
    fn long_sides_are_found() {
        let node = RegionCoordinates { ids: port(0), axis: PieceAxis::Length, ..RegionCoordinates::default() };
        let show = |output| part(&field(&node, &[slabs().into()], output), &canvas(), 0, 0, 64, 64);
        let at = |tile: &Tile, channel: usize, x: usize, y: usize| tile.row(channel, y)[x];
        let (angle, extent, local, uv) = (show("angle"), show("box"), show("local"), show("uv"));
        // The slab of 16 × 4 mm is horizontal, that of 4 × 16 mm is vertical.
        assert!(at(&angle, 0, 10, 3).abs() < 1e-3);
        assert!((at(&angle, 0, 2, 30).abs() - 90.0).abs() < 1e-3, "{}", at(&angle, 0, 2, 30));
        for (x, y) in [(10, 3), (2, 30)] {
            assert!((at(&extent, 0, x, y) - 16.0).abs() < 1e-3 && (at(&extent, 1, x, y) - 4.0).abs() < 1e-3);
        }
        // Half a pixel from the left end and from the upper end.
        assert!((at(&local, 0, 0, 3) + 7.75).abs() < 1e-3 && (at(&uv, 0, 0, 3) - 0.25 / 16.0).abs() < 1e-3);
        assert!((at(&local, 0, 2, 24).abs() - 7.75).abs() < 1e-3);
    }
}
