//! Shared by the nodes of yarn: the make of a yarn, the outputs, and messages.
use crate::bounds::told;
use crate::planes::plane;
use glam::DVec2;
use shibo_kernel::ground::hash::Hash;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::ground::window::{Frame, WindowExt as _};
use shibo_kernel::yarn::laid::{Bit, Detail, Laid};
use shibo_kernel::yarn::lines::{Line, MOST_SEGMENTS};
use shibo_kernel::yarn::section::Yarn;
use shibo_node::{Context, Output, Outputs};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Halo, Stop, Tile, Tiling, Type};
use std::sync::Arc;

/// The make of a yarn as nodes give it; mm.
pub(super) struct Make {
    pub(super) width: f64,
    pub(super) thickness: f64,
    pub(super) flat: f64,
    pub(super) plies: u32,
    /// By default four times the width.
    pub(super) twist: Option<f64>,
    /// By default a sixteenth of the width.
    pub(super) fiber: Option<f64>,
    pub(super) slub: f64,
}

impl Make {
    pub(super) fn yarn(&self) -> Yarn {
        let fiber = self.fiber.unwrap_or(self.width / 16.0);
        Yarn {
            width: 0.5 * self.width,
            thickness: 0.5 * self.thickness,
            flat: self.flat,
            plies: self.plies,
            twist: self.twist.unwrap_or(4.0 * self.width),
            fiber,
            relief: (0.4 * fiber).min(0.1 * self.thickness),
            slub: self.slub,
            slub_length: 10.0 * self.width,
        }
    }
}

/// The outputs that every node of yarn has.
pub(super) const HEIGHT: Output =
    Output::new("height", Type::Gray, "Height over the lowest place of the threads; 0 where there is none.")
        .in_unit("mm");
pub(super) const MASK: Output = Output::new("mask", Type::Gray, "How much of the place threads cover, 0..1.");
pub(super) const THREAD: Output =
    Output::new("thread", Type::Ids, "The number of the thread that shows, from 1; 0 where there is none.");
pub(super) const ALONG: Output =
    Output::new("along", Type::Gray, "The place along the thread, from its start at an edge of the canvas.")
        .in_unit("mm");
pub(super) const ACROSS: Output = Output::new(
    "across",
    Type::Gray,
    "The place across the thread, -1 to 1; positive to the right of its direction, as +y is of +x.",
);
pub(super) const DIRECTION: Output = Output::new(
    "direction",
    Type::Vec2,
    "The direction of the fibres with their twist, as a vector of length 1: for `anisotropy_angle`, \
     `Fibers` and `AlongField`.",
);
pub(super) const CROWN: Output = Output::new(
    "crown",
    Type::Gray,
    "1 on the crowns of plies, or of the thread if it has one ply, and 0 in the creases and beside them.",
);
pub(super) const FIBER: Output = Output::new(
    "fiber",
    Type::Gray,
    "1 on fibres, 0 between them, 0.5 where they are finer than pixels or there are none.",
);

/// A plane of the details.
type Read = fn(&Detail) -> f32;

/// The outputs of laid threads; `part` is the name and the type of the output that tells the part of a thread.
pub(super) fn outputs(cx: &Context<'_>, lines: &[Line], yarns: &[Yarn], hash: Hash) -> Result<Parts, Stop> {
    cx.check()?;
    let laid = Arc::new(Laid::new(lines, yarns, cx.size_mm(), hash));
    let threads = {
        let laid = laid.clone();
        Field::generate(Type::Jacobian, Tiling::BOTH, move |out, given| {
            let frame = tile::frame(out);
            let mut bits = vec![Bit::default(); out.window.len()];
            laid.fill(&|| given.check().is_err(), &frame, &mut bits);
            let planes: [fn(&Bit) -> f32; 4] = [|b| b.height, |b| b.mask, |b| b.segment as f32, |_| 0.0];
            for (plane, read) in out.planes_mut().into_iter().zip(planes) {
                plane.iter_mut().zip(&bits).for_each(|(out, bit)| *out = read(bit));
            }
            given.check()
        })
    };
    let threads = cx.shared_field("threads", threads);
    let place: [Read; 4] = [|d| d.thread as f32, |d| d.part as f32, |d| d.along, |d| d.across];
    let look: [Read; 4] = [|d| d.direction.x, |d| d.direction.y, |d| d.crown, |d| d.fiber];
    let place = cx.shared_field("place", details(&threads, &laid, place));
    let look = cx.shared_field("look", details(&threads, &laid, look));
    Ok(Parts { threads, place, look })
}

