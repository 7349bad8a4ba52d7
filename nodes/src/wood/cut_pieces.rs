//! Cuts made of pieces, each from another place of the solid.
use shibo_kernel::ground::number::narrow;
use shibo_kernel::wood::pieces::{self, Scatter, Turned, WoodPiece};
use shibo_value::{Cut, Field, Grid, Halo, Key, PieceAxes, PieceMap, PiecePlanes, Tile, Type};
use std::sync::Arc;

/// Pieces of the canvas, and the place of each in a solid.
pub(super) struct CutPieces {
    pub(super) local: Field,
    pub(super) ids: Field,
    pub(super) angle: Option<Field>,
    /// Where a component is above ½, the piece is mirrored along its x or y axis.
    pub(super) mirror: Option<Field>,
    pub(super) scatter: Scatter,
}

/// The signs of the axes of pieces that are mirrored as `mirror` says.
fn signs(mirror: [f32; 2]) -> [f32; 2] {
    mirror.map(|component| if component > 0.5 { -1.0 } else { 1.0 })
}

/// The number of a mirrored piece: pieces of one number that are mirrored in different ways are different pieces.
fn coded(id: f32, [x, y]: [f32; 2]) -> f32 {
    4.0 * id.round() + 2.0 * f32::from(u8::from(x < 0.0)) + f32::from(u8::from(y < 0.0))
}

/// The number of a piece and the signs of its axes, by the number that [`coded`] gives.
fn decoded(code: f32) -> (f32, [f64; 2]) {
    let id = (code / 4.0).floor();
    let rest = code - 4.0 * id;
    (id, [rest >= 2.0, rest % 2.0 >= 1.0].map(|mirrored| if mirrored { -1.0 } else { 1.0 }))
}

impl CutPieces {
    /// A field with a property of each piece, at all its pixels.
    pub(super) fn each(&self, of: impl Fn(&WoodPiece, &Turned) -> [f64; 3] + Send + Sync + 'static) -> Field {
        let scatter = self.scatter;
        Field::map(Type::Rgb, [self.ids.clone()], Halo::NONE, move |out: &mut Tile, [ids]: [&Tile; 1]| {
            scatter.each(ids.plane(0), &mut out.planes_mut(), &of);
            Ok(())
        })
        .overwriting()
    }

    /// A field with the number of the tree, of `count`, from which each piece is cut.
    pub(super) fn tree(&self, count: usize) -> Field {
        let scatter = self.scatter;
        Field::map(Type::Gray, [self.ids.clone()], Halo::NONE, move |out: &mut Tile, [ids]: [&Tile; 1]| {
            let mut known = (f32::NAN, 0.0);
            for (out, id) in out.plane_mut(0).iter_mut().zip(ids.plane(0)) {
                if *id != known.0 {
                    known = (*id, scatter.tree(*id, count) as f32);
                }
                *out = known.1;
            }
            Ok(())
        })
    }

    /// A field of the cosine and sine of the angle of pieces on the canvas.
    fn turned(&self) -> Field {
        if let Some(angle) = &self.angle {
            return Field::map(Type::Vec2, [angle.clone()], Halo::NONE, |out: &mut Tile, [angle]: [&Tile; 1]| {
                if let [cos, sin] = &mut out.planes_mut()[..] {
                    pieces::turned_by(angle.plane(0), [&mut **cos, &mut **sin]);
                }
                Ok(())
            });
        }
        let inputs = [self.local.clone(), self.ids.clone()];
        Field::map(Type::Vec2, inputs, Halo::px(1), |out: &mut Tile, [local, ids]: [&Tile; 2]| {
            if let [cos, sin] = &mut out.planes_mut()[..] {
                let local_planes = [local.plane(0), local.plane(1)];
                pieces::turned_like(ids.plane(0), local_planes, ids.width(), [&mut **cos, &mut **sin]);
            }
            Ok(())
        })
    }

