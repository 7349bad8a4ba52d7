//! The picture of a fit: the photograph, the fit at two seeds, and the start.
use super::Done;
use super::evaluate::Evaluator;
use crate::quit::Quit;
use crate::sweep::{Layout, Sheet};
use shibo_fit::{Amount, Ask};
use shibo_picture::Picture;
use shibo_value::{Canvas, Tile, TileMode, Window};
use std::path::Path;

/// Writes the sheet.
pub(super) fn write(path: &Path, done: &Done<'_>, evaluator: &Evaluator<'_>) -> Result<(), Quit> {
    let labels = ["photograph", "fit", "fit, other seed", "start"];
    let longest = labels.iter().map(|label| label.len()).max().unwrap_or(1);
    let mut sheet = Sheet::create(path, Layout::List { count: labels.len(), longest }, "fit")?;
    let found: Vec<Amount> = done.fit.found.iter().map(|found| found.amount).collect();
    let ask = |amounts: &[Amount], combination: usize, seed: u32| Ask { amounts: amounts.to_vec(), combination, seed };
    let start = done.setup.starts.first();
    let asks = [
        Some(ask(&found, done.fit.combination, 101)),
        Some(ask(&found, done.fit.combination, 102)),
        start.map(|start| ask(&start.amounts, start.combination, 101)),
    ];
    sheet.add(tile(&done.photo.picture, done.setup.stretched), labels[0].to_owned())?;
    for (ask, label) in asks.into_iter().zip(&labels[1..]) {
        let picture = ask.and_then(|ask| evaluator.picture(&ask).ok());
        sheet.add(picture.and_then(|picture| tile(&picture, done.setup.stretched)), (*label).to_owned())?;
    }
    sheet.finish()
}

/// A picture as a small tile of linear colours, by the means of areas.
fn tile(picture: &Picture, stretched: bool) -> Option<Tile> {
    let side = crate::sweep::SIDE as usize;
    let (width, height) = (picture.width as usize, picture.height as usize);
    let data = picture.data_channels();
    let all = (0..data).flat_map(|channel| picture.plane(channel)).copied();
    let (low, high) = all.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let mut planes = Vec::with_capacity(3 * side * side);
    for channel in 0..3_u8 {
        let plane = picture.plane(if data >= 3 { channel } else { 0 });
        for at in 0..side * side {
            let range = |k: usize, count: usize| {
                (k * count / side, ((k + 1) * count / side).max(k * count / side + 1).min(count))
            };
            let ((left, right), (top, bottom)) = (range(at % side, width), range(at / side, height));
            let rows = (top..bottom).flat_map(|y| &plane[y * width + left..y * width + right]);
            let (sum, count) = rows.fold((0.0_f32, 0.0_f32), |(sum, count), value| (sum + value, count + 1.0));
            let mean = sum / count.max(1.0);
            let mean = if stretched { (mean - low) / (high - low).max(1e-9) } else { mean };
            planes.push(if picture.source.is_float() { mean } else { shibo_value::srgb_to_linear(mean) });
        }
    }
    let size = glam::UVec2::splat(crate::sweep::SIDE);
    let canvas = Canvas { size_mm: size.as_dvec2(), resolution: size, tile: TileMode::None.tiling(), seed: 0 };
    let mut tile = Tile::new(canvas.grid(size), Window::full(size), 3);
    tile.data_mut().copy_from_slice(&planes);
    Some(tile)
}
