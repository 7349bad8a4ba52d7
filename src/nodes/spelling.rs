//! How values and ranges are written in graph files.
use serde_json::Value as Json;
use shibo_engine::node::{ParamInfo, PortInfo};
use shibo_engine::value::linear_to_srgb;

/// The default of a parameter in RON.
pub(super) fn default(param: &ParamInfo) -> String {
    match (param.ty.as_str(), &param.default) {
        (_, Json::Null) if param.infinite => "inf".to_owned(),
        (_, Json::Null) => "None".to_owned(),
        ("Choice", Json::String(word)) => word.clone(),
        ("Choice", Json::Object(object)) if object.len() == 1 => {
            object.iter().map(|(word, value)| variant(word, value)).collect()
        }
        ("Color", Json::Array(channels)) => color(channels).unwrap_or_else(|| value(&param.default)),
        // One number stands for a pair of equal ones.
        ("Range" | "Linear" | "Xy", Json::Array(pair)) if pair.len() == 2 && pair[0] == pair[1] => value(&pair[0]),
        (_, Json::Array(items)) if param.ty == "List" => format!("[{}]", list(items)),
        (_, other) => value(other),
    }
}

fn variant(word: &str, inner: &Json) -> String {
    match inner {
        Json::Array(items) => format!("{word}({})", list(items)),
        Json::Object(_) => format!("{word}{}", value(inner)),
        Json::Null => format!("{word}(inf)"),
        _ => format!("{word}({})", value(inner)),
    }
}

fn value(json: &Json) -> String {
    match json {
        Json::Null => "None".to_owned(),
        Json::Number(n) if n.is_f64() => n.as_f64().map_or_else(|| n.to_string(), number),
        Json::Number(n) => n.to_string(),
        Json::String(text) => format!("{text:?}"),
        Json::Bool(b) => b.to_string(),
        Json::Array(items) => format!("({})", list(items)),
        Json::Object(fields) => {
            let fields: Vec<String> = fields.iter().map(|(name, v)| format!("{name}: {}", value(v))).collect();
            format!("({})", fields.join(", "))
        }
    }
}

fn list(items: &[Json]) -> String {
    items.iter().map(value).collect::<Vec<_>>().join(", ")
}

/// A number as people write it; the shortest that reads back exactly.
pub(super) fn number(n: f64) -> String {
    let plain = n.to_string();
    if plain.len() <= 12 { plain } else { format!("{n:e}") }
}

/// `"#rrggbb"`, if that is the same colour as far as can be seen.
fn color(channels: &[Json]) -> Option<String> {
    let mut text = String::from("\"#");
    for channel in channels {
        #[expect(clippy::cast_possible_truncation, reason = "colours are f32")]
        let encoded = linear_to_srgb(channel.as_f64()? as f32) * 255.0;
        let byte = (0.0..=255.4).contains(&encoded).then(|| encoded.round())?;
        if (encoded - byte).abs() > 0.01 {
            return None;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 255")]
        text.push_str(&format!("{:02x}", byte as u8));
    }
    Some(text + "\"")
}

/// What numbers a parameter may have, in words; empty if any.
pub(super) fn range(param: &ParamInfo) -> String {
    let unit = param.unit.as_deref().map_or(String::new(), |unit| format!(" {unit}"));
    let infinite = if param.infinite { ", or inf" } else { "" };
    match (param.min, param.max) {
        (Some(min), Some(max)) if param.above_min => {
            format!("more than {} to {}{unit}{infinite}", number(min), number(max))
        }
        (Some(min), Some(max)) => format!("{} to {}{unit}{infinite}", number(min), number(max)),
        (Some(min), None) if param.above_min => format!("more than {}{unit}{infinite}", number(min)),
        (Some(min), None) => format!("at least {}{unit}{infinite}", number(min)),
        (None, Some(max)) => format!("at most {}{unit}{infinite}", number(max)),
        (None, None) => param.unit.clone().unwrap_or_default(),
    }
}

/// What goes into a port, in words.
pub(super) fn port(port: &PortInfo) -> String {
    let ty = if port.list { format!("[{}…]", port.ty) } else { port.ty.to_string() };
    match (port.required, port.default) {
        (_, Some(default)) => format!("{ty}, default {}", number(default)),
        (true, None) => format!("{ty}, required"),
        (false, None) => format!("{ty}, optional"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn spelled(ty: &str, json: Json) -> String {
        default(&ParamInfo { ty: ty.to_owned(), default: json, ..ParamInfo::default() })
    }

    #[test]
    fn defaults_are_spelled_in_ron() {
        assert_eq!(spelled("Number", json!(4.0)), "4");
        assert_eq!(spelled("Number", json!(0.1)), "0.1");
        assert_eq!(spelled("Integer", json!(u64::MAX)), u64::MAX.to_string());
        assert_eq!(spelled("Range", json!([0.2, 4.0])), "(0.2, 4)");
        assert_eq!(spelled("Range", json!([2.0, 2.0])), "2");
        assert_eq!(spelled("Choice", json!("Smooth")), "Smooth");
        assert_eq!(spelled("Choice", json!({ "Radius": 2.0 })), "Radius(2)");
        assert_eq!(spelled("Choice", json!({ "Radius": { "mm": 2.0 } })), "Radius(mm: 2)");
        assert_eq!(spelled("Color", json!([1.0, 0.0, 0.0])), "\"#ff0000\"");
        assert_eq!(spelled("Color", json!([0.5, 0.0, 0.0])), "(0.5, 0, 0)");
        assert_eq!(spelled("List", json!([[0.0, 1.0]])), "[(0, 1)]");
        assert_eq!(spelled("Text", json!("a\"b")), r#""a\"b""#);
        assert_eq!(spelled("Number", Json::Null), "None");
        let infinite = ParamInfo { infinite: true, ..ParamInfo::default() };
        assert_eq!(default(&infinite), "inf");
    }
}
