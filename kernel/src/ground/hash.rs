//! Random numbers as a function of a key and a counter.
//!
//! [`Hash`](struct@Hash) is the splitmix64 generator with random access: `u64(n)` is the value that its stream yields
//! at step `n`, so numbers can be drawn in any order and on any thread.

/// The increment of splitmix64: 2^64 divided by the golden ratio, made odd.
const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// A key for random numbers drawn by counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hash(u64);

impl Hash {
    /// The stream of splitmix64 seeded with `seed`.
    #[inline]
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A separate stream for `word`, independent of this one and of those of other words.
    #[must_use]
    #[inline]
    pub const fn with(self, word: u64) -> Self {
        Self(mix(mix(self.0 ^ GOLDEN).wrapping_add(word.wrapping_mul(GOLDEN))))
    }

    /// The `counter`-th 64-bit number.
    #[inline]
    pub const fn u64(self, counter: u64) -> u64 {
        mix(self.0.wrapping_add(counter.wrapping_add(1).wrapping_mul(GOLDEN)))
    }

    /// The `counter`-th number, uniform in `0 ≤ x < 1` with 53 bits.
    #[inline]
    pub const fn unit(self, counter: u64) -> f64 {
        (self.u64(counter) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// The `counter`-th number, uniform in `0 ≤ x < 1` with 24 bits.
    #[inline]
    pub const fn unit_f32(self, counter: u64) -> f32 {
        (self.u64(counter) >> 40) as f32 * (1.0 / (1u32 << 24) as f32)
    }
}

/// The finaliser of splitmix64: a bijection of 64 bits in which every input bit reaches every output bit.
#[inline]
const fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_splitmix64() {
        let hash = Hash::new(1);
        let expected = [10451216379200822465, 13757245211066428519, 17911839290282890590, 8196980753821780235];
        assert_eq!([0, 1, 2, 3].map(|n| hash.u64(n)), expected);
        assert_eq!(hash.unit(0), 0.5665615751722809);
    }

    #[test]
    fn streams_differ() {
        let hash = Hash::new(7);
        assert_ne!(hash.with(0).u64(0), hash.with(1).u64(0));
        assert_ne!(hash.with(0), hash);
    }
}
