//! Random numbers and noise of expressions: functions of the seed and of single-precision numbers, with identical bits
//! in parameters and in fields. Everything is inlined and free of branches, so loops over rows vectorise.

/// Mixes a canvas seed into one 32-bit word.
#[expect(clippy::cast_possible_truncation, reason = "both halves are mixed")]
pub const fn seed_word(seed: u64) -> u32 {
    mix(seed as u32 ^ mix((seed >> 32) as u32 ^ 0x9e37_79b9))
}

/// A bijection of 32 bits in which every input bit reaches every output bit (C. Wellons' lowbias32).
#[inline(always)]
const fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// The bits of a number; -0 counts as 0.
#[inline(always)]
const fn bits(x: f32) -> u32 {
    (x + 0.0).to_bits()
}

/// The upper 24 bits as a number, 0 ≤ x < 1.
#[inline(always)]
#[expect(clippy::cast_precision_loss, reason = "24 bits fit")]
const fn unit(word: u32) -> f32 {
    // Via a signed number, which the CPU can convert in one instruction.
    (word >> 8).cast_signed() as f32 * (1.0 / 16_777_216.0)
}

/// A random number from `x`, 0 ≤ r < 1.
#[inline(always)]
pub const fn random(seed: u32, x: f32) -> f32 {
    unit(mix(mix(bits(x) ^ seed).wrapping_add(0x9e37_79b9)))
}

/// Combines the random number of the previous numbers, `before`, with one more number.
#[inline(always)]
pub const fn hash(seed: u32, before: f32, x: f32) -> f32 {
    unit(mix(mix(bits(before) ^ seed).wrapping_mul(0x85eb_ca6b) ^ bits(x)))
}

/// Gradient noise with cells of size 1, 0 ≤ n ≤ 1 with mean ½. Repeats after `period` cells; 0 means no period.
#[inline(always)]
pub fn noise(seed: u32, x: f32, y: f32, period: [f32; 2]) -> f32 {
    let (cell, s) = (x.floor(), x - x.floor());
    let (row, t) = (y.floor(), y - y.floor());
    let [x0, x1] = [cell, cell + 1.0].map(|x| wrap(x, period[0]));
    let [y0, y1] = [row, row + 1.0].map(|y| wrap(y, period[1]));
    let fade = |t: f32| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (fx, fy) = (fade(s), fade(t));
    let above = mixed(slope(seed, x0, y0, s, t), slope(seed, x1, y0, s - 1.0, t), fx);
    let below = mixed(slope(seed, x0, y1, s, t - 1.0), slope(seed, x1, y1, s - 1.0, t - 1.0), fx);
    0.5 + 0.5 * mixed(above, below, fy)
}

#[inline(always)]
fn mixed(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

#[inline(always)]
fn wrap(cell: f32, period: f32) -> f32 {
    if period == 0.0 { cell } else { cell - period * (cell / period).floor() }
}

/// Dot product of a corner's gradient and the offset from the corner. The ends of the gradients lie on a square.
#[inline(always)]
#[expect(clippy::cast_precision_loss, reason = "16 bits fit")]
fn slope(seed: u32, cell: f32, row: f32, s: f32, t: f32) -> f32 {
    let word = mix(mix(bits(cell) ^ seed).wrapping_mul(0x85eb_ca6b) ^ bits(row).wrapping_mul(0xc2b2_ae35));
    let along = (word >> 16).cast_signed() as f32 * (2.0 / 65_536.0) - 1.0;
    let side = if word & 1 == 0 { 1.0 } else { -1.0 };
    let (gx, gy) = if word & 2 == 0 { (side, along) } else { (along, side) };
    gx * s + gy * t
}
