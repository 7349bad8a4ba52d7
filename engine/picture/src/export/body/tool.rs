//! The check of a relief for a milling tool.
use super::super::heights::{Stop, place, refused_at, told};
use crate::WriteError;
use crate::value::diagnostics::{Code, Problem};
use glam::DVec2;
use serde_json::{Value as Json, json};
use shibo_kernel::body::{Heights, Left, MOST_REACH};
use std::io;

/// The material that a tool with a ball end leaves on a relief.
pub(super) struct Milled {
    /// The diameter of the tool in mm.
    diameter: f64,
    left: Left,
    /// The place of the most material on the picture, in mm.
    at: [f64; 2],
}

impl Milled {
    /// The material that a tool of this diameter leaves; `error` mm of it are allowed. `on_picture` takes a place on the
    /// samples to the picture.
    ///
    /// # Errors
    /// The tool reaches over too many samples, the heights cannot be read, or the work was stopped.
    pub(super) fn new(
        (heights, on_picture): (&Heights<'_>, &dyn Fn([f64; 2]) -> DVec2),
        (diameter, error): (f64, f64),
        (failed, stop): (&dyn Fn(io::Error) -> WriteError, Stop<'_>),
    ) -> Result<Self, WriteError> {
        let radius = 0.5 * diameter;
        let reach = heights.reach_of_ball(radius).into_iter().max().unwrap_or(0);
        if reach > MOST_REACH {
            let message = format!(
                "the tool of {} mm reaches over {reach} samples; at most {MOST_REACH} are checked",
                told(diameter)
            );
            let help = "lower `--resolution` for the check, or leave `tool` out";
            return Err(refused_at("tool", Code::TooLarge, message, help));
        }
        let left = heights.left_by_ball(radius, error, stop).map_err(failed)?;
        let [column, row] = heights.of_pixel(left.at);
        let at = on_picture(heights.place(column, row)).to_array();
        Ok(Self { diameter, left, at })
    }

    /// The warning about a tool that leaves more than the error.
    pub(super) fn advice(&self, error: f64) -> Option<Problem> {
        if self.left.share <= 0.0 {
            return None;
        }
        let message = format!(
            "a tool of {} mm with a ball end leaves up to {} mm of material, at {}, and more than {} mm on {} % of the relief",
            told(self.diameter),
            told(f64::from(self.left.greatest)),
            place(self.at.into()),
            told(error),
            told(100.0 * self.left.share),
        );
        let help = "take a smaller tool for these places, or make the height with `ToolReach`, which shows the relief \
                    that the tool can mill";
        let [x, y] = self.at;
        Some(Problem::new(Code::Advice, message).at("tool").help(help).at_mm([x, y, 0.0]))
    }

    /// The figures for the report.
    pub(super) fn json(&self) -> Json {
        json!({
            "diameter_mm": self.diameter,
            "left_mm": self.left.greatest,
            "left_at_mm": self.at,
            "left_share": self.left.share,
        })
    }
}