/// The shared fields of laid threads.
pub(super) struct Parts {
    /// Height, coverage, segment.
    threads: Field,
    /// Thread, part, along, across.
    place: Field,
    /// Direction, crown, fibres.
    look: Field,
}

impl Parts {
    /// The outputs that every node of yarn has.
    pub(super) fn outputs(&self) -> Outputs {
        let direction =
            Field::map(Type::Vec2, [self.look.clone()], Halo::NONE, |out: &mut Tile, [look]: [&Tile; 1]| {
                for (number, plane) in out.planes_mut().into_iter().enumerate() {
                    plane.copy_from_slice(look.plane(number));
                }
                Ok(())
            });
        Outputs::one(plane(&self.threads, Type::Gray, 0))
            .with("mask", plane(&self.threads, Type::Gray, 1))
            .with("thread", plane(&self.place, Type::Ids, 0))
            .with("along", plane(&self.place, Type::Gray, 2))
            .with("across", plane(&self.place, Type::Gray, 3))
            .with("direction", direction)
            .with("crown", plane(&self.look, Type::Gray, 2))
            .with("fiber", plane(&self.look, Type::Gray, 3))
    }

    /// The numbers of the parts of threads.
    pub(super) fn part(&self, ty: Type) -> Field {
        plane(&self.place, ty, 1)
    }

    /// A field computed from the numbers of threads.
    pub(super) fn of_thread(&self, ty: Type, of: impl Fn(f32) -> f32 + Send + Sync + 'static) -> Field {
        Field::map(ty, [self.place.clone()], Halo::NONE, move |out: &mut Tile, [place]: [&Tile; 1]| {
            out.plane_mut(0).iter_mut().zip(place.plane(0)).for_each(|(out, thread)| *out = of(*thread));
            Ok(())
        })
    }
}

/// Four planes of the details of threads.
fn details(threads: &Field, laid: &Arc<Laid>, read: [Read; 4]) -> Field {
    let laid = laid.clone();
    Field::map(Type::Jacobian, [threads.clone()], Halo::NONE, move |out: &mut Tile, [threads]: [&Tile; 1]| {
        let frame = tile::frame(out);
        let pixel = narrow((frame.step[0] * frame.step[1]).sqrt());
        let columns = frame.window.columns().max(1);
        let mut planes = out.planes_mut();
        for (k, segment) in threads.plane(2).iter().enumerate() {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number below 2^24")]
            let detail = laid.detail(*segment as u32, center(&frame, k, columns), pixel);
            for (plane, read) in planes.iter_mut().zip(read) {
                plane[k] = read(&detail);
            }
        }
        Ok(())
    })
}

/// The centre of a pixel of a window.
fn center(frame: &Frame, k: usize, columns: usize) -> DVec2 {
    let add = |first: i32, n: usize| first.saturating_add(i32::try_from(n).unwrap_or(i32::MAX));
    DVec2::from(frame.center(add(frame.window.x, k % columns), add(frame.window.y, k / columns)))
}

/// The problem with a number of segments, if there are too many; `field` makes them.
pub(super) fn too_many(what: &str, segments: f64, each: f64, field: &'static str) -> Option<Problem> {
    let most = MOST_SEGMENTS as f64;
    if segments <= most {
        return None;
    }
    let message = format!(
        "there would be {:.0} {what} on the canvas; at most {:.0} are drawn",
        segments / each,
        (most / each).floor()
    );
    Some(Problem::new(Code::TooLarge, message).at(field).help("make them larger, or use a smaller canvas"))
}

/// The problem with a length above a bound that other parameters give, if any.
pub(super) fn at_most(field: &'static str, value: f64, most: f64, why: &str) -> Option<Problem> {
    crate::bounds::exceeds(value, most).then(|| {
        let message = format!("{field} is `{}` mm; it must be at most {} mm, {why}", told(value), told(most));
        Problem::new(Code::OutOfRange, message).at(field)
    })
}
