//! Comparison with golden pictures.
use crate::bless;
use crate::picture::Picture;
use std::path::{Path, PathBuf};

/// Largest mean difference, in steps of 255.
const MEAN: f64 = 1.5;
/// Largest difference of 999 of 1000 samples, in steps of 255.
const MOST: u8 = 12;

/// Path of the comparison picture for a failed test.
fn shown_at(path: &Path) -> PathBuf {
    let folder = path.parent().and_then(Path::file_name).unwrap_or_default();
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("differences").join(folder).join(path.file_name().unwrap_or_default())
}

/// Compares a picture with the golden one at `path`. If they differ, expected, actual and difference are written side
/// by side, or with `BLESS=1` the golden one is rewritten.
pub(crate) fn compare(path: &Path, made: &Picture) -> Result<(), String> {
    let kept = Picture::read(path);
    let difference = kept.as_ref().and_then(|kept| kept.difference(made));
    if difference.as_ref().is_some_and(|difference| difference.within(MEAN, MOST)) {
        return Ok(());
    }
    if bless::blessing() {
        made.write(path)?;
        // The mean difference is what a line of library/changes.ron needs as `worst`.
        let worst = difference.map(|difference| format!(", worst: {:.3}", difference.mean / 255.0));
        bless::say(&format!("rewrote{}", worst.unwrap_or_default()), path);
        return Ok(());
    }
    let reason = match (&kept, difference) {
        (None, _) => "there is no such picture".to_owned(),
        (Some(_), None) => "it has another size".to_owned(),
        (Some(_), Some(difference)) => format!("{difference:?}"),
    };
    let shown = shown_at(path);
    std::fs::create_dir_all(shown.parent().unwrap_or(&shown)).map_err(|error| error.to_string())?;
    Picture::beside(kept.as_ref(), made).write(&shown)?;
    Err(format!(
        "{}: {reason}\n    expected, made, and the difference times 8: {}\n    BLESS=1 rewrites it",
        path.display(),
        shown.display()
    ))
}
