//! [`CutPlane`]: a plane through a solid.
//!
//! Source: Momoi & Takatera 2014, §4.1, §4.2, §5.1 (rows B26–B28, B30). Beyond the source: pieces, each cut from
//! another place, see [`kernel::pieces`](shibo_kernel::wood::pieces). Cost: that of the solid plus about 1 ns a pixel,
//! with pieces about 3 ns.
use super::cut_pieces::CutPieces;
use super::trees::{Triple, vector};
use crate::chosen::Chosen;
use crate::degrees::about;
use crate::normals::normals;
use crate::shown::{shown_by, shown_channels, with_normals};
use glam::DVec3;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::simd::dispatch;
use shibo_kernel::wood::pieces::{Scatter, WoodPiece};
use shibo_node::{
    CanvasFacts, Context, Fact, Gray, IdsField, In, InSpace, MaterialInputs, Node, Output, Outputs, SolidOrMaterial,
    Vec2Field, choice, node,
};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Channel, ChannelSet, Cut, Field, Key, Solid, SolidMaterial, Stop, Tile, Tiling, Type, Value};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Ways of cutting a board from a trunk that stands on the z axis.
#[choice]
pub enum Sawing {
    /// Defined by `origin`, `u` and `v`.
    #[default]
    Given,
    /// Tangential (板目): at `distance` from the pith, with the length along the trunk to the right. Rings form
    /// cathedrals.
    FlatSawn,
    /// Radial (柾目): starting at `distance` from the pith and leading away from it, with the length along the trunk to
    /// the right. Rings form stripes.
    QuarterSawn,
    /// Across the trunk, with the middle at `distance` from the pith. Rings show as circles.
    EndGrain,
}

