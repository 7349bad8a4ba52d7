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

/// The part of the seed of a step that [`seed_word`] made.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "a seed word has 32 bits")]
const fn word(seed: u64) -> u32 {
    seed as u32
}

/// A random number from `x`, 0 ≤ r < 1.
#[inline(always)]
pub const fn random(seed: u64, x: f32) -> f32 {
    let seed = word(seed);
    unit(mix(mix(bits(x) ^ seed).wrapping_add(0x9e37_79b9)))
}

/// Combines the random number of the previous numbers, `before`, with one more number.
#[inline(always)]
pub const fn hash(seed: u64, before: f32, x: f32) -> f32 {
    let seed = word(seed);
    unit(mix(mix(bits(before) ^ seed).wrapping_mul(0x85eb_ca6b) ^ bits(x)))
}

/// Gradient noise with cells of size 1, 0 ≤ n ≤ 1 with mean ½. Repeats after `period` cells; 0 means no period.
#[inline(always)]
pub fn noise(seed: u64, x: f32, y: f32, period: [f32; 3]) -> f32 {
    let seed = word(seed);
    let (cell, s) = (x.floor(), x - x.floor());
    let (row, t) = (y.floor(), y - y.floor());
    let [x0, x1] = [cell, cell + 1.0].map(|x| wrap(x, period[0]));
    let [y0, y1] = [row, row + 1.0].map(|y| wrap(y, period[1]));
    let (fx, fy) = (fade(s), fade(t));
    let above = mixed(slope(seed, x0, y0, s, t), slope(seed, x1, y0, s - 1.0, t), fx);
    let below = mixed(slope(seed, x0, y1, s, t - 1.0), slope(seed, x1, y1, s - 1.0, t - 1.0), fx);
    0.5 + 0.5 * mixed(above, below, fy)
}

/// The same in space (K. Perlin, "Improving noise", 2002). The gradients are the middles of the edges of a cube; the
/// result is limited to 0..1.
#[inline(always)]
pub fn noise3(seed: u64, [x, y, z]: [f32; 3], period: [f32; 3]) -> f32 {
    let seed = word(seed);
    let (cell, row, layer) = (x.floor(), y.floor(), z.floor());
    let [x0, x1] = [cell, cell + 1.0].map(|x| wrap(x, period[0]));
    let [y0, y1] = [row, row + 1.0].map(|y| wrap(y, period[1]));
    let [z0, z1] = [layer, layer + 1.0].map(|z| wrap(z, period[2]));
    let (r, s, t) = (x - cell, y - row, z - layer);
    let (fx, fy, fz) = (fade(r), fade(s), fade(t));
    let line = |y, z, s, t| mixed(slope3(seed, [x0, y, z], [r, s, t]), slope3(seed, [x1, y, z], [r - 1.0, s, t]), fx);
    let plane = |z, t| mixed(line(y0, z, s, t), line(y1, z, s - 1.0, t), fy);
    let noise = 0.5 + 0.5 * mixed(plane(z0, t), plane(z1, t - 1.0), fz);
    let noise = if noise < 1.0 { noise } else { 1.0 };
    if noise > 0.0 { noise } else { 0.0 }
}

/// The polynomial of degree 5 whose first and second derivatives are 0 at 0 and 1.
#[inline(always)]
fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Dot product of the gradient of a corner of a cell and the offset from the corner.
#[inline(always)]
fn slope3(seed: u32, corner: [f32; 3], [r, s, t]: [f32; 3]) -> f32 {
    let [x, y, z] = corner.map(bits);
    let word = mix(mix(x ^ seed).wrapping_mul(0x85eb_ca6b) ^ y.wrapping_mul(0xc2b2_ae35));
    let edge = mix(word ^ z.wrapping_mul(0x27d4_eb2f)) >> 28;
    let along = if edge < 8 { r } else { s };
    let corner = if edge & 13 == 12 { r } else { t };
    let across = if edge < 4 { s } else { corner };
    (if edge & 1 == 0 { along } else { -along }) + if edge & 2 == 0 { across } else { -across }
}

/// The random number of a piece, 0 ≤ r < 1: the first number of the stream of splitmix64 for the piece, with random
/// access. Numbers of pieces are whole.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "pieces are whole; 53 bits fit")]
pub fn of_piece(seed: u64, piece: f32) -> f32 {
    const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
    let piece = (piece.round() as i64).cast_unsigned();
    let key = finish(finish(seed ^ GOLDEN).wrapping_add(piece.wrapping_mul(GOLDEN)));
    ((finish(key.wrapping_add(GOLDEN)) >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)) as f32
}

/// The finaliser of splitmix64.
#[inline(always)]
const fn finish(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
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
