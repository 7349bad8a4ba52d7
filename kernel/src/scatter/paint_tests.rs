//! Tests of [`paint`](super::paint).
#![expect(clippy::cast_possible_truncation, reason = "small numbers of a test")]
use super::atlas::Layout;
use super::paint::{Content, Overlap, Picture, Source, Target, paint};
use super::set::{Stamp, StampSet};
use crate::ground::hash::Hash;
use crate::ground::window::{Frame, WindowExt as _};
use glam::{DVec2, Vec2};
use shibo_value::Tiling;
use shibo_value::Window;

/// A dome: 1 in the middle, 0 at the border.
fn dome(side: usize) -> Vec<f32> {
    let at = |k: usize| (k as f32 + 0.5) / side as f32 * 2.0 - 1.0;
    let value = |k: usize| (1.0 - at(k % side).powi(2)) * (1.0 - at(k / side).powi(2)) * (1.0 + 0.3 * at(k % side));
    (0..side * side).map(value).collect()
}

fn stamps() -> Vec<Stamp> {
    let stamp = |n: u32, x: f64, y: f64, half: f32, degrees: f32, value: f32| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let (center, half, turn) = (DVec2::new(x, y), Vec2::new(half, 0.7 * half), Vec2::new(cos, sin));
        Stamp { center, half, turn, value, id: n, picture: 0 }
    };
    vec![
        stamp(1, 10.0, 8.0, 4.0, 0.0, 1.0),
        stamp(2, 12.5, 9.0, 4.0, 37.0, 0.8),
        stamp(3, 0.5, 19.0, 4.0, -120.0, 1.0),
        stamp(4, 25.0, 3.0, 2.0, 90.0, -0.5),
    ]
}

fn drawn(overlap: Overlap, frame: &Frame, background: f32, shape: bool) -> Vec<f32> {
    let side = 32;
    let layout = Layout::new(side, side);
    let (mut data, mut ones) = (vec![0.0; layout.len()], vec![0.0; layout.len()]);
    layout.build(dome(side), &mut data);
    layout.build(vec![1.0; side * side], &mut ones);
    let picture = Picture { values: vec![&data], shape: shape.then_some(&ones[..]), height: None };
    let source = Source { pictures: vec![picture], ..Source::new(&layout, Vec::new()) };
    let set = StampSet::new(stamps(), (DVec2::new(30.0, 20.0), Tiling::BOTH));
    let mut out = vec![background; frame.window.len()];
    paint(&|| false, (&set, &source, overlap), frame, Target::Values(vec![&mut out]));
    out
}

/// The same by brute force: every stamp in every copy, with the formula of the dome.
fn by_hand(overlap: Overlap, p: DVec2, background: f64) -> f64 {
    let (mut out, mut top) = (background, f64::NEG_INFINITY);
    for s in stamps() {
        for i in -2..=2 {
            for j in -2..=2 {
                let d = p - s.center - DVec2::new(f64::from(i) * 30.0, f64::from(j) * 20.0);
                let (cos, sin) = (f64::from(s.turn.x), f64::from(s.turn.y));
                let u = (cos * d.x + sin * d.y) / f64::from(s.half.x);
                let v = (cos * d.y - sin * d.x) / f64::from(s.half.y);
                if u.abs() > 1.0 || v.abs() > 1.0 {
                    continue;
                }
                let value = (1.0 - u * u) * (1.0 - v * v) * (1.0 + 0.3 * u) * f64::from(s.value);
                match overlap {
                    Overlap::Max => out = out.max(value),
                    Overlap::Add => out += value,
                    Overlap::Over => out = value,
                    Overlap::ByHeight if value > top => (out, top) = (value, value),
                    Overlap::ByHeight => {}
                }
            }
        }
    }
    out
}

#[test]
fn matches_formula_of_stamps() {
    let frame = Frame::new(Window::of(0, 0, 240, 160), [0.125, 0.125]);
    for overlap in [Overlap::Max, Overlap::Add, Overlap::Over, Overlap::ByHeight] {
        for shape in [false, true] {
            let got = drawn(overlap, &frame, 0.0, shape);
            let mut off = 0;
            for (k, got) in (0..).zip(&got) {
                let want = by_hand(overlap, DVec2::from(frame.center(k % 240, k / 240)), 0.0);
                // Pixels at an edge are partly covered.
                off += u32::from((f64::from(*got) - want).abs() > 0.03);
            }
            assert!(off < 240 * 160 / 100, "{overlap:?} {shape}: {off} pixels are off");
        }
    }
}

#[test]
fn windows_are_crops() {
    let whole = Frame::new(Window::of(-20, -10, 280, 190), [0.1237, 0.1291]);
    let part = Frame::new(Window::of(33, 7, 71, 50), [0.1237, 0.1291]);
    for overlap in [Overlap::Max, Overlap::Add, Overlap::Over, Overlap::ByHeight] {
        let (a, b) = (drawn(overlap, &whole, 0.1, false), drawn(overlap, &part, 0.1, false));
        for (k, b) in b.iter().enumerate() {
            let (x, y) = (33 + 20 + k % 71, 7 + 10 + k / 71);
            assert_eq!(a[y * 280 + x].to_bits(), b.to_bits(), "{overlap:?}");
        }
    }
}