/// Cuts a solid with a plane: the canvas shows P = origin + (x / width) · u + (y / height) · v.
///
/// A material of solids, as `Material` makes of a wood, is cut with all its channels: colours, roughness, height, fibres.
/// The cut gets the normal of its height; a normal of the material, such as the tilt of fibres, lies on it as detail.
///
/// With `local` and `ids`, which `Brick`, `Hex`, `FloodFill` and other nodes give, the node cuts **pieces**: boards,
/// blocks, veneers. Each piece is cut from another place of the tree. Its middle lies within `spread` of `origin`, or,
/// with a preset, of the point given by `distance`, `offset` and `height`; `local.x` runs along u, or along the board.
/// `turn` and `flip` turn each piece separately. Cuts with the same pieces and the same `seed` agree with each other.
/// If pieces are rotated on the canvas, connect their `angle` too. With `others` every piece is cut from one of several
/// trees. `mirror` turns pieces over like the pages of a book (book-matching).
///
/// ```ron
/// "nodes": TrunkNodes(height: (-2000, 2000), count: 21, wander: 9),
/// "tree": FitSkeleton(curve: "nodes"),
/// "time": TrunkTime(tree: "tree"),
/// "rings": ColorPattern(),
/// "wood": RingColor(time: "time", pattern: "rings"),
/// "floor": Brick(layout: Herringbone, size: (19.8, 3.8), gap: 0.2),
/// "boards": CutPlane(solid: "wood", preset: FlatSawn, distance: 30, local: "floor.local", ids: "floor.ids",
///   angle: "floor.angle", spread: (20, 20, 1500), turn: (30, 2), flip: true),
/// "example": Blend(base: "boards", top: "#1c120b", mask: "floor.gap"),
/// ```
///
/// Elsewhere: Houdini *Attribute from Map* on fractured pieces; Blender *Mapping* by a random number of each island.
#[node]
pub struct CutPlane {
    /// Solid, or material of solids, to cut.
    pub solid: In<InSpace>,
    /// For pieces: more trees. Each piece is cut from `solid` or one of these, chosen at random with equal chances;
    /// parts that do not show are not computed. Cuts with the same number of trees in the same order agree with each
    /// other.
    #[schemars(extend("optional" = true))]
    pub others: Vec<In<InSpace>>,
    /// Way of cutting the board from the trunk.
    #[default(Sawing::Given)]
    pub preset: Sawing,
    /// For `Given`: the point at the canvas' upper left corner.
    #[schemars(extend("minimum" = -1e7, "maximum" = 1e7, "unit" = "mm"))]
    pub origin: Triple,
    /// For `Given`: the vector from there to the upper right corner; (width of the canvas, 0, 0) if not given.
    #[schemars(extend("minimum" = -1e7, "maximum" = 1e7, "unit" = "mm"))]
    pub u: Option<Triple>,
    /// For `Given`: the vector from `origin` to the lower left corner; (0, 0, height of the canvas) if not given.
    #[schemars(extend("minimum" = -1e7, "maximum" = 1e7, "unit" = "mm"))]
    pub v: Option<Triple>,
    /// For the other presets: the distance from the pith.
    #[schemars(range(min = -1e5, max = 1e5), extend("unit" = "mm"))]
    #[default(40.0)]
    pub distance: f64,
    /// For the other presets: shift of the board in the other horizontal direction.
    #[schemars(range(min = -1e5, max = 1e5), extend("unit" = "mm"))]
    pub offset: f64,
    /// For the other presets: the height in the trunk at which the board starts.
    #[schemars(range(min = -1e5, max = 1e6), extend("unit" = "mm"))]
    pub height: f64,
    /// For the other presets: rotation of the board about the vertical through its middle; a few degrees away from a
    /// quarter cut change much.
    #[schemars(range(min = -180, max = 180), extend("unit" = "°"))]
    pub yaw: f64,
    /// For the other presets: the angle between the board's length and that of the trunk.
    #[schemars(range(min = -90, max = 90), extend("unit" = "°"))]
    pub pitch: f64,
    /// For the other presets: true if the length runs down the canvas instead of to the right.
    pub upright: bool,
    /// For pieces: the place within the piece, in mm from its middle, along it and across it.
    pub local: Option<In<Vec2Field>>,
    /// For pieces: their numbers.
    pub ids: Option<In<IdsField>>,
    /// For pieces: the angle of `local.x` on the canvas in degrees, from +x towards +y. If not given, the angle is
    /// derived from `local`, which is less exact for pieces that are neither horizontal nor vertical.
    pub angle: Option<In<Gray>>,
    /// For pieces: largest random shift of their middles, either way, in x, y and z of the solid.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1e6, "unit" = "mm"))]
    pub spread: Triple,
    /// For pieces: largest random rotation, either way: like `yaw`, and like `pitch`.
    #[schemars(extend("minimum" = 0.0, "maximum" = 180.0, "unit" = "°"))]
    pub turn: (f64, f64),
    /// For pieces: true to turn half of them, at random, end for end.
    pub flip: bool,
    /// A component above ½ mirrors the cut: x left to right, y top to bottom. For pieces: it mirrors each
    /// piece along it (x) and across it (y), about its middle; one value for the whole piece, as in `"= (0, floor(x /
    /// 90) % 2)"`.
    pub mirror: Option<In<Vec2Field>>,
    /// For pieces: another seed cuts them from other places.
    pub seed: u64,
}

/// A plane: the point at the canvas' upper left corner, and the vectors to the upper right and the lower left corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlaneInSolid {
    pub(super) origin: DVec3,
    pub(super) u: DVec3,
    pub(super) v: DVec3,
}

impl PlaneInSolid {
    /// The plane seen in a mirror, where a component of `mirror` is above ½.
    fn mirrored(self, mirror: Option<&Field>) -> Result<Self, Stop> {
        let Some(mirror) = mirror else { return Ok(self) };
        let Some(&[x, y]) = mirror.as_constant() else {
            let message = "`mirror` differs from place to place, but the cut has no pieces";
            let help = "write `mirror: (1, 0)`, or connect `local` and `ids`";
            return Err(Problem::new(Code::BadValue, message).at("mirror").help(help).into());
        };
        let Self { mut origin, mut u, mut v } = self;
        if x > 0.5 {
            (origin, u) = (origin + u, -u);
        }
        if y > 0.5 {
            (origin, v) = (origin + v, -v);
        }
        Ok(Self { origin, u, v })
    }

