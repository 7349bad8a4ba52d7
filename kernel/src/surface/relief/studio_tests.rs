//! Tests of lit pictures in environments.
use super::*;
use crate::ground::math::{max, srgb_encode};
use crate::surface::environment::Scene;
use std::sync::Arc;

/// Pixels along an edge of the test pictures.
const SIDE: usize = 192;

/// A material that is the same everywhere.
#[derive(Clone, Copy)]
struct Even {
    base: [f32; 3],
    roughness: f32,
    metal: f32,
    coat: f32,
}

const BROWN: Even = Even { base: [0.16, 0.085, 0.045], roughness: 0.3, metal: 0.0, coat: 0.0 };
const BLACK: Even = Even { base: [0.02; 3], roughness: 0.3, metal: 0.0, coat: 0.0 };
const BRASS: Even = Even { base: [0.86, 0.66, 0.32], roughness: 0.3, metal: 1.0, coat: 0.0 };
const STEEL: Even = Even { base: [0.56, 0.57, 0.58], roughness: 0.3, metal: 1.0, coat: 0.0 };
const PATENT: Even = Even { base: [0.02; 3], roughness: 0.6, metal: 0.0, coat: 1.0 };
const WHITE: Even = Even { base: [1.0; 3], roughness: 1.0, metal: 0.0, coat: 0.0 };

impl Even {
    const fn rough(self, roughness: f32) -> Self {
        Self { roughness, ..self }
    }
}

/// Heights of grain with this root mean square of its slopes: waves in all directions.
fn grain(x: i32, y: i32, slope: f32) -> f32 {
    let mut sum = 0.0;
    for k in 0..24_u8 {
        let a = f32::from(k);
        let (turn, phase, pitch) = (2.399_963 * a, 1.7 * a * a, 9.0 + 0.55 * a);
        let along = x as f32 * turn.cos() + y as f32 * turn.sin();
        let wave = std::f32::consts::TAU / pitch;
        // Each wave gives its share of the squared slope.
        sum += slope * (2.0_f32 / 24.0).sqrt() / wave * (wave * along + phase).sin();
    }
    sum
}

/// The lit picture of heights in mm; a pixel is 1 mm.
fn lit(height: impl Fn(i32, i32) -> f32, of: Even, spec: &ReliefSpec<'_>) -> [Vec<f32>; 3] {
    let rect = Window::of(0, 0, SIDE, SIDE);
    let big = rect.grow(spec.halo(), spec.halo());
    let data: Vec<f32> = (0..big.rows())
        .flat_map(|j| (0..big.columns()).map(move |i| (big.x + index(i), big.y + index(j))))
        .map(|(x, y)| height(x, y))
        .collect();
    let plane = |v: f32| vec![v; rect.len()];
    let (color, rough, one) = (of.base.map(plane), plane(of.roughness), plane(1.0));
    let (metal, none, coat) = (plane(of.metal), plane(0.0), plane(of.coat));
    let finish = Some(Finish { metallic: &metal, sheen: &none, coat: &coat, lacquer: None });
    let color = color.each_ref().map(|c| &c[..]);
    let surface = Surface { color, roughness: &rough, occlusion: &one, normal: None, fibers: None, finish };
    let mut out = [plane(0.0), plane(0.0), plane(0.0)];
    relief(&View::new(&data, big), rect, &surface, spec, out.each_mut().map(|plane| &mut plane[..]));
    out
}

fn spec(environment: &Arc<Environment>) -> ReliefSpec<'_> {
    ReliefSpec {
        environment: Some(environment.as_ref()),
        curve: Curve::Linear,
        exposure: 0.25,
        ..ReliefSpec::new([1.0; 2])
    }
}

fn luma(picture: &[Vec<f32>; 3]) -> Vec<f32> {
    (0..picture[0].len()).map(|i| 0.2126 * picture[0][i] + 0.7152 * picture[1][i] + 0.0722 * picture[2][i]).collect()
}

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

/// Deviation over mean.
fn contrast(values: &[f32]) -> f32 {
    let mean = mean(values);
    let squares: Vec<f32> = values.iter().map(|v| (v - mean) * (v - mean)).collect();
    self::mean(&squares).sqrt() / mean
}

