//! Settings of the editor.
use crate::inlay::InlayKinds;
use serde::Deserialize;

/// Settings of the editor.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(crate) struct Options {
    /// Inlay hints to show.
    pub(crate) inlay_hints: InlayKinds,
    /// Form of pictures in hovers.
    pub(crate) pictures: PictureForm,
    /// Shows actions above outputs and nodes.
    pub(crate) code_lens: Option<bool>,
}

/// Form of pictures in hovers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum PictureForm {
    /// Address of a file.
    #[default]
    File,
    /// Data in the text itself.
    Data,
    /// No pictures.
    None,
}
