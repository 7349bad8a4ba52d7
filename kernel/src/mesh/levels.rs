//! Neighbours of pixels of an atlas on the surface: the indirection maps of the source (rows C24, C25).
//!
//! At each level, paths of one pixel lead from the pixels near a border of a chart in all eight directions. At the end
//! of a path, a pixel of the chart there represents the point. The offset of the point from the pixel's centre is kept
//! as a residue, since the pixels of two charts are not aligned; the source keeps whole pixels only. Pointers belong to
//! a pixel and a direction, so charts may touch. Cost: O(border pixels), about 0.3 µs for each path.
use super::raster::{Raster, inside};
use super::sites::Sites;
use super::walk::walk;
use crate::ground::number::index_u32;
use crate::ground::stop::Until;
use crate::ground::window::OCTANTS;
use glam::DVec2;
use rayon::prelude::*;
use shibo_value::{Atlas, IndirectionLevel, IndirectionMap, Jump, Jump8, Parent};
use std::sync::Arc;

/// Settings of an indirection map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelsSpec<'a> {
    /// Columns and rows of the finest level.
    pub size: [u32; 2],
    /// Number of levels.
    pub levels: u32,
    /// True if residues are kept; without them the pointers are those of the source.
    pub exact: bool,
    /// Width of the listed ring around charts, in pixels.
    pub ring: u32,
    /// Edges, as triangle and `k`, at which the surface ends, from both sides: those where combed frames turn (S-21).
    pub ends: &'a [(usize, usize)],
}

/// A copy of the atlas whose surface ends at some edges too.
fn ended(atlas: &Atlas, ends: &[(usize, usize)]) -> Atlas {
    let mut atlas = atlas.clone();
    for &(triangle, k) in ends {
        atlas.across[triangle][k] = Atlas::END;
        atlas.inner[triangle] &= !(1 << k);
    }
    atlas
}

/// Builds the indirection map of an atlas. If stopped, the result must not be used.
pub fn indirection(atlas: &Arc<Atlas>, spec: &LevelsSpec<'_>, until: Until<'_>) -> IndirectionMap {
    let ended = (!spec.ends.is_empty()).then(|| ended(atlas, spec.ends));
    let raster = |l: u32| Raster { atlas: ended.as_ref().unwrap_or(atlas), finest: spec.size, h: 1 << l };
    let rasters: Vec<Raster<'_>> = (0..spec.levels).map(raster).collect();
    let owners: Vec<Vec<u32>> = rasters.iter().map(Raster::owners).collect();
    let near: Vec<Vec<u8>> = rasters.par_iter().map(Raster::near).collect();
    let sites: Vec<Sites<'_>> =
        (0..rasters.len()).into_par_iter().map(|l| Sites::new(rasters[l], &owners[l], &near[l])).collect();
    let made: Vec<IndirectionLevel> = (0..sites.len())
        .map(|l| if until() { IndirectionLevel::default() } else { level(&sites[l], sites.get(l + 1), spec.ring) })
        .collect();
    drop(sites);
    let levels = made.into_iter().zip(owners).map(|(mut level, mut owner)| {
        level.border.iter().for_each(|&pixel| owner[pixel as usize] |= IndirectionLevel::BORDER);
        if !spec.exact {
            level.jumps.as_flattened_mut().iter_mut().for_each(|jump| jump.residue = [0; 2]);
            level.parents.iter_mut().for_each(|parent| parent.jump.residue = [0; 2]);
            level.ring.iter_mut().for_each(|(_, jump)| jump.residue = [0; 2]);
        }
        IndirectionLevel { owner, ..level }
    });
    IndirectionMap { atlas: Arc::clone(atlas), size: spec.size, levels: levels.collect() }
}

/// Builds a level, without its owners.
fn level(sites: &Sites<'_>, coarser: Option<&Sites<'_>>, ring: u32) -> IndirectionLevel {
    let size = sites.raster.size();
    let is_border = |&p: &usize| sites.near[p] > 0 && sites.owner[p] > 0;
    let border: Vec<u32> = (0..sites.owner.len()).filter(is_border).map(index_u32).collect();
    let jumps = border.par_iter().with_min_len(64).map(|&pixel| jumps(sites, pixel as usize)).collect();
    let mut rows = vec![0u32; size[1] as usize + 1];
    border.iter().for_each(|pixel| rows[(pixel / size[0]) as usize + 1] += 1);
    for row in 1..rows.len() {
        rows[row] += rows[row - 1];
    }
    let parents = coarser.map_or_else(Vec::new, |coarser| {
        let pixels = (0..sites.owner.len()).into_par_iter().with_min_len(1024);
        pixels.filter_map(|pixel| parent(sites, coarser, pixel)).collect()
    });
    let ring = if ring > 0 { ring_of(sites, i64::from(ring)) } else { Vec::new() };
    IndirectionLevel { h: sites.raster.h, size, owner: Vec::new(), border, jumps, rows, parents, ring }
}

