//! The built-in environments as functions of the direction.
//!
//! Directions are those of a camera: +x to the right, +y up, +z from the surface to the viewer. The camera looks down
//! at the ground by 53°, so the sky is above and behind it.
use super::octahedron::Texel;
use super::{Scene, dot};
use crate::ground::math::{lerp, smooth};

/// The zenith, as seen by the camera.
const UP: [f32; 3] = [0.0, 0.6, 0.8];

/// Turns a direction of the camera to one of the world: +y is the zenith, and -z the horizon before the camera.
pub(super) fn to_world([x, y, z]: [f32; 3]) -> [f32; 3] {
    [x, UP[1] * y + UP[2] * z, UP[1] * z - UP[2] * y]
}

/// A rectangular light far away.
struct Panel {
    /// Direction to its middle; length 1.
    to: [f32; 3],
    /// Direction along its width; length 1, at right angles to `to`.
    side: [f32; 3],
    /// Half its width and height at distance 1.
    half: [f32; 2],
    /// Width of its soft edge at distance 1.
    soft: f32,
}

impl Panel {
    /// A panel whose sides are horizontal and vertical in the picture.
    fn new(to: [f32; 3], half: [f32; 2], soft: f32) -> Self {
        let to = unit(to);
        let side = unit([to[2], 0.0, -to[0]]);
        Self { to, side, half, soft }
    }

    /// Place of a direction on the panel, in units of its half width and height; `None` behind it.
    fn place(&self, d: [f32; 3]) -> Option<[f32; 2]> {
        let z = dot(d, self.to);
        if z <= 0.05 {
            return None;
        }
        let [a, b, c] = self.to;
        let [p, q, r] = self.side;
        let up = [b * r - c * q, c * p - a * r, a * q - b * p];
        Some([dot(d, self.side) / (z * self.half[0]), dot(d, up) / (z * self.half[1])])
    }

    /// 1 on the panel, 0 beside it.
    fn cover(&self, d: [f32; 3]) -> f32 {
        self.place(d).map_or(0.0, |at| {
            let inside = |k: usize| smooth((self.half[k] * (1.0 - at[k].abs()) + self.soft) / (2.0 * self.soft));
            inside(0) * inside(1)
        })
    }
}

fn unit(v: [f32; 3]) -> [f32; 3] {
    let long = dot(v, v).sqrt();
    v.map(|c| c / long)
}

fn gray(v: f32) -> Texel {
    [v, v, v, 0.0]
}

fn add(texel: Texel, color: [f32; 3], amount: f32) -> Texel {
    let [r, g, b, key] = texel;
    [r + color[0] * amount, g + color[1] * amount, b + color[2] * amount, key]
}

/// Light from a direction: all light in red, green and blue, and the amount of key light in it. The colour of the key
/// light is [`key_color`].
pub(super) fn light(scene: Scene, d: [f32; 3]) -> Texel {
    let rise = dot(d, UP);
    let key = key(scene, d);
    let rest = match scene {
        Scene::Studio => studio(d),
        Scene::Overcast => {
            // A bright sky all around, darker towards the horizon, and gray ground.
            let sky = lerp(0.75, 1.1, smooth(rise));
            let ground = [0.24, 0.23, 0.21];
            let share = smooth(0.5 + rise / 0.3);
            let [r, g, b] = [0.97, 1.0, 1.04].map(|c| c * sky);
            [lerp(ground[0], r, share), lerp(ground[1], g, share), lerp(ground[2], b, share), 0.0]
        }
        Scene::Window => {
            // Walls of a room that the window lights; a pale wall stands opposite to it.
            let wall = lerp(0.1, 0.3, smooth(0.5 + 0.6 * d[0]));
            let floor = smooth(0.5 - rise / 0.5);
            let room = add(gray(0.0), [1.06, 1.0, 0.92], wall);
            add(room, [0.05, 0.03, 0.0], floor)
        }
        Scene::Sky => {
            // A blue sky that is paler towards the horizon, and earth.
            let share = smooth(0.5 + rise / 0.16);
            let high = smooth(rise);
            let sky = [lerp(0.85, 0.3, high), lerp(0.95, 0.48, high), lerp(1.05, 0.85, high)];
            let earth = [0.3, 0.26, 0.2];
            [lerp(earth[0], sky[0], share), lerp(earth[1], sky[1], share), lerp(earth[2], sky[2], share), 0.0]
        }
    };
    let [r, g, b, _] = add(rest, key_color(scene), key);
    [r, g, b, key]
}

/// Soft boxes in a gray room: a strip at the right, a panel above, a dim panel behind the surface. The walls are brighter
/// above the camera than below it, so polished surfaces that are nearly level show their waves.
fn studio(d: [f32; 3]) -> Texel {
    let fill = lerp(0.13, 0.47, smooth(0.5 + d[1] / 0.26));
    let strip = Panel::new([0.86, 0.05, 0.42], [0.13, 0.8], 0.03);
    let above = Panel::new([0.15, 0.95, 0.22], [0.7, 0.2], 0.03);
    let behind = Panel::new([0.5, -0.55, -0.6], [0.3, 0.6], 0.1);
    gray(fill + 4.2 * strip.cover(d) + 3.2 * above.cover(d) + 0.8 * behind.cover(d))
}

/// The colour of the key light.
pub(super) const fn key_color(scene: Scene) -> [f32; 3] {
    match scene {
        Scene::Studio => [1.0, 1.0, 1.0],
        Scene::Overcast => [1.0, 0.99, 0.97],
        Scene::Window => [0.97, 1.0, 1.05],
        Scene::Sky => [1.0, 0.94, 0.84],
    }
}

/// The amount of key light from a direction.
fn key(scene: Scene, d: [f32; 3]) -> f32 {
    match scene {
        Scene::Studio => 9.0 * Panel::new([-0.45, 0.45, 0.77], [0.36, 0.26], 0.03).cover(d),
        Scene::Overcast => {
            // The sun behind clouds.
            let near = dot(d, unit([-0.42, 0.5, 0.76]));
            1.5 * smooth((near - 0.72) / 0.28)
        }
        Scene::Window => {
            // Two by three panes between bars.
            let window = Panel::new([-0.72, 0.3, 0.62], [0.42, 0.55], 0.02);
            let bars = window.place(d).map_or(0.0, |[x, y]| {
                let bar = |from: f32, half: f32| smooth((from.abs() - half) / 0.03);
                bar(x, 0.04) * bar(y - 0.34, 0.035) * bar(y + 0.34, 0.035)
            });
            8.0 * window.cover(d) * bars
        }
        Scene::Sky => {
            // The sun with the bright sky around it. The disk has a radius of 2°, so that it needs no finer map.
            let near = dot(d, unit([-0.5, 0.5, 0.707]));
            let disk = smooth((near - 0.999_1) / 0.000_6);
            650.0 * disk + 0.5 * smooth((near - 0.9) / 0.1)
        }
    }
}
