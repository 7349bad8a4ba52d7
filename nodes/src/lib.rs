//! The nodes of Shibo, a folder per family.
//!
//! A node is one file, plus one line in the list of its family. Families do not depend on each other; shared code is in
//! [`shibo_kernel`] or in the engine's `value`. Rows such as A12, B7 or C3 in module docs are those of the tables in
//! `docs/leather.md`, `docs/wood.md` and `docs/synthesis.md`, which list what a source says and where it is done.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions"))]
pub mod combine;
pub mod deposits;
pub mod filter;
pub mod fracture;
pub mod generators;
pub mod image;
pub mod leather;
pub mod material;
pub mod mesh;
pub mod paths;
pub mod patterns;
pub mod reaction;
pub mod regions;
pub mod scatter;
pub mod shapes;
pub mod space;
pub mod surface;
pub mod synthesis;
pub mod tone;
pub mod wood;
pub mod yarn;

mod anywhere;
mod bounds;
mod by_calendar;
mod chosen;
#[cfg(test)]
mod conform;
mod csv_points;
mod degrees;
mod distances;
mod fitted;
mod formulas;
mod map;
mod masked;
mod measured;
mod moved;
mod normals;
mod on_atlas;
mod planes;
mod samples;
mod shown;
#[cfg(test)]
mod testing;
mod torus;
mod values;
mod warped;

pub use shown::cut_material;

use shibo_node::registry::{Family, Internal, Kind, Registry};

/// All nodes, by family.
pub fn families() -> Vec<Family> {
    vec![
        leather::family(),
        wood::family(),
        deposits::family(),
        fracture::family(),
        reaction::family(),
        generators::family(),
        shapes::family(),
        paths::family(),
        patterns::family(),
        yarn::family(),
        regions::family(),
        scatter::family(),
        image::family(),
        tone::family(),
        combine::family(),
        filter::family(),
        space::family(),
        surface::family(),
        synthesis::family(),
        mesh::family(),
        material::family(),
    ]
}

/// Kinds of earlier versions. Formulas replace them, except that `SetChannels` is `Material` with `from`, and
/// `ColorSolid` is `GradientMap`. `shibo migrate` has a table of them (`ide/src/migrate/kinds.rs`).
const RETIRED: [&str; 11] = [
    "ColorSolid",
    "Constant",
    "Expression",
    "MakeVector",
    "MaterialChannel",
    "Math",
    "MixSolids",
    "PackChannels",
    "SetChannels",
    "SolidMath",
    "SplitChannels",
];

/// The fingerprint of this crate's code and of the libraries that it uses.
pub const CODE: &str = env!("CODE_FINGERPRINT");

/// All nodes.
pub fn registry() -> Registry {
    registry_with([])
}

/// All nodes, and families of other crates. Give the result a fingerprint of their code ([`Registry::with_code`]), so
/// that a cache never supplies results of another version.
pub fn registry_with(more: impl IntoIterator<Item = Family>) -> Registry {
    let registry = Registry::new(families().into_iter().chain(more))
        .with_internal(Internal::LayField, Kind::of::<space::Transform>())
        .with_internal(Internal::LayMaterial, Kind::of::<space::LaidMaterial>())
        .with_internal(Internal::ChooseField, Kind::of::<combine::Choose>())
        .with_internal(Internal::ChooseMaterial, Kind::of::<combine::ChooseMaterial>())
        .with_internal(Internal::Formula, Kind::of::<formulas::Formula>())
        .with_internal(Internal::SolidFormula, Kind::of::<formulas::SolidFormula>())
        .with_internal(Internal::CutOnMesh, Kind::of::<mesh::BakeSolid>())
        .with_internal(Internal::Channel, Kind::of::<material::ChannelOf>())
        .with_kept("Fractal", 2, Kind::of::<generators::kept::Fractal2>())
        .with_kept("Fractal", 3, Kind::of::<generators::kept::Fractal3>());
    registry.with_gutters(mesh::filled).with_retired(&RETIRED).with_code(shibo_kernel::CODE).with_code(crate::CODE)
}
