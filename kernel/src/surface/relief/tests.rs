//! Tests of the lit picture.
use super::*;

#[test]
fn slopes_towards_the_light_are_brighter() {
    let (rect, big) = (Window::of(0, 0, 8, 8), Window::of(-1, -1, 10, 10));
    let one = vec![1.0; 64];
    let half = vec![0.3; 64];
    let surface =
        Surface { color: [&half; 3], roughness: &half, occlusion: &one, normal: None, fibers: None, finish: None };
    let mut values = Vec::new();
    for slope in [-0.2, 0.0, 0.2] {
        let data: Vec<f32> = (0..100u8).map(|k| slope * f32::from(k % 10)).collect();
        let [mut r, mut g, mut b] = [(); 3].map(|()| vec![0.0; 64]);
        relief(&View::new(&data, big), rect, &surface, &ReliefSpec::new([1.0; 2]), [&mut r, &mut g, &mut b]);
        assert!(r.iter().chain(&g).chain(&b).all(|v| (0.0..=1.0).contains(v)));
        values.push(g[27]);
    }
    assert!(values[2] > values[1] && values[1] > values[0], "{values:?}");
}

/// The picture of a slope up to the lower right, of a colour with a finish. A slope of .33 mirrors the light.
fn finished(slope: f32, base: [f32; 3], finish: Option<[f32; 3]>) -> [f32; 3] {
    lacquered(slope, base, finish, None)
}

/// The same, with the coat's roughness, its normal and the emission.
fn lacquered(
    slope: f32,
    base: [f32; 3],
    finish: Option<[f32; 3]>,
    lacquer: Option<(f32, Option<[f32; 3]>, f32)>,
) -> [f32; 3] {
    let own = lacquer.map(|(rough, normal, glow)| {
        (vec![rough; 64], normal.map(|n| n.map(|v| vec![0.5 + 0.5 * v; 64])), vec![glow; 64])
    });
    let lacquer = own.as_ref().map(|(roughness, normal, glow)| Lacquer {
        roughness,
        normal: normal.as_ref().map(|n| n.each_ref().map(|plane| &plane[..])),
        emission: [glow; 3],
    });
    let (rect, big) = (Window::of(0, 0, 8, 8), Window::of(-1, -1, 10, 10));
    let plane = |v: f32| vec![v; 64];
    let (color, half, one) = (base.map(plane), plane(0.5), plane(1.0));
    let finish = finish.map(|shares| shares.map(plane));
    let finish = finish.as_ref().map(|[metallic, sheen, coat]| Finish { metallic, sheen, coat, lacquer });
    let surface = Surface {
        color: color.each_ref().map(|c| &c[..]),
        roughness: &half,
        occlusion: &one,
        normal: None,
        fibers: None,
        finish,
    };
    let data: Vec<f32> = (0..100u8).map(|k| slope * f32::from(k % 10 + k / 10)).collect();
    let mut out = [plane(0.0), plane(0.0), plane(0.0)];
    let planes = out.each_mut().map(|plane| &mut plane[..]);
    relief(&View::new(&data, big), rect, &surface, &ReliefSpec::new([1.0; 2]), planes);
    out.map(|plane| plane[27])
}

#[test]
fn metal_coat_and_sheen_show() {
    let red = [0.5, 0.1, 0.1];
    let plain = finished(0.3, red, None);
    let none = finished(0.3, red, Some([0.0; 3]));
    assert!(plain.iter().zip(none).all(|(a, b)| (a - b).abs() < 1e-5), "{plain:?} {none:?}");
    // Metal tints its highlight: the share of red in it is that of the metal.
    let metal = finished(0.1, red, Some([1.0, 0.0, 0.0]));
    assert!(metal[0] / metal[1] > 2.0, "{metal:?}");
    // A coat has a white highlight of its own; sheen is bright where it is seen from the side.
    let coat = finished(0.33, red, Some([0.0, 0.0, 1.0]));
    assert!(coat[1] - finished(0.33, red, None)[1] > 0.05, "{coat:?}");
    let gain = |slope| finished(slope, red, Some([0.0, 1.0, 0.0]))[1] - finished(slope, red, None)[1];
    assert!(gain(2.0) > 0.01 && gain(0.0).abs() < 1e-6, "{} {}", gain(2.0), gain(0.0));
}

