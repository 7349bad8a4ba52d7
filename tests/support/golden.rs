//! Pictures compared with those that are kept.
use crate::bless;
use crate::picture::Picture;
use std::path::{Path, PathBuf};

/// The mean difference allowed, of 255.
const MEAN: f64 = 1.5;
/// The difference that 999 of 1000 samples must not exceed.
const MOST: u8 = 12;

/// Where what differs is shown.
fn shown_at(path: &Path) -> PathBuf {
    let folder = path.parent().and_then(Path::file_name).unwrap_or_default();
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("differences").join(folder).join(path.file_name().unwrap_or_default())
}

/// Compares a picture with the one that is kept at `path`. If they differ, what is expected, what was made and the
/// difference are written side by side; or the picture is rewritten, if that is asked for.
pub(crate) fn compare(path: &Path, made: &Picture) -> Result<(), String> {
    let kept = Picture::read(path);
    let difference = kept.as_ref().and_then(|kept| kept.difference(made));
    if difference.as_ref().is_some_and(|difference| difference.within(MEAN, MOST)) {
        return Ok(());
    }
    if bless::blessing() {
        made.write(path)?;
        bless::say("rewrote", path);
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
