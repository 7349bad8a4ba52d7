//! Compares threads with their geometry.
use super::seam::{Sewn, Stitch};
use super::thread::{Bit, Drawn, Thread};
use crate::ground::window::{Frame, WindowExt as _};
use glam::DVec2;
use shibo_value::{Tiling, Window};

const PLAIN: Thread = Thread { radius: 0.5, strands: 1, lay: 0.0, hole: 0.4, pull: 0.0, spread: 2.0 };

fn sewn(from: (f64, f64), to: (f64, f64)) -> Sewn {
    let (from, to) = (DVec2::from(from), DVec2::from(to));
    Sewn { stitches: vec![Stitch { from, to, phase: 0.0, lift: 0.0 }], holes: vec![[from; 2], [to; 2]] }
}

fn bits(drawn: &Drawn, frame: &Frame) -> Vec<Bit> {
    let mut out = vec![Bit::default(); frame.window.len()];
    drawn.fill(&|| false, frame, &mut out);
    out
}

fn canvas(tiling: Tiling) -> (DVec2, Tiling) {
    (DVec2::new(20.0, 10.0), tiling)
}

#[test]
fn a_plain_thread_is_a_capsule_that_goes_under() {
    let drawn = Drawn::new(sewn((4.0, 5.0), (8.0, 5.0)), PLAIN, canvas(Tiling::NONE));
    for step in [0.02, 0.3] {
        let side = if step < 0.1 { (1000, 500) } else { (66, 33) };
        let frame = Frame::new(Window::of(0, 0, side.0, side.1), [step; 2]);
        let out = bits(&drawn, &frame);
        // A bar of 3 mm with half circles at its ends.
        let area = out.iter().map(|bit| f64::from(bit.mask)).sum::<f64>() * step * step;
        let want = 3.0 + 0.25 * std::f64::consts::PI;
        assert!((area - want).abs() < if step < 0.1 { 0.02 } else { 0.3 }, "{area} {want}");
    }
    let frame = Frame::new(Window::of(0, 0, 1000, 500), [0.02; 2]);
    let out = bits(&drawn, &frame);
    let at = |x: usize, y: usize| out[y * 1000 + x];
    // In the middle the axis lies 0.45 radii above the ground, and the top one radius above the axis.
    assert!((at(300, 250).height - 0.725).abs() < 1e-3);
    let side = at(300, 265);
    assert!((side.height - 0.225 - (0.25f32 - 0.31 * 0.31).sqrt()).abs() < 1e-3, "{side:?}");
    assert!(at(395, 250).height < -0.1 && at(395, 250).id == 1 && at(405, 250).id == 0);
    assert_eq!(at(300, 280), Bit::default());
}

#[test]
fn strands_wind_around_each_other() {
    let thread = Thread { strands: 2, lay: 1.0, ..PLAIN };
    let drawn = Drawn::new(sewn((4.0, 5.0), (16.0, 5.0)), thread, canvas(Tiling::NONE));
    let frame = Frame::new(Window::of(900, 500, 200, 1), [0.01, 0.01]);
    // Along the thread's middle, y = 5.005: each half turn shows the next strand.
    let out = bits(&drawn, &frame);
    // Two circles of 0.56 radii on opposite sides of the axis.
    let (strand, off) = (0.28f32, 0.22f32);
    for (k, bit) in (0u16..).zip(&out) {
        let u = f32::from(k) * 0.01 + 9.005 - 10.0;
        let angle = u * std::f32::consts::TAU;
        let circle = |angle: f32| {
            let across = 0.005 - off * angle.cos();
            off * angle.sin() + (strand * strand - across * across).max(0.0).sqrt()
        };
        let want = circle(angle).max(circle(angle + std::f32::consts::PI));
        let bend = (u.abs() / 6.0).powi(3);
        let axis = 0.225 - bend * (0.225 + 0.75);
        assert!((bit.height - axis - want).abs() < 2e-3, "{u}: {} {}", bit.height - axis, want);
        assert!(bit.crown >= 0.0 && bit.crown <= 1.0);
    }
    // With coarse pixels the thread is smooth.
    let coarse = Frame::new(Window::of(0, 0, 20, 10), [1.0; 2]);
    let plain = Drawn::new(sewn((4.0, 5.0), (16.0, 5.0)), PLAIN, canvas(Tiling::NONE));
    assert_eq!(bits(&drawn, &coarse), bits(&plain, &coarse));
    let covered: f32 = bits(&drawn, &coarse).iter().map(|bit| bit.mask).sum();
    assert!((covered - 11.785).abs() < 0.5, "{covered}");
}

