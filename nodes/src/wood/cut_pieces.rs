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
    pub(super) scatter: Scatter,
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
        Some(Key::of("pieces", &parts))
    }

    /// The cut. Cuts with the same pieces share the fields that they read.
    pub(super) fn cut(&self) -> Cut {
        let scatter = self.scatter;
        let inputs = [self.local.clone(), self.ids.clone()];
        let place = Field::map(Type::Rgb, inputs, Halo::NONE, move |out: &mut Tile, [local, ids]: [&Tile; 2]| {
            scatter.places(ids.plane(0), [local.plane(0), local.plane(1)], &mut out.planes_mut());
            Ok(())
        });
        let (mut place, mut turned) = (place.overwriting(), self.turned().overwriting());
        let key = self.key();
        if let Some(key) = key {
            // Every solid that is cut reads the points, so they get a cache key.
            place = place.keyed(Key::of("piece points", &[key.as_bytes()]));
            turned = turned.keyed(Key::of("piece angles", &[key.as_bytes()]));
        }
        let axes = move |id: f32| {
            let (piece, _) = scatter.piece(id);
            [piece.along, piece.across].map(|axis| axis.to_array().map(narrow))
        };
        let planes = Some(PiecePlanes { turned, axes: PieceAxes(Arc::new(axes)) });
        let spacing = |grid: &Grid| grid.step.max_element();
        Cut::new(key, place, spacing).with_pieces(PieceMap { ids: self.ids.clone(), planes, holes: false })
    }
}
