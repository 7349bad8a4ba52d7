//! Marks solids of growth time that follow a calendar, for nodes that read them.
use shibo_kernel::wood::years::Calendar;
use shibo_value::{Curve, Solid};

/// Marks a time by a calendar: the time is a piecewise linear function of an even time, through the points (even time,
/// year, ·) of `years`. Lookups can use the even time, which has no kinks.
pub(crate) struct ByCalendar {
    pub(crate) even: Solid,
    pub(crate) years: Curve,
}

impl ByCalendar {
    /// The even time and the calendar, if `time` is marked.
    pub(crate) fn of(time: &Solid) -> Option<(&Solid, Calendar)> {
        let note = time.note::<Self>()?;
        Some((&note.even, Calendar::through(&note.years.points)?))
    }
}
