// @ts-check
// Pictures of the opened graph: the renderer makes one per step, coarse to sharp. A newer change takes effect between two steps, or
// ends the renderer if a step takes long.
import { MOST_BYTES, trim } from './kept.js';
import { News, described } from './news.js';
import { Stats } from './stats.js';
import { Tasks, cancelled } from './tasks.js';
import { Tries } from './tries.js';

// The longer sides of the coarse pictures.
const COARSE = [128, 256];
// A coarse picture that takes less time is not made: the next size comes at once, in ms.
const QUICK = 80;
// A step of an older change may take this long, in ms.
const PATIENCE = 400;
// Then the user is asked, in ms.
export const LONG = 10_000;
// Emission may be brighter than white.
/** @type {(target: string) => string} */
export const formOf = (target) => (target.endsWith('.emission') ? 'light' : 'plain');
// Without the user's wish, pictures are not larger than this.
export const MOST_SIZE = 2048;
const USUAL = 512;

/** @typedef {{ target: string, size: number, id: string, generation: number, json: any, data: Float32Array | null, pixels: Uint8ClampedArray<ArrayBuffer>, halves?: Uint16Array<ArrayBuffer>, range: [number, number], scale: number }} Made */
/** @typedef {{ preset: string | null, set: [string, string][], edits?: FieldEdit[] }} Chosen */
/** @typedef {import('./tasks.js').Task} Task */

export class Work extends Tasks {
  /** @param {import('./pool.js').Pool} pool */
  constructor(pool) {
    super();
    this.pool = pool;
    // Called after each change.
    this.onchange = () => {};
    this.news = new News();
    this.text = '';
    // `shibo:NAME` as long as paths in the text mean shipped files, or the name of a file.
    this.name = 'graph.ron';
    /** @type {Record<string, string>} files of the graph, in base64 */
    this.files = {};
    /** @type {Chosen} */
    this.values = { preset: null, set: [] };
    this.size = USUAL;
    // Counts texts and files.
    this.edit = 0;
    this.generation = 0;
    /** @type {any} the answer of `open` for the last sound text, with that text */
    this.opened = null;
    /** @type {any[]} */
    this.errors = [];
    /** @type {Map<string, Made>} the sharpest picture of each target */
    this.pictures = new Map();
    /** @type {Map<string, import('./kept.js').Pixels>} pictures for the history of looks by their ids, the oldest first */
    this.kept = new Map();
    // Memory of all pictures, in bytes.
    this.most = MOST_BYTES;
    /** @type {Map<string, string>} targets without pixels, with their types */
    this.objects = new Map();
    /** @type {Map<string, Sketch | null>} their drawings in this generation */
    this.drawings = new Map();
    /** @type {Set<string>} nodes that cannot be shown in this generation */
    this.failing = new Set();
    /** @type {string[]} channels of the selected node, if it makes a material */
    this.channels = [];
    this.stats = new Stats();
    this.focus = '';
    // In the 3D view all channels of the material are made.
    this.inLight = () => false;
    /** @type {{ generation: number | null, opened: any, began: number, loading: boolean, request: import('./pool.js').Request | null, soon?: number } | null} */
    this.step = null;
    this.paused = false;
    /** @type {Record<number, number>} the time of the last step of a size, in ms */
    this.costs = {};
    /** @type {(() => void)[]} */
    this.rested = [];
    this.opening = false;
    /** @type {Chosen | null} values that wait for a step */
    this.wanted = null;
    /** @type {number | undefined} */
    this.taking = undefined;
    this.tries = new Tries(this);
    this.isBusy = false;
    // Called when a step takes very long, and when it is over.
    this.onlong = (/** @type {boolean} */ _long) => {};
    // Called when all pictures of the page are made.
    this.onrest = () => {};
  }

  // Takes the wanted values. A step that makes the first picture of the values before may end first: while a slider is dragged,
  // pictures follow it.
  take() {
    const { wanted, step } = this;
    if (!wanted) return;
    clearTimeout(this.taking);
    const left = step && step.generation === this.generation && !this.best(this.focus) ? PATIENCE - (performance.now() - step.began) : 0;
    if (left > 0) { this.taking = setTimeout(() => this.take(), left); return; }
    const tried = this.tries.of(wanted);
    // They are being tried.
    if (!tried) return;
    if (tried.wanted === wanted) this.wanted = null;
    this.adopt(tried.values);
    for (const one of tried.refused) this.news.tell('refused', one);
  }

