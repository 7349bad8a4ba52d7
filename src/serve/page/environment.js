// @ts-check
// Light from the maps of an environment, and the background behind the shape. The format of the bytes is in
// serve/environment.rs.
import { cross, dot, rays } from './camera.js';
import { LIGHT } from './light.js';
import { linked } from './shaders.js';

// Texture unit, after those of the material.
const UNIT = 8;
// The slider of the light's height at which the key light stands as in Relief, and the least and the greatest height.
export const USUAL = 37;
const [LOW, HIGH] = [3, 88];
// Direction to the lamp of Relief: 40° high, in the upper left.
/** @type {Vec3} */
const LAMP_AT = [-0.54168, 0.54168, 0.64279];
// From the page to an environment whose horizon is level: its camera looks down at the ground by 53°.
/** @type {Turn} */
const LEVEL = [[1, 0, 0], [0, 0.6, -0.8], [0, 0.8, 0.6]];
/** @type {Turn} */
const ALIKE = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

// Reads the bytes: diffuse light, the key light, and a texture of all levels.
/** @param {WebGL2RenderingContext} gl @param {ArrayBuffer} bytes @returns {Light} */
export function lightOf(gl, bytes) {
  const [count] = new Uint32Array(bytes, 0, 1);
  const sizes = [...new Uint32Array(bytes, 4, count)];
  const numbers = new Float32Array(bytes, 4 + 4 * count, 37);
  const texture = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0 + UNIT);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  // The first level is at the left, the others are below each other at its right.
  const [first, second = 0] = sizes.map((size) => size + 2);
  const below = sizes.slice(1).reduce((sum, size) => sum + size + 2, 0);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA16F, first + second, Math.max(first, below));
  let at = 4 * (1 + count + 37);
  let top = 0;
  /** @type {number[]} */
  const levels = [];
  sizes.forEach((size, level) => {
    const [wide, x] = [size + 2, level ? first : 0];
    gl.texSubImage2D(gl.TEXTURE_2D, 0, x, top, wide, wide, gl.RGBA, gl.HALF_FLOAT, new Uint16Array(bytes, at, 4 * wide * wide));
    levels.push(x, top, size);
    at += 8 * wide * wide;
    top += level ? wide : 0;
  });
  for (const [name, value] of [['WRAP_S', gl.CLAMP_TO_EDGE], ['WRAP_T', gl.CLAMP_TO_EDGE], ['MIN_FILTER', gl.LINEAR], ['MAG_FILTER', gl.LINEAR]]) gl.texParameteri(gl.TEXTURE_2D, /** @type {any} */ (gl)[`TEXTURE_${name}`], Number(value));
  return {
    bytes, texture, levels: new Float32Array(levels), diffuse: numbers.subarray(0, 27),
    key: /** @type {Vec3} */ ([...numbers.subarray(27, 30)]), keyLight: numbers.subarray(30, 33), keyColor: numbers.subarray(33, 36),
  };
}

/** @type {(turn: Turn, v: number[]) => Vec3} */
const turned = (turn, v) => /** @type {Vec3} */ (turn.map((row) => row[0] * v[0] + row[1] * v[1] + row[2] * v[2]));
/** @type {(a: Turn) => Turn} */
const back = (a) => /** @type {Turn} */ ([0, 1, 2].map((i) => a.map((row) => row[i])));
/** @type {(a: Turn, b: Turn) => Turn} */
const both = (a, b) => back(/** @type {Turn} */ (back(b).map((column) => turned(a, column))));

// The key light at a height of the slider: its direction, and the turn from there to its own place. Between the ends of
// the slider the height is that in degrees; in the usual position it is the light's own.
/** @param {Vec3} own @param {Turn} stands @param {number} slider @returns {[Vec3, Turn]} */
export function keyAt(own, stands, slider) {
  if (slider === USUAL) return [own, ALIKE];
  const p = turned(back(stands), own);
  const usual = (Math.asin(Math.max(-1, Math.min(1, p[1]))) * 180) / Math.PI;
  const end = slider < USUAL ? LOW : HIGH;
  const high = ((usual + ((end - usual) * (slider - USUAL)) / (end - USUAL)) * Math.PI) / 180;
  const round = Math.atan2(p[0], p[2]);
  const found = turned(stands, [Math.sin(round) * Math.cos(high), Math.sin(high), Math.cos(round) * Math.cos(high)]);
  // The turn about the axis at right angles to both.
  const [x, y, z] = cross(found, own);
  /** @type {Turn} */
  const over = [[0, -z, y], [z, 0, -x], [-y, x, 0]];
  const twice = both(over, over);
  const share = 1 / (1 + dot(found, own));
  return [found, /** @type {Turn} */ (ALIKE.map((row, i) => row.map((v, j) => v + over[i][j] + share * twice[i][j])))];
}

// Sets the light uniforms of a program. `u` finds uniforms; `turn` is in degrees; `key` is the position of the slider of
// the key light's height, and its size.
/** @param {WebGL2RenderingContext} gl @param {Uniforms} u @param {Lighting} light */
export function illuminate(gl, u, { light, level, turn, key: [high, size], exposure }) {
  const a = (turn * Math.PI) / 180;
  const stands = level ? LEVEL : ALIKE;
  const [at, home] = keyAt(light?.key ?? LAMP_AT, stands, high);
  const way = both(stands, [[Math.cos(a), 0, Math.sin(a)], [0, 1, 0], [-Math.sin(a), 0, Math.cos(a)]]);
  // GLSL counts matrices by columns.
  gl.uniformMatrix3fv(u('uLight'), true, way.flat());
  gl.uniform1i(u('uLamp'), light ? 0 : 1);
  gl.uniform3fv(u('uKey'), at);
  gl.uniformMatrix3fv(u('uKeyBack'), true, home.flat());
  gl.uniform1f(u('uKeySize'), size);
  gl.uniform1i(u('uKeyMoved'), high !== USUAL || size !== 1 ? 1 : 0);
  gl.uniform1f(u('uExposure'), 2 ** exposure);
  gl.uniform1i(u('uEnvironment'), UNIT);
  gl.activeTexture(gl.TEXTURE0 + UNIT);
  gl.bindTexture(gl.TEXTURE_2D, light?.texture ?? null);
  if (!light) return;
  gl.uniform3fv(u('uLevels[0]'), light.levels);
  gl.uniform3fv(u('uDiffuse[0]'), light.diffuse);
  gl.uniform3fv(u('uKeyLight'), light.keyLight);
  gl.uniform3fv(u('uKeyColor'), light.keyColor);
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
void main() {
  vec3 way = uLight * normalize(vWay);
  // The lamp has a sky, which its pictures mirror.
  vec3 light = uLamp ? vec3(max(0.25 + 1.2 * dot(way.xy, uKey.xy), 0.0)) : reflected(way, 0.2).rgb;
  oColor = vec4(developed(light), 1.0);
}`;

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
