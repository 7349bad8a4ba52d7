// @ts-check
// The material on a shape: textures from the server, an orbiting camera, a movable light. Drawn only when something
// changes.
import { camera } from './camera.js';
import { $, press } from './dom.js';
import { Behind, USUAL, illuminate } from './environment.js';
import { Marks } from './marks.js';
import { mesh, worn } from './net.js';
import { FRAGMENT, VERTEX, isSoftware, linked } from './shaders.js';
import { SHAPES } from './shapes.js';
import { Ground, Staging } from './staging.js';
import { Strokes } from './strokes.js';
import { SLOTS, bind, texture } from './textures.js';

/** The name, the label, the least and the greatest value, the step, the first value and the unit. */
/** @type {[string, string, number, number, number, number, string?][]} */
const SLIDERS = [
  ['repeat', 'Repeats', 1, 8, 1, 1], ['relief', 'Relief', 0, 4, 0.05, 1], ['exposure', 'Exposure', -2, 2, 0.05, 0, 'EV'],
  ['light', 'Light direction', -180, 180, 1, 0, '°'], ['lightHeight', 'Light height', 3, 88, 1, USUAL, '°'], ['lightSize', 'Light size', 0.2, 4, 0.1, 1], ['roughness', 'Roughness', 0.05, 1, 0.01, 0.5], ['metallic', 'Metal', 0, 1, 0.01, 0],
  ['anisotropy', 'Anisotropy', 0, 1, 0.01, 0], ['coat', 'Coat', 0, 1, 0.01, 0],
];

// Time budget of a picture in ms, while something moves and at rest.
const MOVING = 40;
const RESTING = 900;
// The view without perspective of a plane that fills the picture.
const ABOVE = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -0.1, 0, 0, 0, 0, 1];
const QUALITIES = [1, 0.75, 0.5, 0.35, 0.25, 0.15];

/** @type {(selector: string) => NodeListOf<HTMLElement>} */
const buttons = (selector) => document.querySelectorAll(selector);

/** @typedef {{ scene: Scene, maps: ChannelMaps, size: number }} Asked */
/** @typedef {{ array: WebGLVertexArrayObject, count: number, free: () => void }} Uploaded */

export class Lit {
  /** @param {HTMLCanvasElement} canvas @param {HTMLElement} panel */
  constructor(canvas, panel) {
    this.canvas = canvas;
    this.panel = panel;
    /** @type {Record<string, number>} */
    this.values = Object.fromEntries(SLIDERS.map(([name, , , , , start]) => [name, start]));
    /** @type {Record<string, Shape>} */
    this.shapes = { ...SHAPES };
    this.shape = 'sphere';
    this.relief = 'parallax';
    this.resolution = 1024;
    /** @type {Worn | null} */
    this.now = null;
    /** @type {Worn | null} */
    this.pinned = null;
    this.wipe = 0.5;
    // True: the plane fills the picture and is seen from above, without perspective, as in pictures of Relief. Only tests
    // set it.
    this.above = false;
    /** @type {Record<string, Uploaded>} */
    this.meshes = {};
    /** @type {WebGL2RenderingContext | null} */
    this.gl = null;
    this.failed = false;
    this.spare = false;
    /** @type {Record<string, WebGLUniformLocation | null>} */
    this.uniforms = {};
    /** @type {Record<string, { slider: HTMLInputElement, value: HTMLElement, unit: string, row: HTMLElement }>} */
    this.sliders = {};
    /** @type {Asked | undefined} */
    this.asked = undefined;
    /** @type {Asked | undefined} */
    this.done = undefined;
    this.loading = false;
    this.queued = false;
    this.budget = MOVING;
    /** @type {number | undefined} */
    this.rest = undefined;
    /** @type {Uploaded | undefined} */
    this.warm = undefined;
    /** @type {string | null | undefined} */
    this.meshId = undefined;
    const [turn, tilt, distance] = this.shapes[this.shape].view;
    this.turn = turn;
    this.tilt = tilt;
    this.distance = distance;
    /** @type {(() => void) | undefined} */
    this.onshape = undefined;
    /** @type {((found: Hover | null) => void) | undefined} */
    this.onhover = undefined;
    this.quality = 0;
    // The user chose a shape.
    this.chosen = false;
    // Cost in ms per pixel; a guess until the first picture is drawn.
    this.cost = 0.002;
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.strokes = new Strokes($('draw'), $('strokes'), () => this.draw());
    this.marks = new Marks($('marks'), () => this.draw(), (found) => this.onhover?.(found));
    this.listen();
    this.build();
    this.staging = new Staging(this);
    this.ground = new Ground();
    this.behind = new Behind();
  }

