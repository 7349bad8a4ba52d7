//! Small pictures of points and lines.
use glam::{DVec2, Vec2};
use shibo_value::Sketch;

/// Width and height in pixels.
pub(super) const SIDE: u32 = 160;
const PAPER: u8 = 245;
const INK: u8 = 40;

/// Draws points and lines of a canvas of this size, dark on light, one byte per pixel. `None` for a sketch that
/// consists of pixels.
pub(super) fn draw(sketch: &Sketch, canvas: DVec2) -> Option<Vec<u8>> {
    let (points, lines): (Vec<Vec2>, Vec<[Vec2; 2]>) = match sketch {
        Sketch::Canvas(shapes) => (shapes.points.clone(), shapes.lines.clone()),
        // Front view: x to the right, z up.
        Sketch::Space(shapes) => {
            let flat = |p: &glam::DVec3| DVec2::new(p.x, -p.z).as_vec2();
            (shapes.points.iter().map(flat).collect(), shapes.lines.iter().map(|[a, b]| [flat(a), flat(b)]).collect())
        }
        Sketch::Pixels(_) => return None,
    };
    let (low, size) = if matches!(sketch, Sketch::Canvas(_)) {
        (Vec2::ZERO, canvas.as_vec2())
    } else {
        let all = points.iter().copied().chain(lines.iter().flatten().copied());
        let (low, high) = all.fold((Vec2::MAX, Vec2::MIN), |(low, high), p| (low.min(p), high.max(p)));
        if low.x > high.x {
            return None;
        }
        (low, high - low)
    };
    let scale = (SIDE as f32 - 4.0) / size.max_element().max(1e-6);
    let place = |p: Vec2| (p - low) * scale + 2.0;
    let mut pixels = vec![PAPER; (SIDE * SIDE) as usize];
    for [a, b] in lines {
        let (a, b) = (place(a), place(b));
        line(&mut pixels, a, b);
    }
    for p in points.into_iter().map(place) {
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            dot(&mut pixels, p + Vec2::new(dx, dy) - 0.5);
        }
    }
    Some(pixels)
}

fn line(pixels: &mut [u8], a: Vec2, b: Vec2) {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bounded by the side of the picture")]
    let steps = (b - a).abs().max_element().clamp(1.0, 4.0 * SIDE as f32) as u32;
    for i in 0..=steps {
        dot(pixels, a.lerp(b, i as f32 / steps as f32));
    }
}

fn dot(pixels: &mut [u8], at: Vec2) {
    let inside = at.cmpge(Vec2::ZERO).all() && at.cmplt(Vec2::splat(SIDE as f32)).all();
    if inside {
        let at = at.as_uvec2();
        pixels[(at.y * SIDE + at.x) as usize] = INK;
    }
}
