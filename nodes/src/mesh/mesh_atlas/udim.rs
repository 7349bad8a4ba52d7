//! Meshes whose UVs lie in several UDIM tiles.
use super::{ChartSource, advice};
use glam::{UVec2, Vec2};
use shibo_kernel::ground::stop::Watch;
use shibo_kernel::mesh::atlas::fits;
use shibo_kernel::mesh::udim::{FIRST, MOST, Tiles, number, place, tiles};
use shibo_node::choice;
use shibo_value::Mesh;
use shibo_value::diagnostics::{Code, Problem};
use std::collections::BTreeSet;

/// The UDIM tiles that the canvas holds.
#[choice]
pub enum Udim {
    /// All tiles from 1001 on that the mesh uses, side by side: 1001 lies at the lower left.
    #[default]
    Auto,
    /// One tile, by its number: 1001 to 2000. Other triangles have no place in the picture.
    Tile(u32),
    /// Numbers of tiles across and up, from 1001 on.
    Tiles(u32, u32),
}

/// Maximum number of tiles that a message names.
const NAMED: usize = 8;

/// The numbers of some tiles, in order.
fn named(tiles: &BTreeSet<u32>) -> String {
    let some: Vec<String> = tiles.iter().take(NAMED).map(u32::to_string).collect();
    format!("{}{}", some.join(", "), if tiles.len() > NAMED { ", …" } else { "" })
}

impl Udim {
    /// The problem for numbers that are not those of a tile.
    pub(super) fn fault(self) -> Option<Problem> {
        let last = number(MOST - 1);
        let message = match self {
            Self::Tile(n) if !(FIRST..=last).contains(&n) => {
                format!("tile is `{n}`; UDIM tiles are numbered from {FIRST} to {last}")
            }
            Self::Tiles(x, y) if UVec2::new(x, y).cmpgt(MOST).any() || x == 0 || y == 0 => {
                format!("tiles are `({x}, {y})`; there are 1 to {} across and 1 to {} up", MOST.x, MOST.y)
            }
            _ => return None,
        };
        Some(Problem::new(Code::BadValue, message).at("udim"))
    }

    /// The UVs of a mesh on the canvas, and advice about them. `aspect` is the width of the canvas divided by its
    /// height.
    pub(super) fn laid(
        self,
        mesh: &Mesh,
        aspect: f64,
        watch: &Watch<'_>,
    ) -> Result<(Vec<[Vec2; 3]>, Option<Problem>), Problem> {
        if self == Self::Auto && fits(&mesh.uvs) {
            return Ok((mesh.uvs.clone(), None));
        }
        let tiles = tiles(mesh, &mesh.uvs, watch).map_err(|error| advice::atlas(&error))?;
        let used: BTreeSet<u32> = tiles.iter().flatten().map(|tile| number(*tile)).collect();
        let all = tiles.iter().flatten().fold(UVec2::ONE, |all, tile| all.max(*tile + 1));
        let held = match self {
            Self::Auto => Tiles { first: UVec2::ZERO, count: all },
            Self::Tile(n) => Tiles { first: place(n), count: UVec2::ONE },
            Self::Tiles(x, y) => Tiles { first: UVec2::ZERO, count: UVec2::new(x, y) },
        };
        let is_held = |n: usize| tiles[n].is_none_or(|tile| held.has(tile));
        let first = (0..tiles.len()).find(|n| tiles[*n].is_some_and(|tile| held.has(tile)));
        let Some(first) = first else {
            let message = format!("no triangle lies in these UDIM tiles; the mesh uses {}", named(&used));
            return Err(Problem::new(Code::BadValue, message).at("udim"));
        };
        // A triangle in another tile, or without area, has no place in the picture: it shrinks to a point.
        let point = [held.at(mesh.uvs[first][0]); 3];
        let uv = |(n, uvs): (usize, &[Vec2; 3])| {
            if is_held(n) && tiles[n].is_some() { uvs.map(|uv| held.at(uv)) } else { point }
        };
        let uvs = mesh.uvs.iter().enumerate().map(uv).collect();
        Ok((uvs, self.told(held, aspect, &used)))
    }

    /// Advice if tiles are not square on the canvas, or if some used tiles are not on it.
    fn told(self, held: Tiles, aspect: f64, used: &BTreeSet<u32>) -> Option<Problem> {
        let beyond: BTreeSet<u32> = used.iter().copied().filter(|n| !held.has(place(*n))).collect();
        if !beyond.is_empty() && !matches!(self, Self::Tile(_)) {
            let message = format!("the UDIM tiles {} of the mesh are not on the canvas", named(&beyond));
            return Some(Problem::new(Code::Advice, message).at("udim").help("give more tiles, or `Auto`"));
        }
        let UVec2 { x, y } = held.count;
        let wanted = f64::from(x) / f64::from(y);
        if (aspect / wanted - 1.0).abs() < 0.01 {
            return None;
        }
        let message = format!(
            "the canvas holds {x} × {y} UDIM tiles (the mesh uses {}), and its sides are not {x} to {y}: texels are stretched",
            named(used)
        );
        let help = format!(
            "set `canvas.size_mm` and `resolution` to sides of {x} to {y}, or take one tile: `udim: Tile({})`",
            used.first()?
        );
        Some(Problem::new(Code::Advice, message).at("udim").help(help))
    }

    /// Advice about tiles that have no effect.
    pub(super) fn idle(self, charts: ChartSource) -> Option<Problem> {
        let made = matches!(charts, ChartSource::New | ChartSource::Repack);
        (made && self != Self::Auto).then(|| {
            let message = format!("`udim` does nothing: `charts: {charts:?}` lays charts out anew");
            Problem::new(Code::Advice, message).at("udim").help("leave it out")
        })
    }
}
