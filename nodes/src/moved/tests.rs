//! Tests of moved fields.
use crate::image::{Image, Wrap};
use crate::space::Transform;
use crate::testing::{Plain, canvas, check_field, field, port, raster, write_tiff};
use glam::{DVec2, UVec2};
use shibo_kernel::filter::sample::Filter;
use shibo_node::{Call, DynNode, Xy};
use shibo_value::{Canvas, Field, Tiling, Value};

/// Noise of `side`² pixels.
fn noise(side: u32) -> Vec<f32> {
    (0..side * side).map(|k| (k * k % 97) as f32 / 97.0).collect()
}

/// The `rgb` or `gray` output of `node`, for a picture of this noise.
fn picture(node: &Image, side: u32, name: &str) -> Field {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("noise.tif");
    write_tiff(&path, side, &["Y"], &[&noise(side)]);
    let files = [("path", (&path).into())];
    let call = Call { kind: "Image", canvas: &canvas(), inputs: &[], files: &files, evaluator: &Plain };
    let Some(Value::Field(field)) = DynNode::evaluate(node, &call).unwrap().take(name, false).cloned() else {
        panic!("{name}")
    };
    // Decode the file before its folder is removed.
    raster(&field, &canvas());
    field
}

/// A picture of 40² pixels that are as large as those of the canvas but lie between them.
fn between_pixels() -> Image {
    Image { position: Xy::new(3.3, -5.1), size_mm: Some(Xy::new(20.0, 20.0)), ..Image::default() }
}

fn cubic(t: f64) -> [f64; 4] {
    let near = |t: f64| 1.5 * t * t * t - 2.5 * t * t + 1.0;
    let far = |t: f64| -0.5 * t * t * t + 2.5 * t * t - 4.0 * t + 2.0;
    [far(1.0 + t), near(t), near(1.0 - t), far(2.0 - t)]
}

/// The value at `at` mm of the repeated noise, placed as by [`between_pixels`].
fn read_once(pixels: &[f32], at: DVec2) -> f64 {
    let at = (at - DVec2::new(3.3, -5.1)) / 0.5 - 0.5;
    let (first, rest) = (at.floor().as_ivec2() - 1, at - at.floor());
    let (x, y) = (cubic(rest.x), cubic(rest.y));
    let value = |i: i32, j: i32| f64::from(pixels[(j.rem_euclid(40) * 40 + i.rem_euclid(40)) as usize]);
    let row = |j: i32| (first.x..).zip(x).map(|(i, x)| x * value(i, j)).sum::<f64>();
    (first.y..).zip(y).map(|(j, y)| y * row(j)).sum()
}

#[test]
fn a_turned_picture_is_filtered_once() {
    let (pixels, input) = (noise(40), picture(&between_pixels(), 40, "gray"));
    for (angle, offset, size) in [(37.0, 0.0, 64), (-120.0, 7.77, 64), (37.0, 1e5, 64), (10.0, 0.0, 32)] {
        let scale = 64.0 / f64::from(size);
        let node = Transform {
            input: port(0),
            angle,
            offset: Xy::new(offset, 0.0),
            scale: Xy::new(scale, scale),
            ..Transform::default()
        };
        let fine = Canvas { resolution: UVec2::splat(size), ..canvas() };
        let turned = raster(&field(&node, &[input.clone().into()]), &fine);
        let back = DVec2::from_angle(-angle.to_radians());
        let mut squares = 0.0;
        for (k, v) in (0..).zip(turned.plane(0)) {
            let at = fine.grid(fine.resolution).center(k % size as i32, k / size as i32);
            let want = read_once(&pixels, 16.0 + back.rotate(at - 16.0 - DVec2::new(offset, 0.0)) / scale);
            squares += (f64::from(*v) - want).powi(2);
        }
        let rms = (squares / f64::from(size * size)).sqrt();
        assert!(rms < 1e-5, "{angle}° at {size}: {rms}");
    }
}

#[test]
fn moves_and_quarter_turns_show_the_pixels() {
    // The position and the offset add up to whole pixels: ten in x, none in y.
    let pixels = noise(40);
    let node = Transform { input: port(0), offset: Xy::new(1.7, 5.1), ..Transform::default() };
    let moved = raster(&field(&node, &[picture(&between_pixels(), 40, "gray").into()]), &canvas());
    for (y, row) in (0..64).map(|y| (y, moved.row(0, y))) {
        assert!((0..64).all(|x| row[x] == pixels[(y % 40) * 40 + (x + 30) % 40]), "{y}");
    }
    // With this filter all values are values of the picture.
    let nearest = Image { filter: Filter::Nearest, ..between_pixels() };
    let node = Transform { input: port(0), angle: 90.0, ..Transform::default() };
    let turned = raster(&field(&node, &[picture(&nearest, 40, "gray").into()]), &canvas());
    assert!(turned.plane(0).iter().all(|v| pixels.contains(v)));
}

#[test]
fn a_turned_picture_holds_in_any_window() {
    for wrap in [Wrap::Repeat, Wrap::Clamp] {
        for (angle, offset) in [(37.0, 0.0), (-90.0, 0.3), (200.0, 1e6)] {
            let input = picture(&Image { wrap, ..between_pixels() }, 40, "rgb");
            let node = Transform { input: port(0), angle, offset: Xy::new(offset, 0.7), ..Transform::default() };
            check_field(&field(&node, &[input.into()]));
        }
    }
    // 23 pixels on 16 mm are as large as the pixels that a tiling rotation by 45° reads.
    let diagonal = Xy::new(0.5f64.sqrt(), 0.5f64.sqrt());
    let node = Transform { input: port(0), angle: 45.0, scale: diagonal, ..Transform::default() };
    let input = picture(&Image { size_mm: Some(Xy::new(16.0, 16.0)), ..Image::default() }, 23, "rgb");
    let turned = field(&node, &[input.into()]);
    assert_eq!(turned.tiling(), Tiling::BOTH);
    check_field(&turned);
}