/// Leather of roughness .05, .3 and 1 looks like three surfaces (MATERIALS, section 1).
#[test]
fn roughness_changes_the_contrast_of_grain() {
    let studio = Environment::of(Scene::Studio);
    let spec = ReliefSpec { exposure: 0.1, ..spec(&studio) };
    for (of, least) in [(BROWN, [4.0, 2.0]), (BLACK, [6.0, 3.0]), (BRASS, [6.0, 3.0])] {
        let [sharp, satin, matte] =
            [0.05, 0.3, 1.0].map(|r| contrast(&luma(&lit(|x, y| grain(x, y, 0.15), of.rough(r), &spec))));
        assert!(
            sharp >= least[0] * matte && satin >= least[1] * matte,
            "{:?}: {:.2} {:.2} of {matte:.3}",
            of.base,
            sharp / matte,
            satin / matte
        );
    }
}

#[test]
fn brown_leather_is_nowhere_bluish() {
    let studio = Environment::of(Scene::Studio);
    for roughness in [0.05, 0.3, 1.0] {
        let [red, _, blue] = lit(|x, y| grain(x, y, 0.3), BROWN.rough(roughness), &spec(&studio));
        assert!(red.iter().zip(&blue).all(|(r, b)| b <= r), "{roughness}");
    }
}

#[test]
fn white_card_is_white() {
    for scene in Scene::ALL {
        let environment = Environment::of(scene);
        let spec = ReliefSpec { exposure: 0.5, ..spec(&environment) };
        let card = lit(|_, _| 0.0, WHITE, &spec).map(|plane| 2.0 * plane[SIDE * SIDE / 2]);
        // A rough white card also reflects 4 % at its surface; together with the rest it returns all light.
        assert!(card.iter().all(|c| (c - 1.0).abs() < 0.02), "{scene:?}: {card:?}");
    }
}

/// The mean colours on screens differ by more than what an eye needs.
#[test]
fn brass_steel_and_patent_can_be_told_apart() {
    for scene in Scene::ALL {
        let environment = Environment::of(scene);
        let shown = ReliefSpec { exposure: 1.0, curve: Curve::Neutral, ..spec(&environment) };
        let seen = [BRASS, STEEL, PATENT]
            .map(|of| lit(|x, y| grain(x, y, 0.15), of, &shown).map(|plane| 255.0 * srgb_encode(mean(&plane))));
        for (a, b) in [(0, 1), (1, 2), (0, 2)] {
            let apart = (0..3).map(|k| (seen[a][k] - seen[b][k]).abs()).fold(0.0, f32::max);
            assert!(apart > 20.0, "{scene:?}: {seen:?}");
        }
    }
}

/// A wall of 8 pixels that stands across the light casts a shadow of height / tan(elevation) away from it.
#[test]
fn shadows_have_the_length_of_geometry() {
    for (scene, azimuth) in
        [(Scene::Studio, 225.0_f64), (Scene::Studio, 180.0), (Scene::Sky, 180.0), (Scene::Sky, 40.0)]
    {
        let environment = Environment::of(scene);
        let spec = ReliefSpec { shadows: 60.0, azimuth: azimuth.to_radians(), ..spec(&environment) };
        let to = spec.around().unwrap().key();
        let flat = to[0].hypot(to[1]);
        let middle = SIDE as f32 / 2.0;
        // Distance from the middle, away from the light.
        let away = |x: f32, y: f32| -((x - middle) * to[0] + (y - middle) * to[1]) / flat;
        let height = 20.0;
        let wall = |x: i32, y: i32| if away(x as f32, y as f32).abs() < 4.0 { height } else { 0.0 };
        let picture = luma(&lit(wall, WHITE, &spec));
        let at = |d: f32| {
            let (x, y) = (middle - d * to[0] / flat, middle - d * to[1] / flat);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place in the picture")]
            let [x, y] = [x, y].map(|v| v.round() as usize);
            picture[y * SIDE + x]
        };
        let (dark, bright) = (at(10.0), at(70.0));
        assert!(dark < 0.75 * bright, "{scene:?} {azimuth}: {dark} {bright}");
        assert!((at(-30.0) / bright - 1.0).abs() < 0.05, "the side of the light is lit");
        let edge = (40..350).map(|k| 0.2 * k as f32).find(|d| at(*d) > 0.5 * (dark + bright)).unwrap() - 4.0;
        let expected = height * flat / to[2];
        assert!((edge / expected - 1.0).abs() < 0.12, "{scene:?} {azimuth}: {edge} for {expected}");
    }
}

