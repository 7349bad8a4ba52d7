// @ts-check
// Textures of the lit view.

// Displayed channels, in the order of the menu. The index of each is its bit in `uMaps`.
export const CHANNELS = [
  'base_color', 'roughness', 'metallic', 'normal', 'height', 'ao', 'anisotropy', 'anisotropy_angle', 'sheen', 'coat', 'opacity',
  'coat_roughness', 'coat_normal', 'emission', 'ior', 'specular', 'subsurface',
];

// Textures by the name of their uniform, in the order of their units, with their channels. Four single-channel maps
// share a texture, because only sixteen texture units are available everywhere.
/** @type {Record<string, string[]>} */
export const SLOTS = {
  uBaseColor: ['base_color'], uNormal: ['normal'], uHeight: ['height'], uEmission: ['emission'], uCoatNormal: ['coat_normal'],
  uSurface: ['roughness', 'metallic', 'ao', 'opacity'], uGloss: ['anisotropy', 'anisotropy_angle', 'sheen', 'coat'],
  uInner: ['coat_roughness', 'ior', 'specular', 'subsurface'],
};

// Makes the texture of a slot; `found` has the samples of its channels by name. Also returns the channels present, the
// factor of the colours, and the minimum and maximum of a height.
/**
 * @param {{ gl: WebGL2RenderingContext, mipHalf?: unknown, sharp?: EXT_texture_filter_anisotropic | null }} view
 * @param {string} slot
 * @param {Record<string, Samples>} found
 * @returns {Texture}
 */
export function texture({ gl, mipHalf, sharp }, slot, found) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  const channels = SLOTS[slot].filter((channel) => found[channel]);
  const { width, height, form, data, scale = 1 } = found[channels[0]];
  const colors = form === 'rgba8';
  if (colors) {
    const inner = slot === 'uBaseColor' || slot === 'uEmission' ? gl.SRGB8_ALPHA8 : gl.RGBA8;
    gl.texImage2D(gl.TEXTURE_2D, 0, inner, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(data));
  } else {
    const [lanes, numbers] = together(SLOTS[slot].map((channel) => found[channel]));
    const [inner, outer] = /** @type {Record<number, Vec2>} */ ({ 1: [gl.R16F, gl.RED], 2: [gl.RG16F, gl.RG], 4: [gl.RGBA16F, gl.RGBA] })[lanes];
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 2);
    gl.texImage2D(gl.TEXTURE_2D, 0, inner, width, height, 0, outer, form === 'r16f' ? gl.HALF_FLOAT : gl.FLOAT, numbers);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
  }
  const mips = colors || !!mipHalf;
  if (mips) gl.generateMipmap(gl.TEXTURE_2D);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, mips ? gl.LINEAR_MIPMAP_LINEAR : gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  if (sharp && slot !== 'uHeight') gl.texParameterf(gl.TEXTURE_2D, sharp.TEXTURE_MAX_ANISOTROPY_EXT, 8);
  /** @type {Vec2} */
  const range = slot === 'uHeight' && form === 'r16f' ? extent(new Uint16Array(data)) : [0, 0];
  return { texture: made, channels, scale, range };
}

// Interleaves the samples of up to four channels, and returns the number of values per pixel. A single channel stays as
// it is.
/** @param {(Samples | undefined)[]} list @returns {[number, Uint16Array | Float32Array]} */
function together(list) {
  const planes = list.map((one) => one && new (one.form === 'r16f' ? Uint16Array : Float32Array)(one.data));
  const count = planes.findLastIndex(Boolean) + 1;
  if (count === 1) return [1, /** @type {Uint16Array | Float32Array} */ (planes[0])];
  const lanes = count === 2 ? 2 : 4;
  const first = /** @type {Uint16Array | Float32Array} */ (planes.find(Boolean));
  const out = new (/** @type {Uint16ArrayConstructor | Float32ArrayConstructor} */ (first.constructor))(lanes * first.length);
  planes.forEach((plane, lane) => plane?.forEach((value, i) => { out[lanes * i + lane] = value; }));
  return [lanes, out];
}

// Binds the textures of a material to the program; `at` finds its uniforms.
/** @param {WebGL2RenderingContext} gl @param {Uniforms} at @param {Partial<Record<string, Texture>>} maps */
export function bind(gl, at, maps) {
  let bits = 0;
  Object.keys(SLOTS).forEach((slot, unit) => {
    gl.uniform1i(at(slot), unit);
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, maps[slot]?.texture ?? null);
    for (const channel of maps[slot]?.channels ?? []) bits |= 1 << CHANNELS.indexOf(channel);
  });
  gl.uniform1i(at('uMaps'), bits);
  gl.uniform1f(at('uGlow'), maps.uEmission?.scale ?? 1);
}

// Minimum and maximum of half-precision numbers.
/** @param {Uint16Array} halves @returns {Vec2} */
function extent(halves) {
  let [lo, hi] = [Infinity, -Infinity];
  for (const h of halves) {
    const e = (h >> 10) & 31;
    const m = h & 1023;
    if (e === 31) continue;
    const v = (e ? (1 + m / 1024) * 2 ** (e - 15) : m * 2 ** -24) * (h & 0x8000 ? -1 : 1);
    if (v < lo) lo = v;
    if (v > hi) hi = v;
  }
  return lo > hi ? [0, 0] : [lo, hi];
}
