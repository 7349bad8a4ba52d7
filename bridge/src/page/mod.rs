//! A scene as pages show it: its graph level by level, the texts and values of its nodes, drawings of objects, meshes with their
//! overlays, bodies, and textures that cut solids along a shape. The page of `shibo watch` and the playground take them from here.
mod about;
mod body;
mod drawing;
pub mod edits;
mod groups;
pub mod layout;
mod levels;
mod marks;
mod mesh;
pub mod numbers;
mod wear;
pub mod wiring;

pub use about::about;
pub use body::{bodies, preview_body, shown_body};
pub use drawing::drawing;
pub use levels::level;
pub use marks::marks;
pub use mesh::PageMesh;
pub use wear::{SolidShape, worn};
