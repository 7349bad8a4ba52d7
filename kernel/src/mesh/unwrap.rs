//! Unwraps meshes without UVs, and repacks existing charts with gutters, by the crate `uvunwrap`, which no other file
//! uses.
//!
//! Its results have the same bits on every machine and for any number of threads. Cost: about 50 µs a triangle.
use crate::ground::number::index_u32;
use glam::{DVec2, Vec2};
use shibo_value::Mesh;
use std::sync::atomic::{AtomicBool, Ordering};
use uvunwrap::{Density, MeshInput, Options, Packing};

/// Settings of unwrapping and packing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unwrap {
    /// True if the charts of the mesh's own UVs are kept, and only repacked.
    pub repack: bool,
    /// Maximum angle between a triangle and its chart's mean normal, in degrees below 90.
    pub angle: f32,
    /// Maximum factor between areas in a chart and on the surface.
    pub stretch: f32,
    /// Grid of the layout: texels along a side.
    pub page: u32,
    /// Free texels around each chart.
    pub gutter: u32,
    /// True if charts may lie in hollows of other charts; takes longer.
    pub tight: bool,
}

/// Reasons why there are no charts.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnwrapError {
    /// `alive` returned false.
    #[error("cancelled")]
    Cancelled,
    /// The charts do not fit.
    #[error("its charts do not fit on one page of {0} texels with this gutter")]
    Full(u32),
    /// The library failed.
    #[error("no charts can be made of it: {0}")]
    Impossible(String),
}

/// Splits the vertices of a mesh by their UVs; returns vertices, UVs, and three indices per triangle.
fn split(mesh: &Mesh) -> (Vec<[f32; 3]>, Vec<[f32; 2]>, Vec<u32>) {
    let corners = mesh.triangles.as_flattened().iter().zip(mesh.uvs.as_flattened());
    let mut all: Vec<(u32, [u32; 2], u32)> = Vec::with_capacity(3 * mesh.triangles.len());
    all.extend((0..).zip(corners).map(|(n, (v, uv))| (*v, (*uv + Vec2::ZERO).to_array().map(f32::to_bits), n)));
    all.sort_unstable();
    let (mut places, mut uvs, mut indices) = (Vec::new(), Vec::new(), vec![0; all.len()]);
    for same in all.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        for (_, _, n) in same {
            indices[*n as usize] = index_u32(places.len());
        }
        places.push(mesh.positions[same[0].0 as usize].to_array());
        uvs.push(same[0].1.map(f32::from_bits));
    }
    (places, uvs, indices)
}

