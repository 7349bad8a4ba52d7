//! Tests of threads on a canvas.
use super::braid::{BandShape, Bands, default_strand};
use super::chart::Chart;
use super::cloth::Woven;
use super::draft::Draft;
use super::knit::Knitted;
use super::laid::{Bit, Detail, Laid};
use super::section::Yarn;
use crate::ground::hash::Hash;
use crate::ground::window::{Frame, WindowExt as _};
use glam::DVec2;
use shibo_value::Window;

const SIZE: DVec2 = DVec2::new(24.0, 18.0);

fn yarn(width: f64, thickness: f64) -> Yarn {
    Yarn {
        width: 0.5 * width,
        thickness: 0.5 * thickness,
        flat: 0.0,
        plies: 3,
        twist: 4.0 * width,
        fiber: 0.1 * width,
        relief: 0.02 * width,
        slub: 0.3,
        slub_length: 10.0 * width,
    }
}

fn knit(text: &str) -> Laid {
    let chart = Chart::read(text).unwrap();
    let counts = [chart.columns.max(4), chart.rows * (6 / chart.rows).max(1)];
    let yarn_size = DVec2::new(1.2, 1.0);
    let knitted = Knitted { chart, counts, size: SIZE, yarn: yarn_size, irregular: 0.5 };
    Laid::new(&knitted.lines(Hash::new(1)), &[yarn(1.2, 1.0)], SIZE, Hash::new(2))
}

fn braid(shape: BandShape, strands: u32) -> Laid {
    let (strand, lay) = default_strand(shape, strands, 5.5);
    let bands = Bands {
        shape,
        strands,
        count: 3,
        turns: (SIZE.x / lay).round(),
        size: SIZE,
        width: 5.5,
        strand: DVec2::new(strand, strand),
        irregular: 0.5,
        alternate: true,
    };
    Laid::new(&bands.lines(Hash::new(1)), &[yarn(strand, strand); 2], SIZE, Hash::new(2))
}

fn woven(draft: &str, irregular: f64) -> (Woven, Laid) {
    let draft = Draft::read(draft).unwrap();
    let counts = [draft.warp * (16 / draft.warp), draft.weft * (12 / draft.weft)];
    let woven = Woven { draft, counts, size: SIZE, thickness: [0.9, 0.7], crimp: 0.4, irregular };
    let yarns = [yarn(1.2, 0.9), yarn(1.2, 0.7)].map(|yarn| Yarn { slub: 0.3 * irregular, relief: 0.0, ..yarn });
    let laid = Laid::new(&woven.lines(Hash::new(1)), &yarns, SIZE, Hash::new(2));
    (woven, laid)
}

/// Pixels of a window on a grid with this many pixels along x.
fn bits(laid: &Laid, count: u32, window: Window) -> (Frame, Vec<Bit>) {
    let step = SIZE.x / f64::from(count);
    let frame = Frame::new(window, [step, step]);
    let mut bits = vec![Bit::default(); window.len()];
    laid.fill(&|| false, &frame, &mut bits);
    (frame, bits)
}

fn details(laid: &Laid, frame: &Frame, bits: &[Bit]) -> Vec<Detail> {
    let columns = i32::try_from(frame.window.width).unwrap();
    let at = |k: i32| DVec2::from(frame.center(frame.window.x + k % columns, frame.window.y + k / columns));
    let pixel = frame.step[0];
    (0..).zip(bits).map(|(k, bit)| laid.detail(bit.segment, at(k), crate::ground::number::narrow(pixel))).collect()
}

fn all() -> Vec<(&'static str, Laid)> {
    vec![
        ("stocking", knit("stocking")),
        ("cable", knit("cable")),
        ("moss", knit("moss")),
        ("rope", braid(BandShape::Rope, 3)),
        ("plait", braid(BandShape::Flat, 4)),
        ("cord", braid(BandShape::Cord, 16)),
        ("plain", woven("plain", 0.6).1),
        ("herringbone", woven("herringbone", 0.6).1),
    ]
}

#[test]
fn threads_repeat_with_the_canvas() {
    for (name, laid) in all() {
        let (_, here) = bits(&laid, 96, Window::of(0, 0, 96, 72));
        let (_, there) = bits(&laid, 96, Window::of(-96, 72, 96, 72));
        let same = |a: &Bit, b: &Bit| (a.height - b.height).abs() < 1e-3 && (a.mask - b.mask).abs() < 1e-3;
        let different = here.iter().zip(&there).filter(|(a, b)| !same(a, b)).count();
        assert!(different <= here.len() / 200, "{name}: {different}");
    }
}

