// @ts-check
// Surroundings of the shape: environment, backdrop, shadow at its foot; and the view stored for each graph.
import { $, element, keep, setting } from './dom.js';
import { environment } from './net.js';
import { linked } from './shaders.js';

const SCENES = ['Studio', 'Overcast sky', 'Evening', 'One light', 'Own HDRI'];
const OWN = 4;
const BACKDROPS = ['As the page', 'Black', 'Grey', 'White', 'The environment'];
const BEHIND = 4;
// A plane shows its relief best in grazing light.
const GRAZING = 14;
const USUAL = 37;
// Maximum number of graphs whose views are stored.
const KEPT = 12;

export class Staging {
  /** @param {import('./lit.js').Lit} lit */
  constructor(lit) {
    this.lit = lit;
    this.scene = 0;
    this.backdrop = 0;
    this.shadow = true;
    /** @type {string | null} */
    this.file = null;
    /** @type {number | undefined} */
    this.soon = undefined;
    this.byHand = false;
    /** @param {string} id @param {string} text @param {string[]} options @param {(n: number) => void} set */
    const select = (id, text, options, set) => {
      const made = element('select', { id }, ...options.map((name, i) => element('option', { value: i, textContent: name })));
      made.onchange = () => { set(+made.value); this.keepSoon(); };
      lit.panel.append(element('div', { className: 'param' }, element('label', { htmlFor: id, textContent: text }), made));
      return made;
    };
    this.sceneBox = select('light-scene', 'Environment', SCENES, (n) => this.setScene(n));
    // Without a panorama the user's own environment cannot be chosen.
    this.sceneBox.options[OWN].hidden = this.sceneBox.options[OWN].disabled = true;
    this.backBox = select('light-backdrop', 'Backdrop', BACKDROPS, (n) => this.setBackdrop(n));
    this.shadowBox = element('input', { type: 'checkbox', id: 'light-shadow', checked: true });
    this.shadowBox.onchange = () => { this.shadow = this.shadowBox.checked; this.keepSoon(); lit.draw(); };
    lit.panel.append(element('label', { className: 'check', htmlFor: 'light-shadow' }, this.shadowBox, 'Shadow on the ground'));
    this.shaped(lit.shape);
  }

  get isOwn() { return this.scene === OWN && !!this.lit.own; }

  get showsEnvironment() { return this.backdrop === BEHIND; }

  /** @param {number} n */
  setScene(n) {
    this.scene = n;
    this.sceneBox.value = String(n);
    // In a panorama the height of the sun is fixed.
    this.lit.sliders.lightHeight.row.hidden = n === OWN;
    this.lit.draw();
  }

  // Uses the user's own panorama as the environment: a file, or null for the last one of this run.
  /** @param {File | null} file */
  async setOwn(file) {
    const { lit } = this;
    const bytes = await environment(file);
    if (bytes) lit.setPanorama(bytes);
    if (!lit.own) return;
    const option = this.sceneBox.options[OWN];
    option.hidden = option.disabled = false;
    if (file) option.textContent = file.name;
    this.setScene(OWN);
    this.keepSoon();
  }

  /** @param {number} n */
  setBackdrop(n) {
    this.backdrop = n;
    $('stage').dataset.backdrop = String(n);
    this.lit.draw();
  }

  // Once the user has set the height of the light, it is kept.
  /** @param {string} name */
  touched(name) { if (name === 'lightHeight') this.byHand = true; }

  /** @param {string} shape */
  shaped(shape) {
    if (!this.byHand) this.lit.set('lightHeight', shape === 'plane' ? GRAZING : USUAL);
  }

  // Restores the stored view of a graph.
  /** @param {string} file */
  open(file) {
    if (this.file === file) return;
    this.file = file;
    const kept = /** @type {[string, any][] | null} */ (setting('views'))?.find(([name]) => name === file)?.[1];
    if (!kept) return;
    const { lit } = this;
    const [shape, turn, tilt, distance, light, height, size, exposure, scene, backdrop, shadow] = kept;
    if (lit.shapes[shape]) lit.setShape(shape);
    Object.assign(lit, { turn, tilt, distance });
    this.byHand = true;
    for (const [name, value] of Object.entries({ light, lightHeight: height, lightSize: size, exposure })) lit.set(name, value);
    if (scene === OWN) this.setOwn(null).catch(() => {}); else this.setScene(scene);
    this.shadow = shadow;
    this.setBackdrop(backdrop);
    this.backBox.value = backdrop;
    this.shadowBox.checked = shadow;
    this.dirty = false;
  }

  keepSoon() {
    if (!this.file) return;
    clearTimeout(this.soon);
    this.soon = setTimeout(() => {
      const { lit } = this;
      /** @param {number} v */
      const round = (v) => +v.toFixed(3);
      const { light, lightHeight, lightSize, exposure } = lit.values;
      const now = [lit.shape, ...[lit.turn, lit.tilt, lit.distance, light, lightHeight, lightSize, exposure].map(round), this.scene, this.backdrop, this.shadow];
      keep('views', [[this.file, now], ...(/** @type {[string, any][] | null} */ (setting('views')) ?? []).filter(([name]) => name !== this.file)].slice(0, KEPT));
    }, 400);
  }
}

const VERTEX = `#version 300 es
layout(location = 0) in vec2 aPlace;
uniform mat4 uView;
uniform float uFoot;
out vec2 vPlace;
void main() { vPlace = aPlace; gl_Position = uView * vec4(aPlace.x * 2.2, uFoot, aPlace.y * 2.2, 1.0); }`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec2 vPlace;
out vec4 oColor;
void main() {
  float r = length(vPlace) * 2.2;
  float dark = 0.55 * exp(-2.2 * r * r) + 0.2 * exp(-0.9 * r * r);
  oColor = vec4(0.0, 0.0, 0.0, dark * smoothstep(2.2, 1.4, r));
}`;

// The shadow where the shape touches the ground.
export class Ground {
  /** @param {WebGL2RenderingContext} gl @param {number[]} view @param {number} [foot] */
  paint(gl, view, foot) {
    if (foot === undefined) return;
    if (this.gl !== gl) this.prepare(gl);
    gl.useProgram(this.program ?? null);
    gl.uniformMatrix4fv(this.view ?? null, false, view);
    gl.uniform1f(this.foot ?? null, foot);
    gl.bindVertexArray(this.array ?? null);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  /** @param {WebGL2RenderingContext} gl */
  prepare(gl) {
    this.gl = gl;
    const program = linked(gl, VERTEX, FRAGMENT);
    this.program = program;
    this.view = gl.getUniformLocation(program, 'uView');
    this.foot = gl.getUniformLocation(program, 'uFoot');
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 8, 0);
  }
}