    /// The cache key of these pieces, if the fields that make them have keys.
    fn key(&self) -> Option<Key> {
        let Scatter { from, tilt, spread, turn, flip, hash } = self.scatter;
        let vectors = [from.middle, from.along, from.across, tilt, spread].map(|v| v.to_array());
        let numbers = vectors.as_flattened().iter().chain(&turn).map(|n| (n + 0.0).to_bits());
        let words = numbers.chain([u64::from(flip), hash.u64(0), hash.u64(1)]);
        let bytes: Vec<u8> = words.flat_map(u64::to_le_bytes).collect();
        let (local, ids) = (self.local.key()?, self.ids.key()?);
        let mut parts: Vec<&[u8]> = vec![&bytes, local.as_bytes(), ids.as_bytes()];
        let angle = match &self.angle {
            Some(angle) => Some(angle.key()?),
            None => None,
        };
        parts.extend(angle.as_ref().map(|key| &key.as_bytes()[..]));
        let mirror = match &self.mirror {
            Some(mirror) => Some(mirror.key()?),
            None => None,
        };
        if let Some(mirror) = &mirror {
            parts.extend([&b"mirrored"[..], mirror.as_bytes()]);
        }
        Some(Key::of("pieces", &parts))
    }

    /// The place within the pieces, mirrored.
    fn mirrored_local(&self) -> Field {
        let Some(mirror) = &self.mirror else { return self.local.clone() };
        let inputs = [self.local.clone(), mirror.clone()];
        Field::map(Type::Vec2, inputs, Halo::NONE, |out: &mut Tile, [local, mirror]: [&Tile; 2]| {
            for (axis, plane) in out.planes_mut().into_iter().enumerate() {
                let values = local.plane(axis).iter().zip(mirror.plane(axis));
                plane.iter_mut().zip(values).for_each(|(out, (local, mirror))| *out = local * signs([*mirror; 2])[0]);
            }
            Ok(())
        })
        .overwriting()
    }

    /// The numbers of the pieces, [`coded`] if they are mirrored.
    fn mirrored_ids(&self) -> Field {
        let Some(mirror) = &self.mirror else { return self.ids.clone() };
        let inputs = [self.ids.clone(), mirror.clone()];
        Field::map(Type::Ids, inputs, Halo::NONE, |out: &mut Tile, [ids, mirror]: [&Tile; 2]| {
            let mirror = mirror.plane(0).iter().zip(mirror.plane(1));
            for ((out, id), (x, y)) in out.data_mut().iter_mut().zip(ids.plane(0)).zip(mirror) {
                *out = coded(*id, signs([*x, *y]));
            }
            Ok(())
        })
        .overwriting()
    }

    /// The cut. Cuts with the same pieces share the fields that they read.
    pub(super) fn cut(&self) -> Cut {
        let scatter = self.scatter;
        let inputs = [self.mirrored_local(), self.ids.clone()];
        let place = Field::map(Type::Rgb, inputs, Halo::NONE, move |out: &mut Tile, [local, ids]: [&Tile; 2]| {
            scatter.places(ids.plane(0), [local.plane(0), local.plane(1)], &mut out.planes_mut());
            Ok(())
        });
        let mut ids = self.mirrored_ids();
        let (mut place, mut turned) = (place.overwriting(), self.turned().overwriting());
        let key = self.key();
        if let Some(key) = key {
            // Every solid that is cut reads the points, so they get a cache key.
            place = place.keyed(Key::of("piece points", &[key.as_bytes()]));
            turned = turned.keyed(Key::of("piece angles", &[key.as_bytes()]));
            if self.mirror.is_some() {
                ids = ids.keyed(Key::of("mirrored pieces", &[key.as_bytes()]));
            }
        }
        let mirrors = self.mirror.is_some();
        let axes = move |id: f32| {
            let (id, [x, y]) = if mirrors { decoded(id) } else { (id, [1.0; 2]) };
            let (piece, _) = scatter.piece(id);
            [x * piece.along, y * piece.across].map(|axis| axis.to_array().map(narrow))
        };
        let planes = Some(PiecePlanes { turned, axes: PieceAxes(Arc::new(axes)) });
        let spacing = |grid: &Grid| grid.step.max_element();
        Cut::new(key, place, spacing).with_pieces(PieceMap { ids, planes, holes: false })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_tell_how_pieces_are_mirrored() {
        for id in [0.0, 1.0, 77.0, 4_000_000.0] {
            for mirror in [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]] {
                let [x, y] = signs(mirror);
                assert_eq!(decoded(coded(id, [x, y])), (id, [f64::from(x), f64::from(y)]));
            }
        }
    }
}