#[test]
fn draws_holes_and_pull() {
    let thread = Thread { pull: 0.3, ..PLAIN };
    let drawn = Drawn::new(sewn((4.0, 5.0), (8.0, 5.0)), thread, canvas(Tiling::NONE));
    let frame = Frame::new(Window::of(0, 0, 1000, 500), [0.02; 2]);
    let (mut holes, mut pull) = (vec![0.0; 500_000], vec![0.0; 500_000]);
    drawn.holes(&|| false, &frame, &mut holes);
    drawn.pull(&|| false, &frame, &mut pull);
    let area = holes.iter().map(|v| f64::from(*v)).sum::<f64>() * 4e-4;
    assert!((area - 2.0 * std::f64::consts::PI * 0.16).abs() < 0.01, "{area}");
    let at = |x: usize, y: usize| pull[y * 1000 + x];
    assert!((at(200, 250) - 0.3).abs() < 0.01 && (at(300, 250) - 0.18).abs() < 0.01);
    // One millimetre beside the middle of the stitch: from the round ground under the thread, 0.618 of 1.5616 mm.
    let rest = 1.0 - (1.25f32.sqrt() - 0.5) / (4.25f32.sqrt() - 0.5);
    assert!((at(300, 300) - 0.18 * rest * rest).abs() < 2e-3, "{}", at(300, 300));
    assert_eq!((at(300, 351), at(99, 250)), (0.0, 0.0));
}

#[test]
fn pulls_meet_without_a_crease() {
    // Two parallel stitches, 1.2 mm apart: midway both pull equally.
    let thread = Thread { pull: 1.0, ..PLAIN };
    let mut two = sewn((4.0, 5.0), (12.0, 5.0));
    let other = sewn((4.0, 6.2), (12.0, 6.2));
    two.stitches.extend(other.stitches);
    two.holes.extend(other.holes);
    let drawn = Drawn::new(two, thread, canvas(Tiling::NONE));
    let step = 0.01;
    let frame = Frame::new(Window::of(800, 400, 1, 320), [step; 2]);
    let mut pull = vec![0.0; 320];
    drawn.pull(&|| false, &frame, &mut pull);
    let slope = |k: usize| f64::from(pull[k + 1] - pull[k]) / step;
    let bends = (1..318).map(|k| (slope(k) - slope(k - 1)).abs() / step);
    // With the maximum of both, the slope would jump by about 1.2 midway, which is a bend of 120 per mm. The falloff
    // alone bends by less than 3.
    let most = bends.fold(0.0, f64::max);
    assert!(most < 8.0, "{most}");
    assert!(pull.iter().all(|v| (0.0..=0.61).contains(v)), "never deeper than the thread");
}

#[test]
fn windows_are_crops_and_repeat() {
    let mut sewn = sewn((18.0, 9.0), (23.0, 12.0));
    sewn.stitches.push(Stitch { from: DVec2::new(1.0, 1.0), to: DVec2::new(-3.0, 0.5), phase: 0.3, lift: 0.5 });
    let thread = Thread { strands: 3, lay: 2.0, pull: 0.2, ..PLAIN };
    let drawn = Drawn::new(sewn, thread, canvas(Tiling::BOTH));
    let fill = |rect: Window| {
        let frame = Frame::new(rect, [0.1; 2]);
        let (mut holes, mut pull) = (vec![0.0; rect.len()], vec![0.0; rect.len()]);
        drawn.holes(&|| false, &frame, &mut holes);
        drawn.pull(&|| false, &frame, &mut pull);
        let bits = bits(&drawn, &frame).into_iter().zip(holes.into_iter().zip(pull));
        bits.map(|(bit, (hole, pull))| [bit.height, bit.mask, bit.crown, bit.id as f32, hole, pull]).collect::<Vec<_>>()
    };
    let whole = fill(Window::of(-30, -20, 250, 140));
    assert!(whole.iter().filter(|v| v[1] > 0.0).count() > 1000);
    for (k, v) in fill(Window::of(-7, 3, 60, 41)).iter().enumerate() {
        assert_eq!(*v, whole[(23 + k / 60) * 250 + 23 + k % 60]);
    }
    let first = fill(Window::of(0, 0, 200, 100));
    for k in (0..4000_u16).step_by(997) {
        let other = fill(Window::of(200 + i32::from(k % 200), -100 + i32::from(k / 200), 1, 1))[0];
        let here = first[usize::from(k)];
        let same = here.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-3 * (1.0 + a.abs()));
        assert!(same, "{k}: {here:?} {other:?}");
    }
}
