//! The published method in double precision, against vectors to 1e-9.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use glam::DVec3;
use serde_json::Value as Json;
use shibo_kernel::wood::branch::{Axis, Power, blend_all, branch_time};
use shibo_kernel::wood::fit::{self, Scheme};
use shibo_kernel::wood::straight::Straight;
use shibo_kernel::wood::trunk::{Growth, Places, Rows, Trunk};

fn vectors() -> Json {
    serde_json::from_str(include_str!("../vectors/wood.json")).unwrap()
}

fn number(v: &Json) -> f64 {
    v.as_f64().unwrap_or_else(|| if v == "inf" { f64::INFINITY } else { panic!("{v} is no number") })
}

fn point(v: &Json) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|i| number(&v[i])))
}

fn points(v: &Json) -> Vec<DVec3> {
    v.as_array().unwrap().iter().map(point).collect()
}

fn close(a: f64, b: f64) -> bool {
    a == b || (a - b).abs() <= 1e-9
}

fn list<'a>(v: &'a Json, key: &str) -> &'a [Json] {
    v[key].as_array().unwrap()
}

fn scheme(v: &Json) -> Scheme {
    if v["scheme"] == "local" { Scheme::Local } else { Scheme::Natural }
}

fn same_controls(a: &[[DVec3; 4]], b: &Json) {
    for (a, b) in a.iter().zip(b.as_array().unwrap()) {
        assert!(a.iter().zip(points(b)).all(|(a, b)| a.distance(b) < 1e-9), "{a:?} {b}");
    }
    assert_eq!(a.len(), b.as_array().unwrap().len());
}

fn growth(vectors: &Json) -> Growth {
    let speeds = &vectors["speeds"];
    Growth { elongation: number(&speeds["ve"]), thickening: number(&speeds["vh"]), ground: 0.0, boost: 0.0, fade: 1.0 }
}

/// The coordinates of query points, one list per axis.
fn columns(queries: &[Json]) -> [Vec<f64>; 3] {
    std::array::from_fn(|axis| queries.iter().map(|q| number(&q["P"][axis])).collect())
}

#[test]
fn skeletons_and_trunk_times() {
    let vectors = vectors();
    for skeleton in list(&vectors, "skeletons") {
        let raw = fit::fit(&points(&skeleton["nodes"]), scheme(skeleton)).unwrap();
        same_controls(&raw, &skeleton["controls_raw"]);
        let (even, _) = fit::equalize(&raw).unwrap();
        same_controls(&even, &skeleton["controls_equalised"]);
        let queries = list(skeleton, "queries");
        let [x, y, z] = columns(queries);
        let at = Places { x: &x, y: &y, z: &z, rows: Rows::Any };
        let trunk = Trunk::<f64>::new(&even);
        let (mut times, mut distances) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        trunk.time(&at, &growth(&vectors), &mut times);
        trunk.distance(&at, &mut distances);
        for (i, query) in queries.iter().enumerate() {
            let q = point(&query["Q"]);
            let [qx, qy] = trunk.axis_at(z[i]);
            assert!(close(qx, q.x) && close(qy, q.y), "{query}");
            assert!(close(distances[i], number(&query["d"])), "{query}");
            assert!(close(times[i], number(&query["T"])), "{query}: {}", times[i]);
        }
    }
}

#[test]
fn branches_and_blends() {
    let vectors = vectors();
    let growth = growth(&vectors);
    for case in list(&vectors, "branches") {
        let named = |s: &&Json| s["name"] == case["skeleton"] && s["scheme"] == case["scheme"];
        let skeleton = list(&vectors, "skeletons").iter().find(named).unwrap();
        let (trunk, _) = fit::equalize(&fit::fit(&points(&skeleton["nodes"]), scheme(skeleton)).unwrap()).unwrap();
        let mut branches = Vec::new();
        for (branch, b1) in list(case, "branches").iter().zip(list(case, "b1")) {
            let start = fit::point_at(&trunk, number(&branch["z"]));
            assert!(start.distance(point(b1)) < 1e-9);
            let direction = point(&branch["dir"]).normalize();
            let birth = start.z / growth.elongation;
            branches.push(Axis::new(start, direction, f64::INFINITY, birth, growth.elongation, number(&branch["vb"])));
        }
        let queries = list(case, "queries");
        let [x, y, z] = columns(queries);
        let at = Places { x: &x, y: &y, z: &z, rows: Rows::Any };
        let (mut t1, mut t2) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        Trunk::<f64>::new(&trunk).time(&at, &growth, &mut t1);
        for (i, query) in queries.iter().enumerate() {
            assert!(close(t1[i], number(&query["T1"])), "{query}");
        }
        for (n, branch) in branches.iter().enumerate() {
            branch_time(&[*branch], &at, &mut t2);
            for (i, query) in queries.iter().enumerate() {
                let want = number(&query["T2"][n]);
                assert!(close(t2[i], want) || (t2[i] / want - 1.0).abs() < 1e-12, "{query}: {}", t2[i]);
            }
        }
        branch_time(&branches, &at, &mut t2);
        blend_all(&mut t1, &t2, Power::Two);
        for (i, query) in queries.iter().enumerate() {
            assert!(close(t1[i], number(&query["T"])), "{query}");
        }
    }
}

#[test]
fn matches_earlier_method() {
    let vectors = vectors();
    for case in list(&vectors, "straight") {
        let skeleton = list(&vectors, "skeletons").iter().find(|s| s["name"] == case["skeleton"]).unwrap();
        let straight = Straight::<f64>::new(&points(&skeleton["nodes"]), number(&case["va"]), number(&case["vb"]));
        for query in list(case, "queries") {
            let time = straight.time_at(point(&query["P"]).to_array());
            assert!(close(time, number(&query["T"])), "{query}: {time}");
        }
    }
}

#[test]
fn rejects_invalid_nodes() {
    for case in list(&vectors(), "invalid") {
        for scheme in [Scheme::Natural, Scheme::Local] {
            let nodes = points(&case["nodes"]);
            let result = fit::fit(&nodes, scheme).and_then(|raw| fit::equalize(&raw));
            let local_rises = scheme == Scheme::Local && case["why"] == "tangent falls";
            assert!(result.is_err() || local_rises, "{case}");
        }
    }
}
