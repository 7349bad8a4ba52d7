// Textures of the lit view.

// A texture of the samples of a channel, and the least and the greatest of them.
export function texture({ gl, mipHalf, sharp }, { width, height, form, data }, channel) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  let range = [0, 0];
  let mips = true;
  if (form === 'r16f') {
    const halves = new Uint16Array(data);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 2);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16F, width, height, 0, gl.RED, gl.HALF_FLOAT, halves);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    range = extent(halves);
    mips = !!mipHalf;
  } else {
    const inner = channel === 'base_color' ? gl.SRGB8_ALPHA8 : gl.RGBA8;
    gl.texImage2D(gl.TEXTURE_2D, 0, inner, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(data));
  }
  if (mips) gl.generateMipmap(gl.TEXTURE_2D);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, mips ? gl.LINEAR_MIPMAP_LINEAR : gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  if (sharp && channel !== 'height') gl.texParameterf(gl.TEXTURE_2D, sharp.TEXTURE_MAX_ANISOTROPY_EXT, 8);
  return { texture, range };
}

// The least and the greatest of numbers in half precision.
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