#[test]
fn heights_lie_between_the_lowest_and_the_highest_place() {
    for (name, laid) in all() {
        let (_, bits) = bits(&laid, 96, Window::of(0, 0, 96, 72));
        let high = f64::from(bits.iter().map(|bit| bit.height).fold(0.0, f32::max));
        assert!(bits.iter().all(|bit| bit.height >= 0.0 && (0.0..=1.0).contains(&bit.mask)), "{name}");
        assert!(high <= laid.top + 0.1 && high > 0.5 * laid.top, "{name}: {high} of {}", laid.top);
    }
    // Each thread of a cloth bends by its share around the other one; long floats rise a little.
    assert!((woven("plain", 0.0).1.top - (0.7 + 0.6 * 1.6)).abs() < 1e-6);
    assert!(woven("satin", 0.0).1.top <= 1.66 * 1.1);
    // A knitted fabric is at most three yarns thick.
    assert!(knit("stocking").top < 3.0 * 1.3);
}

#[test]
fn warp_and_weft_lie_on_top_as_drafted() {
    for draft in ["plain", "basket", "twill 2/1", "herringbone", "satin", "xx./x.x/..x"] {
        let (woven, laid) = woven(draft, 0.0);
        let pitch = woven.pitch();
        for j in 0..woven.counts[1] {
            for i in 0..woven.counts[0] {
                let at = (DVec2::new(f64::from(i), f64::from(j)) + 0.5) * pitch;
                let frame = Frame { window: Window::of(0, 0, 1, 1), origin: (at - 0.005).into(), step: [0.01; 2] };
                let mut bit = [Bit::default()];
                laid.fill(&|| false, &frame, &mut bit);
                let warp = laid.detail(bit[0].segment, at, 0.01).thread <= woven.counts[0];
                assert_eq!(warp, woven.draft.over(i.into(), j.into()), "{draft} at {i}, {j}");
            }
        }
    }
}

#[test]
fn directions_follow_the_threads() {
    let (woven, laid) = woven("twill 2/2", 0.0);
    let (frame, bits) = bits(&laid, 240, Window::of(0, 0, 240, 180));
    for detail in details(&laid, &frame, &bits) {
        assert!((detail.direction.length() - 1.0).abs() < 1e-5);
        if detail.thread > 0 {
            let along = if detail.thread <= woven.counts[0] { detail.direction.y } else { detail.direction.x };
            // The twist turns fibres by less than 50°.
            assert!(along.abs() > 0.64, "{detail:?}");
            assert!(detail.across.abs() <= 1.0 && detail.along >= 0.0);
            assert!((0.0..=1.0).contains(&detail.crown) && (0.0..=1.0).contains(&detail.fiber));
        }
    }
}

#[test]
fn places_along_a_thread_grow_by_the_distance() {
    let laid = knit("stocking");
    let (frame, bits) = bits(&laid, 240, Window::of(0, 0, 240, 180));
    let details = details(&laid, &frame, &bits);
    let (mut steps, mut wrong) = (0, 0);
    for k in 0..details.len() - 1 {
        let (a, b) = (&details[k], &details[k + 1]);
        if k % 240 < 239 && a.thread == b.thread && a.part == b.part && (a.across - b.across).abs() < 0.1 {
            steps += 1;
            wrong += usize::from((a.along - b.along).abs() > 0.5);
        }
    }
    assert!(steps > 10_000 && wrong < steps / 50, "{wrong} of {steps}");
}

#[test]
fn pictures_of_two_resolutions_agree() {
    for (name, laid) in all() {
        let (_, coarse) = bits(&laid, 160, Window::of(0, 0, 160, 120));
        let (_, fine) = bits(&laid, 480, Window::of(0, 0, 480, 360));
        // Every third pixel of the larger picture has the same middle.
        let pairs = (0..coarse.len()).map(|k| (coarse[k], fine[(k / 160 * 3 + 1) * 480 + k % 160 * 3 + 1]));
        let inside = pairs.filter(|(a, b)| a.mask == 1.0 && b.mask == 1.0 && a.segment == b.segment);
        let (mut count, mut sum) = (0.0, 0.0);
        for (a, b) in inside {
            count += 1.0;
            sum += f64::from((a.height - b.height).abs());
        }
        let mean = sum / count;
        assert!(count > 8_000.0 && mean < 0.03, "{name}: {count} pixels differ by {mean} mm");
    }
}

#[test]
fn each_line_is_a_thread() {
    assert_eq!(knit("moss").count(), 6);
    assert_eq!(braid(BandShape::Rope, 3).count(), 9);
    assert_eq!(woven("plain", 0.0).1.count(), 28);
}
