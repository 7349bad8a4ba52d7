// @ts-check
// Overlays on the mesh of the lit view: charts, a grid of texture coordinates, chart borders and directions; and the
// point under the cursor.
import { hit, ray } from './camera.js';
import { ask, latest } from './net.js';
import { linked } from './shaders.js';

// Vertex: position, texture coordinates, colour of the chart.
const FILL = `#version 300 es
layout(location = 0) in vec3 aPosition;
layout(location = 1) in vec2 aUv;
layout(location = 2) in vec3 aColor;
uniform mat4 uView;
out vec2 vUv;
out vec3 vColor;
void main() { vUv = aUv; vColor = aColor; gl_Position = uView * vec4(aPosition, 1.0); }`;
const FILLED = `#version 300 es
precision highp float;
in vec2 vUv;
in vec3 vColor;
uniform bool uGrid;
out vec4 oColor;
void main() {
  if (!uGrid) { oColor = vec4(vColor, 0.6); return; }
  vec2 cell = vUv * 16.0;
  vec2 wide = fwidth(cell);
  vec2 near = abs(fract(cell + 0.5) - 0.5) / max(wide, vec2(1e-6));
  float line = 1.0 - smoothstep(0.6, 1.6, min(near.x, near.y));
  float odd = mod(floor(cell.x) + floor(cell.y), 2.0);
  oColor = mix(vec4(vUv.x, vUv.y, 0.35, 0.25 + 0.25 * odd), vec4(1.0), 0.85 * line);
}`;
// Draws a line as two triangles, with a width in pixels.
const LINE = `#version 300 es
layout(location = 0) in vec3 aFrom;
layout(location = 1) in vec3 aTo;
layout(location = 2) in float aSide;
uniform mat4 uView;
uniform vec3 uWide;   // size of the picture and line width, in pixels
void main() {
  vec4 a = uView * vec4(aFrom, 1.0);
  vec4 b = uView * vec4(aTo, 1.0);
  vec2 d = (b.xy / b.w - a.xy / a.w) * uWide.xy;
  vec2 across = vec2(-d.y, d.x) / max(length(d), 1e-6);
  a.xy += across * aSide * uWide.z / uWide.xy * a.w;
  a.z -= 2e-4 * a.w;
  gl_Position = a;
}`;
const LINED = `#version 300 es
precision mediump float;
uniform vec3 uColor;
out vec4 oColor;
void main() { oColor = vec4(uColor, 1.0); }`;

// Half the size of the cross at a singular point of the directions.
const CROSS = 0.025;
/** @type {Record<'seams' | 'strokes' | 'ends' | 'singular', { of: string, color: Vec3, width: number }>} */
const LINES = {
  seams: { of: 'seams', color: [1, 0.82, 0.1], width: 2.5 },
  strokes: { of: 'directions', color: [0.08, 0.75, 1], width: 1.8 },
  ends: { of: 'directions', color: [1, 0.2, 0.75], width: 3 },
  singular: { of: 'directions', color: [1, 0.15, 0.1], width: 4 },
};

// Gives consecutive numbers different colours.
/** @param {number} chart */
function tint(chart) {
  const hue = (chart * 0.61803398875) % 1;
  return [0, 2 / 3, 1 / 3].map((shift) => 0.55 + 0.4 * Math.cos(2 * Math.PI * (hue + shift)));
}

/** @param {number[]} points */
function crosses(points) {
  /** @type {number[]} */
  const out = [];
  for (let n = 0; n < points.length; n += 3) {
    for (let axis = 0; axis < 3; axis += 1) {
      for (const by of [-CROSS, CROSS]) out.push(...[0, 1, 2].map((k) => points[n + k] + (k === axis ? by : 0)));
    }
  }
  return out;
}

// Two triangles for each line.
/** @param {number[]} ends */
function ribbons(ends) {
  /** @type {number[]} */
  const out = [];
  for (let n = 0; n < ends.length; n += 6) {
    const [a, b] = [ends.slice(n, n + 3), ends.slice(n + 3, n + 6)];
    const [left, right] = [[...a, ...b, 1], [...a, ...b, -1]];
    // At the other end of the line, left and right are swapped.
    const [far, away] = [[...b, ...a, -1], [...b, ...a, 1]];
    out.push(...left, ...right, ...far, ...far, ...right, ...away);
  }
  return new Float32Array(out);
}

