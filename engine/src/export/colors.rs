//! How colours of exported materials are stored.
use crate::picture::Format;

/// How the colours of an exported material are stored: what it reflects and what it sends out. Everything else is data, which a
/// JPEG would spoil.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colors {
    /// Without loss: PNG, and for light in USD floats.
    #[default]
    Png,
    /// JPEG of this quality, from 1 to 100.
    Jpeg(u8),
}

impl Colors {
    /// The quality if none is stated.
    pub const QUALITY: u8 = 90;
    /// The words for them, and whether they are JPEG.
    pub const ALL: [(&'static str, bool); 2] = [("Png", false), ("Jpeg", true)];

    /// The format of a picture of 8 bits.
    pub(super) const fn format(self) -> Format {
        match self {
            Self::Png => Format::Png,
            Self::Jpeg(quality) => Format::Jpeg(quality),
        }
    }
}
