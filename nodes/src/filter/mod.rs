//! Filters: fields made from a field and its surroundings.
mod along_field;
mod around;
mod blur;
mod directional_blur;
mod disk;
mod distance_field;
mod edge_detect;
mod guided_filter;
mod high_pass;
mod make_tileable;
mod median;
mod morphology;
mod radial_blur;
mod sharpen;
mod slope_blur;
#[cfg(test)]
mod wide_tests;

pub use along_field::AlongField;
pub use blur::Blur;
pub use directional_blur::DirectionalBlur;
pub use distance_field::{DistanceField, Side};
pub use edge_detect::EdgeDetect;
pub use guided_filter::GuidedFilter;
pub use high_pass::HighPass;
pub use make_tileable::MakeTileable;
pub use median::Median;
pub use morphology::{Morphology, MorphologyOperation};
pub use radial_blur::{RadialBlur, RadialDirection};
pub use sharpen::Sharpen;
pub use slope_blur::{SlopeBlur, SlopeBlurMode};

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Filters",
        doc: "Fields made from a field and its surroundings; widths in mm, so the picture is the same at every resolution.",
        kinds: vec![
            Kind::of::<Blur>(),
            Kind::of::<DirectionalBlur>(),
            Kind::of::<AlongField>(),
            Kind::of::<RadialBlur>(),
            Kind::of::<SlopeBlur>(),
            Kind::of::<GuidedFilter>(),
            Kind::of::<Median>(),
            Kind::of::<Sharpen>(),
            Kind::of::<HighPass>(),
            Kind::of::<Morphology>(),
            Kind::of::<DistanceField>(),
            Kind::of::<EdgeDetect>(),
            Kind::of::<MakeTileable>(),
        ],
    }
}