  /** @param {Chosen} values */
  adopt(values) {
    this.tries.era += 1;
    this.values = this.fitting(values);
    this.paused = false;
    this.onchange();
    if (this.opened) this.begin();
  }

  // Drops values that wait: others have replaced them.
  forget() {
    clearTimeout(this.taking);
    this.wanted = null;
    this.tries.era += 1;
  }

  // Values that the opened graph has.
  /** @param {Chosen} values @returns {Chosen} */
  fitting({ preset, set, edits }) {
    const { opened } = this;
    const ofNodes = edits?.length ? { edits } : {};
    if (!opened) return { preset, set, ...ofNodes };
    const names = new Set(opened.params.map((/** @type {any} */ p) => p.name));
    return { preset: preset && opened.presets[preset] ? preset : null, set: set.filter(([name]) => names.has(name)), ...ofNodes };
  }

  // Begins a new generation: other values, another text or another size.
  begin() {
    this.generation += 1;
    // The selected picture stays until there is a new one.
    for (const target of this.pictures.keys()) if (target !== this.focus) this.pictures.delete(target);
    this.drawings.clear();
    this.failing.clear();
    this.drop((task) => task.generation !== undefined && task.generation !== this.generation);
    this.state();
    this.hurry();
    this.work();
  }

  state() { this.news.tell('state', this.news.state(this)); }

  get request() { return { op: 'open', graph: this.name, text: this.text, files: this.files }; }

  // ---- targets

  // The targets to make, the selected one first.
  get targets() {
    if (this.focus.startsWith('@')) return this.inLight() ? [this.focus, ...this.channels] : [this.focus];
    const [output, channel] = this.focus.split('.');
    const of = this.opened?.outputs.find((/** @type {any} */ o) => o.name === output) ?? null;
    if (!of) return [];
    // A text may take a channel away from its material.
    if (channel && !of.channels?.includes(channel)) return [];
    const first = channel || !of.channels ? [this.focus] : [];
    const material = of.channels ? of : this.opened.outputs.find((/** @type {any} */ o) => o.channels);
    if (!material || (first.length && !this.inLight())) return first;
    return [...new Set([...first, ...material.channels.map((/** @type {string} */ c) => `${material.name}.${c}`)])];
  }

  // The sizes to make, coarse to sharp.
  get sizes() {
    const all = [...COARSE.filter((n) => n < this.size), this.size];
    while (all.length > 1 && this.costs[all[1]] < QUICK) all.shift();
    return all;
  }

  /** @param {string} target */
  look(target) {
    if (target !== this.focus) this.channels = [];
    this.focus = target;
    this.work();
  }

  // The sharpest picture of a target in this generation.
  /** @param {string} target */
  best(target) {
    const made = this.pictures.get(target);
    return made?.generation === this.generation ? made : null;
  }

  // A picture of a target: the one that is there, or the next one. Null if the graph changes before. Exact values may have to be made
  // again.
  /** @param {string} target @returns {Promise<Made | null>} */
  async picture(target, isExact = false) {
    const found = this.best(target);
    if (found && (found.data || !isExact)) return found;
    if (!this.opened) return null;
    return this.render(target, found?.size ?? this.sizes[0]).catch(() => null);
  }

  // ---- work

  // The picture of a target at a size, as a task.
  /** @param {string} target @param {number} size @returns {Promise<Made>} */
  async render(target, size) {
    const { generation } = this;
    /** @type {Made | null} */
    let made = null;
    await this.task((hand) => this.ask(hand, target, size, (found) => { made = found; }));
    if (!made || generation !== this.generation) throw cancelled('the graph has changed');
    this.store(made);
    return made;
  }

  /** @param {import('./pool.js').Hand} hand @param {string} target @param {number} size @param {(made: Made) => void} give */
  ask(hand, target, size, give) {
    const { generation } = this;
    const request = hand.ask({ op: 'look', graph: hand.has?.graph, target, size, ...this.chosen }, ({ json, data, pixels, ...rest }) => {
      if (generation !== this.generation) return;
      if (json.event === 'object') this.draws(target, json);
      else if (json.event === 'picture' && data && pixels) give(/** @type {Made} */ ({ target, size, id: `${json.key} ${size}`, generation, json, data, pixels, ...rest }));
    }, formOf(target));
    request.done.then((ok) => { if (generation === this.generation) this.stats.add(generation, size, ok.nodes); }, () => {});
    return request;
  }

