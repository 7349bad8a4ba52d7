//! How colours of exported materials are stored.
use crate::Format;

/// The format of the colours of an exported material: of reflected and of emitted light. All other channels are data,
/// which JPEG would damage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colors {
    /// Lossless: PNG; floats for emitted light in USD.
    #[default]
    Png,
    /// JPEG of this quality, from 1 to 100.
    Jpeg(u8),
}

impl Colors {
    /// The default quality.
    pub(super) const QUALITY: u8 = 90;
    /// All names, and whether each is JPEG.
    pub(super) const ALL: [(&'static str, bool); 2] = [("Png", false), ("Jpeg", true)];

    /// The format of a picture of 8 bits.
    pub(super) const fn format(self) -> Format {
        match self {
            Self::Png => Format::Png,
            Self::Jpeg(quality) => Format::Jpeg(quality),
        }
    }
}
