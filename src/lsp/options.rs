//! Settings of the editor.
use serde::Deserialize;
use shibo_ide::inlay::InlayKinds;

/// Settings of the editor.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Options {
    /// Inlay hints to show.
    pub(super) inlay_hints: InlayKinds,
    /// Form of pictures in hovers.
    pub(super) pictures: PictureForm,
    /// Shows actions above outputs and nodes.
    pub(super) code_lens: Option<bool>,
}

/// Form of pictures in hovers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) enum PictureForm {
    /// Address of a file.
    #[default]
    File,
    /// Data in the text itself.
    Data,
    /// No pictures.
    None,
}