/// Steps of gravel-like heights do not sparkle: no pixel is far brighter than all of its neighbours.
#[test]
fn has_no_isolated_white_pixels() {
    let studio = Environment::of(Scene::Studio);
    let steps = |x: i32, y: i32| (2.5 * grain(x, y, 0.3)).floor();
    let spec = ReliefSpec { shadows: 20.0, exposure: 1.0, curve: Curve::Neutral, ..spec(&studio) };
    let picture = luma(&lit(steps, BROWN.rough(0.2), &spec)).iter().map(|v| srgb_encode(*v)).collect::<Vec<_>>();
    let mut sparks = 0;
    for y in 1..SIDE - 1 {
        for x in 1..SIDE - 1 {
            let around =
                [1, SIDE - 1, SIDE, SIDE + 1].map(|o| max(picture[y * SIDE + x - o], picture[y * SIDE + x + o]));
            let most = around.iter().copied().fold(0.0, f32::max);
            sparks += usize::from(picture[y * SIDE + x] > most + 0.35);
        }
    }
    assert!(sparks == 0, "{sparks}");
}

/// A surface and a light that are both turned by a right angle give the turned picture.
#[test]
fn turns_with_the_azimuth() {
    let studio = Environment::of(Scene::Studio);
    let quarter = |azimuth: f64| ReliefSpec { azimuth: azimuth.to_radians(), ..spec(&studio) };
    let plain = lit(|x, y| grain(x, y, 0.2), BROWN, &quarter(225.0));
    // A quarter turn of both the surface and the light turns the picture.
    let side = index(SIDE) - 1;
    let turned = lit(|x, y| grain(y, side - x, 0.2), BROWN, &quarter(315.0));
    for y in 0..SIDE {
        for x in 0..SIDE {
            let (a, b) = (plain[0][y * SIDE + x], turned[0][x * SIDE + SIDE - 1 - y]);
            assert!((a - b).abs() < 2e-3 + 0.01 * a, "{x} {y}: {a} {b}");
        }
    }
}

/// Brushed metal reflects a streak across its fibres.
#[test]
fn gloss_is_wide_across_fibres() {
    let studio = Environment::of(Scene::Studio);
    let lit = |angle: f32| {
        let rect = Window::of(0, 0, SIDE, SIDE);
        let spec = ReliefSpec { anisotropy: 1.0, ..spec(&studio) };
        let big = rect.grow(1, 1);
        // A bowl: its normals point in all directions.
        let data: Vec<f32> = (0..big.rows())
            .flat_map(|j| (0..big.columns()).map(move |i| (i as f32 - 97.0, j as f32 - 97.0)))
            .map(|(x, y)| -0.003 * (x * x + y * y))
            .collect();
        let plane = |v: f32| vec![v; rect.len()];
        let (color, rough, one, zero) = (STEEL.base.map(plane), plane(0.3), plane(1.0), plane(0.0));
        let (share, angle) = (plane(0.9), plane(angle));
        let surface = Surface {
            color: color.each_ref().map(|c| &c[..]),
            roughness: &rough,
            occlusion: &one,
            normal: None,
            fibers: Some([&share, &angle]),
            finish: Some(Finish { metallic: &one, sheen: &zero, coat: &zero, lacquer: None }),
        };
        let mut out = [plane(0.0), plane(0.0), plane(0.0)];
        relief(&View::new(&data, big), rect, &surface, &spec, out.each_mut().map(|plane| &mut plane[..]));
        out[1].clone()
    };
    // Fibres along x: the picture changes fast along x, slowly along y.
    let changes = |picture: &[f32]| {
        let (mut along, mut down) = (0.0, 0.0);
        for i in SIDE..picture.len() - SIDE {
            along += (picture[i + 1] - picture[i - 1]).abs();
            down += (picture[i + SIDE] - picture[i - SIDE]).abs();
        }
        along / down
    };
    let (x, y) = (changes(&lit(0.0)), changes(&lit(90.0)));
    assert!(x > 1.3 * y, "{x} {y}");
}
