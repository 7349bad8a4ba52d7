// @ts-check
// Strokes drawn by hand on the mesh: shown as ribbons, and written as `strokes` of `TangentField`.
import { cross, hit, ray, unit } from './camera.js';
import { linked } from './shaders.js';

// In units of the mesh's radius: distance between two points, half the width of a ribbon, and its height above the
// surface.
const STEP = 0.03;
const HALF = 0.007;
const LIFT = 0.006;

const VERTEX = `#version 300 es
layout(location = 0) in vec3 aPosition;
uniform mat4 uView;
void main() { gl_Position = uView * vec4(aPosition, 1.0); }`;
const FRAGMENT = `#version 300 es
precision mediump float;
out vec4 oColor;
void main() { oColor = vec4(0.08, 0.75, 1.0, 1.0); }`;

/** @typedef {Required<Pick<Shape, 'make' | 'perMm' | 'middle'>>} MeshShape */

export class Strokes {
  // `changed` is called when a redraw is needed; the elements are the button that starts drawing, and the panel.
  /** @param {HTMLElement} button @param {HTMLElement} panel @param {() => void} changed */
  constructor(button, panel, changed) {
    this.button = button;
    this.panel = panel;
    this.changed = changed;
    /** @type {Hit[][]} */
    this.strokes = [];
    this.drawing = false;
    /** @type {MeshShape | null} */
    this.mesh = null;
    /** @type {MeshShape | null} */
    this.owner = null;
    /** @type {Hit[] | null} */
    this.open = null;
    this.dirty = false;
    this.count = 0;
    this.text = /** @type {HTMLTextAreaElement} */ (panel.querySelector('textarea'));
    button.onclick = () => this.toggle();
    /** @param {string} name @param {() => void} action */
    const click = (name, action) => { /** @type {HTMLElement} */ (panel.querySelector(`[data-stroke=${name}]`)).onclick = action; };
    click('copy', () => this.copy());
    click('undo', () => this.undo());
    click('clear', () => { this.strokes = []; this.tell(); });
    this.show(null);
  }

  // Sets the shown mesh; null while another shape is shown. Strokes are kept until their mesh
  // returns; a different mesh discards them.
  /** @param {Shape | null} shape */
  show(shape) {
    const mesh = /** @type {MeshShape | null} */ (shape);
    if (mesh && mesh !== this.owner) [this.owner, this.strokes] = [mesh, []];
    this.mesh = mesh;
    this.button.hidden = !mesh;
    if (!mesh) this.drawing = false;
    this.tell();
  }

  toggle() {
    this.drawing = !this.drawing && !!this.mesh;
    this.tell();
  }

  tell() {
    this.button.ariaPressed = String(this.drawing);
    this.panel.hidden = !this.mesh || !(this.drawing || this.strokes.length);
    this.text.value = this.ron();
    this.dirty = true;
    this.changed();
  }

  undo() { this.strokes.pop(); this.tell(); }

  async copy() {
    this.text.select();
    // If the browser refuses, the text is selected and copied.
    try { await navigator.clipboard.writeText(this.text.value); } catch { document.execCommand('copy'); }
  }

  // The strokes in mm, as a line of a graph: in the mesh's coordinates, z up.
  ron() {
    if (!this.mesh || !this.strokes.length) return '';
    const { middle, perMm } = this.mesh;
    /** @param {Hit} hit */
    const mm = ({ at: [x, y, z] }) => [middle[0] + x / perMm, middle[1] - z / perMm, middle[2] + y / perMm];
    const digits = perMm > 0.02 ? 2 : 1;
    /** @param {Hit} p */
    const point = (p) => `(${mm(p).map((c) => +c.toFixed(digits)).join(', ')})`;
    return `strokes: [\n${this.strokes.map((stroke) => `  [${stroke.map(point).join(', ')}],\n`).join('')}],`;
  }

  // Begins a drag; returns whether it draws. `place` is in the picture, whose corners are ±1, y up.
  /** @param {Vec3} eye @param {number} aspect @param {Vec2} place */
  begin(eye, aspect, place) {
    if (!this.drawing) return false;
    const found = this.pick(eye, aspect, place);
    this.open = found && [found];
    return !!found;
  }

  /** @param {Vec3} eye @param {number} aspect @param {Vec2} place */
  move(eye, aspect, place) {
    const found = this.open && this.pick(eye, aspect, place);
    if (!found || !this.open) return;
    const last = this.open[this.open.length - 1].at;
    if (Math.hypot(...found.at.map((c, k) => c - last[k])) < STEP) return;
    this.open.push(found);
    if (this.open.length === 2) this.strokes.push(this.open);
    this.tell();
  }

  end() { this.open = null; }

  /** @param {Vec3} eye @param {number} aspect @param {Vec2} place */
  pick(eye, aspect, place) { return hit(/** @type {MeshShape} */ (this.mesh).make(1), eye, ray(eye, aspect, place)); }

  // One ribbon per stroke, with an arrow at its end.
  ribbons() {
    /** @type {number[]} */
    const out = [];
    /** @type {(p: Hit, side: Vec3, by: number, along?: number[]) => number[]} */
    const at = (p, side, by, along = [0, 0, 0]) => p.at.map((c, k) => c + p.normal[k] * LIFT + side[k] * by + along[k]);
    for (const stroke of this.strokes) {
      const sides = stroke.map((p, n) => {
        const [a, b] = [stroke[Math.max(n - 1, 0)], stroke[Math.min(n + 1, stroke.length - 1)]];
        return unit(cross(unit(b.at.map((c, k) => c - a.at[k])), p.normal));
      });
      for (let n = 1; n < stroke.length; n += 1) {
        const [a, b] = [stroke[n - 1], stroke[n]];
        const [l, r, m, s] = [at(a, sides[n - 1], -HALF), at(a, sides[n - 1], HALF), at(b, sides[n], -HALF), at(b, sides[n], HALF)];
        out.push(...l, ...r, ...m, ...m, ...r, ...s);
      }
      const [tip, side] = [stroke[stroke.length - 1], sides[sides.length - 1]];
      const ahead = cross(tip.normal, side).map((c) => c * 6 * HALF);
      out.push(...at(tip, side, -3 * HALF), ...at(tip, side, 3 * HALF), ...at(tip, side, 0, ahead));
    }
    return new Float32Array(out);
  }

  /** @param {WebGL2RenderingContext} gl @param {number[]} view */
  paint(gl, view) {
    if (!this.mesh || !this.strokes.length) return;
    if (this.gl !== gl) this.prepare(gl);
    gl.useProgram(this.program ?? null);
    gl.uniformMatrix4fv(this.view ?? null, false, view);
    gl.bindVertexArray(this.array ?? null);
    if (this.dirty) {
      const data = this.ribbons();
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer ?? null);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
      this.count = data.length / 3;
      this.dirty = false;
    }
    gl.drawArrays(gl.TRIANGLES, 0, this.count);
  }

  /** @param {WebGL2RenderingContext} gl */
  prepare(gl) {
    this.gl = gl;
    const program = linked(gl, VERTEX, FRAGMENT);
    this.program = program;
    this.view = gl.getUniformLocation(program, 'uView');
    this.array = gl.createVertexArray();
    this.buffer = gl.createBuffer();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 12, 0);
    this.dirty = true;
  }
}
