//! Tests of environments.
use super::*;

fn gray(d: [f32; 3], f: impl Fn([f32; 3]) -> f32) -> Texel {
    let v = f(d);
    [v, v, v, 0.0]
}

/// The light on a white card with normal `n`.
fn card(environment: &Environment, n: [f32; 3]) -> [f32; 3] {
    let (key, light) = environment.key();
    let ambient = environment.ambient(n);
    [0, 1, 2].map(|k| ambient[k] + light[k] * dot(n, key).max(0.0))
}

#[test]
fn white_card_is_white_in_every_scene() {
    for scene in Scene::ALL {
        let white = card(&Environment::of(scene), [0.0, 0.0, 1.0]);
        assert!(white.iter().all(|c| (c - 1.0).abs() < 1e-3), "{scene:?}: {white:?}");
    }
}

#[test]
fn even_light_is_even_at_every_roughness() {
    let even = Environment::from_map(Map::of(64, |d| gray(d, |_| 3.0)), [1.0; 3], true);
    for level in even.levels() {
        assert!(level.texels().iter().all(|t| (t[0] - 1.0).abs() < 2e-3), "{}", level.size());
    }
    for n in [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, -1.0, 0.0]] {
        assert!((even.ambient(n)[1] - 1.0).abs() < 2e-3, "{:?}", even.ambient(n));
    }
}

/// Blurring keeps the light: the mean over all directions is that of the sharp map.
#[test]
fn blurred_levels_keep_the_mean() {
    for scene in Scene::ALL {
        let environment = Environment::of(scene);
        let mean = |map: &Map| map.sum(|_, t, angle| [t[1] * angle])[0];
        let sharp = mean(&environment.levels()[0]);
        for level in environment.levels() {
            assert!((mean(level) / sharp - 1.0).abs() < 0.06, "{scene:?} {}: {}", level.size(), mean(level) / sharp);
        }
    }
}

/// The studio has no colour, and its highlights become wider and weaker with roughness.
#[test]
fn studio_is_neutral_and_rough_surfaces_blur_it() {
    let studio = Environment::of(Scene::Studio);
    let (key, _) = studio.key();
    let mut before = f32::INFINITY;
    for step in 0..=6_u8 {
        let light = studio.reflected(key, f32::from(step) / 6.0);
        assert!((light[0] - light[2]).abs() < 1e-3 * light[0], "{light:?}");
        assert!(light[0] < before, "{step}: {light:?}");
        assert!(light[3] > 0.0);
        before = light[0];
    }
}

/// Compares the level of roughness .5 with an integral over all directions.
#[test]
fn blurred_level_equals_the_integral() {
    let environment = Environment::of(Scene::Studio);
    let level = 3;
    let roughness: f32 = 0.5;
    let a2 = roughness.powi(4);
    for z in [[0.0, 0.0, 1.0], [-0.48, 0.48, 0.734], [0.8, 0.0, 0.6]] {
        let [sum, all] = environment.levels()[0].sum(|d, t, angle| {
            let nl = dot(d, z);
            if nl <= 0.0 {
                return [0.0; 2];
            }
            let h = [0, 1, 2].map(|k| d[k] + z[k]);
            let nh2 = dot(h, z) * dot(h, z) / dot(h, h);
            let spread = nh2 * (a2 - 1.0) + 1.0;
            let weight = nl * a2 / (spread * spread) * angle;
            [weight * t[1], weight]
        });
        let (found, expected) = (f64::from(environment.levels()[level].at(place(z))[1]), sum / all);
        assert!((found / expected - 1.0).abs() < 0.06, "{z:?}: {found} {expected}");
    }
}

/// A panorama of a function of the direction of the world.
fn made(width: usize, f: impl Fn([f32; 3]) -> f32) -> Result<Environment, String> {
    let height = width / 2;
    let plane: Vec<f32> = (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let turn = std::f32::consts::TAU * ((x as f32 + 0.5) / width as f32 - 0.5);
            let polar = std::f32::consts::PI * (y as f32 + 0.5) / height as f32;
            f([polar.sin() * turn.sin(), polar.cos(), -polar.sin() * turn.cos()])
        })
        .collect();
    panorama(&Panorama { width, height, planes: [&plane, &plane, &plane] })
}

#[test]
fn panorama_lights_from_its_side() {
    let right = made(512, |d| f32::from(u8::from(d[0] > 0.0))).unwrap();
    // The half that the card sees gives it the brightness 1; one that faces the lit half gets all its light.
    for (n, light) in [([1.0, 0.0, 0.0], 2.0), ([0.0, 0.0, 1.0], 1.0), ([-1.0, 0.0, 0.0], 0.0)] {
        assert!((card(&right, n)[0] - light).abs() < 0.08, "{n:?}: {:?}", card(&right, n));
    }
    let above = made(512, |d| f32::from(u8::from(d[1] > 0.0))).unwrap();
    assert!(card(&above, [0.0, 0.6, 0.8])[0] > 1.05);
    let mirrored = |d| above.reflected(d, 0.0)[0];
    assert!(mirrored([0.0, 0.6, 0.8]) > 0.9 && mirrored([0.0, -0.6, -0.8]) < 0.01);
}

#[test]
fn sun_of_a_panorama_is_the_key_light() {
    let to = [0.4_f32, 0.5, 0.6];
    let long = dot(to, to).sqrt();
    let to = to.map(|c| c / long);
    let with = |sun: f32| made(1024, move |d| if dot(d, to) > 0.9998 { sun } else { 1.0 }).unwrap();
    let lit = with(20_000.0);
    let (key, light) = lit.key();
    assert!(dot(scenes::to_world(key), to) > 0.9995, "{key:?}");
    assert!(light[0] > 0.5);
    assert_eq!(with(4.0).key().1, [0.0; 3]);
}

#[test]
fn rejects_pictures_that_are_no_panoramas() {
    let plane = vec![1.0; 64 * 16];
    let planes = [&plane[..]; 3];
    assert!(panorama(&Panorama { width: 64, height: 16, planes }).unwrap_err().contains("twice as wide as high"));
    assert!(panorama(&Panorama { width: 64, height: 32, planes }).unwrap_err().contains("too few"));
    assert!(made(64, |_| 0.0).unwrap_err().contains("black"));
    // Values that are not finite do no harm.
    let odd = made(64, |d| if d[1] > 0.9 { f32::NAN } else { 1.0 }).unwrap();
    assert!(odd.levels().iter().all(|level| level.texels().iter().flatten().all(|v| v.is_finite())));
}

/// A thread that waits for parts of an environment may take other work that needs the same one.
#[test]
fn gives_environments_to_all_threads_at_once() {
    use rayon::prelude::*;
    let all: Vec<_> = (0..64).into_par_iter().map(|k| Environment::of(Scene::ALL[k % 4])).collect();
    assert!((4..64).all(|k| Arc::ptr_eq(&all[k], &all[k - 4])));
}
