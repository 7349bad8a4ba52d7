// @ts-check
// Limits the memory of pictures.

// All pictures together, in bytes.
export const MOST_BYTES = 256 << 20;

/** @typedef {import('./work.js').Made} Made */
/** @typedef {{ width: number, height: number, pixels: Uint8ClampedArray<ArrayBuffer> }} Pixels */

// The bytes of the present pictures and of those for the history of looks. A buffer in both counts once.
/** @param {Map<string, Made>} pictures @param {Map<string, Pixels>} kept */
export function bytesOf(pictures, kept) {
  const buffers = new Set();
  for (const { data, pixels, halves } of pictures.values()) for (const one of [data, pixels, halves]) if (one) buffers.add(one.buffer);
  for (const { pixels } of kept.values()) buffers.add(pixels.buffer);
  return [...buffers].reduce((sum, { byteLength }) => sum + byteLength, 0);
}

// Drops the oldest pictures of the history until the limit holds, then exact values of targets other than `focus`. The present
// pictures stay, because the page shows them: alone they may have more than `most`.
/** @param {Map<string, Made>} pictures by targets @param {Map<string, Pixels>} kept by ids @param {string} focus */
export function trim(pictures, kept, focus, most = MOST_BYTES) {
  let bytes = bytesOf(pictures, kept);
  const present = new Set([...pictures.values()].map((made) => made.pixels));
  for (const [id, { pixels }] of kept) {
    if (bytes <= most) return;
    if (present.has(pixels)) continue;
    kept.delete(id);
    bytes -= pixels.buffer.byteLength;
  }
  for (const [target, made] of pictures) {
    if (bytes <= most) return;
    if (target === focus || !made.data) continue;
    pictures.set(target, { ...made, data: null });
    bytes -= made.data.buffer.byteLength;
  }
}