/// The eight neighbours of a pixel.
fn jumps(sites: &Sites<'_>, pixel: usize) -> Jump8 {
    let Sites { raster, owner, near, .. } = sites;
    let size = raster.size().map(u32::cast_signed);
    let (x, y) = (i64::from(index_u32(pixel)) % i64::from(size[0]), i64::from(index_u32(pixel)) / i64::from(size[0]));
    let triangle = owner[pixel] as usize - 1;
    let chart = raster.atlas.charts[triangle];
    let free = near[pixel] < 2;
    OCTANTS.map(|[dx, dy]| {
        let beside = inside(x + i64::from(dx), y + i64::from(dy), size);
        if let Some(to) = beside.filter(|&to| free && sites.is_of(to, chart)) {
            return Jump { to: index_u32(to), residue: [0; 2] };
        }
        let d = DVec2::new(f64::from(dx), f64::from(dy)) * raster.step();
        let way = walk(raster.atlas, raster.spot(triangle, pixel), d);
        way.map_or(Jump::NONE, |way| sites.jump(way.spot))
    })
}

/// The parent of a pixel, if it is not simply the coarser pixel around it.
fn parent(sites: &Sites<'_>, coarser: &Sites<'_>, pixel: usize) -> Option<Parent> {
    let triangle = sites.owner[pixel].checked_sub(1)? as usize;
    let (w, across) = (sites.raster.size()[0] as usize, coarser.raster.size()[0] as usize);
    let around = pixel / w / 2 * across + pixel % w / 2;
    let chart = sites.raster.atlas.charts[triangle];
    let own = coarser.is_of(around, chart);
    if own && coarser.near[around] < 3 {
        return None;
    }
    let spot = sites.raster.spot(triangle, pixel);
    let way = walk(sites.raster.atlas, spot, coarser.raster.center(around) - spot.uv);
    let (jump, still) = match way {
        Some(way) => (coarser.jump(way.spot), false),
        None => (coarser.jump(spot), true),
    };
    let plain = own && !still && jump == Jump { to: index_u32(around), residue: [0; 2] };
    (!plain).then_some(Parent { pixel: index_u32(pixel), jump, still })
}

