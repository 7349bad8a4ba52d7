//! Components of values: `color.r`, and several of them in any order, `color.bgr`.
use super::shorten;

/// The letters of values with two or three components.
const LETTERS: [&str; 2] = ["rgb", "xyz"];
/// The letters of values with an unknown number of components.
const ALL_LETTERS: [&str; 2] = ["rgba", "xyzw"];
/// The components of a matrix.
const MATRIX: [&str; 4] = ["xx", "xy", "yx", "yy"];

/// The components that letters name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Chosen {
    /// These, in this order.
    These(Vec<usize>),
    /// An unknown number of components of a value that has an unknown number of them.
    Any,
}

/// The components that `letters` names of a value with `count` components, or with an unknown number; `None` if it has no
/// such components. A value with an unknown number has all.
pub(super) fn choose(count: Option<usize>, letters: &str) -> Option<Chosen> {
    let matrix = MATRIX.iter().position(|name| *name == letters);
    let of =
        |sets: &[&str]| sets.iter().find_map(|set| letters.chars().map(|c| set.find(c)).collect::<Option<Vec<_>>>());
    let short = (1..=4).contains(&letters.len());
    match count {
        Some(2) => of(&["xy"]).filter(|_| short).map(Chosen::These),
        Some(3) => of(&LETTERS).filter(|_| short).map(Chosen::These),
        Some(4) => matrix.map(|index| Chosen::These(vec![index])),
        Some(_) => None,
        None if matrix.is_some() || !short => Some(Chosen::Any),
        None => Some(of(&ALL_LETTERS).map_or(Chosen::Any, Chosen::These)),
    }
}

/// The number of components after all `letters`, which may have dots, were chosen.
///
/// # Errors
/// The message and the help for letters that `subject` does not have.
pub(super) fn check(count: Option<usize>, subject: &str, letters: &str) -> Result<Option<usize>, (String, String)> {
    letters.split('.').try_fold(count, |count, part| match choose(count, part) {
        Some(Chosen::These(components)) => Ok(Some(components.len())),
        Some(Chosen::Any) => Ok(None),
        None => Err(missing(count.unwrap_or(1), subject, part)),
    })
}

/// The message and the help for components that `subject` does not have.
fn missing(count: usize, subject: &str, letters: &str) -> (String, String) {
    let message = format!("`{}` has no component `{}`", shorten(subject), shorten(letters));
    let help = match count {
        2 => "components: `x`, `y`, or several of them, such as `yx`".to_owned(),
        3 => "components: `r`, `g`, `b`, or `x`, `y`, `z`, or several of either, such as `bgr`".to_owned(),
        4 => format!("components: `{}`", MATRIX.join("`, `")),
        _ => format!("it is a single number; write `{}`", shorten(subject)),
    };
    (message, help)
}
