//! How colours of exported materials are stored.
use super::decl::{FieldDecl, Takes};
use super::target::Options;
use crate::diagnostics::{Code, Problem};
use crate::picture::Format;

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
    const QUALITY: u8 = 90;
    /// All names, and whether each is JPEG.
    const ALL: [(&'static str, bool); 2] = [("Png", false), ("Jpeg", true)];
    /// The option that chooses the format.
    pub(super) const FORMAT: FieldDecl = FieldDecl::new(
        "colors",
        "How the base colour and the emission are stored: `Png`, or `Jpeg`, which is smaller and not exact.",
        Takes::Words(|| Self::ALL.map(|(name, _)| name).to_vec()),
    );
    /// The option for the quality of JPEG.
    pub(super) const OF_JPEG: FieldDecl =
        FieldDecl::new("quality", "That of JPEG, from 1 to 100; 90 if left out.", Takes::Whole(1, 100));

    /// Reads [`FORMAT`](Self::FORMAT) and [`OF_JPEG`](Self::OF_JPEG).
    pub(super) fn read(options: &Options) -> Result<Self, Problem> {
        let (jpeg, quality) = (options.word("colors", &Self::ALL).unwrap_or_default(), options.whole("quality"));
        if let (false, Some(_)) = (jpeg, quality) {
            let error = Problem::new(Code::BadValue, "`quality` is that of JPEG, and `colors` are PNG").at("quality");
            return Err(error.help("write `colors: Jpeg`, or leave `quality` out"));
        }
        Ok(if jpeg { Self::Jpeg(quality.unwrap_or(Self::QUALITY)) } else { Self::Png })
    }

    /// The format of a picture of 8 bits.
    pub(super) const fn format(self) -> Format {
        match self {
            Self::Png => Format::Png,
            Self::Jpeg(quality) => Format::Jpeg(quality),
        }
    }
}
