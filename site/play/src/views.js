// @ts-check
// Answers about everything beside the pictures of outputs: nodes and levels of the graph, variations, textures on shapes, meshes and bodies.
import { MOST_SIZE, formOf } from './work.js';

/** @typedef {import('./model.js').Model} Model */
/** @typedef {import('./pool.js').Answer} Answer */
/** @typedef {import('./pool.js').Failure} Failure */

// Longest sides of a variation, of the picture that it shrinks, and of a thumbnail, in pixels.
const [VARIATION, WHOLE, THUMB] = [240, 512, 96];

// A painted picture, at most `longest` pixels wide and high.
/** @param {Answer | null} answer @param {number} longest */
function shrunk(answer, longest) {
  if (!answer?.pixels) return null;
  const { width, height } = answer.json;
  const k = Math.min(1, longest / Math.max(width, height));
  const [resizeWidth, resizeHeight] = [width, height].map((n) => Math.max(1, Math.round(n * k)));
  const whole = new ImageData(answer.pixels, width, height);
  return createImageBitmap(whole, { resizeWidth, resizeHeight, resizeQuality: 'high', colorSpaceConversion: 'none', premultiplyAlpha: 'none' });
}

// Samples for a texture.
/** @param {Pick<Answer, 'json' | 'pixels' | 'halves' | 'scale'> | null} answer @returns {Samples | null} */
export function samples(answer) {
  if (!answer?.pixels) return null;
  const { json: { width, height }, pixels, halves, scale } = answer;
  if (halves) return { width, height, form: 'r16f', scale: 1, data: halves.buffer };
  return { width, height, form: 'rgba8', scale, data: /** @type {ArrayBuffer} */ (pixels.buffer) };
}

export class Views {
  /** @param {Model} model @param {typeof import('./shapes.js').meshShape} meshShape */
  constructor(model, meshShape) {
    this.model = model;
    this.meshShape = meshShape;
    /** @type {string[]} the nodes of the graph, in its order */
    this.names = [];
    // Levels of the present text, by their paths: values move no box.
    /** @type {any} */
    this.of = null;
    /** @type {Map<string, Promise<any>>} */
    this.levels = new Map();
    // Textures on shapes of the present graph.
    this.generation = -1;
    /** @type {Map<string, Promise<Samples | null>>} */
    this.cuts = new Map();
    /** @type {{ key: string, shape: Shape } | null} the last mesh of a graph */
    this.last = null;
  }

  // The event of a request about the graph with its values. Null if there is none, or if the graph changes before.
  /** @param {{ op: string, [field: string]: unknown }} request @param {{ form?: string, range?: Vec2, isLater?: boolean }} [how] @returns {Promise<Answer | null>} */
  async fetch(request, { form, range, isLater } = {}) {
    const { generation, chosen, opened } = this.model;
    if (!opened) return null;
    /** @type {Answer | null} */
    let made = null;
    const run = (/** @type {import('./pool.js').Hand} */ hand) => {
      made = null;
      return hand.ask({ graph: hand.has?.graph, ...chosen, ...request }, (answer) => { made = answer; }, form, range);
    };
    try {
      await this.model.task(run, { isLater, generation });
    } catch (error) {
      if (/** @type {Failure} */ (error).code !== 'cancelled') throw error;
      return null;
    }
    return generation === this.model.generation ? made : null;
  }

  // Another picture than those that the page shows: of other values, of a node, or on a shape. Null if it cannot be made.
  /** @param {{ target: string, size: number, [field: string]: unknown }} wish @param {{ range?: Vec2, isLater?: boolean }} [how] */
  view(wish, how) { return this.fetch({ op: 'look', ...wish }, { ...how, form: formOf(wish.target) }).catch(() => null); }

  // An answer of the editor's engine about the graph with its values; null if there is none, undefined if the graph changes before.
  /** @param {{ op: string, [field: string]: unknown }} request @returns {Promise<any>} */
  async tell(request) {
    const { opened, chosen, pool, generation } = this.model;
    if (!opened) return undefined;
    const found = await pool.editor.ask({ graph: opened.graph, ...chosen, ...request }).done.catch(() => null);
    return generation === this.model.generation ? found : undefined;
  }

  // The description of a node.
  /** @param {string} target @returns {Promise<(About & { line?: number, column?: number }) | null | undefined>} */
  about(target) { return this.tell({ op: 'about', target }); }

  // The description of a node in the text as it is, without tried values.
  /** @param {string} node @returns {Promise<(About & { line?: number, column?: number }) | null | undefined>} */
  place(node) { return this.tell({ op: 'about', target: `@${node}`, edits: undefined }); }