/** @typedef {Required<Pick<Shape, 'make' | 'perMm' | 'middle'>>} MeshShape */
/** @typedef {{ array: WebGLVertexArrayObject | null, buffer: WebGLBuffer | null, count: number }} Buffers */
/**
 * The programs and buffers on the graphics card.
 * @typedef {{
 *   fill: Record<'program' | 'uView' | 'uGrid', any>,
 *   line: Record<'program' | 'uView' | 'uWide' | 'uColor', any>,
 *   surface: Buffers & { triangles: WebGLBuffer | null },
 *   lines: Record<string, Buffers>,
 * }} Drawn
 */

export class Marks {
  // `changed` is called when a redraw is needed, `onhover` with the point under the cursor.
  /** @param {HTMLElement} group @param {() => void} changed @param {(found: Hover | null) => void} onhover */
  constructor(group, changed, onhover) {
    this.group = group;
    this.changed = changed;
    this.onhover = onhover;
    /** @type {Set<string>} */
    this.layers = new Set();
    /** @type {MeshShape | null} */
    this.mesh = null;
    /** @type {MeshMarks | null} */
    this.data = null;
    this.generation = -1;
    this.dirty = false;
    /** @type {number | undefined} */
    this.soon = undefined;
    /** @type {WebGL2RenderingContext | undefined} */
    this.gl = undefined;
    /** @type {Drawn | undefined} */
    this.drawn = undefined;
    for (const b of this.buttons('[data-mark]')) b.onclick = () => this.toggle(String(b.dataset.mark));
    this.fetch = latest(async () => {
      const { generation } = this;
      const found = await ask('marks', { g: generation });
      if (!found || generation !== this.generation) return;
      this.data = found;
      this.dirty = true;
      const [directions] = this.buttons('[data-mark=directions]');
      directions.disabled = !found.strokes.length;
      directions.title = found.strokes.length ? 'The directions of TangentField; where they turn, and the points round which they do' : 'The graph has no TangentField on this mesh';
      this.changed();
    });
    this.tell();
  }

  /** @param {string} selector @returns {NodeListOf<HTMLButtonElement>} */
  buttons(selector) { return this.group.querySelectorAll(selector); }

  // Sets the shown mesh; null while another shape is shown.
  /** @param {Shape | null} shape */
  show(shape) {
    const mesh = /** @type {MeshShape | null} */ (shape);
    if (mesh !== this.mesh) [this.mesh, this.data] = [mesh, null];
    this.tell();
    if (mesh) this.fetch();
  }

  // Handles a new graph; its mesh may be the same.
  /** @param {number} generation */
  follow(generation) {
    if (generation === this.generation) return;
    this.generation = generation;
    if (this.mesh) this.fetch();
  }

  /** @param {string} layer */
  toggle(layer) {
    if (!this.layers.delete(layer)) this.layers.add(layer);
    // Only one layer covers the surface at a time.
    if (layer === 'charts') this.layers.delete('grid');
    if (layer === 'grid') this.layers.delete('charts');
    this.tell();
  }

  tell() {
    this.group.hidden = !this.mesh;
    for (const b of this.buttons('[data-mark]')) b.ariaPressed = String(this.layers.has(String(b.dataset.mark)));
    this.changed();
  }

  // Finds the point under a point of the picture, whose corners are ±1, y up, shortly after the cursor rests.
  /** @param {Vec3 | null} eye @param {number} aspect @param {Vec2 | null} place */
  hover(eye, aspect, place) {
    clearTimeout(this.soon);
    if (!this.mesh) return;
    this.soon = setTimeout(() => {
      if (!this.mesh) return;
      const made = this.mesh.make(1);
      const found = eye && place && hit(made, eye, ray(eye, aspect, place));
      if (!found) { this.onhover(null); return; }
      const { middle, perMm } = this.mesh;
      const [x, y, z] = found.at;
      /** @type {Vec3} */
      const mm = [middle[0] + x / perMm, middle[1] - z / perMm, middle[2] + y / perMm];
      /** @param {number} k */
      const corner = (k) => made.index[3 * found.triangle + k] * 11;
      const uv = /** @type {Vec2} */ ([9, 10].map((at) => [0, 1, 2].reduce((sum, k) => sum + found.weights[k] * made.data[corner(k) + at], 0)));
      const { triangles, parts, names, charts } = /** @type {Partial<MeshMarks>} */ (this.data ?? {});
      const n = found.triangle;
      this.onhover({ mm, uv, triangle: triangles?.[n], part: names?.[parts?.[n] ?? -1], chart: charts?.[n] });
    }, 30);
  }