#[test]
fn shades_lacquer_with_own_normal_and_roughness() {
    let (gray, coat) = ([0.2; 3], Some([0.0, 0.0, 1.0]));
    // Without a normal and with the default roughness, the coat equals a plain one.
    let same = lacquered(0.33, gray, coat, Some((COAT, None, 0.0)));
    assert!(same.iter().zip(finished(0.33, gray, coat)).all(|(a, b)| (a - b).abs() < 1e-6));
    // A level coat on a slope that mirrors the light does not mirror it; a coat with that slope on level ground does.
    let level = lacquered(0.33, gray, coat, Some((COAT, Some([0.0, 0.0, 1.0]), 0.0)));
    assert!(same[1] - level[1] > 0.05, "{same:?} {level:?}");
    // The ground falls towards the upper left: its normal points there, which is up with y up.
    let z = 1.0 / (1.0 + 2.0 * 0.33_f32 * 0.33).sqrt();
    let sloping = Some([-0.33 * z, 0.33 * z, z]);
    let tilted = lacquered(0.0, gray, coat, Some((COAT, sloping, 0.0)));
    assert!(tilted[1] - finished(0.0, gray, coat)[1] > 0.05, "{tilted:?}");
    let glowing = lacquered(0.0, gray, None.or(Some([0.0; 3])), Some((COAT, None, 0.3)));
    assert!(glowing[1] > finished(0.0, gray, None)[1] + 0.05, "{glowing:?}");
}

/// The picture of a level surface of a colour with fibres at an angle, and a normal.
fn fibrous(angle: f32, normal: [f32; 3], gain: f64) -> [f32; 3] {
    let (rect, big) = (Window::of(0, 0, 8, 8), Window::of(-1, -1, 10, 10));
    let plane = |v: f32| vec![v; 64];
    let (color, rough, one, angle) = ([plane(0.5), plane(0.3), plane(0.1)], plane(0.6), plane(1.0), plane(angle));
    let normal = normal.map(|v| plane(0.5 + 0.5 * v));
    let surface = Surface {
        color: color.each_ref().map(|c| &c[..]),
        roughness: &rough,
        occlusion: &one,
        normal: Some(normal.each_ref().map(|c| &c[..])),
        fibers: (gain > 0.0).then_some([&one, &angle]),
        finish: None,
    };
    let spec = ReliefSpec { fibers: gain, curve: Curve::Neutral, exposure: 0.4, ..ReliefSpec::new([1.0; 2]) };
    let mut out = [plane(0.0), plane(0.0), plane(0.0)];
    relief(&View::new(&[0.0; 100], big), rect, &surface, &spec, out.each_mut().map(|plane| &mut plane[..]));
    out.map(|plane| plane[27])
}

#[test]
fn fibres_shine_across_the_light_and_in_their_own_colour() {
    let up = [0.0, 0.0, 1.0];
    // The light comes from 225°: fibres at 135° lie across it and reflect it up, those at 45° do not.
    let (across, along) = (fibrous(135.0, up, 0.6), fibrous(45.0, up, 0.6));
    assert!(across[0] > 1.2 * along[0], "{across:?} {along:?}");
    let none = fibrous(135.0, up, 0.0);
    let more: Vec<f32> = (0..3).map(|k| across[k] - none[k]).collect();
    assert!(more[0] > 0.02 && more[0] > 2.0 * more[2], "{more:?}");
    // Tilts towards the light and away from it look different, so figure is visible.
    let tilted = |s: f32| {
        fibrous(0.0, [s, 0.0, (1.0 - s * s).sqrt()], 0.6)[0] - fibrous(0.0, [s, 0.0, (1.0 - s * s).sqrt()], 0.0)[0]
    };
    assert!((tilted(0.08) - tilted(-0.08)).abs() > 0.02, "{} {}", tilted(0.08), tilted(-0.08));
}

#[test]
fn a_normal_takes_the_place_of_the_height() {
    let level = fibrous(0.0, [0.0, 0.0, 1.0], 0.0);
    let z = (1.0_f32 - 2.0 * 0.04).sqrt();
    // Up is y: this normal faces the light, which comes from the upper left.
    let facing = fibrous(0.0, [-0.2, 0.2, z], 0.0);
    assert!(facing[1] > level[1] + 0.01, "{facing:?} {level:?}");
}