/// UVs for all triangles, v down, on a canvas of `size_mm`, so that texels are square there. `seams` marks for each
/// triangle the edges that must be borders of charts; empty for none. `alive` is called often; if it returns false, the
/// work ends soon.
///
/// # Errors
/// Returns an error if charts do not fit or cannot be made, or if cancelled.
pub fn unwrap(
    mesh: &Mesh,
    size_mm: DVec2,
    how: &Unwrap,
    seams: &[[bool; 3]],
    alive: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<[Vec2; 3]>, UnwrapError> {
    let (places, own, indices) = if how.repack {
        split(mesh)
    } else {
        let places = mesh.positions.iter().map(|p| p.to_array()).collect();
        (places, Vec::new(), mesh.triangles.as_flattened().to_vec())
    };
    let parts: Vec<u32> = mesh.parts.iter().map(|part| u32::from(*part)).collect();
    let input = MeshInput {
        face_materials: (parts.len() == mesh.triangles.len()).then_some(&parts),
        polygons: (mesh.polygons.len() == mesh.triangles.len()).then_some(&mesh.polygons),
        existing_uvs: how.repack.then_some(&own),
        seams: (seams.len() == mesh.triangles.len()).then_some(seams),
        ..MeshInput::new(&places, &indices)
    };
    let options = Options {
        max_chart_angle: how.angle,
        max_area_distortion: how.stretch,
        density: Density::Auto { page_size: how.page },
        padding: how.gutter,
        packing: if how.tight { Packing::Shape } else { Packing::Fast },
        ..Options::default()
    };
    let cancelled = AtomicBool::new(false);
    let go_on = |_| {
        let go_on = alive();
        cancelled.fetch_or(!go_on, Ordering::Relaxed);
        go_on
    };
    let made = uvunwrap::generate_with_progress(&[input], &options, go_on).map_err(|error| match error {
        _ if cancelled.load(Ordering::Relaxed) => UnwrapError::Cancelled,
        uvunwrap::Error::ChartTooLarge { .. } => UnwrapError::Full(how.page),
        error => UnwrapError::Impossible(error.to_string()),
    })?;
    let out = made.meshes.first().filter(|_| made.page_count <= 1).ok_or(UnwrapError::Full(how.page))?;
    // The page is a square at the canvas' corner, cropped at the bottom; the library's v points up seen from outside.
    let square = DVec2::splat(size_mm.min_element()) / size_mm;
    let height = f64::from(made.height) / f64::from(made.width.max(1));
    let uv = |index: u32| {
        let uv = Vec2::from_array(out.vertices[index as usize].uv).as_dvec2();
        (DVec2::new(uv.x, (1.0 - uv.y) * height) * square).as_vec2()
    };
    Ok(out.indices.as_chunks().0.iter().map(|corners: &[u32; 3]| corners.map(uv)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::stop::Watch;
    use crate::mesh::atlas::atlas;
    use crate::mesh::charts::cross;
    use crate::mesh::layout::layout;
    use crate::mesh::{samples, shapes};
    use glam::DVec3;
    use std::sync::Arc;

    const HOW: Unwrap = Unwrap { repack: false, angle: 70.0, stretch: 4.0, page: 256, gutter: 4, tight: true };

    #[test]
    fn charts_are_made_and_keep_apart() {
        let size = DVec3::splat(60.0);
        for (mesh, repack) in [
            (shapes::sphere(size, 32), false),
            (shapes::torus(size.truncate(), 15.0, 32), false),
            (samples::cube(), false),
            (samples::plane_wild(), true),
            (samples::cube(), true),
        ] {
            for canvas in [DVec2::splat(100.0), DVec2::new(200.0, 100.0)] {
                let uvs = unwrap(&mesh, canvas, &Unwrap { repack, ..HOW }, &[], &|| true).unwrap();
                let atlas = atlas(Arc::new(mesh.clone()), &uvs, canvas).unwrap();
                assert!(uvs.iter().all(|uvs| cross(*uvs) < 0.0), "none is mirrored");
                let found = layout(&atlas, 256, &Watch::never());
                assert!(found.overlap.is_none() && !found.close);
                let square = canvas.min_element().powi(2) / canvas.element_product();
                assert!(atlas.used > 0.3 * square, "{}", atlas.used);
                // Texels are square: charts are stretched equally in both directions.
                let ratio = (0..uvs.len()).map(|n| crate::mesh::bake::stretch(&atlas, n)).map(|[a, b]| a / b);
                let mut ratio: Vec<f64> = ratio.collect();
                ratio.sort_by(f64::total_cmp);
                assert!(ratio[ratio.len() / 2] < 1.3, "{}", ratio[ratio.len() / 2]);
            }
        }
    }

    #[test]
    fn keeps_charts_when_repacking() {
        let mesh = samples::plane_wild();
        let canvas = DVec2::splat(100.0);
        let uvs = unwrap(&mesh, canvas, &Unwrap { repack: true, ..HOW }, &[], &|| true).unwrap();
        assert_eq!(atlas(Arc::new(mesh), &uvs, canvas).unwrap().chart_count(), 3);
    }

    #[test]
    fn a_seam_is_a_border_of_charts() {
        let mesh = shapes::torus(DVec3::splat(60.0).truncate(), 15.0, 32);
        let ring = |n: u32| 2.0 * std::f64::consts::PI * f64::from(n) / 24.0;
        let along = (0..=24).map(|n| DVec3::new(libm::cos(ring(n)), libm::sin(ring(n)), 0.0) * 45.0).collect();
        let marked = crate::mesh::seams::seams(&mesh, &[along]).unwrap();
        let canvas = DVec2::splat(100.0);
        let uvs = unwrap(&mesh, canvas, &HOW, &marked, &|| true).unwrap();
        let found = atlas(Arc::new(mesh.clone()), &uvs, canvas).unwrap();
        let seen = marked.iter().flatten().filter(|marked| **marked).count();
        assert!(seen >= 40, "{seen} edges are marked");
        for (n, marked) in marked.iter().enumerate() {
            for k in (0..3).filter(|k| marked[*k]) {
                // The edge from corner k is opposite to corner k + 2.
                assert!(found.inner[n] & (1 << ((k + 2) % 3)) == 0, "triangle {n}, edge {k}");
            }
        }
    }

    #[test]
    fn stops_when_cancelled_and_rejects_full_page() {
        let mesh = shapes::sphere(DVec3::splat(60.0), 64);
        let canvas = DVec2::splat(100.0);
        assert_eq!(unwrap(&mesh, canvas, &HOW, &[], &|| false), Err(UnwrapError::Cancelled));
        let crowded = Unwrap { page: 64, gutter: 31, ..HOW };
        assert!(matches!(unwrap(&mesh, canvas, &crowded, &[], &|| true), Err(UnwrapError::Full(64))));
    }
}
