//! Tone: point-wise changes of one field.
mod auto_levels;
mod convert_color;
mod curve;
mod dither;
mod gradient_map;
mod hsv;
mod invert;
mod levels;
mod match_histogram;
mod quantize;
mod remap;
mod replace_color;
mod threshold;

pub use auto_levels::AutoLevels;
pub use convert_color::ConvertColor;
pub use curve::Curve;
pub use dither::Dither;
pub use gradient_map::{GradientMap, MixSpace};
pub use hsv::Hsv;
pub use invert::Invert;
pub use levels::Levels;
pub use match_histogram::MatchHistogram;
pub use quantize::Quantize;
pub use remap::Remap;
pub use replace_color::ReplaceColor;
pub use threshold::Threshold;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Tone",
        doc: "Point-wise changes of one field; colours are changed channel by channel, scene-linear.",
        kinds: vec![
            Kind::of::<Levels>(),
            Kind::of::<AutoLevels>(),
            Kind::of::<Curve>(),
            Kind::of::<Remap>(),
            Kind::of::<Invert>(),
            Kind::of::<Threshold>(),
            Kind::of::<Quantize>(),
            Kind::of::<Dither>(),
            Kind::of::<GradientMap>(),
            Kind::of::<Hsv>(),
            Kind::of::<ReplaceColor>(),
            Kind::of::<MatchHistogram>(),
            Kind::of::<ConvertColor>(),
        ],
    }
}