    /// The cut of this plane on a canvas of `size` mm.
    pub(super) fn cut(self, size: glam::DVec2) -> Cut {
        let Self { origin, u, v } = self;
        let numbers = [origin, u, v].map(|p| p.to_array()).concat();
        let bytes: Vec<u8> =
            numbers.iter().chain(&size.to_array()).flat_map(|n| (n + 0.0).to_bits().to_le_bytes()).collect();
        let (right, down) = (u / size.x, v / size.y);
        let place = Field::generate(Type::Rgb, Tiling::NONE, move |out: &mut Tile, _| {
            let (grid, window) = (out.grid, out.window);
            let width = out.width();
            // Computed from the numbers of pixels, so that any window gives the same bits.
            let columns = (0..width).map(|i| grid.origin.x + (f64::from(window.x) + i as f64 + 0.5) * grid.step.x);
            let columns: Vec<f64> = columns.collect();
            dispatch(
                #[inline(always)]
                || {
                    for (axis, plane) in out.planes_mut().into_iter().enumerate() {
                        for (row, line) in plane.chunks_exact_mut(width.max(1)).enumerate() {
                            let y = grid.center(0, window.y.saturating_add_unsigned(count(row))).y;
                            let (from, right) = (origin[axis] + down[axis] * y, right[axis]);
                            line.iter_mut().zip(&columns).for_each(|(value, x)| *value = single(from + right * x));
                        }
                    }
                },
            );
            Ok(())
        });
        let place = place.overwriting();
        let spacing = move |grid: &shibo_value::Grid| (right.length() * grid.step.x).max(down.length() * grid.step.y);
        let unit = |v: DVec3| v.normalize().to_array().map(single);
        Cut::new(Key::of("plane", &[&bytes]), place, spacing).with_level_rows(u.z == 0.0).with_flat(unit(u), unit(v))
    }
}

