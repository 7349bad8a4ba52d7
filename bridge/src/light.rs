//! Light of environments for pages, in one format: the environments of `Relief`, and panoramas as OpenEXR or Radiance HDR.
use half::f16;
use serde::Deserialize;
use shibo_kernel::surface::environment::{Environment, Map, Panorama, Scene, panorama};
use shibo_picture::{Conversion, FileFormat, Header, ReadError, ReadLimits, header_bytes, read_bytes};

/// Maximum file size in bytes: 8192 × 4096 pixels with 16 bits per channel fit.
pub const MOST: usize = 256 << 20;
/// Limits for decoding.
const LIMITS: ReadLimits =
    ReadLimits { max_file_bytes: MOST as u64, max_pixels: 1 << 26, max_bytes_decoded: 768 << 20 };

/// The maximum of half precision.
const GREATEST: f32 = 65504.0;

/// Encodes an environment for pages. Integers: the number of levels, then the texels along an edge of each, without the
/// border. Floats: the nine coefficients of diffuse light, then direction, light and colour of the key light, three each,
/// and its angular radius. Then the levels by rows, with their borders, as four numbers of half precision per texel.
fn encoded(environment: &Environment) -> Vec<u8> {
    let levels = environment.levels();
    let sizes = std::iter::once(levels.len()).chain(levels.iter().map(Map::size));
    let head = sizes.flat_map(|n| u32::try_from(n).unwrap_or(0).to_le_bytes());
    let (toward, light) = environment.key();
    let key = [toward, light, environment.key_color()].into_iter().flatten().chain([environment.key_radius()]);
    let floats = environment.diffuse().iter().flatten().copied().chain(key).flat_map(f32::to_le_bytes);
    let numbers = levels.iter().flat_map(Map::texels).flatten();
    let texels = numbers.flat_map(|v| f16::from_f32(v.clamp(0.0, GREATEST)).to_le_bytes());
    head.chain(floats).chain(texels).collect()
}

/// The environments of `Relief` that have maps.
#[derive(Clone, Copy, Debug, Deserialize)]
pub enum BuiltIn {
    /// A photo studio.
    Studio,
    /// A sky of clouds.
    Overcast,
    /// A room with a window.
    Window,
    /// A clear sky with the sun.
    Sky,
}

impl BuiltIn {
    /// The light of this environment.
    pub fn light(self) -> Vec<u8> {
        encoded(&Environment::of(match self {
            Self::Studio => Scene::Studio,
            Self::Overcast => Scene::Overcast,
            Self::Window => Scene::Window,
            Self::Sky => Scene::Sky,
        }))
    }
}

/// The light of a panorama in a file of at most [`MOST`] bytes, or the reason why there is none.
pub fn of_file(file: &[u8]) -> Result<Vec<u8>, String> {
    let is_light = |header: &Header| matches!(header.format, FileFormat::Exr | FileFormat::Hdr);
    let header = match header_bytes(file) {
        Ok(header) if is_light(&header) => header,
        Ok(_) | Err(ReadError::UnknownFormat(_)) => return Err("it is neither OpenEXR nor Radiance HDR".to_owned()),
        Err(error) => return Err(error.to_string()),
    };
    let mut picture = read_bytes(file, &LIMITS).map_err(|error| error.to_string())?;
    Conversion::of_file(&header).0.apply(&mut picture);
    let plane = |channel: u8| picture.plane(if picture.channels < 3 { 0 } else { channel });
    let (width, height) = (picture.width as usize, picture.height as usize);
    Ok(encoded(&panorama(&Panorama { width, height, planes: [plane(0), plane(1), plane(2)] })?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The page reads these places: see environment.js.
    #[test]
    fn encodes_levels_after_coefficients_and_key_light() {
        let (environment, bytes) = (Environment::of(Scene::Window), BuiltIn::Window.light());
        let word = |i: usize| <[u8; 4]>::try_from(&bytes[4 * i..4 * i + 4]).unwrap();
        let sizes: Vec<usize> = environment.levels().iter().map(Map::size).collect();
        let count = sizes.len();
        assert_eq!(u32::from_le_bytes(word(0)) as usize, count);
        assert_eq!((1..=count).map(|i| u32::from_le_bytes(word(i)) as usize).collect::<Vec<_>>(), sizes);
        let float = |i: usize| f32::from_le_bytes(word(1 + count + i));
        assert_eq!(float(3), environment.diffuse()[1][0]);
        let (toward, light) = environment.key();
        assert_eq!([27, 28, 29].map(float), toward);
        assert_eq!([30, 31, 32].map(float), light);
        assert_eq!([33, 34, 35].map(float), environment.key_color());
        assert_eq!(float(36), environment.key_radius());
        let texels: usize = sizes.iter().map(|size| (size + 2) * (size + 2)).sum();
        let start = 4 * (1 + count + 37);
        assert_eq!(bytes.len(), start + 8 * texels);
        let last = f16::from_le_bytes([bytes[bytes.len() - 2], bytes[bytes.len() - 1]]).to_f32();
        let expected = environment.levels()[count - 1].texels().last().unwrap()[3];
        assert!((last - expected).abs() <= 1e-3 * expected.abs(), "{last} {expected}");
    }

    #[test]
    fn rejects_files_that_are_no_panoramas() {
        assert!(of_file(b"not a picture").unwrap_err().contains("neither OpenEXR nor Radiance HDR"));
    }
}