#[test]
fn returns_id_and_position_of_top_stamp() {
    let frame = Frame::new(Window::of(0, 0, 240, 160), [0.125, 0.125]);
    let layout = Layout::new(8, 8);
    let mut data = vec![0.0; layout.len()];
    layout.build(vec![1.0; 64], &mut data);
    let source = Source::new(&layout, vec![&data]);
    let set = StampSet::new(stamps(), (DVec2::new(30.0, 20.0), Tiling::BOTH));
    let [mut ids, mut x, mut y, mut cover] = [(); 4].map(|()| vec![0.0; frame.window.len()]);
    paint(&|| false, (&set, &source, Overlap::Over), &frame, Target::Ids(&mut ids));
    paint(&|| false, (&set, &source, Overlap::Over), &frame, Target::Local([&mut x, &mut y]));
    paint(&|| false, (&set, &source, Overlap::Over), &frame, Target::Cover(&mut cover));
    let mut counts = [0; 5];
    for k in 0..ids.len() {
        counts[ids[k] as usize] += 1;
        // Two stamps that each cover just under half of a pixel together cover three quarters of it.
        assert!(if ids[k] > 0.0 { cover[k] >= 0.5 } else { cover[k] <= 0.75 }, "{k}");
        if ids[k] > 0.0 {
            let half = stamps()[ids[k] as usize - 1].half;
            assert!(x[k].abs() <= half.x + 0.1 && y[k].abs() <= half.y + 0.1);
        }
    }
    // 8 × 5.6 mm and 4 × 2.8 mm at 64 pixels to the mm²; the second lies over the first.
    assert!((counts[2] - 2867i32).abs() < 40 && (counts[3] - 2867i32).abs() < 40 && (counts[4] - 717i32).abs() < 20);
    assert!(counts[1] < 2000 && counts[1] > 500, "{counts:?}");
}

/// Many stamps that hide each other.
fn crowd(count: u32) -> Vec<Stamp> {
    let stamp = |n: u32| {
        let draw = |k: u64| Hash::new(11).with(n.into()).unit(k);
        Stamp {
            center: DVec2::new(30.0 * draw(0), 20.0 * draw(1)),
            half: Vec2::new(1.0 + 2.0 * draw(2) as f32, 1.0 + draw(3) as f32),
            turn: if n.is_multiple_of(3) { Vec2::X } else { Vec2::from_angle(7.0 * draw(4) as f32) },
            value: (1.4 * draw(5) - 0.2) as f32,
            id: n + 1,
            picture: u32::from(n % 5 < 2),
        }
    };
    (0..count).map(stamp).collect()
}

/// Two opaque pictures.
fn both<'a>(pictures: [&'a [f32]; 2]) -> Vec<Picture<'a>> {
    pictures.map(|values| Picture { values: vec![values], ..Picture::default() }).to_vec()
}

/// Drawing all stamps at once must give the same bits as drawing each stamp by itself and combining them by the
/// definition.
#[test]
fn keeps_bits_when_culling_hidden_stamps() {
    let frame = Frame::new(Window::of(-3, 5, 101, 77), [0.131, 0.127]);
    let (side, area) = (16, frame.window.len());
    let layout = Layout::new(side, side);
    let [mut data, mut ones, mut other] = [(); 3].map(|()| vec![0.0; layout.len()]);
    layout.build(dome(side), &mut data);
    layout.build(vec![1.0; side * side], &mut ones);
    layout.build(dome(side).iter().map(|v| 0.3 + 0.4 * v).collect(), &mut other);
    // Two stamps of five show the second picture.
    let content = Source { pictures: both([&data, &other]), ..Source::new(&layout, Vec::new()) };
    let full = Source { pictures: both([&ones, &ones]), ..Source::new(&layout, Vec::new()) };
    let canvas = (DVec2::new(30.0, 20.0), Tiling::BOTH);
    let draw = |stamps: &[Stamp], source: &Source<'_>, overlap: Overlap, what: u8, background: f32| {
        let (set, mut out) = (StampSet::new(stamps.to_vec(), canvas), vec![background; area]);
        let target = match what {
            0 => Target::Values(vec![&mut out]),
            1 => Target::Cover(&mut out),
            _ => Target::Ids(&mut out),
        };
        paint(&|| false, (&set, source, overlap), &frame, target);
        out
    };
    let crowd = crowd(400);
    let alone: Vec<[Vec<f32>; 2]> = (crowd.iter())
        .map(|stamp| {
            let one = [*stamp];
            let steady = Source { content: Content::Steady, ..full.clone() };
            [draw(&one, &content, Overlap::Add, 0, 0.0), draw(&one, &steady, Overlap::Add, 0, 0.0)]
        })
        .collect();
    let (largest, sum, last) = (
        draw(&crowd, &content, Overlap::Max, 0, 0.1),
        draw(&crowd, &content, Overlap::Add, 0, 0.1),
        draw(&crowd, &content, Overlap::Over, 2, 0.0),
    );
    let (highest, cover) =
        (draw(&crowd, &content, Overlap::Max, 2, 0.0), draw(&crowd, &content, Overlap::Over, 1, 0.0));
    for k in 0..area {
        let (mut max, mut added, mut on_top, mut top, mut best, mut open) = (0.1f32, 0.1f32, 0, f32::MIN, 0, 1.0f64);
        for (stamp, [value, covered]) in crowd.iter().zip(&alone) {
            if covered[k] > 0.0 {
                max = max.max(value[k]);
            }
            added += value[k];
            open *= 1.0 - f64::from(covered[k]);
            if covered[k] >= 0.5 {
                on_top = stamp.id;
                if value[k] > top {
                    (top, best) = (value[k], stamp.id);
                }
            }
        }
        assert_eq!(largest[k].to_bits(), max.to_bits(), "{k}");
        assert!((sum[k] - added).abs() < 1e-4, "{k}: {} {added}", sum[k]);
        assert_eq!((last[k], highest[k]), (on_top as f32, best as f32), "{k}");
        assert!((f64::from(cover[k]) - (1.0 - open)).abs() < 1e-5, "{k}");
    }
}

