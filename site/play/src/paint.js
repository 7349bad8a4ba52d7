// @ts-check
// Samples as pictures and textures. The rules are those of bridge/src/scene/paint.rs and serve/map.rs.

const CODES = 4096;
/** @type {(v: number) => number} */
const srgb = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
const CODE = Uint8Array.from({ length: CODES + 1 }, (_, i) => Math.round(255 * srgb(i / CODES)));
// Near black the curve is steep: a table of its own has the first part.
const DARK = Uint8Array.from({ length: CODES + 1 }, (_, i) => Math.round(255 * srgb(i / CODES / 16)));
// Values a little outside 0..1 count as fractions.
const SLACK = 1e-3;

/** @type {(v: number) => number} */
const code = (v) => (v <= 0 ? 0 : v >= 1 ? 255 : v < 0.0625 ? DARK[(v * 16 * CODES + 0.5) | 0] : CODE[(v * CODES + 0.5) | 0]);

// The values that become black and white.
/** @param {Float32Array} data @param {string} meaning @returns {[number, number]} */
export function range(data, meaning) {
  let [lo, hi] = [Infinity, -Infinity];
  for (const v of data) {
    if (v < lo && v > -Infinity) lo = v;
    if (v > hi && v < Infinity) hi = v;
  }
  if (lo > hi || meaning === 'color' || meaning === 'normal') return [0, 1];
  if (meaning === 'data') {
    const reach = Math.max(Math.abs(lo), Math.abs(hi), 1e-30);
    return [-reach, reach];
  }
  return lo < -SLACK || hi > 1 + SLACK ? [lo, hi] : [0, 1];
}

const [FLOAT, BITS] = [new Float32Array(1), new Uint32Array(1)];
// Half precision, to the nearest number; ties to even.
/** @param {number} value */
function half(value) {
  FLOAT[0] = value;
  BITS[0] = new Uint32Array(FLOAT.buffer)[0];
  const [x] = BITS;
  const sign = (x >>> 16) & 0x8000;
  const exponent = (x >>> 23) & 255;
  const mantissa = x & 0x7fffff;
  if (exponent === 255) return sign | 0x7c00 | (mantissa ? 0x200 : 0);
  const e = exponent - 112;
  if (e >= 31) return sign | 0x7c00;
  if (e <= 0) {
    if (e < -10) return sign;
    const m = mantissa | 0x800000;
    const shift = 14 - e;
    const rest = m & ((1 << shift) - 1);
    const middle = 1 << (shift - 1);
    const kept = m >> shift;
    return sign | (kept + (rest > middle || (rest === middle && kept & 1) ? 1 : 0));
  }
  const kept = (e << 10) | (mantissa >> 13);
  const rest = mantissa & 0x1fff;
  return sign | (kept + (rest > 0x1000 || (rest === 0x1000 && kept & 1) ? 1 : 0));
}

/** @param {Float32Array} data @returns {Uint16Array<ArrayBuffer>} */
export function halves(data) {
  const Half = /** @type {any} */ (globalThis).Float16Array;
  return Half ? new Uint16Array(new Half(data).buffer) : Uint16Array.from(data, half);
}

// The picture of an event: its samples, pixels for the screen, and half-precision numbers of a single channel. `form` is that of the
// channel: `light` may be brighter than white, and is scaled. `given` has the values that become black and white; colours have none.
/** @param {any} json @param {Uint8Array<ArrayBuffer>} bytes @param {string} form @param {[number, number]} [given] */
export function paint(json, bytes, form, given) {
  const { width, height, components, value, meaning } = json;
  const count = width * height;
  const data = value ? new Float32Array(count * components) : new Float32Array(bytes.buffer);
  if (value) for (let i = 0; i < data.length; i += 1) data[i] = value[i % components];
  const pixels = new Uint8ClampedArray(4 * count).fill(255);
  const [lo, hi] = given && meaning !== 'color' && meaning !== 'normal' ? given : range(data, meaning);
  let scale = 1;
  if (form === 'light') for (const v of data) if (v > scale && v < Infinity) scale = v;
  const gain = 255 / Math.max(hi - lo, 1e-30);
  if (components === 1) {
    for (let i = 0, o = 0; i < count; i += 1, o += 4) pixels[o] = pixels[o + 1] = pixels[o + 2] = (data[i] - lo) * gain;
  } else {
    for (let i = 0, o = 0; o < pixels.length; i += components, o += 4) {
      for (let k = 0; k < 3; k += 1) {
        if (k >= components) pixels[o + k] = 128;
        else pixels[o + k] = meaning === 'color' ? code(data[i + k] / scale) : (data[i + k] - lo) * gain;
      }
    }
  }
  return { data, pixels, range: [lo, hi], scale, halves: components === 1 ? halves(data) : undefined };
}