  /** @param {WebGL2RenderingContext} gl @param {number[]} view */
  paint(gl, view) {
    if (!this.mesh || !this.data || !this.layers.size) return;
    const drawn = this.gl === gl && this.drawn ? this.drawn : this.prepare(gl);
    if (this.dirty) this.upload(gl, drawn);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    if (this.layers.has('charts') || this.layers.has('grid')) {
      gl.depthFunc(gl.LEQUAL);
      gl.enable(gl.POLYGON_OFFSET_FILL);
      gl.polygonOffset(-1, -1);
      gl.useProgram(drawn.fill.program);
      gl.uniformMatrix4fv(drawn.fill.uView, false, view);
      gl.uniform1i(drawn.fill.uGrid, this.layers.has('grid') ? 1 : 0);
      gl.bindVertexArray(drawn.surface.array);
      gl.drawElements(gl.TRIANGLES, drawn.surface.count, gl.UNSIGNED_INT, 0);
      gl.disable(gl.POLYGON_OFFSET_FILL);
      gl.depthFunc(gl.LESS);
    }
    gl.useProgram(drawn.line.program);
    gl.uniformMatrix4fv(drawn.line.uView, false, view);
    for (const [name, { of, color, width }] of Object.entries(LINES)) {
      if (!this.layers.has(of) || !drawn.lines[name].count) continue;
      gl.uniform3f(drawn.line.uWide, gl.drawingBufferWidth, gl.drawingBufferHeight, width);
      gl.uniform3fv(drawn.line.uColor, color);
      gl.bindVertexArray(drawn.lines[name].array);
      gl.drawArrays(gl.TRIANGLES, 0, drawn.lines[name].count);
    }
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  /** @param {WebGL2RenderingContext} gl @returns {Drawn} */
  prepare(gl) {
    this.gl = gl;
    /** @type {(vertex: string, fragment: string, names: string[]) => any} */
    const program = (vertex, fragment, names) => {
      const made = linked(gl, vertex, fragment);
      return { program: made, ...Object.fromEntries(names.map((name) => [name, gl.getUniformLocation(made, name)])) };
    };
    const fill = program(FILL, FILLED, ['uView', 'uGrid']);
    const line = program(LINE, LINED, ['uView', 'uWide', 'uColor']);
    /** @type {(sizes: number[]) => Buffers} */
    const buffers = (sizes) => {
      const [array, buffer] = [gl.createVertexArray(), gl.createBuffer()];
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      const stride = 4 * sizes.reduce((a, b) => a + b);
      sizes.reduce((at, n, i) => {
        gl.enableVertexAttribArray(i);
        gl.vertexAttribPointer(i, n, gl.FLOAT, false, stride, at);
        return at + 4 * n;
      }, 0);
      return { array, buffer, count: 0 };
    };
    const surface = { ...buffers([3, 2, 3]), triangles: gl.createBuffer() };
    const lines = Object.fromEntries(Object.keys(LINES).map((name) => [name, buffers([3, 3, 1])]));
    this.dirty = true;
    this.drawn = { fill, line, surface, lines };
    return this.drawn;
  }

  /** @param {WebGL2RenderingContext} gl @param {Drawn} drawn */
  upload(gl, { surface, lines }) {
    this.dirty = false;
    const { data, index } = /** @type {MeshShape} */ (this.mesh).make(1);
    const marks = /** @type {MeshMarks} */ (this.data);
    const { charts } = marks;
    const vertices = new Float32Array((data.length / 11) * 8);
    for (let v = 0; v < data.length / 11; v += 1) vertices.set([0, 1, 2, 9, 10].map((k) => data[11 * v + k]), 8 * v);
    for (let n = 0; n < index.length; n += 1) vertices.set(tint(charts[(n / 3) | 0]), 8 * index[n] + 5);
    gl.bindVertexArray(surface.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, surface.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, surface.triangles);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, index, gl.STATIC_DRAW);
    surface.count = index.length;
    for (const name of /** @type {(keyof typeof LINES)[]} */ (Object.keys(LINES))) {
      const made = ribbons(name === 'singular' ? crosses(marks.singular) : marks[name]);
      gl.bindBuffer(gl.ARRAY_BUFFER, lines[name].buffer);
      gl.bufferData(gl.ARRAY_BUFFER, made, gl.STATIC_DRAW);
      lines[name].count = made.length / 7;
    }
  }
}
