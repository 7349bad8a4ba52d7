//! Links of the Delaunay triangulation, in the plane or on the torus.
//!
//! Not in the source, which does not say which points are neighbours unless they form a grid (JP4905282B2 §3). Wrinkles
//! perpendicular to these links enclose each point, so that hills appear between the grooves.

use super::links::{Links, small};
use crate::ground::hash::Hash;
use crate::ground::number::index_u32;
use crate::ground::stop::{NEVER, Until, Watch, unwind_when};
use glam::{DVec2, Vec2};
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

/// A point of the triangulation: a point of the set, in some copy of the canvas.
#[derive(Clone, Copy)]
struct Site<'w> {
    at: DVec2,
    id: u32,
    wrap: [i8; 2],
    watch: &'w Watch<'w>,
}

impl HasPosition for Site<'_> {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        // The library calls this often, and no other code of this project; so check for cancellation here.
        self.watch.tick();
        Point2::new(self.at.x, self.at.y)
    }
}

/// Links of the Delaunay triangulation of `points`, sorted, each once with the smaller index first. Of points at the
/// same position only the first is linked; points that are not finite are skipped. With `periodic`, points must lie in
/// `0 ≤ p < size`; links then carry wraps, also between a point and its own copy if there are very few. O(n log n).
pub fn delaunay(points: &[Vec2], size: Vec2, periodic: bool) -> Links {
    delaunay_until(points, size, periodic, NEVER)
}

/// Like [`delaunay`]; returns no links if stopped.
pub fn delaunay_until(points: &[Vec2], size: Vec2, periodic: bool, until: Until<'_>) -> Links {
    unwind_when(until, |watch| links(points, size, periodic, watch)).unwrap_or_default()
}

fn links(points: &[Vec2], size: Vec2, periodic: bool, watch: &Watch<'_>) -> Links {
    let sites = unique(points, size, periodic, watch);
    let home = sites.len();
    if home == 0 {
        return Links::default();
    }
    if !periodic {
        let links = edges(&triangulate(sites), watch);
        return Links { pairs: links.into_iter().map(|l| l.0).collect(), wraps: Vec::new() };
    }
    let size = size.as_dvec2();
    let spacing = (size.x * size.y / home as f64).sqrt();
    let mut margin = (3.0 * spacing).min(size.max_element());
    loop {
        let whole = margin >= size.max_element();
        let triangulation = triangulate(with_ghosts(&sites, size, margin));
        // Triangles on the canvas are right if no omitted copy can lie in their circumcircles.
        if whole || circles_inside(&triangulation, size, margin) {
            let links = edges(&triangulation, watch);
            return Links { pairs: links.iter().map(|l| l.0).collect(), wraps: links.iter().map(|l| l.1).collect() };
        }
        margin = (2.0 * margin).min(size.max_element());
    }
}

/// The first of the points at each position, in order. On the torus every point is moved by a tiny amount, hashed from
/// its index: if four points lie on a circle, all copies must choose the same diagonal.
fn unique<'w>(points: &[Vec2], size: Vec2, periodic: bool, watch: &'w Watch<'w>) -> Vec<Site<'w>> {
    let mut order: Vec<u32> = (0..index_u32(points.len())).filter(|&i| points[i as usize].is_finite()).collect();
    let key = |i: u32| points[i as usize].map(|v| v + 0.0);
    order.sort_unstable_by(|&a, &b| {
        watch.tick();
        let (p, q) = (key(a), key(b));
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(a.cmp(&b))
    });
    order.dedup_by(|b, a| key(*a) == key(*b));
    order.sort_unstable_by(|a, b| {
        watch.tick();
        a.cmp(b)
    });
    let tiny = 1e-7 * f64::from((size.x * size.y).sqrt()) / (order.len().max(1) as f64).sqrt();
    let hash = Hash::new(0);
    let site = |&id: &u32| {
        let n = 2 * u64::from(id);
        let shift = if periodic { DVec2::new(hash.unit(n), hash.unit(n + 1)) * tiny } else { DVec2::ZERO };
        // The triangulation rejects numbers too close to 0.
        let at = (points[id as usize].as_dvec2() + shift).map(|v| if v.abs() < 1e-30 { 0.0 } else { v });
        Site { at, id, wrap: [0, 0], watch }
    };
    order.iter().map(site).collect()
}

/// The points, and their copies within `margin` of the canvas.
fn with_ghosts<'w>(sites: &[Site<'w>], size: DVec2, margin: f64) -> Vec<Site<'w>> {
    let mut all = sites.to_vec();
    for y in -1..=1i8 {
        for x in -1..=1i8 {
            if (x, y) == (0, 0) {
                continue;
            }
            let copies = sites.iter().map(|s| Site {
                at: s.at + DVec2::new(f64::from(x), f64::from(y)) * size,
                wrap: [x, y],
                ..*s
            });
            all.extend(copies.filter(|s| s.at.cmpge(DVec2::splat(-margin)).all() && s.at.cmple(size + margin).all()));
        }
    }
    all
}

fn triangulate(sites: Vec<Site<'_>>) -> DelaunayTriangulation<Site<'_>> {
    DelaunayTriangulation::bulk_load(sites).expect("coordinates are finite, neither huge nor all but 0")
}

/// Returns whether the circumcircles of all triangles with a corner on the canvas lie within the canvas and its margin.
fn circles_inside(triangulation: &DelaunayTriangulation<Site<'_>>, size: DVec2, margin: f64) -> bool {
    let hull_is_ghosts = triangulation.convex_hull().all(|e| e.from().data().wrap != [0, 0]);
    hull_is_ghosts
        && triangulation.inner_faces().all(|face| {
            if face.vertices().iter().all(|v| v.data().wrap != [0, 0]) {
                return true;
            }
            let (centre, radius) = face.circumcircle();
            let (centre, radius) = (DVec2::new(centre.x, centre.y), radius.sqrt());
            (centre - radius).cmpge(DVec2::splat(-margin)).all() && (centre + radius).cmple(size + margin).all()
        })
}

/// The edges with an end on the canvas, sorted, each once.
fn edges(triangulation: &DelaunayTriangulation<Site<'_>>, watch: &Watch<'_>) -> Vec<([u32; 2], [i8; 2])> {
    let edge = |e: spade::handles::UndirectedEdgeHandle<'_, Site<'_>, (), (), ()>| {
        watch.tick();
        let [a, b] = e.vertices().map(|v| *v.data());
        if a.wrap != [0, 0] && b.wrap != [0, 0] {
            return None;
        }
        let wrap = [0, 1].map(|axis| small(f32::from(b.wrap[axis]) - f32::from(a.wrap[axis])));
        let back = wrap.map(|w| -w);
        let forward = (a.id, back) < (b.id, wrap);
        Some(if forward { ([a.id, b.id], wrap) } else { ([b.id, a.id], back) })
    };
    let mut all: Vec<_> = triangulation.undirected_edges().filter_map(edge).collect();
    all.sort_unstable_by(|a, b| {
        watch.tick();
        a.cmp(b)
    });
    all.dedup();
    all
}
