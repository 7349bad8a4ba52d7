//! Colours that users write by their names.
use crate::node::parse_color;

/// Colour names, for users who write names instead of codes.
const COLORS: [(&str, &str); 20] = [
    ("black", "#000000"),
    ("silver", "#c0c0c0"),
    ("gray", "#808080"),
    ("grey", "#808080"),
    ("white", "#ffffff"),
    ("maroon", "#800000"),
    ("red", "#ff0000"),
    ("purple", "#800080"),
    ("magenta", "#ff00ff"),
    ("green", "#008000"),
    ("lime", "#00ff00"),
    ("olive", "#808000"),
    ("yellow", "#ffff00"),
    ("navy", "#000080"),
    ("blue", "#0000ff"),
    ("teal", "#008080"),
    ("cyan", "#00ffff"),
    ("orange", "#ffa500"),
    ("brown", "#a52a2a"),
    ("pink", "#ffc0cb"),
];

/// The colour meant by a text that is not a valid colour: a name, or digits without `#`.
pub(super) fn color_meant(text: &str) -> Option<String> {
    let lower = text.trim().to_ascii_lowercase();
    if let Some((_, code)) = COLORS.iter().find(|(name, _)| *name == lower) {
        return Some((*code).to_owned());
    }
    let prefix = lower.strip_prefix("0x").or_else(|| lower.strip_prefix('#'));
    // A word without digits, such as `facade`, is a name.
    if prefix.is_none() && !lower.contains(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let code = format!("#{}", prefix.unwrap_or(&lower));
    // In eight digits, the last two are opacity.
    let code = if code.len() == 9 && code.is_ascii() { code[..7].to_owned() } else { code };
    (code != text && parse_color(&code).is_some()).then_some(code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recognizes_colours_by_names_and_digits() {
        let meant = |text: &str| color_meant(text);
        assert_eq!(meant("Red").as_deref(), Some("#ff0000"));
        assert_eq!(meant("0xff8000").as_deref(), Some("#ff8000"));
        assert_eq!(meant("#FF8000CC").as_deref(), Some("#ff8000"));
        assert_eq!(meant("a1c").as_deref(), Some("#a1c"));
        assert!(["rad", "facade", "0xff80", "#abc", "height", "é12345é"].into_iter().all(|text| meant(text).is_none()));
        assert!(COLORS.iter().all(|(_, code)| parse_color(code).is_some()));
    }
}