  // The view uses no resources until it is first opened.
  start() {
    if (this.gl || this.failed) return;
    // Without a graphics card the CPU renders; fewer samples, triangles and steps make it twice as fast.
    this.spare = isSoftware();
    const gl = this.canvas.getContext('webgl2', { antialias: !this.spare, alpha: true, premultipliedAlpha: false, preserveDrawingBuffer: true });
    if (!gl) { this.fail('This browser has no WebGL 2; the picture view works without it.'); return; }
    this.gl = gl;
    this.canvas.addEventListener('webglcontextlost', (e) => { e.preventDefault(); this.fail('The graphics driver gave up; reload the page.'); });
    gl.getExtension('EXT_color_buffer_float');
    this.mipHalf = gl.getExtension('EXT_color_buffer_half_float') || gl.getExtension('EXT_color_buffer_float');
    this.sharp = this.spare ? null : gl.getExtension('EXT_texture_filter_anisotropic');
    try {
      this.program = linked(gl, VERTEX, FRAGMENT);
    } catch (error) {
      this.fail(`The lit view cannot be drawn: ${/** @type {Error} */ (error).message}`);
      return;
    }
    gl.useProgram(this.program);
    this.uniforms = {};
    const count = gl.getProgramParameter(this.program, gl.ACTIVE_UNIFORMS);
    for (let i = 0; i < count; i += 1) {
      const { name } = /** @type {WebGLActiveInfo} */ (gl.getActiveUniform(this.program, i));
      this.uniforms[name] = gl.getUniformLocation(this.program, name);
    }
    gl.enable(gl.DEPTH_TEST);
    gl.uniform1f(this.uniforms.uFine, this.spare ? 0.4 : 1);
    this.setShape(this.shape);
    this.staging.ready();
  }

  /** @param {string} text */
  fail(text) {
    this.failed = true;
    this.gl = null;
    this.panel.append(Object.assign(document.createElement('p'), { textContent: text }));
    this.canvas.dataset.drawn = 'failed';
  }