#[test]
fn shows_last_stamp_where_it_covers() {
    let frame = Frame::new(Window::of(0, 0, 120, 80), [0.25, 0.25]);
    let layout = Layout::new(1, 1);
    let mut ones = vec![0.0; layout.len()];
    layout.build(vec![1.0], &mut ones);
    let set = StampSet::new(crowd(300), (DVec2::new(30.0, 20.0), Tiling::BOTH));
    let picture = Picture { values: vec![&ones], ..Picture::default() };
    let source = Source { pictures: vec![picture; 2], ..Source::new(&layout, Vec::new()) };
    let [mut values, mut ids] = [0.0, 0.0].map(|v| vec![v; frame.window.len()]);
    paint(&|| false, (&set, &source, Overlap::Over), &frame, Target::Values(vec![&mut values]));
    paint(&|| false, (&set, &source, Overlap::Over), &frame, Target::Ids(&mut ids));
    // Inside a stamp its exact value is visible; at edges, two are blended.
    let whole = (0..ids.len()).filter(|k| ids[*k] > 0.0 && values[*k] == crowd(300)[ids[*k] as usize - 1].value);
    assert!(whole.count() > ids.len() * 6 / 10);
}

#[test]
fn rotates_angles_and_hides_stamps_below_ground() {
    let frame = Frame::new(Window::of(0, 0, 240, 160), [0.125, 0.125]);
    let layout = Layout::new(1, 1);
    let (mut ten, mut ones) = (vec![0.0; layout.len()], vec![0.0; layout.len()]);
    layout.build(vec![10.0], &mut ten);
    layout.build(vec![1.0], &mut ones);
    let set = StampSet::new(stamps(), (DVec2::new(30.0, 20.0), Tiling::BOTH));
    let source = Source { content: Content::Angle, ..Source::new(&layout, vec![&ten]) };
    let mut angle = vec![-1.0; frame.window.len()];
    paint(&|| false, (&set, &source, Overlap::Over), &frame, Target::Values(vec![&mut angle]));
    // At the middles of the second stamp, which is rotated by 37°, and of the third, and far from all.
    let at = |x: usize, y: usize| angle[y * 8 * 240 + x * 8];
    assert!((at(13, 9) - 47.0).abs() < 1e-3 && (at(1, 19) + 110.0).abs() < 1e-3 && at(20, 14) == -1.0);
    assert!(angle.iter().all(|v| [-1.0, 10.0, 47.0, -110.0, 100.0].iter().any(|known| (v - known).abs() < 1e-3)));
    // Heights are 1, 0.8, 1 and -0.5; the ground is at 0.9 on the left, at 2 on the right.
    let ground: Vec<f32> = (0..240 * 160).map(|k| if k % 240 < 92 { 0.9 } else { 2.0 }).collect();
    let picture = Picture { values: vec![&ones], shape: None, height: Some(&ones) };
    let source = Source { pictures: vec![picture], ground: Some(&ground), ..Source::new(&layout, Vec::new()) };
    let mut ids = vec![0.0; frame.window.len()];
    paint(&|| false, (&set, &source, Overlap::ByHeight), &frame, Target::Ids(&mut ids));
    for k in 0..ids.len() {
        assert!(ids[k] == 0.0 || (ground[k] < 1.0 && (ids[k] == 1.0 || ids[k] == 3.0)), "{k}");
    }
    assert!(ids[64 * 240 + 80] == 1.0 && ids[64 * 240 + 100] == 0.0);
}
