// @ts-check
// Surroundings of the shape: environment, backdrop, shadow at its foot; and the view stored for each graph.
import { $, element, keep, setting } from './dom.js';
import { USUAL, lightOf } from './environment.js';
import { environment } from './net.js';
import { linked } from './shaders.js';

// The environments of Relief, and the user's own panorama.
const [STUDIO, LAMP, OWN] = ['Studio', 'Lamp', 'Own HDRI'];
const SCENES = [STUDIO, 'Overcast', 'Window', 'Sky', LAMP, OWN];
const BACKDROPS = ['As the page', 'Black', 'Grey', 'White', 'The environment'];
const BEHIND = 4;
// A plane shows its relief best in grazing light.
const GRAZING = 14;
// Maximum number of graphs whose views are stored.
const KEPT = 12;

export class Staging {
  /** @param {import('./lit.js').Lit} lit */
  constructor(lit) {
    this.lit = lit;
    this.scene = STUDIO;
    // The light of each environment, once it is there.
    /** @type {Record<string, Light>} */
    this.lights = {};
    // The light shown last, until that of the chosen environment is there.
    /** @type {Light | null | undefined} */
    this.before = undefined;
    this.backdrop = 0;
    this.shadow = true;
    /** @type {string | null} */
    this.file = null;
    /** @type {number | undefined} */
    this.soon = undefined;
    this.byHand = false;
    /** @param {string} id @param {string} text @param {(string | number)[]} values @param {string[]} options @param {(value: string) => void} set */
    const select = (id, text, values, options, set) => {
      const made = element('select', { id }, ...options.map((name, i) => element('option', { value: values[i], textContent: name })));
      made.onchange = () => { set(made.value); this.keepSoon(); };
      lit.panel.append(element('div', { className: 'param' }, element('label', { htmlFor: id, textContent: text }), made));
      return made;
    };
    this.sceneBox = select('light-scene', 'Environment', SCENES, SCENES, (name) => this.setScene(name));
    // Without a panorama the user's own environment cannot be chosen.
    this.ownOption.hidden = this.ownOption.disabled = true;
    this.backBox = select('light-backdrop', 'Backdrop', [...BACKDROPS.keys()], BACKDROPS, (n) => this.setBackdrop(+n));
    this.shadowBox = element('input', { type: 'checkbox', id: 'light-shadow', checked: true });
    this.shadowBox.onchange = () => { this.shadow = this.shadowBox.checked; this.keepSoon(); lit.draw(); };
    lit.panel.append(element('label', { className: 'check', htmlFor: 'light-shadow' }, this.shadowBox, 'Shadow on the ground'));
    this.shaped(lit.shape);
  }

  get isOwn() { return this.scene === OWN; }

  get ownOption() { return this.sceneBox.options[SCENES.indexOf(OWN)]; }

  // The light to draw with; null for the lamp, undefined as long as there is none.
  /** @returns {Light | null | undefined} */
  get light() {
    const found = this.scene === LAMP ? null : this.lights[this.scene];
    if (found !== undefined) this.before = found;
    return this.before;
  }

  // A plane is seen from above, as pictures of Relief; around other shapes the horizon is level. The studio and the lamp
  // have none: they stand as the camera sees them.
  get level() { return this.lit.shape !== 'plane' && this.scene !== STUDIO && this.scene !== LAMP; }

  get showsEnvironment() { return this.backdrop === BEHIND; }

  /** @param {string} name */
  setScene(name) {
    this.scene = name;
    this.sceneBox.value = name;
    // In a panorama the height of the sun is fixed.
    this.lit.sliders.lightHeight.row.hidden = name === OWN;
    return this.ready();
  }

  // Fetches the light of the chosen environment unless it is there, and draws with it.
  async ready() {
    const { lit, scene, lights } = this;
    if (scene !== LAMP && scene !== OWN && lit.gl && !lights[scene]) {
      // The server may have ended.
      const bytes = await environment(null, scene).catch(() => null);
      if (bytes && lit.gl) lights[scene] ??= lightOf(lit.gl, bytes);
    }
    if (scene === this.scene) lit.draw();
  }

  // Uses the user's own panorama as the environment: a file, or null for the last one of this run.
  /** @param {File | null} file */
  async setOwn(file) {
    const { lit } = this;
    const bytes = await environment(file);
    if (bytes) lit.start();
    if (bytes && lit.gl) {
      if (this.lights[OWN]) lit.gl.deleteTexture(this.lights[OWN].texture);
      this.lights[OWN] = lightOf(lit.gl, bytes);
    }
    if (!this.lights[OWN]) return;
    const option = this.ownOption;
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
    const { lit } = this;
    lit.chosen = false;
    const kept = /** @type {[string, any][] | null} */ (setting('views'))?.find(([name]) => name === file)?.[1];
    if (!kept) return;
    const [shape, turn, tilt, distance, light, height, size, exposure, scene, backdrop, shadow] = kept;
    if (lit.shapes[shape]) { lit.chosen = true; lit.setShape(shape); }
    Object.assign(lit, { turn, tilt, distance });
    this.byHand = true;
    for (const [name, value] of Object.entries({ light, lightHeight: height, lightSize: size, exposure })) lit.set(name, value);
    if (scene === OWN) this.setOwn(null).catch(() => {}); else this.setScene(SCENES.includes(scene) ? scene : STUDIO);
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
