//! The picture of a fit: the photograph, the fit at two seeds, and the start.
use crate::quit::Quit;
use crate::sweep::{Layout, Sheet};
use shibo_fit::graph::Fitted;
use shibo_picture::Picture;
use shibo_value::{Canvas, Tile, TileMode, Window};
use std::path::Path;

/// Writes the sheet.
pub(super) fn write(path: &Path, fitted: &Fitted<'_>) -> Result<(), Quit> {
    let labels = ["photograph", "fit", "fit, other seed", "start"];
    let longest = labels.iter().map(|label| label.len()).max().unwrap_or(1);
    let mut sheet = Sheet::create(path, Layout::List { count: labels.len(), longest }, "fit")?;
    let photo = Some(fitted.fitting.photo().picture().clone());
    let pictures = [photo, fitted.picture(101), fitted.picture(102), fitted.fitting.picture_of_start(101)];
    for (picture, label) in pictures.into_iter().zip(labels) {
        let stretched = fitted.fitting.is_stretched();
        sheet.add(picture.and_then(|picture| tile(&picture, stretched)), label.to_owned())?;
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