  listen() {
    const { canvas } = this;
    /** @type {Vec2 | null} */
    let from = null;
    /** @type {(e: MouseEvent) => Vec2} */
    const place = (e) => [(2 * e.offsetX) / canvas.clientWidth - 1, 1 - (2 * e.offsetY) / canvas.clientHeight];
    const aspect = () => canvas.clientWidth / canvas.clientHeight;
    canvas.addEventListener('pointerdown', (e) => {
      canvas.setPointerCapture(e.pointerId);
      if (!this.strokes.begin(this.eye(), aspect(), place(e))) from = [e.clientX, e.clientY];
    });
    const end = () => { from = null; this.strokes.end(); };
    canvas.addEventListener('pointerup', end);
    canvas.addEventListener('pointercancel', end);
    canvas.addEventListener('pointermove', (e) => {
      this.strokes.move(this.eye(), aspect(), place(e));
      if (!from) { this.marks.hover(this.eye(), aspect(), place(e)); return; }
      const [dx, dy] = [e.clientX - from[0], e.clientY - from[1]];
      from = [e.clientX, e.clientY];
      if (e.shiftKey) {
        this.set('light', ((this.values.light + dx * 0.5 + 540) % 360) - 180);
      } else {
        this.turnBy(-dx * 0.008, dy * 0.008);
      }
      this.draw();
    });
    canvas.addEventListener('pointerleave', () => this.marks.hover(null, 1, null));
    canvas.addEventListener('wheel', (e) => { e.preventDefault(); this.zoom(Math.exp(-e.deltaY * 0.0012)); }, { passive: false });
    canvas.addEventListener('keydown', (e) => {
      const by = /** @type {Record<string, Vec2>} */ ({ ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] })[e.key];
      if (!by || e.ctrlKey || e.altKey || e.metaKey) return;
      e.preventDefault();
      this.turnBy(-by[0] * 0.12, -by[1] * 0.12);
    });
    canvas.addEventListener('dblclick', () => this.reset());
    for (const b of buttons('[data-shape]')) b.onclick = () => { this.chosen = true; this.setShape(String(b.dataset.shape)); };
    for (const b of buttons('[data-relief]')) b.onclick = () => this.setRelief(String(b.dataset.relief));
  }

  build() {
    this.panel.replaceChildren(Object.assign(document.createElement('h2'), { textContent: 'Light and surface' }));
    for (const [name, text, min, max, step, , unit] of SLIDERS) {
      const row = Object.assign(document.createElement('div'), { className: 'param' });
      const head = Object.assign(document.createElement('div'), { className: 'head' });
      const label = Object.assign(document.createElement('label'), { textContent: text, htmlFor: `light-${name}` });
      const value = Object.assign(document.createElement('span'), { className: 'unit' });
      const slider = Object.assign(document.createElement('input'), { type: 'range', id: `light-${name}`, min: String(min), max: String(max), step: String(step) });
      slider.oninput = () => { this.set(name, slider.valueAsNumber); this.staging.touched(name); };
      head.append(label, value);
      row.append(head, slider);
      this.panel.append(row);
      this.sliders[name] = { slider, value, unit: unit ?? '', row };
      this.set(name, this.values[name]);
    }
    const row = Object.assign(document.createElement('div'), { className: 'param' });
    const label = Object.assign(document.createElement('label'), { textContent: 'Texture', htmlFor: 'light-resolution' });
    const select = Object.assign(document.createElement('select'), { id: 'light-resolution' });
    for (const n of [512, 1024, 2048]) select.append(Object.assign(document.createElement('option'), { value: String(n), textContent: `${n} px`, selected: n === this.resolution }));
    select.onchange = () => { this.resolution = +select.value; if (this.asked) this.load(this.asked.scene, this.asked.maps, this.resolution); };
    row.append(label, select);
    this.panel.append(row);
    this.setRelief(this.relief);
    this.reset();
  }

  // Light settings. In a panorama the height of the light is fixed.
  /** @returns {Lighting} */
  get lighting() {
    const { light, lightHeight, lightSize, exposure } = this.values;
    const { staging } = this;
    return { light: staging.light ?? null, level: staging.level, turn: light, key: [staging.isOwn ? USUAL : lightHeight, lightSize], exposure };
  }

  /** @param {string} name @param {number} value */
  set(name, value) {
    this.values[name] = value;
    const { slider, value: text, unit } = this.sliders[name];
    slider.value = String(value);
    text.textContent = `${+value.toFixed(2)}${unit && ` ${unit}`}`;
    this.staging?.keepSoon();
    this.draw();
  }

  /** @param {number} turn @param {number} tilt */
  turnBy(turn, tilt) {
    this.staging.keepSoon();
    this.turn += turn;
    this.tilt = Math.min(1.5, Math.max(-1.5, this.tilt + tilt));
    this.draw();
  }

  /** @param {number} by */
  zoom(by) {
    this.staging.keepSoon();
    this.distance = Math.min(12, Math.max(1.25, this.distance / by));
    this.draw();
  }

  reset() { [this.turn, this.tilt, this.distance] = this.shapes[this.shape].view; this.draw(); }

  /** @returns {Vec3} */
  eye() {
    const [flat, up] = [Math.cos(this.tilt), Math.sin(this.tilt)];
    return /** @type {Vec3} */ ([Math.sin(this.turn) * flat, up, Math.cos(this.turn) * flat].map((c) => c * this.distance));
  }

  /** @param {string} shape */
  setShape(shape) {
    this.shape = shape;
    this.strokes.show(shape === 'mesh' ? this.shapes.mesh : null);
    this.marks.show(shape === 'mesh' ? this.shapes.mesh : null);
    press($('shapes'), (b) => b.dataset.shape === shape);
    this.reset();
    this.staging?.shaped(shape);
    this.onshape?.();
  }

  // Replaces a shape, or takes it away.
  /** @param {string} name @param {Shape | null} shape */
  put(name, shape) {
    for (const uploaded of [`${name} true`, `${name} false`]) {
      this.meshes[uploaded]?.free();
      delete this.meshes[uploaded];
    }
    if (shape) this.shapes[name] = shape; else delete this.shapes[name];
  }

  // Adds the graph's mesh to the shapes while the graph has one.
  /** @param {Scene} scene */
  async setMesh(scene) {
    const id = scene.mesh ?? null;
    this.marks.follow(scene.generation);
    if (id === this.meshId) return;
    this.meshId = id;
    // The server may have ended.
    const found = id && await mesh({ g: scene.generation }).catch(() => null);
    if (this.meshId !== id) return;
    // The graph has changed meanwhile; news of the new graph will load its mesh.
    if (id && !found) { this.meshId = undefined; return; }
    const had = !!this.shapes.mesh;
    this.put('mesh', found || null);
    buttons('[data-shape=mesh]')[0].hidden = !found;
    if (found && !had && !this.chosen) this.setShape('mesh');
    else if (!found && this.shape === 'mesh') this.setShape('sphere');
    else if (this.shape === 'mesh') { this.strokes.show(this.shapes.mesh); this.marks.show(this.shapes.mesh); }
    else this.draw();
  }

  // Offers shapes cut from a solid if the graph has one.
  /** @param {boolean} there */
  setSolid(there) {
    for (const b of buttons('[data-shape^=solid]')) b.hidden = !there;
    if (!there && this.shapes[this.shape].solid) this.setShape('sphere');
  }

  nextShape() {
    const all = [...buttons('[data-shape]:not([hidden])')];
    all[(all.findIndex((b) => b.dataset.shape === this.shape) + 1) % all.length].click();
  }

  /** @param {string} relief */
  setRelief(relief) {
    this.relief = relief;
    press($('reliefs'), (b) => b.dataset.relief === relief);
    this.draw();
  }

  /** @param {string} target */
  wants(target) { return !!this.asked && Object.values(this.asked.maps).some((m) => m.t === target); }

  // Fetches missing textures. `maps` gives for each channel the target and a name of its content.
  /** @param {Scene} scene @param {ChannelMaps} maps @param {number} size */
  async load(scene, maps, size) {
    if (!this.gl) return;
    this.asked = { scene, maps, size };
    if (this.loading) return;
    this.loading = true;
    while (this.asked !== this.done) {
      const asked = /** @type {Asked} */ (this.asked);
      try { await this.fetch(asked); } catch { /* the graph has changed */ }
      this.done = asked;
    }
    this.loading = false;
  }

  /** @param {Asked} asked */
  async fetch({ scene, maps, size }) {
    const old = this.now?.maps ?? {};
    /** @type {Partial<Record<string, LoadedTexture>>} */
    const made = {};
    await Promise.all(Object.entries(SLOTS).map(async ([slot, all]) => {
      const channels = all.filter((channel) => maps[channel]);
      if (!channels.length) return;
      const [id, of] = /** @type {('id' | 't')[]} */ (['id', 't']).map((what) => channels.map((channel) => `${channel} ${maps[channel][what]} ${maps[channel].solid}`).join());
      const before = old[slot];
      if (before && before.id === id && before.size >= size) { made[slot] = before; return; }
      const samples = await Promise.all(channels.map((channel) => worn(scene, maps[channel], size)));
      const found = /** @type {Record<string, Samples>} */ (Object.fromEntries(channels.map((channel, i) => [channel, samples[i]]).filter(([, one]) => one)));
      if (Object.keys(found).length) made[slot] = { id, of, size, ...texture(/** @type {this & { gl: WebGL2RenderingContext }} */ (this), slot, found) };
      else if (before && before.of === of) made[slot] = before;
    }));
    const kept = new Set([...Object.values(made), ...Object.values(this.pinned?.maps ?? {})]);
    for (const map of Object.values(old)) if (map && !kept.has(map)) this.gl?.deleteTexture(map.texture);
    await this.staging.ready();
    this.now = { maps: made, mm: scene.canvas.size_mm };
    const shown = new Set(Object.values(made).flatMap((map) => map?.channels ?? []));
    for (const name of ['roughness', 'metallic', 'anisotropy', 'coat']) this.sliders[name].row.hidden = shown.has(name);
    this.canvas.dataset.generation = String(scene.generation);
    this.canvas.dataset.size = String(size);
    this.draw();
  }

  pin() {
    this.pinned = this.pinned ? null : this.now;
    this.draw();
    return !!this.pinned;
  }

  resize() { this.draw(); }

  // Draws soon; where drawing is slow, as without a graphics card, a coarse picture comes first.
  draw() {
    if (this.gl && this.now && this.canvas.clientWidth) this.schedule(MOVING);
  }

  /** @param {number} budget */
  schedule(budget) {
    this.budget = budget;
    if (this.queued) return;
    this.queued = true;
    requestAnimationFrame(() => { this.queued = false; this.paint(); });
  }

  // Linear share of the screen's pixels that can be drawn within a time budget in ms.
  /** @param {number} budget */
  bearable(budget) {
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const pixels = this.canvas.clientWidth * this.canvas.clientHeight * ratio * ratio;
    const fits = Math.sqrt(budget / (this.cost * pixels));
    const found = QUALITIES.find((q) => q <= fits) ?? QUALITIES.at(-1);
    return budget === RESTING ? Math.max(found ?? 0, 0.35) : found ?? 0;
  }

  // The buffers of the shape; the view has been started.
  mesh() {
    const gl = /** @type {WebGL2RenderingContext} */ (this.gl);
    const fine = this.relief === 'displacement';
    const name = `${this.shape} ${fine}`;
    const known = this.meshes[name];
    if (known) return known;
    const { data, index } = this.shapes[this.shape].make((fine ? 1 : 0.35) * (this.spare ? 0.5 : 1));
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const [vertices, triangles] = [gl.createBuffer(), gl.createBuffer()];
    gl.bindBuffer(gl.ARRAY_BUFFER, vertices);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    [[3, 0], [3, 3], [3, 6], [2, 9]].forEach(([n, at], i) => {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, n, gl.FLOAT, false, 44, at * 4);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, triangles);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, index, gl.STATIC_DRAW);
    const free = () => {
      gl.deleteVertexArray(array);
      for (const buffer of [vertices, triangles]) gl.deleteBuffer(buffer);
    };
    this.meshes[name] = { array, count: index.length, free };
    return this.meshes[name];
  }

  paint() {
    const { gl, canvas } = this;
    if (!gl || !this.now || !canvas.clientWidth || this.staging.light === undefined) return;
    const mesh = this.mesh();
    const began = performance.now();
    this.quality = this.bearable(this.budget);
    const ratio = Math.min(devicePixelRatio || 1, 2) * this.quality;
    const [w, h] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.max(1, Math.round(n * ratio)));
    this.render(w, h);
    // Reading a pixel waits for the GPU, which gives the real cost.
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    const took = performance.now() - began;
    // The first picture of a shape is not measured, because it includes set-up work.
    const cold = this.warm !== mesh;
    if (!cold) this.cost = took / (w * h);
    this.warm = mesh;
    clearTimeout(this.rest);
    const wait = cold || this.budget === RESTING ? 20 : 220;
    this.rest = setTimeout(() => { if (this.quality < this.bearable(RESTING)) this.schedule(RESTING); }, wait);
    canvas.dataset.drawn = String((Number(canvas.dataset.drawn) || 0) + 1);
    canvas.dataset.quality = String(this.quality);
  }

  // Draws w × h pixels: the current material, and the pinned one left of the dividing line.
  /** @param {number} w @param {number} h */
  render(w, h) {
    const { canvas } = this;
    const gl = /** @type {WebGL2RenderingContext} */ (this.gl);
    if (w !== canvas.width || h !== canvas.height) [canvas.width, canvas.height] = [w, h];
    gl.viewport(0, 0, w, h);
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const split = this.pinned ? Math.round(w * this.wipe) : 0;
    if (this.staging.showsEnvironment) this.behind.paint(gl, this.eye(), w / h, this.lighting);
    gl.enable(gl.SCISSOR_TEST);
    if (this.pinned) {
      gl.scissor(0, 0, split, h);
      this.material(this.pinned);
    }
    gl.scissor(split, 0, w - split, h);
    this.material(/** @type {Worn} */ (this.now));
  }

  /** @param {Worn} material */
  material({ maps: all, mm }) {
    const { canvas, uniforms: u, values } = this;
    const gl = /** @type {WebGL2RenderingContext} */ (this.gl);
    const { span = 0, solid, plain, perMm = solid ? 2 / Math.max(...mm) : undefined } = this.shapes[this.shape];
    const maps = plain ? {} : all;
    // A mesh shows its textures once, without repeats; so does a shape cut from a solid.
    const repeat = perMm ? 1 : values.repeat;
    const heights = maps.uHeight?.range ?? [0, 0];
    const eye = this.eye();
    const view = this.above ? ABOVE : camera(eye, canvas.width / canvas.height);
    const moved = this.relief === 'displacement' && !!maps.uHeight;
    gl.useProgram(this.program ?? null);
    bind(gl, (name) => u[name], maps);
    gl.uniformMatrix4fv(u.uView, false, view);
    gl.uniform4f(u.uEye, ...(this.above ? /** @type {Vec3} */ ([0, 0, 1]) : eye), this.above ? 0 : 1);
    illuminate(gl, (name) => u[name], this.lighting);
    gl.uniform2f(u.uRepeat, repeat, perMm ? 1 : (repeat * mm[0]) / mm[1]);
    gl.uniform1f(u.uDisplace, moved ? (perMm ?? (span / repeat) / mm[0]) * values.relief : 0);
    gl.uniform2fv(u.uHeights, heights);
    gl.uniform1f(u.uUvPerMm, 1 / mm[0]);
    gl.uniform2f(u.uAspect, 1, mm[0] / mm[1]);
    gl.uniform1f(u.uRelief, values.relief);
    gl.uniform1i(u.uParallax, this.relief === 'parallax' ? 1 : 0);
    gl.uniform1f(u.uWorldPerMm, perMm ?? 0);
    gl.uniform4f(u.uConstants, values.roughness, values.metallic, values.anisotropy, values.coat);
    const { array, count } = this.mesh();
    gl.bindVertexArray(array);
    gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    if (this.staging.shadow) this.ground.paint(gl, view, this.shapes[this.shape].foot);
    this.marks.paint(gl, view);
    this.strokes.paint(gl, view);
  }
}