  // The drawing of a level; null if there is none, undefined if the graph changes before.
  /** @param {number} generation @param {string} path */
  async level(generation, path) {
    const { model, levels } = this;
    const { opened } = model;
    if (generation !== model.generation || !opened) return undefined;
    if (this.of !== opened) {
      this.of = opened;
      levels.clear();
    }
    const known = levels.get(path) ?? model.pool.editor.ask({ op: 'level', graph: opened.graph, path }).done.catch(() => null);
    levels.set(path, known);
    const found = await known;
    if (!found) levels.delete(path);
    if (generation !== model.generation) return undefined;
    if (found) this.names = found.names;
    return found;
  }

  // The drawing of an object without pixels.
  /** @param {string} target @returns {Promise<Sketch | null>} */
  async drawing(target) {
    const { model } = this;
    if (!model.drawings.has(target)) {
      const found = await this.view({ target, size: model.size });
      if (found?.json.event === 'object') model.draws(target, found.json);
    }
    return model.drawings.get(target) ?? null;
  }

  // A small picture of an output of a node: the whole one, shrunk.
  /** @param {{ g: number, n: number, o: number }} of */
  async thumb({ g, n, o }) {
    const { model, names: { [n]: name } } = this;
    if (g !== model.generation || name === undefined) return null;
    const found = await this.view({ target: `@${name}`, port: o, size: Math.min(WHOLE, model.size) }, { isLater: true });
    if (found?.json.event === 'object' && o === 0) model.drawings.set(`@${name}`, found.json.drawing);
    return shrunk(found, THUMB);
  }

  // A picture with other values.
  /** @param {{ g: number, t: string, v: string, lo?: number, hi?: number, s?: number }} of */
  async vary({ g, t, v, lo, hi, s = VARIATION }) {
    const { model } = this;
    if (g !== model.generation) return null;
    const { preset, set, edits } = JSON.parse(v);
    const wish = { target: t, size: Math.min(WHOLE, model.size), preset: preset ?? undefined, set: Object.fromEntries(set), edits };
    return shrunk(await this.view(wish, { range: lo === undefined || hi === undefined ? undefined : [lo, hi], isLater: true }), s);
  }

  // A texture of a shape that is cut from a solid.
  /** @param {number} generation @param {string} target @param {string} shape @param {number} size */
  cut(generation, target, shape, size) {
    const { model } = this;
    if (generation !== model.generation) return Promise.resolve(null);
    if (this.generation !== generation) {
      this.generation = generation;
      this.cuts.clear();
    }
    const wish = { target, shape, size: Math.min(size, Math.max(WHOLE, model.size)) };
    const key = JSON.stringify(wish);
    const known = this.cuts.get(key);
    if (known) return known;
    const made = this.view(wish).then(samples);
    this.cuts.set(key, made);
    return made;
  }

  // The mesh of the graph.
  /** @param {number} generation @returns {Promise<Shape | null>} */
  async mesh(generation) {
    const { model, last } = this;
    if (generation !== model.generation) return null;
    const found = await this.fetch({ op: 'shape', size: model.size, known: last?.key });
    if (found?.json.event === 'same' && last) return last.shape;
    if (!found?.bytes) return null;
    const shape = this.shapeOf(found);
    this.last = { key: found.json.key, shape };
    return shape;
  }

  // The overlays of the mesh.
  /** @param {number} generation @returns {Promise<MeshMarks | null>} */
  async marks(generation) {
    const { model } = this;
    if (generation !== model.generation) return null;
    const found = await this.fetch({ op: 'shape', size: model.size, marks: true }).catch(() => null);
    return found?.json.marks ?? null;
  }

  // The body of an output, with its report: at the size of the graph, as its files are written.
  /** @param {number} generation @param {string} output @returns {Promise<(Shape & { report: BodyReport }) | null>} */
  async body(generation, output) {
    const { model } = this;
    if (generation !== model.generation) return null;
    const size = Math.min(MOST_SIZE, Math.max(...model.opened.canvas.resolution));
    const found = await this.fetch({ op: 'shape', output, size });
    return found?.bytes ? { ...this.shapeOf(found), report: found.json.report } : null;
  }

  /** @param {Answer} answer */
  shapeOf({ json: { vertices, indices, per_mm: perMm, middle }, bytes }) {
    return this.meshShape(/** @type {ArrayBuffer} */ (bytes?.buffer), vertices, indices, perMm, middle);
  }
}
