// Workers without a module: requests wait until a test answers them.
import { Model } from '../src/model.js';
import { Failure } from '../src/pool.js';

// Gives waiting work a turn.
export const turn = () => new Promise((done) => setTimeout(done, 5));

export class FakeHand {
  constructor() {
    /** @type {any[]} requests that wait */
    this.asked = [];
    this.ready = Promise.resolve();
    this.prepared = undefined;
    this.has = null;
    this.runs = 0;
    this.ondefect = () => {};
  }

  ask(request, heard = () => {}, form, range) {
    const one = { request, heard, form, range };
    one.done = new Promise((resolve, reject) => Object.assign(one, { resolve, reject }));
    this.asked.push(one);
    return { n: this.asked.length, done: one.done, stop: () => { one.stopped = true; }, finish: () => { one.finished = true; } };
  }

  end() { this.ended = true; }

  // The oldest waiting request of an operation.
  next(op) {
    const at = this.asked.findIndex((one) => one.request.op === op);
    if (at < 0) throw new Error(`no ${op} waits; there are ${this.asked.map((one) => one.request.op)}`);
    return this.asked.splice(at, 1)[0];
  }

  waits(op) { return this.asked.filter((one) => one.request.op === op).length; }

  async answer(op, ok) {
    this.next(op).resolve(ok);
    await turn();
  }

  async fail(op, error) {
    this.next(op).reject(new Failure(error));
    await turn();
  }

  // Answers a request for a picture.
  async draw({ width = 2, height = 2 } = {}) {
    await turn();
    const one = this.next('look');
    const json = { event: 'picture', key: `${one.request.target} ${one.request.graph} ${JSON.stringify(one.request.set)}`, width, height, components: 1, meaning: 'number' };
    one.heard({ json, data: new Float32Array(width * height), pixels: new Uint8ClampedArray(4 * width * height), range: [0, 1], scale: 1 });
    one.resolve({});
    await turn();
    return one.request;
  }
}

// A model whose workers are fakes, with the news that it told.
export function fake() {
  const pool = { editor: new FakeHand(), renderer: new FakeHand(), takeovers: 0, replace() { pool.renderer = new FakeHand(); pool.takeovers += 1; } };
  const model = new Model(pool);
  const told = [];
  model.news.listen((kind, data) => told.push([kind, data]));
  return { model, pool, told };
}

// The answer to `open` of a text with these outputs.
export const opened = (sha256, outputs = ['a'], params = []) => ({
  graph: `graph of ${sha256}`, sha256, params, presets: {}, warnings: [], nodes: [], breaks: [], canvas: { size_mm: [1, 1], resolution: [64, 64], tile: 'None' },
  outputs: outputs.map((one) => (typeof one === 'string' ? { name: one, type: 'Gray' } : one)),
});

// Opens a text in the editor's worker. The first text is opened in the renderer, too.
export async function open({ model, pool }, text, answer, of) {
  const isFirst = !model.opened;
  model.setText(text, of);
  await turn();
  if (isFirst) await pool.renderer.answer('open', answer);
  await pool.editor.answer('open', answer);
}