  // The values in the form of a request.
  get chosen() {
    const { preset, set, edits } = this.values;
    return { preset: preset ?? undefined, set: Object.fromEntries(set), edits };
  }

  // A target has no pixels.
  /** @param {string} target @param {{ type?: string, drawing?: Sketch | null }} object */
  draws(target, { type, drawing }) {
    this.objects.set(target, type ?? 'object');
    this.drawings.set(target, drawing ?? null);
  }

  // The next picture to make.
  next() {
    for (const size of this.sizes) {
      for (const target of this.targets) {
        if (this.objects.has(target) || this.failing.has(target)) continue;
        const best = this.best(target);
        const isBare = size === this.size && target === this.focus && !best?.data;
        if (!best || best.size < size || isBare) return { target, size };
      }
    }
    return null;
  }

  // Does one step after the other until nothing is left.
  async work() {
    if (this.step) return;
    if (this.wanted) {
      this.take();
      // While values are tried, pictures of those before are made.
      if (this.step || !this.tries.isRunning) return;
    }
    const tasks = this.tasks.filter((one) => !one.dead);
    const urgent = tasks.find((one) => !one.isLater);
    const next = urgent || this.paused || !this.opened ? null : this.next();
    const task = urgent ?? (next ? undefined : tasks[0]);
    // The page does not wait for later ones.
    if (!urgent && !next) {
      if (!this.wanted) this.rest();
      if (!task) return;
    }
    this.now = task;
    /** @type {NonNullable<Work['step']>} */
    const step = { generation: task ? task.generation ?? null : this.generation, opened: this.opened, began: performance.now(), loading: true, request: null };
    this.step = step;
    if (!task?.isLater) this.busy(true);
    const hand = this.pool.renderer;
    /** @type {number | undefined} */
    let long;
    try {
      await hand.ready;
      step.loading = false;
      await hand.prepared;
      step.began = performance.now();
      long = setTimeout(() => { if (this.step === step) this.onlong(true); }, LONG);
      if (step.opened && this.isCurrent(step)) await this.reopen(hand, step);
      // A change during the waits: the step is chosen again below.
      if (this.isCurrent(step)) await (task ? this.runTask(task, hand, step) : this.runPicture(/** @type {{ target: string, size: number }} */ (next), hand, step));
    } catch (error) {
      if (this.isCurrent(step)) this.failed(/** @type {import('./pool.js').Failure} */ (error), task);
    }
    clearTimeout(long);
    clearTimeout(step.soon);
    if (this.step === step) {
      this.step = null;
      this.onlong(false);
      this.work();
    }
  }

  rest() {
    this.busy(false);
    if (this.opened) this.onrest();
    if (!this.opening) for (const done of this.rested.splice(0)) done();
  }

  // True if a step still runs for the text and the values with which it began. A task fits any values.
  /** @param {NonNullable<Work['step']>} step */
  isCurrent(step) {
    return this.step === step && step.opened === this.opened && (step.generation === null || step.generation === this.generation);
  }

  // Opens the first text in the renderer, too, before it is known to be sound: both workers begin at once.
  prepare() {
    const { files, name, request } = this;
    const hand = this.pool.renderer;
    hand.prepared = hand.ask(request).done.then((answer) => { hand.has = { graph: answer.graph, sha256: answer.sha256, files, name }; }, () => {});
  }

  // Opens the text of a step in the renderer, unless it has this one.
  /** @param {import('./pool.js').Hand} hand @param {{ opened: any, request?: import('./pool.js').Request | null }} step */
  async reopen(hand, step) {
    const { opened } = step;
    const { has } = hand;
    if (has && has.sha256 === opened.sha256 && has.files === opened.files && has.name === opened.name) return;
    const { name, files, text, sha256 } = opened;
    step.request = hand.ask({ op: 'open', graph: name, text, files });
    const { graph } = await step.request.done;
    hand.has = { graph, sha256, files, name };
    if (has) hand.ask({ op: 'close', graph: has.graph }).done.catch(() => {});
  }

