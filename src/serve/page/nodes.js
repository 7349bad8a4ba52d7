// @ts-check
// The graph, level by level: boxes with thumbnails, cost and origin of the result. A sub-graph is a box that opens.
// Boxes are drawn only while in view, so thousands of nodes are possible.
import { $ } from './dom.js';
import { ask, bitmap } from './net.js';
import { paintBox } from './box.js';
import { bounds, Minimap, paintGroups } from './minimap.js';
import { paintPorts, paintWire, typeLegend, Way } from './wires.js';

export const [W, H, DX, DY] = [168, 112, 220, 130];
const KEPT = 600;
// Minimum scale when a level opens: labels of 12 pixels stay 11 pixels high.
const READABLE = 0.92;
// Minimum scale of a fit of the whole level.
const LEAST = 0.01;
/** @type {Record<string, Vec2>} */
const NEXT = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** @typedef {{ image: ImageBitmap | null, object: Sketch | null }} Thumb */
/** @typedef {{ state: Stat['state'], seconds: number } | null} Sum */

export class Graph {
  // `onselect` is called with a selected node, `onjump` with a node to show in the editor, `onlevel` with a new level.
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{
   *   onselect: (name: string, node: Box) => void,
   *   onjump: (name: string) => void,
   *   onlevel: (path: string) => void,
   *   values: () => Values,
   * }} on
   */
  constructor(canvas, { onselect, onjump, onlevel, values }) {
    this.canvas = canvas;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    this.onselect = onselect;
    this.onjump = onjump;
    this.onlevel = onlevel;
    this.level = '';
    /** @type {Box[]} */
    this.nodes = [];
    /** @type {string[]} */
    this.names = [];
    /** @type {GraphWire[]} */
    this.wires = [];
    /** @type {Stat[]} */
    this.stats = [];
    /** @type {Sum[]} */
    this.sums = [];
    /** @type {Map<string, Thumb>} */
    this.thumbs = new Map();
    /** @type {Set<number>} */
    this.asked = new Set();
    /** @type {number[]} */
    this.queue = [];
    /** @type {Map<string, number>} */
    this.byName = new Map();
    this.generation = -1;
    this.dearest = 0;
    this.fresh = false;
    this.queued = false;
    this.working = 0;
    /** @type {string | null} */
    this.marked = null;
    this.scale = 1;
    this.center = [0, 0];
    /** @type {string | null} */
    this.selected = null;
    this.hover = -1;
    this.minimap = new Minimap(this);
    this.values = values;
    /** @type {Promise<import('./peek.js').Peek> | undefined} */
    this.peeking = undefined;
    this.way = new Way(this);
    // Corners of a frame that is being dragged.
    /** @type {[Vec2, Vec2] | null} */
    this.frame = null;
    this.fitted = true;
    // True if the whole level is in view, false for a readable part of it.
    this.whole = false;
    this.heat = false;
    // While pictures are made, thumbnails wait.
    this.patient = false;
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.listen();
  }

  // Larger pictures of nodes; their code is loaded when it is first needed.
  /** @param {(peek: import('./peek.js').Peek) => void} work */
  peek(work) {
    this.peeking ??= import('./peek.js').then(({ Peek }) => new Peek(this, $('peek'), this.values));
    this.peeking.then(work);
  }

  get ratio() { return devicePixelRatio || 1; }
  get open() { return this.canvas.clientWidth > 0; }

  listen() {
    const { canvas } = this;
    /** @type {Vec2 | null} */
    let from = null;
    let moved = 0;
    let onMap = false;
    /** @param {MouseEvent} e */
    const toMap = (e) => { const at = this.minimap.hit(e); if (at) { this.center = at; this.fitted = false; this.draw(); } return !!at; };
    canvas.addEventListener('pointerdown', (e) => {
      canvas.setPointerCapture(e.pointerId);
      this.peek((p) => p.hide());
      onMap = toMap(e);
      if (onMap) return;
      from = [e.clientX, e.clientY];
      moved = 0;
      if (e.shiftKey) this.frame = [this.place(e), this.place(e)];
    });
    canvas.addEventListener('pointerleave', () => this.peek((p) => p.rest(-1)));
    canvas.addEventListener('pointermove', (e) => {
      if (onMap) { toMap(e); return; }
      if (from && this.frame) {
        moved += Math.abs(e.clientX - from[0]) + Math.abs(e.clientY - from[1]);
        this.frame[1] = this.place(e);
        this.draw();
      } else if (from) {
        moved += Math.abs(e.clientX - from[0]) + Math.abs(e.clientY - from[1]);
        this.center[0] -= (e.clientX - from[0]) / this.scale;
        this.center[1] -= (e.clientY - from[1]) / this.scale;
        from = [e.clientX, e.clientY];
        this.fitted = false;
        this.draw();
      } else {
        const hover = this.hit(e);
        if (hover !== this.hover) { this.hover = hover; this.peek((p) => p.rest(hover)); canvas.title = hover < 0 ? '' : this.about(hover); this.draw(); }
      }
    });
    canvas.addEventListener('pointerup', (e) => {
      if (from && moved < 4) { const i = this.hit(e); if (i >= 0) this.show(this.nodes[i]); }
      if (this.frame) this.enclose(this.frame);
      this.frame = null;
      from = null;
      onMap = false;
    });
    canvas.addEventListener('dblclick', (e) => { const i = this.hit(e); if (i >= 0) this.dive(this.nodes[i]); });
    canvas.addEventListener('keydown', (e) => this.key(e));
    canvas.addEventListener('wheel', (e) => {
      e.preventDefault();
      const before = this.place(e);
      this.scale = Math.min(Math.max(this.scale * Math.exp(-e.deltaY * 0.0018), 0.01), 3);
      const after = this.place(e);
      this.fitted = false;
      this.center[0] += before[0] - after[0];
      this.center[1] += before[1] - after[1];
      this.draw();
    }, { passive: false });
  }

  // Click or Enter: shows the picture of a node; for a sub-graph, of its main output.
  /** @param {Box} node */
  show(node) {
    this.marked = node.name;
    if (node.index !== null && node.index !== undefined) {
      const name = this.names[node.index];
      this.onselect(node.use && node.output ? `${name}:${node.ports[0].name}` : name, node);
    }
    this.tell();
  }

  // Double click or O: opens the level of a sub-graph, or shows the line of a node in the editor.
  /** @param {Box} node */
  dive(node) {
    if (node.use) this.enter(node.name);
    else if (node.outside) this.enter(node.name.includes('/') ? node.name.slice(0, node.name.lastIndexOf('/')) : '');
    else this.onjump(node.name);
  }

  /** @param {KeyboardEvent} e */
  key(e) {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    const node = this.nodes[this.at()];
    const by = NEXT[e.key];
    if (by && e.shiftKey) this.mark(this.way.go(e.key, this.at()));
    else if (by) this.go(node, by);
    else if (e.key === ' ' && node) this.peek((p) => p.toggle(this.at()));
    else if (e.key === 'Enter' && node) this.show(node);
    else if (e.key.toLowerCase() === 'o' && node) this.dive(node);
    else if (e.key === 'Backspace' && this.level) this.enter(this.level.includes('/') ? this.level.slice(0, this.level.lastIndexOf('/')) : '');
    else return;
    e.preventDefault();
    e.stopPropagation();
  }

  // Nearest box in a direction.
  /** @param {Box | undefined} from @param {Vec2} way */
  go(from, [dx, dy]) {
    // The first arrow key starts at an output.
    if (!from) { this.mark(this.nodes.find((n) => n.shown) ?? this.nodes.at(-1)); return; }
    /** @param {Box} n */
    const away = (n) => {
      const [x, y] = [(n.x - from.x) / DX, (n.y - from.y) / DY];
      const along = x * dx + y * dy;
      return along < 0.3 ? Infinity : along + 2 * Math.abs(x * dy + y * dx);
    };
    const best = this.nodes.reduce((a, b) => (away(b) < away(a) ? b : a), from);
    this.mark(away(best) === Infinity ? from : best);
  }

  /** @param {Box | undefined} node */
  mark(node) {
    if (!node) return;
    this.marked = node.name;
    this.center = [node.x + W / 2, node.y + H / 2];
    this.scale = Math.max(this.scale, READABLE);
    this.fitted = false;
    this.tell();
    this.draw();
  }

  tell() {
    const i = this.at();
    if (i >= 0) $('graph-at').textContent = this.about(i);
  }

  // The box in this level that contains the marked node.
  at() {
    const known = this.byName.get(this.marked ?? this.selected ?? '');
    if (known !== undefined) return known;
    const index = this.index(this.selected ?? '');
    return index < 0 ? -1 : this.nodes.findIndex((n) => n.members?.includes(index));
  }

  /** @param {string} name @returns {Box | null} */
  box(name) { return this.nodes[this.byName.get(name) ?? -1] ?? null; }
  /** @param {string} name */
  index(name) { return this.names.indexOf(name); }

  // Shows another level.
  /** @param {string} path @returns {Promise<void>} */
  enter(path) {
    this.level = path;
    this.marked = null;
    this.fitted = true;
    this.fresh = true;
    this.onlevel(path);
    return this.load(this.generation);
  }

  /** @param {number} i */
  about(i) {
    const node = this.nodes[i];
    const s = this.sums[i];
    const what = node.use ? `${node.kind}, ${node.members?.length} nodes; double click or O opens it` : node.outside ? 'outside of this level' : `${node.kind}, line ${node.line}`;
    return `${node.name}: ${what}${s ? `\n${s.state}, ${(s.seconds * 1000).toFixed(1)} ms` : ''}${node.broken ? `\n${node.broken}` : ''}`;
  }

  /** @param {MouseEvent} e @returns {Vec2} */
  place(e) {
    const box = this.canvas.getBoundingClientRect();
    return [this.center[0] + (e.clientX - box.left - box.width / 2) / this.scale, this.center[1] + (e.clientY - box.top - box.height / 2) / this.scale];
  }

  /** @param {MouseEvent} e */
  hit(e) {
    const [x, y] = this.place(e);
    return this.nodes.findIndex((n) => x >= n.x && x <= n.x + W && y >= n.y && y <= n.y + H);
  }

  /** @param {number} generation @returns {Promise<void>} */
  async load(generation) {
    this.generation = generation;
    this.asked.clear();
    this.queue.length = 0;
    const { level } = this;
    /** @type {{ nodes: Box[], wires: GraphWire[], names: string[] } | null | undefined} */
    const graph = await ask('graph', { g: generation, u: level });
    if (this.generation !== generation || this.level !== level) return;
    // The sub-graph was deleted from the file.
    if (graph === null && level) { await this.enter(''); return; }
    if (!graph) return;
    const first = !this.nodes.length || this.fresh;
    this.fresh = false;
    this.nodes = graph.nodes.map((n) => ({ ...n, x: n.column * DX, y: n.row * DY }));
    this.wires = graph.wires;
    typeLegend(this.wires);
    if (this.peeking) this.peek((p) => p.hide());
    this.names = graph.names;
    this.byName = new Map(this.nodes.map((n, i) => [n.name, i]));
    this.canvas.dataset.nodes = String(this.nodes.length);
    this.canvas.dataset.level = level;
    if (first) this.fit(false);
    await this.loadStats(generation);
  }

  /** @param {number} generation */
  async loadStats(generation) {
    /** @type {Stat[] | null} */
    const stats = await ask('stats', { g: generation });
    if (!stats || this.generation !== generation) return;
    this.stats = stats;
    // A box has the total cost of its nodes, and the first of these states that one of them has.
    /** @type {Stat['state'][]} */
    const order = ['computed', 'disk', 'memory', 'folded', 'unused'];
    this.sums = this.nodes.map((node) => {
      const inside = (node.members ?? []).map((i) => stats[i]).filter(Boolean);
      if (!inside.length) return null;
      return { state: order.find((s) => inside.some((i) => i.state === s)) ?? 'unused', seconds: inside.reduce((sum, i) => sum + i.seconds, 0) };
    });
    this.dearest = this.sums.reduce((most, s) => Math.max(most, s?.seconds ?? 0), 0);
    this.canvas.dataset.computed = String(stats.filter((s) => s.state === 'computed').length);
    this.canvas.dataset.unused = stats.filter((s) => s.state === 'unused').map((s) => s.name).join(' ');
    this.draw();
  }

  resize() {
    const { canvas } = this;
    const [w, h] = [Math.round(canvas.clientWidth * this.ratio), Math.round(canvas.clientHeight * this.ratio)];
    if (!w || !h) return;
    [canvas.width, canvas.height] = [w, h];
    if (this.fitted) this.fit(this.whole); else this.draw();
  }

  // Brings the whole level into view; without `whole`, as much of it as is readable, with the outputs.
  fit(whole = true) {
    this.whole = whole;
    if (!this.nodes.length || !this.open) return;
    const { left, right, top, bottom } = bounds(this.nodes);
    const [wide, high] = [this.canvas.clientWidth / (right - left + 60), this.canvas.clientHeight / (bottom - top + 40)];
    this.scale = Math.min(Math.max(Math.min(wide, high), whole ? LEAST : READABLE), innerWidth < 2400 ? 1.2 : 2);
    this.center = [(left + right) / 2, (top + bottom) / 2];
    // If the level does not fit at a readable size, its right end with the outputs is shown.
    const output = this.nodes.find((n) => n.shown) ?? this.nodes[this.nodes.length - 1];
    if (wide < this.scale) this.center[0] = right + 30 - this.canvas.clientWidth / 2 / this.scale;
    if (high < this.scale) this.center[1] = output.y + H / 2;
    this.fitted = true;
    this.draw();
  }

  // Brings the boxes within a frame into view.
  /** @param {[Vec2, Vec2]} frame */
  enclose([[x0, y0], [x1, y1]]) {
    const [left, right, top, bottom] = [Math.min(x0, x1), Math.max(x0, x1), Math.min(y0, y1), Math.max(y0, y1)];
    const inside = this.nodes.filter((n) => n.x + W > left && n.x < right && n.y + H > top && n.y < bottom);
    if (inside.length && right - left > 4) {
      const all = bounds(inside);
      this.scale = Math.min(this.canvas.clientWidth / (all.right - all.left + 60), this.canvas.clientHeight / (all.bottom - all.top + 50), 2);
      this.center = [(all.left + all.right) / 2, (all.top + all.bottom) / 2];
      this.fitted = false;
    }
    this.draw();
  }

  // Marks a node; with `bring`, scrolls to it if necessary.
  /** @param {string | null} name @param {boolean} bring */
  async select(name, bring) {
    this.selected = name;
    this.marked = null;
    if (bring && name && this.box(name) === null) {
      const level = name.includes('/') ? name.slice(0, name.lastIndexOf('/')) : '';
      if (level !== this.level) await this.enter(level);
    }
    const node = this.nodes[this.at()];
    if (node && bring) {
      this.scale = Math.max(this.scale, READABLE);
      this.fitted = false;
      this.center = [node.x + W / 2, node.y + H / 2];
    }
    this.draw();
  }

  draw() {
    if (this.queued || !this.open) return;
    this.queued = true;
    requestAnimationFrame(() => { this.queued = false; this.paint(); });
  }

  paint() {
    const { canvas, context: c, scale } = this;
    const style = getComputedStyle(document.documentElement);
    /** @param {string} name */
    const color = (name) => style.getPropertyValue(name);
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.clearRect(0, 0, canvas.width, canvas.height);
    const k = scale * this.ratio;
    c.setTransform(k, 0, 0, k, canvas.width / 2 - this.center[0] * k, canvas.height / 2 - this.center[1] * k);
    const view = [this.center[0] - canvas.width / 2 / k, this.center[1] - canvas.height / 2 / k, this.center[0] + canvas.width / 2 / k, this.center[1] + canvas.height / 2 / k];
    const near = this.at();
    const colors = Object.fromEntries(['bar', 'raised', 'line', 'text', 'dim', 'accent', 'bad', 'stage', 'computed', 'memory', 'disk', 'folded', 'unused'].map((n) => [n, color(`--${n}`)]));
    paintGroups(this, colors);
    for (const wire of this.wires) paintWire(this, wire, view, near);
    c.globalAlpha = 1;
    this.nodes.forEach((node, i) => {
      if (node.x > view[2] || node.y > view[3] || node.x + W < view[0] || node.y + H < view[1]) return;
      paintBox(this, node, i, colors, i === near);
      if (node.index !== null && node.index !== undefined && !this.asked.has(i)) { this.asked.add(i); this.queue.push(i); }
    });
    paintPorts(this, this.hover >= 0 ? this.hover : near, colors);
    if (this.frame) {
      const [[x0, y0], [x1, y1]] = this.frame;
      c.strokeStyle = colors.accent;
      c.lineWidth = 1.5 / scale;
      c.strokeRect(x0, y0, x1 - x0, y1 - y0);
    }
    this.minimap.paint(view, colors);
    this.fetch();
  }

  // Fetches the thumbnails in view, a few at a time.
  async fetch() {
    while (this.queue.length && !this.patient && this.working < 2) {
      const i = /** @type {number} */ (this.queue.shift());
      const node = this.nodes[i];
      if (!node) continue;
      this.working += 1;
      this.thumbnail(node, this.generation).catch(() => {}).finally(() => { this.working -= 1; this.draw(); });
    }
  }

  /** @param {Box} node @param {number} generation */
  async thumbnail(node, generation) {
    const image = await bitmap('thumb', { g: generation, n: Number(node.index), o: node.output ?? 0 });
    const object = image || node.use ? null : await ask('object', { g: generation, t: `@${this.names[Number(node.index)]}` });
    if (this.generation !== generation) return;
    this.thumbs.get(node.name)?.image?.close();
    this.thumbs.set(node.name, { image, object });
    for (const name of this.thumbs.keys()) {
      if (this.thumbs.size <= KEPT) break;
      this.thumbs.delete(name);
    }
  }
}
