//! A note on solids of growth time that follow a calendar, for nodes that read them.
use shibo_engine::value::{Curve, Solid};
use shibo_kernel::wood::years::Calendar;

/// A note on a time by a calendar: it is the piecewise linear function through the points of `years` (even time, year,
/// ·) of an even time. Lookups can use the even time, which has no kinks.
pub(super) struct ByCalendar {
    pub(super) even: Solid,
    pub(super) years: Curve,
}

impl ByCalendar {
    /// The even time and the calendar, if `time` is known to go by one.
    pub(super) fn of(time: &Solid) -> Option<(&Solid, Calendar)> {
        let note = time.note::<Self>()?;
        Some((&note.even, Calendar::through(&note.years.points)?))
    }
}