  /** @param {Task} task @param {import('./pool.js').Hand} hand @param {NonNullable<Work['step']>} step */
  async runTask(task, hand, step) {
    step.request = task.run(hand);
    let [ok, failure] = /** @type {[any, any]} */ ([null, null]);
    try { ok = await /** @type {import('./pool.js').Request} */ (step.request).done; } catch (error) { failure = error; }
    // The renderer was replaced: the task runs again.
    if (this.step !== step && !task.dead) return;
    this.tasks = this.tasks.filter((one) => one !== task);
    if (failure) task.reject(failure); else task.resolve(ok);
  }

  /** @param {{ target: string, size: number }} next @param {import('./pool.js').Hand} hand @param {NonNullable<Work['step']>} step */
  async runPicture({ target, size }, hand, step) {
    /** @type {Made | null} */
    let made = null;
    step.request = this.ask(hand, target, size, (found) => { made = found; });
    try {
      await step.request.done;
    } catch (error) {
      if (!target.startsWith('@') || !this.isCurrent(step)) throw error;
      this.fails(target, /** @type {import('./pool.js').Failure} */ (error));
      return;
    }
    this.costs[size] = performance.now() - step.began;
    if (!this.isCurrent(step)) return;
    if (made) this.store(made);
    else if (this.objects.has(target)) this.news.tell('look', { target: this.focus });
    else this.failing.add(target);
  }

  // A selected node cannot be shown; the outputs go on. The page leaves a node that is gone by itself.
  /** @param {string} target @param {import('./pool.js').Failure} failure */
  fails(target, failure) {
    if (failure.code === 'cancelled') return;
    if (failure.code === 'no-graph' || failure.code === 'defect') throw failure;
    this.failing.add(target);
    if (failure.code !== 'no-output') this.complain(failure, this.opened.text);
  }

  /** @param {Made} made */
  store(made) {
    const best = this.best(made.target);
    if (best && (best.size > made.size || (best.size === made.size && best.data))) return;
    this.pictures.set(made.target, made);
    this.kept.delete(made.id);
    this.kept.set(made.id, { width: made.json.width, height: made.json.height, pixels: made.pixels });
    trim(this.pictures, this.kept, this.focus, this.most);
    // In light the coarse maps count, too: textures follow a slider.
    const isShown = made.size >= this.size || this.inLight();
    const shown = { ...this.news.shown(this, made), final: isShown, generation: made.generation };
    this.news.known[made.target] = shown;
    this.news.tell('shown', shown);
  }

  // A change while a step runs: its picture is not wanted any more.
  hurry() {
    const { step } = this;
    // Loading the module is no work for the older change.
    if (!step || step.loading || step.generation === null || step.generation === this.generation) return;
    step.request?.stop();
    if (step.soon) return;
    const left = Math.max(0, PATIENCE - (performance.now() - step.began));
    step.soon = setTimeout(() => { if (this.step === step) this.abandon(); }, left);
  }

  // Ends the running step at once; the spare worker goes on.
  abandon() {
    if (!this.step) return;
    clearTimeout(this.step.soon);
    this.step = null;
    this.onlong(false);
    this.pool.replace();
    this.work();
  }

  // The user does not want to wait.
  pause() {
    this.paused = true;
    this.drop(() => true, 'stopped');
    if (this.step) this.abandon();
  }

  // A failure of a step. A task that could not begin fails with it.
  /** @param {import('./pool.js').Failure} failure @param {Task} [task] */
  failed(failure, task) {
    if (failure.code === 'cancelled') return;
    if (failure.code === 'no-graph') { this.pool.renderer.has = null; return; }
    this.tasks = this.tasks.filter((one) => one !== task);
    task?.reject(failure);
    this.paused = true;
    this.complain(failure, this.opened?.text ?? this.text);
  }

  // Shows the errors of a failure that belongs to a text.
  /** @param {{ code?: string, message: string, errors?: any[] }} failure @param {string} text */
  complain({ code = 'defect', message, errors }, text) {
    this.errors = errors?.length ? errors : [{ code, message, line: 1, column: 1, end_line: 1, end_column: 1 }];
    const told = this.errors.map((e) => described(e, text));
    if (this.opened) this.news.tell('errors', { errors: told }); else this.news.tell('state', { ...this.news.empty(this), errors: told });
  }

  /** @param {boolean} busy */
  busy(busy) {
    if (busy === this.isBusy) return;
    this.isBusy = busy;
    this.news.tell('busy', { busy });
  }

  // Resolves once nothing is left to do.
  sharp() {
    return new Promise((/** @type {(value?: unknown) => void} */ done) => { this.rested.push(done); this.work(); });
  }
}
