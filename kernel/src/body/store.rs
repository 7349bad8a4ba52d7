//! The triangles of blocks as bytes, so that they may lie in memory or in a file.
use super::block::Mesh;
use super::patch::Spot;
use std::fmt;
use std::io;

/// Keeps bytes until they are read again.
pub trait Store: fmt::Debug + Send + Sync {
    /// Adds bytes; returns their place.
    ///
    /// # Errors
    /// There is no space.
    fn add(&mut self, bytes: &[u8]) -> io::Result<u64>;

    /// Replaces bytes that were added, from a place on.
    ///
    /// # Errors
    /// The bytes cannot be written.
    fn replace(&mut self, at: u64, bytes: &[u8]) -> io::Result<()>;

    /// Reads bytes that were added, from a place on.
    ///
    /// # Errors
    /// The bytes cannot be read.
    fn read(&self, at: u64, to: &mut [u8]) -> io::Result<()>;
}

impl Store for Vec<u8> {
    fn add(&mut self, bytes: &[u8]) -> io::Result<u64> {
        let at = self.len() as u64;
        self.extend_from_slice(bytes);
        Ok(at)
    }

    fn replace(&mut self, at: u64, bytes: &[u8]) -> io::Result<()> {
        let from = usize::try_from(at).map_err(io::Error::other)?;
        let to = from.checked_add(bytes.len()).and_then(|end| self.get_mut(from..end));
        to.ok_or(io::ErrorKind::UnexpectedEof)?.copy_from_slice(bytes);
        Ok(())
    }

    fn read(&self, at: u64, to: &mut [u8]) -> io::Result<()> {
        let from = usize::try_from(at).map_err(io::Error::other)?;
        let bytes = from.checked_add(to.len()).and_then(|end| self.get(from..end));
        to.copy_from_slice(bytes.ok_or(io::ErrorKind::UnexpectedEof)?);
        Ok(())
    }
}

/// The place of a block in a store.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    at: u64,
    spots: u16,
    pub(super) triangles: u16,
    size: [u8; 2],
}

/// Bytes of a vertex: its sample and its height.
const SPOT: usize = 6;
/// Bytes of a triangle: the numbers of its vertices.
const TRIANGLE: usize = 6;

/// Adds the triangles of a block. `bytes` is memory for them.
pub(super) fn add(store: &mut dyn Store, mesh: &Mesh, bytes: &mut Vec<u8>) -> io::Result<Place> {
    bytes.clear();
    for (spot, height) in mesh.spots.iter().zip(&mesh.heights) {
        bytes.extend(spot);
        bytes.extend(height.to_le_bytes());
    }
    for corner in mesh.triangles.iter().flatten() {
        bytes.extend(corner.to_le_bytes());
    }
    let count = |number: usize| u16::try_from(number).map_err(io::Error::other);
    let (spots, triangles) = (count(mesh.spots.len())?, count(mesh.triangles.len())?);
    Ok(Place { at: store.add(bytes)?, spots, triangles, size: mesh.size })
}

/// Reads the triangles of a block.
pub(super) fn read(store: &dyn Store, place: Place, bytes: &mut Vec<u8>) -> io::Result<Mesh> {
    let middle = SPOT * usize::from(place.spots);
    bytes.clear();
    bytes.resize(middle + TRIANGLE * usize::from(place.triangles), 0);
    store.read(place.at, bytes)?;
    let (spots, triangles) = bytes.split_at(middle);
    let pair = |bytes: &[u8], at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let height = |bytes: &[u8]| f32::from_le_bytes([bytes[2], bytes[3], bytes[4], bytes[5]]);
    Ok(Mesh {
        spots: spots.chunks_exact(SPOT).map(|bytes| -> Spot { [bytes[0], bytes[1]] }).collect(),
        heights: spots.chunks_exact(SPOT).map(height).collect(),
        triangles: triangles.chunks_exact(TRIANGLE).map(|bytes| [0, 2, 4].map(|at| pair(bytes, at))).collect(),
        size: place.size,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_come_back_as_they_were() {
        let mesh = Mesh {
            spots: vec![[0, 0], [64, 0], [64, 63], [0, 63]],
            heights: vec![0.5, -1.25, f32::MIN_POSITIVE, 3.0],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            size: [64, 63],
        };
        let mut store: Vec<u8> = vec![7; 3];
        let mut bytes = Vec::new();
        let place = add(&mut store, &mesh, &mut bytes).unwrap();
        add(&mut store, &Mesh::default(), &mut bytes).unwrap();
        assert_eq!(read(&store, place, &mut bytes).unwrap(), mesh);
        store.truncate(20);
        assert!(read(&store, place, &mut bytes).is_err());
    }
}
