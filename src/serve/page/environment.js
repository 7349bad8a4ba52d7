// @ts-check
// Light from a panorama, and the background behind the shape. The format of the bytes is in sky.rs.
import { rays } from './camera.js';
import { LIGHT, linked } from './shaders.js';

// Texture unit, after those of the material.
const UNIT = 8;

// Reads the bytes: coefficients of the light, direction and colour of the sun, and a texture of all levels.
/** @param {WebGL2RenderingContext} gl @param {ArrayBuffer} bytes @returns {Panorama} */
export function panorama(gl, bytes) {
  const [width, height, levels] = new Uint32Array(bytes, 0, 3);
  const numbers = new Float32Array(bytes, 12, 33);
  const texture = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0 + UNIT);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  let at = 4 * 36;
  for (let level = 0; level < levels; level += 1) {
    const [w, h] = [width >> level, height >> level];
    gl.texImage2D(gl.TEXTURE_2D, level, gl.RGB9_E5, w, h, 0, gl.RGB, gl.UNSIGNED_INT_5_9_9_9_REV, new Uint32Array(bytes, at, w * h));
    at += 4 * w * h;
  }
  for (const [name, value] of [['MAX_LEVEL', levels - 1], ['WRAP_T', gl.CLAMP_TO_EDGE], ['MIN_FILTER', gl.LINEAR_MIPMAP_LINEAR], ['MAG_FILTER', gl.LINEAR]]) gl.texParameteri(gl.TEXTURE_2D, /** @type {any} */ (gl)[`TEXTURE_${name}`], Number(value));
  // The shader's key light is 2.2 times its colour.
  return { bytes, texture, irradiance: numbers.subarray(0, 27), sun: numbers.subarray(27, 30), light: numbers.slice(30, 33).map((v) => v / 2.2) };
}

// Sets the light uniforms of a program. `u` finds uniforms; `turn` is in degrees; `key` is the elevation of the key
// light in degrees, and its size.
/** @param {WebGL2RenderingContext} gl @param {Uniforms} u @param {Lighting} light */
export function illuminate(gl, u, { scene, own, turn, key, exposure }) {
  const a = (turn * Math.PI) / 180;
  const [high, round] = [(key[0] * Math.PI) / 180, -0.8567];
  /** @type {Vec3} */
  const toward = own ? /** @type {Vec3} */ (/** @type {unknown} */ (own.sun)) : [Math.sin(round) * Math.cos(high), Math.sin(high), Math.cos(round) * Math.cos(high)];
  gl.uniformMatrix3fv(u('uLight'), false, [Math.cos(a), 0, -Math.sin(a), 0, 1, 0, Math.sin(a), 0, Math.cos(a)]);
  gl.uniform1i(u('uScene'), own ? 4 : scene);
  gl.uniform4f(u('uKey'), ...toward, key[1]);
  gl.uniform1f(u('uExposure'), 2 ** exposure);
  gl.uniform1i(u('uEnvironment'), UNIT);
  gl.activeTexture(gl.TEXTURE0 + UNIT);
  gl.bindTexture(gl.TEXTURE_2D, own?.texture ?? null);
  if (!own) return;
  gl.uniform3fv(u('uIrradiance[0]'), own.irradiance);
  gl.uniform3fv(u('uSunLight'), own.light);
}

const BEHIND = `#version 300 es
layout(location = 0) in vec2 aPlace;
layout(location = 1) in vec3 aWay;
out vec3 vWay;
void main() { vWay = aWay; gl_Position = vec4(aPlace, 0.9999, 1.0); }`;
const SEEN = `#version 300 es
precision highp float;
in vec3 vWay;
out vec4 oColor;
${LIGHT}
void main() { oColor = vec4(developed(studio(normalize(vWay), 0.2)), 1.0); }`;

// The environment behind the shape, slightly out of focus.
export class Behind {
  /** @param {WebGL2RenderingContext} gl @param {Vec3} eye @param {number} aspect @param {Lighting} light */
  paint(gl, eye, aspect, light) {
    if (this.gl !== gl) this.prepare(gl);
    gl.useProgram(this.program ?? null);
    illuminate(gl, /** @type {Uniforms} */ (this.at), light);
    gl.bindVertexArray(this.array ?? null);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer ?? null);
    const corners = [[-1, -1], [1, -1], [-1, 1], [1, 1]].flatMap((place) => [...place, ...rays(eye, aspect, place)]);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(corners), gl.DYNAMIC_DRAW);
    gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.depthMask(true);
  }

  /** @param {WebGL2RenderingContext} gl */
  prepare(gl) {
    this.gl = gl;
    const program = linked(gl, BEHIND, SEEN);
    this.program = program;
    /** @type {Record<string, WebGLUniformLocation | null>} */
    const known = {};
    /** @type {Uniforms} */
    this.at = (name) => (known[name] ??= gl.getUniformLocation(program, name));
    this.array = gl.createVertexArray();
    this.buffer = gl.createBuffer();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    for (const [i, [n, from]] of [[2, 0], [3, 8]].entries()) {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, n, gl.FLOAT, false, 20, from);
    }
  }
}
