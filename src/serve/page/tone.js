// @ts-check
// Maps values to colours on the screen: black and white point, exposure, false colour, contour lines.
/** @type {Tone} */
const OWN = { range: null, exposure: 0, heat: false, contours: 0 };

/** @type {() => Tone} */
export const neutral = () => ({ ...OWN });
/** @type {(tone: Tone) => boolean} */
export const isNeutral = (tone) => !tone.range && !tone.exposure && !tone.heat && !tone.contours;

// Turbo colour map as a polynomial (Mikhailov, 2019).
/** @param {number} x */
function turbo(x) {
  /** @param {number[]} a */
  const p = (a) => a.reduceRight((sum, c) => sum * x + c, 0);
  /** @param {number} v */
  const byte = (v) => Math.min(255, Math.max(0, Math.round(v * 255)));
  return [
    byte(p([0.13572138, 4.6153926, -42.66032258, 132.13108234, -152.94239396, 59.28637943])),
    byte(p([0.09140261, 2.19418839, 4.84296658, -14.18503333, 4.27729857, 2.82956604])),
    byte(p([0.1066733, 12.64194608, -60.58204836, 110.36276771, -89.90310912, 27.34824973])),
  ];
}

const STEPS = 1024;
const HEAT = Array.from({ length: STEPS + 1 }, (_, i) => turbo(i / STEPS));
// False colour of a share, 0 to 1.
/** @param {number} x @returns {number[]} */
export const heat = (x) => HEAT[Math.round(STEPS * x)];
const toLinear = Float32Array.from({ length: 256 }, (_, i) => { const v = i / 255; return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; });
const CODES = 4096;
const toCode = Uint8ClampedArray.from({ length: CODES + 1 }, (_, i) => { const v = i / CODES; return 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055); });

// Values of a picture: exact ones if available, else decoded from its pixels.
/** @param {Source} source @returns {PictureValues} */
export function values(source) {
  if (source.samples) return source.samples;
  if (source.decoded) return source.decoded;
  const { image, range, type } = source;
  const { width, height } = image;
  const canvas = new OffscreenCanvas(width, height);
  const c = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext('2d', { willReadFrequently: true }));
  c.drawImage(image, 0, 0);
  const bytes = c.getImageData(0, 0, width, height).data;
  const channels = type === 'Gray' ? 1 : 3;
  const data = new Float32Array(width * height * channels);
  const [lo, hi] = range ?? [0, 1];
  for (let i = 0, o = 0; i < bytes.length; i += 4) {
    for (let k = 0; k < channels; k += 1, o += 1) data[o] = type === 'Rgb' ? toLinear[bytes[i + k]] : lo + ((hi - lo) * bytes[i + k]) / 255;
  }
  source.decoded = { width, height, channels, type, data };
  return source.decoded;
}

// Draws the picture of a source with another tone.
/** @param {Source} source @param {Tone} tone @returns {OffscreenCanvas} */
export function toned(source, tone) {
  const key = JSON.stringify(tone) + !!source.samples;
  if (source.tonedKey === key) return /** @type {OffscreenCanvas} */ (source.toned);
  const from = values(source);
  const { width, height, channels, data } = from;
  const canvas = new OffscreenCanvas(width, height);
  const c = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext('2d'));
  const out = c.createImageData(width, height);
  const [lo, hi] = tone.range ?? source.range ?? [0, 1];
  const gain = 2 ** tone.exposure / Math.max(hi - lo, 1e-30);
  const pixels = out.data;
  const rgb = source.type === 'Rgb';
  const one = channels === 1 && source.type !== 'Ids';
  for (let i = 0, o = 0; o < pixels.length; i += channels, o += 4) {
    pixels[o + 3] = 255;
    if (one) {
      const x = (data[i] - lo) * gain;
      if (tone.heat) {
        const color = HEAT[Math.min(STEPS, Math.max(0, Math.round(x * STEPS)))];
        [pixels[o], pixels[o + 1], pixels[o + 2]] = color ?? [0, 0, 0];
      } else {
        pixels[o] = pixels[o + 1] = pixels[o + 2] = x * 255 + 0.5;
      }
    } else {
      for (let k = 0; k < 3; k += 1) {
        const x = k < channels ? (data[i + k] - lo) * gain : 0.5;
        pixels[o + k] = rgb ? toCode[Math.min(CODES, Math.max(0, Math.round(x * CODES)))] : x * 255 + 0.5;
      }
    }
  }
  if (one && tone.contours > 0) contours(data, width, height, tone.contours, pixels, tone.heat);
  c.putImageData(out, 0, 0);
  Object.assign(source, { toned: canvas, tonedKey: key });
  return canvas;
}

