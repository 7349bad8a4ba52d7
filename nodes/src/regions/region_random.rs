//! [`RegionRandom`]: a random number, colour and vector for every piece.
//!
//! Computed as hashes of the numbers of pieces. Cost: O(pixels).
use super::region_coordinates::hash_of;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::region::pieces::runs;
use shibo_node::{Context, Fact, IdsField, In, Node, Output, Outputs, Range, node};
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// A random number for each piece, the same at all its pixels: tones of boards, heights of stones, a choice of red
/// leaves.
///
/// It depends only on the number of the piece, so a piece keeps its random number when other pieces change. Number 0,
/// such as the ground of `FloodFill`, is a piece like any other.
///
/// ```ron
/// "floor": Brick(layout: BasketWeave, size: (9.8, 4.8), gap: 0.2),
/// "tone": RegionRandom(ids: "floor.ids", range: (0.4, 1)),
/// "wood": GradientMap(input: "tone", stops: [(0.4, "#4a2f1c"), (1, "#b98a58")]),
/// "example": Blend(base: "wood", top: "#14100c", mask: "floor.gap"),
/// ```
///
/// Elsewhere: Substance Designer *Flood Fill to Random Grayscale*, *Flood Fill to Random Color*; Material Maker *Fill
/// to Random Gray*, *Fill to Random Color*; Blender *Random per Island*.
#[node]
pub struct RegionRandom {
    /// The numbers of the pieces.
    pub ids: In<IdsField>,
    /// Smallest and largest value.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    #[default(Range::new(0.0, 1.0))]
    pub range: Range,
    /// Another seed gives other values.
    pub seed: u64,
}

impl Node for RegionRandom {
    const OUTPUTS: &'static [Output] = &[
        Output::new("value", Type::Gray, "The number of each piece."),
        Output::new("color", Type::Rgb, "Three numbers of each piece; the first is `value`."),
        Output::new("vector", Type::Vec2, "Two more numbers of each piece."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Seed];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let ids = cx.get(&self.ids)?;
        let (hash, lo, more) = (Hash::new(cx.seed(self.seed)), self.range.lo, self.range.hi - self.range.lo);
        let field = |ty: Type, first: u64| {
            Field::map(ty, [ids.clone()], Halo::NONE, move |out: &mut Tile, [ids]: [&Tile; 1]| {
                let ids = ids.plane(0);
                let mut planes = out.planes_mut();
                runs(ids, |from, to| {
                    let piece = hash_of(hash, ids[from]);
                    for (plane, k) in planes.iter_mut().zip(first..) {
                        plane[from..to].fill(narrow(lo + more * piece.unit(k)));
                    }
                });
                Ok(())
            })
        };
        Ok(Outputs::one(field(Type::Gray, 0)).with("color", field(Type::Rgb, 0)).with("vector", field(Type::Vec2, 3)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::stand_in::slabs;
    use super::*;
    use crate::conform::{conforms, pairs};
    use crate::testing::{field, port};

    #[test]
    fn every_piece_has_one_number() {
        let node = RegionRandom { ids: port(0), range: Range::new(2.0, 3.0), ..RegionRandom::default() };
        conforms(&node, &[slabs().into()]);
        let pairs = pairs(&slabs(), &field(&node, &[slabs().into()]));
        let mut seen = [None; 4];
        for (id, value) in pairs {
            assert!((2.0..3.0).contains(&value));
            let known = [0.0, 1.0, 2.0, 3.0].iter().position(|known| *known == id).unwrap();
            assert_eq!(*seen[known].get_or_insert(value), value);
        }
        let mut values = seen.map(|v| v.unwrap());
        values.sort_by(f32::total_cmp);
        assert!(values.windows(2).all(|v| v[0] < v[1]), "{values:?}");
    }
}
