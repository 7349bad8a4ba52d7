//! Tests of contour lines.
use super::super::heights::tests::map;
use super::*;

fn maker() -> LineMaker {
    LineMaker { stem: "a".to_owned(), step: 0.1, levels: None, tolerance: 0.0, dxf: false }
}

/// The messages of warnings.
fn warnings(maker: &LineMaker, values: &[f32]) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let parts = maker.make(&map(3, values), folder.path(), &|| false).unwrap();
    parts
        .into_iter()
        .filter_map(|part| if let Part::Advice(advice) = part { Some(advice.message) } else { None })
        .collect()
}

#[test]
fn levels_without_lines_are_told() {
    let values = [0.0, 0.01, 0.02, 0.0, 0.01, 0.05, 0.0, 0.01, 0.02];
    let given = |levels: &[f64]| warnings(&LineMaker { levels: Some(levels.to_vec()), ..maker() }, &values);
    assert_eq!(given(&[99.0]), ["the level 99 mm has no line: the heights range from 0 to 0.05 mm"]);
    let several = given(&[-4.0, -3.0, 0.015, 1.0, 2.0, 3.0]);
    assert_eq!(several, ["the levels -4, -3, 1 mm and 2 others have no lines: the heights range from 0 to 0.05 mm"]);
    assert_eq!(given(&[0.005, 0.015]), [""; 0]);
    assert_eq!(warnings(&LineMaker { step: 0.02, ..maker() }, &values), [""; 0]);
    let coarse = warnings(&LineMaker { step: 0.3, ..maker() }, &values.map(|v| v + 0.01));
    assert_eq!(coarse.len(), 1, "{coarse:?}");
    assert!(coarse[0].contains("no multiple of `step`, 0.3 mm, has a line"), "{coarse:?}");
}

#[test]
fn work_stops_within_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let values: Vec<f32> = (0..300_u16).map(f32::from).collect();
    let stopped = LineMaker { step: 1.0, ..maker() }.make(&map(3, &values), folder.path(), &|| true);
    assert!(stopped.is_err_and(|error| error.to_string().contains("a.svg")));
    assert_eq!(folder.path().read_dir().unwrap().count(), 0);
}