// Contour lines where a height crosses a multiple of `step`.
/** @param {Float32Array} data @param {number} width @param {number} height @param {number} step @param {Uint8ClampedArray} pixels @param {boolean} heat */
function contours(data, width, height, step, pixels, heat) {
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      const i = y * width + x;
      const level = Math.floor(data[i] / step);
      const right = Math.floor(data[y * width + (x + 1) % width] / step);
      const below = Math.floor(data[((y + 1) % height) * width + x] / step);
      if (level === right && level === below) continue;
      const o = i * 4;
      [pixels[o], pixels[o + 1], pixels[o + 2]] = heat ? [0, 0, 0] : [235, 120, 40];
    }
  }
}

// Minimum, maximum, mean, and the number of values in each of `count` bins, by channel.
/** @param {Source} source @param {Vec2} range */
export function histogram(source, [lo, hi], count = 128) {
  const { channels, data } = values(source);
  const shown = Math.min(channels, 3);
  const bins = Array.from({ length: shown }, () => new Uint32Array(count));
  let [least, greatest, sum, n] = [Infinity, -Infinity, 0, 0];
  for (let i = 0; i < data.length; i += channels) {
    for (let k = 0; k < shown; k += 1) {
      const v = data[i + k];
      if (!Number.isFinite(v)) continue;
      if (v < least) least = v;
      if (v > greatest) greatest = v;
      sum += v;
      n += 1;
      const bin = Math.floor(((v - lo) / (hi - lo)) * count);
      bins[k][Math.min(count - 1, Math.max(0, bin))] += 1;
    }
  }
  return { bins, least, greatest, mean: n ? sum / n : 0 };
}

// Values along a line between two positions, in shares of the picture.
/** @param {Source} source @param {Vec2} from @param {Vec2} to @param {number} count */
export function profile(source, [x0, y0], [x1, y1], count) {
  const { width, height, channels, data } = values(source);
  /** @param {number} v @param {number} n */
  const wrap = (v, n) => ((v % n) + n) % n;
  return Array.from({ length: count }, (_, i) => {
    const t = i / (count - 1);
    const [x, y] = [(x0 + (x1 - x0) * t) * width, (y0 + (y1 - y0) * t) * height].map(Math.floor);
    const at = (wrap(y, height) * width + wrap(x, width)) * channels;
    return Array.from(data.subarray(at, at + Math.min(channels, 3)));
  });
}

// Value at a position, in shares of the picture.
/** @param {Source} source @param {Vec2} place */
export function valueAt(source, [x, y]) { return profile(source, [x, y], [x, y], 2)[0]; }

// Difference of two pictures over all channels: mean, root mean square and maximum. A smaller picture is sampled at the
// positions of the larger one. A value that is NaN in only one picture counts as the greatest difference.
/** @param {Source} first @param {Source} second */
export function difference(first, second) {
  const [a, b] = [values(first), values(second)].sort((p, q) => q.width * q.height - p.width * p.height);
  const shown = Math.min(a.channels, b.channels, 3);
  let [sum, squares, most] = [0, 0, 0];
  for (let y = 0; y < a.height; y += 1) {
    const row = Math.floor(((y + 0.5) / a.height) * b.height) * b.width;
    for (let x = 0; x < a.width; x += 1) {
      const i = (y * a.width + x) * a.channels;
      const j = (row + Math.floor(((x + 0.5) / a.width) * b.width)) * b.channels;
      for (let k = 0; k < shown; k += 1) {
        const d = Object.is(a.data[i + k], b.data[j + k]) ? 0 : Math.abs(a.data[i + k] - b.data[j + k]);
        if (Number.isNaN(d)) { most = Infinity; continue; }
        sum += d;
        squares += d * d;
        if (d > most) most = d;
      }
    }
  }
  const n = a.width * a.height * shown;
  return { mean: sum / n, rms: Math.sqrt(squares / n), most };
}
