//! UDIM: UVs in several tiles, each of which is a picture.
//!
//! Tile 1001 is the unit square, 1002 lies to the right of it, up to 1010; 1011 lies above 1001. Cost: O(n).
use super::atlas::{AtlasError, SLACK, outside};
use super::charts::{charts, cross};
use super::topology;
use crate::ground::stop::Watch;
use glam::{DVec2, UVec2, Vec2};
use shibo_value::Mesh;

/// Maximum number of tiles horizontally, and vertically.
pub const MOST: UVec2 = UVec2::new(10, 100);
/// Number of the first tile.
pub const FIRST: u32 = 1001;

/// Column and row of a tile by its number, counted from 0, rows upwards.
pub const fn place(number: u32) -> UVec2 {
    let n = number.saturating_sub(FIRST);
    UVec2::new(n % MOST.x, n / MOST.x)
}

/// Number of a tile.
pub const fn number(tile: UVec2) -> u32 {
    FIRST + tile.x + MOST.x * tile.y
}

/// A rectangle of adjacent tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tiles {
    /// Column and row of the lower left tile.
    pub first: UVec2,
    /// Number of tiles horizontally, and vertically.
    pub count: UVec2,
}

impl Tiles {
    /// Maps a UV (v down from the upper end of tile 1001) to the rectangle as the unit square, v down.
    pub fn at(&self, uv: Vec2) -> Vec2 {
        let (first, count) = (self.first.as_dvec2(), self.count.as_dvec2());
        let p = uv.as_dvec2();
        (DVec2::new(p.x - first.x, p.y + first.y + count.y - 1.0) / count).as_vec2()
    }

    /// Returns whether a tile is in the rectangle.
    pub fn has(&self, tile: UVec2) -> bool {
        tile.cmpge(self.first).all() && tile.cmplt(self.first + self.count).all()
    }
}

/// The tile that contains a triangle; `None` if no tile does.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "compared with the corners afterwards")]
fn tile(uvs: &[Vec2; 3]) -> Option<UVec2> {
    let up = uvs.map(|uv| DVec2::new(f64::from(uv.x), 1.0 - f64::from(uv.y)));
    let middle = ((up[0] + up[1] + up[2]) / 3.0).floor();
    let slack = f64::from(SLACK);
    let inside = |p: &DVec2| {
        (*p - middle).cmpge(DVec2::splat(-slack)).all() && (*p - middle).cmple(DVec2::splat(1.0 + slack)).all()
    };
    let tile = UVec2::new(middle.x as u32, middle.y as u32);
    (up.iter().all(inside) && middle.cmpge(DVec2::ZERO).all() && tile.cmplt(MOST).all()).then_some(tile)
}

/// The tile of each triangle; `None` for those without area in it.
///
/// # Errors
/// Returns an error for UVs beyond all tiles, and for charts in several tiles, as in textures that repeat.
pub fn tiles(mesh: &Mesh, uvs: &[[Vec2; 3]], watch: &Watch<'_>) -> Result<Vec<Option<UVec2>>, AtlasError> {
    let mut tiles = Vec::with_capacity(uvs.len());
    for uvs_of in watch.over(uvs) {
        let flat = cross(*uvs_of) == 0.0;
        let found = tile(uvs_of);
        if found.is_none() && !flat {
            return Err(outside(uvs));
        }
        tiles.push(found.filter(|_| !flat));
    }
    let across = topology::watched(&mesh.triangles, watch).across;
    let charts = charts(uvs, &across, watch);
    let mut of_chart = vec![None; charts.count];
    for (chart, tile) in charts.of.iter().zip(&tiles) {
        let of = &mut of_chart[*chart as usize];
        if tile.is_some() && of.is_some() && of != tile {
            return Err(outside(uvs));
        }
        *of = of.or(*tile);
    }
    Ok(tiles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples;

    #[test]
    fn numbers_tiles_as_in_standard() {
        for (n, x, y) in [(1001, 0, 0), (1002, 1, 0), (1010, 9, 0), (1011, 0, 1), (1022, 1, 2), (2000, 9, 99)] {
            assert_eq!((place(n), number(UVec2::new(x, y))), (UVec2::new(x, y), n));
        }
    }

    #[test]
    fn tiles_are_laid_out_from_the_lower_left() {
        let all = Tiles { first: UVec2::ZERO, count: UVec2::new(2, 3) };
        // The upper left corner of 1001, the middle of 1022, the lower right corner of 1002.
        assert_eq!(all.at(Vec2::ZERO), Vec2::new(0.0, 2.0 / 3.0));
        assert_eq!(all.at(Vec2::new(1.5, -1.5)), Vec2::new(0.75, 0.5 / 3.0));
        assert_eq!(all.at(Vec2::new(2.0, 1.0)), Vec2::ONE);
        let one = Tiles { first: UVec2::new(1, 2), count: UVec2::ONE };
        assert_eq!(one.at(Vec2::new(1.25, -1.25)), Vec2::new(0.25, 0.75));
        let square = Tiles { first: UVec2::ZERO, count: UVec2::ONE };
        assert_eq!(square.at(Vec2::new(0.3, 0.7)), Vec2::new(0.3, 0.7));
    }

    #[test]
    fn charts_lie_in_one_tile_each() {
        let cube = samples::cube();
        let moved = |by: &dyn Fn(usize) -> Vec2| -> Vec<[Vec2; 3]> {
            cube.uvs.iter().enumerate().map(|(n, uvs)| uvs.map(|uv| uv + by(n / 2))).collect()
        };
        // A side of the cube is a chart of two triangles.
        let found = tiles(&cube, &moved(&|side| Vec2::new(side as f32, -2.0 * side as f32)), &Watch::never()).unwrap();
        for (n, tile) in found.iter().enumerate() {
            let side = u32::try_from(n / 2).unwrap();
            assert_eq!(*tile, Some(UVec2::new(side, 2 * side)));
        }
        for by in [Vec2::new(0.3, 0.0), Vec2::new(-1.0, 0.0), Vec2::new(0.0, 1.0), Vec2::new(10.0, 0.0), Vec2::NAN] {
            let refused = tiles(&cube, &moved(&|_| by), &Watch::never());
            assert!(matches!(refused, Err(AtlasError::Outside { .. })), "{by}");
        }
        // A sheet of two quads, cut exactly between two tiles: no triangle crosses, but the chart does.
        let sheet = samples::plane_one();
        let twice: Vec<[Vec2; 3]> = sheet.uvs.iter().map(|uvs| uvs.map(|uv| (uv - 0.25) * 4.0 - Vec2::Y)).collect();
        assert!(twice.iter().all(|uvs| tile(uvs).is_some()));
        assert!(tiles(&sheet, &twice, &Watch::never()).is_err());
    }
}