/// Pointers of the pixels outside charts, within `reach` of one: the path from the nearest pixel of a chart leads
/// there.
fn ring_of(sites: &Sites<'_>, reach: i64) -> Vec<(u32, Jump)> {
    let size = sites.raster.size().map(u32::cast_signed);
    let w = sites.raster.size()[0] as usize;
    let found = |pixel: usize| -> Option<(u32, Jump)> {
        if sites.owner[pixel] > 0 {
            return None;
        }
        let (x, y) = (i64::try_from(pixel % w).ok()?, i64::try_from(pixel / w).ok()?);
        let mut best: Option<(i64, usize)> = None;
        for (dx, dy) in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy))) {
            let distance = dx * dx + dy * dy;
            let Some(near) = inside(x + dx, y + dy, size).filter(|&p| sites.owner[p] > 0) else { continue };
            if best.is_none_or(|b| distance < b.0) {
                best = Some((distance, near));
            }
        }
        let from = sites.raster.spot(sites.owner[best?.1] as usize - 1, best?.1);
        let way = walk(sites.raster.atlas, from, sites.raster.center(pixel) - from.uv);
        Some((index_u32(pixel), way.map_or(Jump::NONE, |way| sites.jump(way.spot))))
    };
    (0..sites.owner.len()).into_par_iter().with_min_len(1024).filter_map(found).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::stop::NEVER;
    use crate::mesh::fixture::{atlas, cube, plane, sphere, strip, torus};
    use glam::{DVec3, Vec2};

    fn of(atlas: &Atlas, size: [u32; 2], levels: u32) -> IndirectionMap {
        let spec = LevelsSpec { size, levels, exact: true, ring: 2, ends: &[] };
        indirection(&Arc::new(atlas.clone()), &spec, NEVER)
    }

    /// Rows C24, C25: the test vectors `indirection`, all pixels of the ring that jump.
    #[test]
    fn matches_pointers_of_vectors() {
        let all: serde_json::Value =
            serde_json::from_str(include_str!("../../tests/vectors/synthesis.json")).expect("JSON");
        let vectors = &all["indirection"];
        let number = |v: &serde_json::Value| v.as_f64().expect("a number");
        // Sides of 32 pixels make the UVs exact.
        let uv = |uv: &serde_json::Value| DVec2::new(number(&uv[0]) / 32.0, number(&uv[1]) / 32.0).as_vec2();
        let uvs: Vec<[Vec2; 3]> =
            vectors["uvs"].as_array().unwrap().iter().map(|uvs| [0, 1, 2].map(|k| uv(&uvs[k]))).collect();
        let map = of(&atlas(strip(), &uvs), [32, 32], 1);
        let level = &map.levels[0];
        let place = |pixel: u32| serde_json::json!([pixel % 32, pixel / 32]);
        let found: Vec<serde_json::Value> = level
            .ring
            .iter()
            .filter(|(_, jump)| jump.is_some())
            .map(|(at, jump)| {
                assert_eq!(jump.residue, [0; 2], "charts that line up leave no residue");
                serde_json::json!({ "at": place(*at), "to": place(jump.to) })
            })
            .collect();
        assert_eq!(found, *vectors["jumps"].as_array().unwrap());
        assert_eq!(found.len(), 32);
    }

    /// On a plane, the point that a pointer represents is exactly the expected one.
    #[test]
    fn on_a_plane_pointers_lead_to_the_next_pixel() {
        for (name, near) in [("plane_one", 1e-4), ("plane_cut", 1e-4), ("plane_wild", 1e-3)] {
            let atlas = plane(name);
            let map = of(&atlas, [160, 160], 3);
            for level in &map.levels {
                let raster = Raster { atlas: &atlas, finest: map.size, h: level.h };
                let place = |pixel: usize, off: [f32; 2]| {
                    let off = DVec2::new(f64::from(off[0]), f64::from(off[1]));
                    atlas.place(level.triangle(pixel).unwrap(), raster.center(pixel) + off * raster.step())
                };
                let (mut ends, mut crossed) = (0, 0);
                for (&pixel, jumps) in level.border.iter().zip(&level.jumps) {
                    for (jump, [dx, dy]) in jumps.iter().zip(OCTANTS) {
                        let to = place(pixel as usize, [dx as f32, dy as f32]);
                        let inside = to.x.min(to.y) > -1e-6 && to.x.max(to.y) < 64.0 + 1e-6;
                        if !jump.is_some() {
                            assert!(!inside, "{name} {}: no pointer to {to}", level.h);
                            ends += 1;
                            continue;
                        }
                        let size = atlas.jacobians[0][0].length() as f64 / 160.0 * f64::from(level.h);
                        let off = place(jump.to as usize, jump.offset()).distance(to) / size;
                        assert!(off < near, "{name} {}: {off} pixels off at {to}", level.h);
                        let charts = [pixel, jump.to].map(|p| atlas.charts[level.triangle(p as usize).unwrap()]);
                        crossed += usize::from(charts[0] != charts[1]);
                    }
                }
                assert!(ends > 0 && (crossed > 20) == (name != "plane_one"), "{name} {}: {ends} {crossed}", level.h);
            }
        }
    }

    #[test]
    fn places_parents_at_coarser_pixels() {
        let atlas = plane("plane_wild");
        let map = of(&atlas, [160, 160], 4);
        for pair in map.levels.windows(2) {
            let rasters = [&pair[0], &pair[1]].map(|level| Raster { atlas: &atlas, finest: map.size, h: level.h });
            let mut still = 0;
            for parent in &pair[0].parents {
                let pixel = parent.pixel as usize;
                let triangle = pair[0].triangle(pixel).unwrap();
                let (w, across) = (pair[0].size[0] as usize, pair[1].size[0] as usize);
                let around = pixel / w / 2 * across + pixel % w / 2;
                let wanted = if parent.still { rasters[0].center(pixel) } else { rasters[1].center(around) };
                still += usize::from(parent.still);
                let to = parent.jump.to as usize;
                assert!(parent.jump.is_some());
                let off = parent.jump.offset();
                let off = DVec2::new(f64::from(off[0]), f64::from(off[1])) * rasters[1].step();
                let found = atlas.place(pair[1].triangle(to).unwrap(), rasters[1].center(to) + off);
                assert!(found.distance(atlas.place(triangle, wanted)) < 1e-2);
            }
            assert!(!pair[0].parents.is_empty() && still < pair[0].parents.len());
        }
    }

    /// On closed surfaces every pixel has all of its neighbours, about as far away as expected.
    #[test]
    fn closed_surfaces_have_all_pointers_of_the_right_length() {
        for (atlas, size, curved) in [(sphere(), 320, true), (torus(48, 24), 256, true), (cube(), 128, false)] {
            let map = of(&atlas, [size; 2], 4);
            for level in map.levels.iter().filter(|level| level.owned() >= 64) {
                let raster = Raster { atlas: &atlas, finest: map.size, h: level.h };
                let mut sum = 0.0f64;
                let mut missing = 0;
                for (&pixel, jumps) in level.border.iter().zip(&level.jumps) {
                    let pixel = pixel as usize;
                    let triangle = level.triangle(pixel).unwrap();
                    let axes = atlas.jacobians[triangle].map(|axis| axis.as_dvec3());
                    let from = atlas.place(triangle, raster.center(pixel));
                    for (jump, [dx, dy]) in jumps.iter().zip(OCTANTS) {
                        if !jump.is_some() {
                            missing += 1;
                            continue;
                        }
                        let step: DVec3 =
                            axes[0] * f64::from(dx) * raster.step().x + axes[1] * f64::from(dy) * raster.step().y;
                        let (to, [ox, oy]) = (jump.to as usize, jump.offset().map(f64::from));
                        let at = raster.center(to) + DVec2::new(ox, oy) * raster.step();
                        let length = atlas.place(level.triangle(to).unwrap(), at).distance(from);
                        sum += (length / step.length() - 1.0).abs();
                    }
                }
                assert_eq!(missing, 0, "spacing {}", level.h);
                // The stretch differs between triangles that meet in the plane of the atlas; at a cube's corners,
                // distances are chords.
                let mean = sum / (8 * level.border.len()) as f64;
                let most = if curved { [0.02, 0.04, 0.06, 0.1][level.h.ilog2() as usize] } else { 0.1 };
                assert!(mean < most, "spacing {}: {mean}", level.h);
            }
        }
    }

    /// Without residues, pointers are whole pixels as in the source.
    #[test]
    fn nearest_pointers_keep_no_residue() {
        let atlas = plane("plane_wild");
        let spec = LevelsSpec { size: [96, 96], levels: 2, exact: false, ring: 0, ends: &[] };
        let map = indirection(&Arc::new(atlas.clone()), &spec, NEVER);
        let exact = of(&atlas, [96, 96], 2);
        for (level, exact) in map.levels.iter().zip(&exact.levels) {
            let to = |level: &IndirectionLevel| level.jumps.as_flattened().iter().map(|j| j.to).collect::<Vec<_>>();
            assert_eq!(to(level), to(exact));
            assert!(level.jumps.as_flattened().iter().all(|j| j.residue == [0; 2]) && level.ring.is_empty());
        }
        assert!(exact.levels[0].jumps.as_flattened().iter().any(|j| j.residue != [0; 2]));
    }

    /// S-21: edges at which combed directions end act like the end of the surface.
    #[test]
    fn pointers_do_not_cross_the_ends_of_combed_directions() {
        let atlas = torus(48, 24);
        let half = |triangle: usize| atlas.mesh.corners(triangle).iter().sum::<DVec3>().x > 0.0;
        let apart = |&(triangle, k): &(usize, usize)| half(triangle) != half(atlas.across(triangle, k).unwrap().0);
        let edges = (0..atlas.uvs.len()).flat_map(|triangle| [0, 1, 2].map(|k| (triangle, k)));
        let ends: Vec<_> = edges.filter(apart).collect();
        let spec = LevelsSpec { size: [128; 2], levels: 3, exact: true, ring: 0, ends: &ends };
        let map = indirection(&Arc::new(atlas.clone()), &spec, NEVER);
        for (level, free) in map.levels.iter().zip(of(&atlas, [128; 2], 3).levels) {
            let side = |pixel: u32| half(level.triangle(pixel as usize).unwrap());
            let crossing = |level: &IndirectionLevel| {
                let pairs = level.border.iter().zip(&level.jumps);
                let there = |&(&pixel, jumps): &(&u32, &Jump8)| {
                    jumps.iter().any(|jump| jump.is_some() && side(jump.to) != side(pixel))
                };
                pairs.filter(there).count()
            };
            // If an edge ends within a pixel, the pixel may represent either side.
            assert!(crossing(&free) > 8, "spacing {}", level.h);
            assert_eq!(crossing(level), 0, "spacing {}", level.h);
            assert!(level.jumps.as_flattened().iter().any(|jump| !jump.is_some()), "spacing {}", level.h);
            assert_eq!(level.owned(), free.owned());
        }
    }
}
