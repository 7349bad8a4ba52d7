//! Tests of views of shapes.
use super::*;
use crate::surface::environment::Scene;

fn maps<'a>(color: &'a [Vec<f32>; 3], height: &'a [f32], rough: &'a [f32], metal: &'a [f32]) -> Maps<'a> {
    Maps {
        size: [16, 16],
        size_mm: [16.0, 16.0],
        repeats: [true, true],
        color: color.each_ref().map(|plane| &plane[..]),
        roughness: rough,
        metallic: metal,
        occlusion: &[1.0],
        height,
        normal: None,
        sheen: &[],
        coat: &[],
        coat_roughness: &[],
        emission: [&[], &[], &[]],
        anisotropy: [&[], &[]],
    }
}

fn spec<'a>(environment: &'a Environment, shape: Shape<'a>) -> ViewSpec<'a> {
    ViewSpec { shape, pixels: [48, 48], environment, exposure: 1.0, fibers: 0.0 }
}

#[test]
fn shows_the_colour_of_the_material_in_the_middle() {
    let studio = Environment::of(Scene::Studio);
    let red = [vec![0.6], vec![0.1], vec![0.05]];
    for shape in [Shape::Ball, Shape::Cube, Shape::Plane] {
        let picture = view(&maps(&red, &[0.0], &[0.9], &[0.0]), &spec(&studio, shape));
        let middle = picture.each_ref().map(|plane| plane[30 * 48 + 24]);
        assert!(middle[0] > 3.0 * middle[1] && middle[0] > 0.15, "{shape:?}: {middle:?}");
        assert!(picture.iter().flatten().all(|v| (0.0..=1.0).contains(v)));
    }
}

/// A polished ball of metal mirrors the key light; a rough one does not.
#[test]
fn polished_ball_has_a_highlight() {
    let studio = Environment::of(Scene::Studio);
    let steel = [vec![0.56], vec![0.57], vec![0.58]];
    let most = |rough: f32| {
        let [red, ..] = view(&maps(&steel, &[0.0], &[rough], &[1.0]), &spec(&studio, Shape::Ball));
        red.iter().copied().fold(0.0, f32::max)
    };
    assert!(most(0.05) > 0.9 && most(0.9) < 0.75, "{} {}", most(0.05), most(0.9));
}

/// At its edge a polished ball mirrors the walls behind it; it is not black.
#[test]
fn edge_of_a_ball_mirrors_what_is_behind_it() {
    let studio = Environment::of(Scene::Studio);
    let steel = [vec![0.56], vec![0.57], vec![0.58]];
    let [red, ..] = view(&maps(&steel, &[0.0], &[0.2], &[1.0]), &spec(&studio, Shape::Ball));
    // The ball ends at about .83 of half the width.
    let edge = red[24 * 48 + 24 - 19];
    assert!(edge > 0.05, "{edge}");
}

#[test]
fn wrong_sizes_and_values_do_not_panic() {
    let studio = Environment::of(Scene::Studio);
    let odd = [vec![f32::NAN], vec![1e30], vec![-1.0]];
    let picture = view(&maps(&odd, &[f32::INFINITY], &[f32::NAN], &[]), &spec(&studio, Shape::Ball));
    assert_eq!(picture[0].len(), 48 * 48);
}
