//! Colours of shapes: the forms that `svgtypes` reads, and some forms of CSS that it does not know.
use std::borrow::Cow;
use std::str::FromStr;
use svgtypes::{Color, Paint};

/// A paint in a form that `svgtypes` knows; `None` if the paint is unknown. `is_set` tells if the file sets a custom
/// property such as `--brand`.
pub(super) fn known<'a>(text: &'a str, is_set: &dyn Fn(&str) -> bool) -> Option<Cow<'a, str>> {
    if Paint::from_str(text).is_ok() {
        return Some(Cow::Borrowed(text.trim()));
    }
    let text = substituted(text.trim(), is_set)?;
    let (link, rest) = match text.strip_prefix("url(") {
        Some(link) => text.split_at(text.len() - link.len() + link.find(')')? + 1),
        None => ("", text),
    };
    let rest = rest.trim();
    let plain = match rest.to_ascii_lowercase().as_str() {
        "currentcolor" => "currentColor".to_owned(),
        // This name is in CSS 4 but not in CSS 3.
        "rebeccapurple" => "#663399".to_owned(),
        other => with_plain_alpha(other),
    };
    let plain = if link.is_empty() { plain } else { format!("{link} {plain}") };
    Paint::from_str(&plain).is_ok().then_some(Cow::Owned(plain))
}

/// True for a colour, and for `currentColor`.
pub(super) fn is_color(text: &str) -> bool {
    text == "currentColor" || Color::from_str(text).is_ok()
}

/// The fallback of `var(--name, fallback)` if the file does not set the property.
fn substituted<'a>(text: &'a str, is_set: &dyn Fn(&str) -> bool) -> Option<&'a str> {
    // Each round removes a pair of brackets.
    let mut text = text;
    while text.get(..4).is_some_and(|head| head.eq_ignore_ascii_case("var(")) {
        let (name, instead) = text[4..].strip_suffix(')')?.split_once(',')?;
        if is_set(name.trim()) {
            return None;
        }
        text = instead.trim();
    }
    Some(text)
}

/// `rgb(255 0 0 / 50%)` as `rgb(255 0 0 / 0.5)`.
fn with_plain_alpha(color: &str) -> String {
    let percent = |color: &str| {
        let inside = color.strip_suffix(')')?.trim_end().strip_suffix('%')?;
        let at = inside.rfind(['/', ',', ' '])? + 1;
        let number: f64 = inside[at..].parse().ok()?;
        // A fourth number: after a `/` or three commas.
        let is_alpha = inside.contains('/') || inside.matches(',').count() == 3;
        (color.starts_with("rgb") && is_alpha).then(|| format!("{}{})", &inside[..at], number / 100.0))
    };
    percent(color).unwrap_or_else(|| color.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn color(text: &str) -> Option<[u8; 4]> {
        let known = known(text, &|name| name == "--set")?;
        match Paint::from_str(&known).unwrap() {
            Paint::Color(Color { red, green, blue, alpha }) => Some([red, green, blue, alpha]),
            _ => None,
        }
    }

    #[test]
    fn reads_colors_in_all_forms_of_css() {
        let red = Some([255, 0, 0, 255]);
        for text in
            ["red", "RED", "#f00", "#FF0000", "rgb(255,0,0)", "rgb(255 0 0)", "RGB(100%, 0%, 0%)", "hsl(0,100%,50%)"]
        {
            assert_eq!(color(text), red, "{text}");
        }
        let half = Some([255, 0, 0, 128]);
        for text in
            ["rgba(255,0,0,.5)", "rgba(255, 0, 0, 50%)", "rgb(255 0 0 / 50%)", "hsla(0, 100%, 50%, 0.5)", "#ff000080"]
        {
            assert_eq!(color(text), half, "{text}");
        }
        assert_eq!(color("RebeccaPurple"), Some([102, 51, 153, 255]));
        assert_eq!(color("transparent"), Some([0; 4]));
    }

    #[test]
    fn takes_the_fallback_of_a_property_that_is_not_set() {
        assert_eq!(color("var(--fill-0, #112233)"), Some([17, 34, 51, 255]));
        assert_eq!(color("var(--a, var(--b, red))"), Some([255, 0, 0, 255]));
        assert_eq!(color("var(--set, red)"), None);
        assert_eq!(color("var(--a)"), None);
        let none = |text| known(text, &|_| false).map(Cow::into_owned);
        assert_eq!(none("CurrentColor").as_deref(), Some("currentColor"));
        assert_eq!(none("url(#a) CURRENTCOLOR").as_deref(), Some("url(#a) currentColor"));
        for text in ["", "reddish", "var(", "var()", "lab(50% 0 0)", "url(", "url(#a) reddish"] {
            assert_eq!(none(text), None, "{text}");
        }
    }
}
