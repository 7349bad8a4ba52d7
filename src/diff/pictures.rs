//! The pictures of two versions: their differences, and a sheet that shows them.
use super::DiffArgs;
use crate::quit::Quit;
use crate::sweep::{Layout, SIDE, Sheet};
use crate::terminal::Terminal;
use crate::{environment, interrupt, library, open};
use shibo_bridge::GraphText;
use shibo_bridge::pictures::{Compared, PictureDiff, PicturesRequest, pictures};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::Session;
use shibo_value::{Tile, Window};
use std::io::IsTerminal as _;
use std::path::Path;

/// Pixels of the longer side of pictures, if a person reads the output.
const USUAL: u32 = 256;
/// The largest gain of the differences in a sheet.
const MOST_GAIN: f32 = 64.0;

/// Renders pictures, if the arguments ask for them.
pub(super) struct Pictures<'a> {
    session: Session,
    request: PicturesRequest,
    cancel: CancelToken,
    terminal: &'a Terminal,
    /// The compared pictures of all graphs, for the sheet.
    found: Vec<(String, Compared)>,
}

impl<'a> Pictures<'a> {
    /// `None` if no pictures are wanted.
    pub(super) fn of(args: &DiffArgs, terminal: &'a Terminal) -> Result<Option<Self>, Quit> {
        let asked = args.sheet.is_some() || !args.output.is_empty() || args.preset.is_some();
        let seen = !args.git && args.format == crate::check::FormatArg::Human && std::io::stdout().is_terminal();
        let size = match args.pictures.as_deref() {
            Some("none") => None,
            Some(size) => Some(size.parse().ok().filter(|size| (1..=4096).contains(size)).ok_or_else(|| {
                Quit::Usage(format!("`--pictures {size}`: write `none`, or a number of pixels from 1 to 4096"))
            })?),
            None => (asked || seen).then_some(if args.sheet.is_some() { SIDE } else { USUAL }),
        };
        let Some(size) = size else { return Ok(None) };
        let session = open::session(library::registry(), &args.engine, terminal)?;
        let cancel = CancelToken::default();
        interrupt::cancel_on_signals(&cancel);
        let request = PicturesRequest {
            size: if args.sheet.is_some() { size.min(SIDE) } else { size },
            outputs: args.output.clone(),
            preset: args.preset.clone(),
            import_paths: environment::import_paths().to_vec(),
        };
        Ok(Some(Self { session, request, cancel, terminal, found: Vec::new() }))
    }

    /// Pixels of the longer side.
    pub(super) fn size(&self) -> u32 {
        self.request.size
    }

    /// Compares the pictures of two versions. Errors are shown.
    pub(super) fn compare(
        &mut self,
        name: &str,
        before: &GraphText,
        after: &GraphText,
    ) -> Result<Vec<PictureDiff>, Quit> {
        let found = pictures(&self.session, (before, after), &self.request, &self.cancel)
            .map_err(|failed| open::failed(failed.failure, &failed.sources, self.terminal))?;
        let diffs = found.iter().map(|compared| compared.diff.clone()).collect();
        let differing = found.into_iter().filter(|one| one.before.is_some() || one.after.is_some());
        self.found.extend(differing.map(|compared| (name.to_owned(), compared)));
        Ok(diffs)
    }

    /// Writes a sheet with a row for each picture that differs: before, after, and the difference.
    pub(super) fn write_sheet(self, path: &Path) -> Result<(), Quit> {
        let several = self.found.iter().any(|(name, _)| *name != self.found[0].0);
        let gains: Vec<f32> = self.found.iter().map(|(_, compared)| gain(compared)).collect();
        let label = |((graph, compared), gain): (&(String, Compared), &f32)| {
            let graph = if several { format!("{graph} ") } else { String::new() };
            format!("{graph}{} x{gain}", compared.diff.name)
        };
        let rows = self.found.iter().zip(&gains).map(label).collect();
        let columns = ["before", "after", "difference"].map(str::to_owned).to_vec();
        let mut sheet = Sheet::create(path, Layout::Matrix { rows, columns }, "diff")?;
        for ((_, compared), gain) in self.found.iter().zip(gains) {
            let apart =
                compared.before.as_ref().zip(compared.after.as_ref()).map(|(one, other)| apart(one, other, gain));
            let range = range(compared);
            let shown = |tile: &Option<Tile>| tile.as_ref().map(|tile| three(tile, range));
            sheet.add(shown(&compared.before), String::new())?;
            sheet.add(shown(&compared.after), String::new())?;
            sheet.add(apart.map(|tile| three(&tile, (0.0, 1.0))), String::new())?;
        }
        sheet.finish()
    }
}

/// The power of two that makes the largest difference as visible as possible.
fn gain(compared: &Compared) -> f32 {
    let (Some(one), Some(other)) = (&compared.before, &compared.after) else { return 1.0 };
    let most = one.data().iter().zip(other.data()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    let mut gain = 1.0;
    while gain < MOST_GAIN && most * gain * 2.0 <= 1.0 {
        gain *= 2.0;
    }
    gain
}

/// The absolute difference of two pictures.
fn apart(one: &Tile, other: &Tile, gain: f32) -> Tile {
    let mut apart = one.clone();
    if one.data().len() == other.data().len() {
        apart.data_mut().iter_mut().zip(other.data()).for_each(|(a, b)| *a = (gain * (*a - b).abs()).min(1.0));
    }
    apart
}

/// The values shown as black and white: 0 and 1, or the extremes of both pictures where values lie outside.
fn range(compared: &Compared) -> (f32, f32) {
    let values = || [&compared.before, &compared.after].into_iter().flatten().flat_map(|tile| tile.data());
    let (low, high) = values().fold((f32::MAX, f32::MIN), |(low, high), value| (low.min(*value), high.max(*value)));
    let inside = compared.is_color || (low >= 0.0 && high <= 1.0) || low >= high;
    if inside { (0.0, 1.0) } else { (low, high) }
}

/// A picture with three channels, as the sheet takes it, with `low` shown as 0 and `high` as 1.
fn three(tile: &Tile, (low, high): (f32, f32)) -> Tile {
    let window = Window { x: 0, y: 0, ..tile.window };
    let mut shown = Tile::new(tile.grid, window, 3);
    for channel in 0..3 {
        let values = tile.plane(channel.min(tile.channels() - 1)).iter().map(|value| (value - low) / (high - low));
        shown.plane_mut(channel).iter_mut().zip(values).for_each(|(shown, value)| *shown = value);
    }
    shown
}
