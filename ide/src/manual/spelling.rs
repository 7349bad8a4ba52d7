//! Types, ranges and defaults in words.
use shibo_node::{Bounds, Output, OutputType, ParamInfo, PortInfo, spell_number};

/// Default of a parameter in words.
pub fn default(param: &ParamInfo) -> String {
    if param.required { "must be given".to_owned() } else { format!("default {}", param.written) }
}

/// Type of an output in words. An output that follows its inputs names their ports, formatted by `name`.
pub fn output(output: &Output, name: impl Fn(&str) -> String) -> String {
    let ty = match output.ty {
        OutputType::Fixed(ty) => ty.name().to_owned(),
        OutputType::Told => "as the node says".to_owned(),
        OutputType::ColorOf(_) => "Rgb or SolidColor".to_owned(),
        OutputType::NumberOf(_) => "Gray or Solid".to_owned(),
        OutputType::MaterialOf(_) => "Material or SolidMaterial".to_owned(),
        OutputType::Like(ports) | OutputType::ValueOf(ports) => {
            format!("as {}", ports.iter().map(|port| name(port)).collect::<Vec<_>>().join(", "))
        }
    };
    output.unit.map_or(ty.clone(), |unit| format!("{ty}, {unit}"))
}

/// Range of a parameter in words; empty if unlimited.
pub fn range(param: &ParamInfo) -> String {
    bounds(&param.bounds, if param.infinite { ", or inf" } else { "" })
}

fn bounds(bounds: &Bounds, infinite: &str) -> String {
    let unit = bounds.unit.as_deref().map_or(String::new(), |unit| format!(" {unit}"));
    match (bounds.min, bounds.max) {
        (Some(min), Some(max)) if bounds.above_min => {
            format!("more than {} to {}{unit}{infinite}", spell_number(min), spell_number(max))
        }
        (Some(min), Some(max)) => format!("{} to {}{unit}{infinite}", spell_number(min), spell_number(max)),
        (Some(min), None) if bounds.above_min => format!("more than {}{unit}{infinite}", spell_number(min)),
        (Some(min), None) => format!("at least {}{unit}{infinite}", spell_number(min)),
        (None, Some(max)) => format!("at most {}{unit}{infinite}", spell_number(max)),
        (None, None) => bounds.unit.clone().unwrap_or_default(),
    }
}

/// Type of a port in words.
pub fn port(port: &PortInfo) -> String {
    let ty = if port.list { format!("[{}…]", port.ty) } else { port.ty.to_string() };
    let range = Some(bounds(&port.bounds, "")).filter(|range| !range.is_empty());
    let range = range.map_or(String::new(), |range| format!(", {range}"));
    match (port.required, port.default) {
        (_, Some(default)) => format!("{ty}, default {}{range}", spell_number(default)),
        (true, None) => format!("{ty}, required{range}"),
        (false, None) => format!("{ty}, optional{range}"),
    }
}
