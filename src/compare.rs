//! `shibo compare`: the differences between two pictures of a material.
use crate::check::FormatArg;
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::Args;
use shibo_bridge::compare::{CompareRequest, Comparison, compare};
use shibo_picture::{Picture, ReadLimits, read};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo compare out/lit.png reference.png --width-mm 40
  shibo compare a.png b.png --width-mm 60 --width-mm-b 40      pictures of different sizes
  shibo compare a.png b.png --format json --max-distance 0.5   for scripts; exit code 1 when farther apart

The pictures need not show the same place: statistics are compared, not pixels. Pictures are compared as shown on a screen, at the
same mm per pixel and at most 256 pixels wide. Each difference has an error, and words appear only for differences above it.";

/// Tell the differences between two pictures of a material.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CompareArgs {
    /// The picture.
    a: PathBuf,
    /// The picture that it is compared with.
    b: PathBuf,
    /// Width of the pictures in mm.
    #[arg(long, value_name = "W")]
    width_mm: Option<f64>,
    /// Width of the second picture in mm, if it is another one.
    #[arg(long, value_name = "W")]
    width_mm_b: Option<f64>,
    /// Exit with 1 if the distance is larger.
    #[arg(long, value_name = "D")]
    max_distance: Option<f64>,
    /// For people, or for programs.
    #[arg(long, default_value = "human")]
    format: FormatArg,
}

/// Runs the command.
pub(crate) fn run(args: &CompareArgs, terminal: &Terminal) -> Result<(), Quit> {
    let picture = |path: &Path| -> Result<Picture, Quit> {
        read(path, &ReadLimits::default()).map_err(|error| Quit::failed(error.to_string()))
    };
    let request = CompareRequest { width_mm_a: args.width_mm, width_mm_b: args.width_mm_b };
    let found = compare(&picture(&args.a)?, &picture(&args.b)?, &request).map_err(Quit::failed)?;
    match args.format {
        FormatArg::Json => terminal.json(&found)?,
        FormatArg::Human => terminal.data(&page(&found))?,
    }
    if args.max_distance.is_some_and(|most| found.distance > most) { Err(Quit::Shown) } else { Ok(()) }
}

fn page(found: &Comparison) -> String {
    let floor = found.floor.map(|floor| format!(" (floor {floor:.2})")).unwrap_or_default();
    let parts = found.parts;
    let mut page = format!(
        "distance {:.2}{floor}: colour {:.2}, energy {:.2}, shape {:.2}, correlations {:.2}, phase {:.2}\n",
        found.distance, parts.color, parts.energy, parts.shape, parts.corr, parts.phase
    );
    for words in &found.words {
        page += &format!("  {words}\n");
    }
    page
}