fn count(row: usize) -> u32 {
    u32::try_from(row).unwrap_or(u32::MAX)
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
const fn single(v: f64) -> f32 {
    v as f32
}

impl CutPlane {
    fn plane(&self, size: glam::DVec2) -> PlaneInSolid {
        let (w, h) = (size.x, size.y);
        let (long, wide) = if self.upright { (h, w) } else { (w, h) };
        // The middle of the board, and the directions of its length and breadth.
        let (middle, length, breadth) = match self.preset {
            Sawing::Given => {
                let u = self.u.map_or(DVec3::new(w, 0.0, 0.0), vector);
                let v = self.v.map_or(DVec3::new(0.0, 0.0, h), vector);
                return PlaneInSolid { origin: vector(self.origin), u, v };
            }
            Sawing::FlatSawn => {
                (DVec3::new(self.offset, self.distance, self.height + 0.5 * long), DVec3::Z * long, DVec3::X * wide)
            }
            Sawing::QuarterSawn => {
                let middle = DVec3::new(self.distance + 0.5 * wide, self.offset, self.height + 0.5 * long);
                (middle, DVec3::Z * long, DVec3::X * wide)
            }
            Sawing::EndGrain => (DVec3::new(self.offset, self.distance, self.height), DVec3::X * long, DVec3::Y * wide),
        };
        let [length, breadth] = self.turned(length, breadth);
        let (u, v) = if self.upright { (breadth, length) } else { (length, breadth) };
        PlaneInSolid { origin: middle - 0.5 * u - 0.5 * v, u, v }
    }

    /// The directions of a board's length and breadth, turned by `yaw` and `pitch`.
    fn turned(&self, length: DVec3, breadth: DVec3) -> [DVec3; 2] {
        if self.yaw == 0.0 && self.pitch == 0.0 {
            return [length, breadth];
        }
        let turn = about(DVec3::Z, self.yaw) * about(breadth.normalize(), self.pitch);
        [turn * length, turn * breadth]
    }

    /// The random placement of pieces in the solid.
    fn scatter(&self, size: glam::DVec2, hash: Hash) -> Scatter {
        let (distance, offset, height) = (self.distance, self.offset, self.height);
        let (middle, length, breadth) = match self.preset {
            Sawing::Given => {
                let PlaneInSolid { origin, u, v } = self.plane(size);
                (origin, u.normalize_or(DVec3::X), v.normalize_or(DVec3::Z))
            }
            Sawing::FlatSawn => (DVec3::new(offset, distance, height), DVec3::Z, DVec3::X),
            Sawing::QuarterSawn => (DVec3::new(distance, offset, height), DVec3::Z, DVec3::X),
            Sawing::EndGrain => (DVec3::new(offset, distance, height), DVec3::X, DVec3::Y),
        };
        let given = self.preset == Sawing::Given;
        let [length, breadth] = if given { [length, breadth] } else { self.turned(length, breadth) };
        let (along, across) = if self.upright && !given { (breadth, length) } else { (length, breadth) };
        Scatter {
            from: WoodPiece { middle, along, across },
            tilt: breadth,
            spread: vector(self.spread),
            turn: [self.turn.0, self.turn.1],
            flip: self.flip,
            hash,
        }
    }

    /// True if a parameter makes pieces differ.
    fn scatters(&self) -> bool {
        !self.others.is_empty()
            || self.spread != (0.0, 0.0, 0.0)
            || self.turn != (0.0, 0.0)
            || self.flip
            || self.angle.is_some()
    }
}

/// The solids, or the materials, that pieces are cut from.
enum Trees<'a> {
    Solids(Vec<&'a Solid>),
    Materials(Vec<&'a Arc<SolidMaterial>>),
}

fn trees_of(trees: &[SolidOrMaterial]) -> Result<Trees<'_>, Stop> {
    let solids: Vec<_> = trees
        .iter()
        .filter_map(|tree| if let SolidOrMaterial::Solid(solid) = tree { Some(solid) } else { None })
        .collect();
    let materials: Vec<_> = trees
        .iter()
        .filter_map(|tree| if let SolidOrMaterial::Material(material) = tree { Some(material) } else { None })
        .collect();
    match (solids.is_empty(), materials.is_empty()) {
        (_, true) => Ok(Trees::Solids(solids)),
        (true, _) => Ok(Trees::Materials(materials)),
        _ => {
            let message = "`solid` and `others` are solids and materials; they must all be solids, or all materials";
            Err(Problem::new(Code::TypeMismatch, message).at("others").into())
        }
    }
}

impl Node for CutPlane {
    const OUTPUTS: &'static [Output] = &[
        Output::like(
            "value",
            &["solid", "others"],
            "What the plane shows: of a solid a field, of a material all channels.",
        ),
        Output::new("place", Type::Rgb, "Where the middle of the piece was cut: x, y and z.").in_unit("mm"),
        Output::new(
            "turned",
            Type::Rgb,
            "By how much the piece was turned by chance: yaw, pitch, and 180 if end for end.",
        )
        .in_unit("°"),
        Output::new("tree", Type::Gray, "Which tree the piece is from: 0 is `solid`, 1 the first of `others`."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let mut problems = Vec::new();
        let plane = self.plane(canvas.size_mm());
        if plane.u.cross(plane.v).length() <= 1e-12 * plane.u.length() * plane.v.length() {
            let message = "u and v point the same way; they must span a plane";
            problems.push(Problem::new(Code::BadValue, message).at("v"));
        }
        let missing = |this: &'static str, other: &'static str| {
            let message = format!("`{this}` is given without `{other}`; pieces need both");
            let help = format!("connect the output `{other}` of the node that gives `{this}`");
            Problem::new(Code::MissingInput, message).at(this).help(help)
        };
        match (&self.local, &self.ids) {
            (Some(_), None) => problems.push(missing("local", "ids")),
            (None, Some(_)) => problems.push(missing("ids", "local")),
            _ => {}
        }
        problems
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.ids.is_some() || !self.scatters() {
            return Vec::new();
        }
        let message = "`spread`, `turn`, `flip`, `angle` and `others` have no effect without pieces";
        vec![Problem::new(Code::Advice, message).help("connect `local` and `ids`, as `Brick` gives them")]
    }

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        if self.ids.is_some() { Tiling::BOTH } else { Tiling::NONE }
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        shown_channels(inputs.at("solid").union(inputs.at("others")))
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (size, solid, mirror) = (cx.size_mm(), cx.get(&self.solid)?, cx.get_opt(&self.mirror)?);
        if let (Some(local), Some(ids)) = (cx.get_opt(&self.local)?, cx.get_opt(&self.ids)?) {
            let scatter = self.scatter(size, Hash::new(cx.seed(self.seed)));
            let pieces = CutPieces { local, ids, angle: cx.get_opt(&self.angle)?, mirror, scatter };
            let place = pieces.each(|piece, _| piece.middle.to_array());
            let turned = pieces.each(|_, turned| *turned);
            let count = 1 + self.others.len();
            let cut = pieces.cut();
            let trees = [vec![solid], cx.get_all(&self.others)?].concat();
            let one_of = |solids: Vec<&Solid>| {
                let mut shown: Vec<Field> = solids.into_iter().map(|solid| cx.cut(solid, &cut)).collect();
                if shown.iter().any(|field| field.ty() == Type::Rgb) {
                    shown.iter_mut().for_each(|field| *field = field.to_rgb());
                }
                Chosen::field(&pieces.ids, shown, move |id| scatter.tree(id, count))
            };
            let value = match trees_of(&trees)? {
                Trees::Solids(solids) => Value::Field(one_of(solids)),
                Trees::Materials(materials) => {
                    let all = |material: &&Arc<SolidMaterial>| material.channels().to_vec();
                    let channels: BTreeSet<Channel> =
                        materials.iter().flat_map(all).map(|(channel, _)| channel).collect();
                    let shown = channels.into_iter().map(|channel| {
                        let solids: Vec<Solid> =
                            materials.iter().map(|material| material.or_default(channel)).collect();
                        (channel, one_of(solids.iter().collect()))
                    });
                    with_normals(shown.collect(), normals).into()
                }
            };
            let tree = pieces.tree(count);
            return Ok(Outputs::one(value).with("place", place).with("turned", turned).with("tree", tree));
        }
        let plane = self.plane(size).mirrored(mirror.as_ref())?;
        let middle = (plane.origin + 0.5 * (plane.u + plane.v)).to_array().map(single);
        Ok(Outputs::one(shown_by(cx, &solid, &plane.cut(size)))
            .with("place", Field::constant(Type::Rgb, &middle))
            .with("turned", Field::constant(Type::Rgb, &[0.0; 3]))
            .with("tree", Field::constant(Type::Gray, &[0.0])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn plane(cut: &CutPlane) -> (DVec3, DVec3, DVec3) {
        let PlaneInSolid { origin, u, v } = cut.plane(DVec2::new(200.0, 80.0));
        (origin, u, v)
    }

    fn close(a: DVec3, b: DVec3) {
        assert!(a.distance(b) < 1e-9, "{a} is not {b}");
    }

    #[test]
    fn presets_place_cuts_in_the_trunk() {
        let cut = |preset| CutPlane { preset, distance: 30.0, offset: 5.0, height: 700.0, ..CutPlane::default() };
        // Tangential: the whole cut lies 30 mm in front of the pith, the trunk's length to the right.
        let (origin, u, v) = plane(&cut(Sawing::FlatSawn));
        close(origin, DVec3::new(5.0 - 40.0, 30.0, 700.0));
        close(u, DVec3::Z * 200.0);
        close(v, DVec3::X * 80.0);
        // Radial: away from the pith.
        let (origin, u, v) = plane(&cut(Sawing::QuarterSawn));
        close(origin, DVec3::new(30.0, 5.0, 700.0));
        close(u, DVec3::Z * 200.0);
        close(v, DVec3::X * 80.0);
        // Across: horizontal.
        let (origin, u, v) = plane(&cut(Sawing::EndGrain));
        close(origin, DVec3::new(5.0 - 100.0, 30.0 - 40.0, 700.0));
        close(u, DVec3::X * 200.0);
        close(v, DVec3::Y * 80.0);
        // Upright: the length down the canvas.
        let (_, u, v) = plane(&CutPlane { upright: true, ..cut(Sawing::FlatSawn) });
        close(u, DVec3::X * 200.0);
        close(v, DVec3::Z * 80.0);
    }

    #[test]
    fn boards_turn_about_their_middles() {
        for preset in [Sawing::FlatSawn, Sawing::QuarterSawn] {
            let cut = |yaw, pitch| CutPlane { preset, distance: 30.0, yaw, pitch, ..CutPlane::default() };
            let middle = |(origin, u, v): (DVec3, DVec3, DVec3)| origin + 0.5 * (u + v);
            let straight = plane(&cut(0.0, 0.0));
            let turned = plane(&cut(90.0, 0.0));
            close(middle(turned), middle(straight));
            // A rotation about the vertical: the length stays, the breadth turns from x to y.
            close(turned.1, straight.1);
            close(turned.2, DVec3::Y * 80.0);
            let tilted = plane(&cut(0.0, 10.0));
            close(middle(tilted), middle(straight));
            close(tilted.2, straight.2);
            let lean = tilted.1.angle_between(DVec3::Z).to_degrees();
            assert!((lean - 10.0).abs() < 1e-9 && (tilted.1.length() - 200.0).abs() < 1e-9, "{lean}");
        }
    }
}
