//! Recycled memory for tiles, and for temporary data of kernels.
//!
//! Tiles are created and dropped by the thousand. They are so large that the allocator would return their memory to the
//! system and fetch it again, page by page, which costs about as much as a cheap node. So some buffers are kept for
//! reuse. They hold no results, so they belong to the process and not to a session.
use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Smaller buffers are left to the allocator, which handles them well.
const LEAST: usize = 1 << 13;
/// The maximum total of kept numbers, unless a session sets another limit: 32 MiB.
const MOST: usize = 1 << 23;

/// Unused buffers, by their capacity.
struct Spare {
    by_capacity: BTreeMap<usize, Vec<Vec<f32>>>,
    held: usize,
    most: usize,
}

static SPARE: Mutex<Spare> = Mutex::new(Spare { by_capacity: BTreeMap::new(), held: 0, most: MOST });

fn spare() -> MutexGuard<'static, Spare> {
    SPARE.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Spare {
    /// Takes the smallest buffer that holds `length` numbers, if it is not much too large.
    fn take(&mut self, length: usize) -> Option<Vec<f32>> {
        let (capacity, list) = self.by_capacity.range_mut(length..=length + length / 2).next()?;
        let (capacity, buffer) = (*capacity, list.pop());
        if list.is_empty() {
            self.by_capacity.remove(&capacity);
        }
        self.held -= capacity;
        buffer
    }

    fn put(&mut self, buffer: Vec<f32>) {
        let capacity = buffer.capacity();
        self.held += capacity;
        self.by_capacity.entry(capacity).or_default().push(buffer);
    }
}

/// Sets the maximum number of kept bytes. Whole rows of tiles are freed at once, so about an eighth of the memory for
/// tiles is a good limit.
pub fn hold_back(bytes: u64) {
    spare().most = usize::try_from(bytes / 4).unwrap_or(MOST);
}

/// Numbers whose memory is reused by another buffer after the drop.
#[derive(Debug, PartialEq)]
pub struct Buffer(Vec<f32>);

impl Buffer {
    /// `length` zeros.
    pub fn zeros(length: usize) -> Self {
        match Self::used(length) {
            Some(mut buffer) => {
                buffer.fill(0.0);
                buffer
            }
            None => Self(vec![0.0; length]),
        }
    }

    /// A buffer of `length` arbitrary values, for code that sets all of them.
    pub fn unset(length: usize) -> Self {
        Self::used(length).unwrap_or_else(|| Self(vec![0.0; length]))
    }

    /// A recycled buffer with its old content.
    fn used(length: usize) -> Option<Self> {
        let mut buffer = if length < LEAST { None } else { spare().take(length) }?;
        buffer.resize(length, 0.0);
        Some(Self(buffer))
    }
}

impl Clone for Buffer {
    fn clone(&self) -> Self {
        let mut copy = Self::unset(self.len());
        copy.copy_from_slice(self);
        copy
    }
}

impl Deref for Buffer {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        &self.0
    }
}

impl DerefMut for Buffer {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut self.0
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        let capacity = self.0.capacity();
        if capacity < LEAST {
            return;
        }
        let mut spare = spare();
        if spare.held + capacity <= spare.most {
            spare.put(std::mem::take(&mut self.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_used_again_and_is_zero() {
        // A size that no other test uses.
        let length = LEAST + 4321;
        let mut first = Buffer::zeros(length);
        first.fill(7.0);
        let place = first.as_ptr();
        drop(first);
        let second = Buffer::zeros(length - 100);
        assert_eq!(second.as_ptr(), place);
        assert!(second.len() == length - 100 && second.iter().all(|v| *v == 0.0));
        drop(second);
        let third = Buffer::unset(length);
        assert_eq!((third.as_ptr(), third.len()), (place, length));
    }

    #[test]
    fn keeps_at_most_the_bound() {
        let most = spare().most;
        let many: Vec<Buffer> = (0..40).map(|_| Buffer::zeros(most / 16)).collect();
        drop(many);
        assert!(spare().held <= most);
        drop(Buffer::zeros(2 * most));
        assert!(spare().held <= most);
        assert!(Buffer::zeros(LEAST - 1).iter().all(|v| *v == 0.0));
    }
}
