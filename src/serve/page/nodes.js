// The graph: boxes with thumbnails, time and where their result came from. Thousands of nodes are drawn as they come into view.
import { ask, bitmap } from './net.js';

const [W, H, DX, DY] = [150, 96, 200, 112];
const KEPT = 600;

export class Graph {
  constructor(canvas, onselect) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
    this.onselect = onselect;
    this.nodes = [];
    this.wires = [];
    this.stats = [];
    this.thumbs = new Map();
    this.asked = new Set();
    this.queue = [];
    this.scale = 1;
    this.center = [0, 0];
    this.selected = null;
    this.hover = -1;
    this.fitted = true;
    // While pictures are made, thumbnails wait.
    this.patient = false;
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.listen();
  }

  get ratio() { return devicePixelRatio || 1; }
  get open() { return this.canvas.clientWidth > 0; }

  listen() {
    const { canvas } = this;
    let from = null;
    let moved = 0;
    canvas.addEventListener('pointerdown', (e) => { from = [e.clientX, e.clientY]; moved = 0; canvas.setPointerCapture(e.pointerId); });
    canvas.addEventListener('pointermove', (e) => {
      if (from) {
        moved += Math.abs(e.clientX - from[0]) + Math.abs(e.clientY - from[1]);
        this.center[0] -= (e.clientX - from[0]) / this.scale;
        this.center[1] -= (e.clientY - from[1]) / this.scale;
        from = [e.clientX, e.clientY];
        this.fitted = false;
        this.draw();
      } else {
        const hover = this.hit(e);
        if (hover !== this.hover) { this.hover = hover; canvas.title = hover < 0 ? '' : this.about(hover); this.draw(); }
      }
    });
    canvas.addEventListener('pointerup', (e) => {
      if (from && moved < 4) { const i = this.hit(e); if (i >= 0) this.onselect(this.nodes[i].name); }
      from = null;
    });
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

  about(i) {
    const s = this.stats[i];
    return `${this.nodes[i].name}: ${this.nodes[i].kind}, line ${this.nodes[i].line}${s ? `\n${s.state}, ${(s.seconds * 1000).toFixed(1)} ms` : ''}`;
  }

  place(e) {
    const box = this.canvas.getBoundingClientRect();
    return [this.center[0] + (e.clientX - box.left - box.width / 2) / this.scale, this.center[1] + (e.clientY - box.top - box.height / 2) / this.scale];
  }

  hit(e) {
    const [x, y] = this.place(e);
    return this.nodes.findIndex((n) => x >= n.x && x <= n.x + W && y >= n.y && y <= n.y + H);
  }

  async load(generation) {
    this.generation = generation;
    this.asked.clear();
    this.queue.length = 0;
    const graph = await ask('graph', { g: generation });
    if (!graph || this.generation !== generation) return;
    const first = !this.nodes.length;
    this.nodes = graph.nodes.map((n) => ({ ...n, x: n.column * DX, y: n.row * DY }));
    this.wires = graph.wires;
    this.byName = new Map(this.nodes.map((n, i) => [n.name, i]));
    this.canvas.dataset.nodes = this.nodes.length;
    if (first) this.fit();
    await this.loadStats(generation);
  }

  async loadStats(generation) {
    const stats = await ask('stats', { g: generation });
    if (stats && this.generation === generation) {
      this.stats = stats;
      this.canvas.dataset.computed = stats.filter((s) => s.state === 'computed').length;
      this.draw();
    }
  }

  resize() {
    const { canvas } = this;
    const [w, h] = [Math.round(canvas.clientWidth * this.ratio), Math.round(canvas.clientHeight * this.ratio)];
    if (!w || !h) return;
    [canvas.width, canvas.height] = [w, h];
    if (this.fitted) this.fit(); else this.draw();
  }

  fit() {
    if (!this.nodes.length || !this.open) return;
    const [xs, ys] = [this.nodes.map((n) => n.x), this.nodes.map((n) => n.y)];
    const min = (list) => list.reduce((a, b) => Math.min(a, b));
    const max = (list) => list.reduce((a, b) => Math.max(a, b));
    const [left, right, top, bottom] = [min(xs), max(xs) + W, min(ys), max(ys) + H];
    this.center = [(left + right) / 2, (top + bottom) / 2];
    this.scale = Math.min(this.canvas.clientWidth / (right - left + 60), this.canvas.clientHeight / (bottom - top + 40), innerWidth < 2400 ? 1.2 : 2);
    this.fitted = true;
    // A graph too large to be seen as a whole is shown around its first output.
    if (this.scale < 0.08) {
      const output = this.nodes.find((n) => n.output) ?? this.nodes[0];
      this.scale = 0.35;
      this.center = [output.x + W / 2, output.y + H / 2];
    }
    this.draw();
  }

  // Marks a node, and brings it into view if need be.
  select(name, bring) {
    this.selected = name;
    const node = this.nodes[this.byName?.get(name)];
    if (node && bring) {
      this.scale = Math.max(this.scale, 0.7);
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
    const color = (name) => style.getPropertyValue(name);
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.clearRect(0, 0, canvas.width, canvas.height);
    const k = scale * this.ratio;
    c.setTransform(k, 0, 0, k, canvas.width / 2 - this.center[0] * k, canvas.height / 2 - this.center[1] * k);
    const view = [this.center[0] - canvas.width / 2 / k, this.center[1] - canvas.height / 2 / k, this.center[0] + canvas.width / 2 / k, this.center[1] + canvas.height / 2 / k];
    const near = this.selected === null ? -1 : this.byName?.get(this.selected) ?? -1;
    for (const wire of this.wires) this.wire(wire, view, near, scale);
    c.globalAlpha = 1;
    const colors = Object.fromEntries(['raised', 'line', 'text', 'dim', 'accent', 'stage', 'computed', 'memory', 'disk', 'unused'].map((n) => [n, color(`--${n}`)]));
    this.nodes.forEach((node, i) => {
      if (node.x > view[2] || node.y > view[3] || node.x + W < view[0] || node.y + H < view[1]) return;
      this.box(node, i, colors, scale);
    });
    this.fetch();
  }

  wire(wire, view, near, scale) {
    const c = this.context;
    const [a, b] = [this.nodes[wire.from], this.nodes[wire.to]];
    const points = [[a.x + W, a.y + H / 2], ...wire.bends.map(([x, y]) => [x * DX + W / 2, y * DY + H / 2]), [b.x, b.y + H / 2]];
    const [low, high] = [Math.min(...points.map((p) => p[1])), Math.max(...points.map((p) => p[1]))];
    if (points[0][0] > view[2] || points.at(-1)[0] < view[0] || low > view[3] || high < view[1]) return;
    const touched = wire.from === near || wire.to === near;
    c.globalAlpha = touched ? 1 : near < 0 ? 0.55 : 0.28;
    c.strokeStyle = wire.color ?? '#777';
    c.lineWidth = (touched ? 2.4 : 1.5) * Math.max(1, 0.5 / scale);
    c.beginPath();
    c.moveTo(...points[0]);
    for (let i = 1; i < points.length; i += 1) {
      const [[x0, y0], [x1, y1]] = [points[i - 1], points[i]];
      const mid = (x0 + x1) / 2;
      c.bezierCurveTo(mid, y0, mid, y1, x1, y1);
    }
    c.stroke();
  }

  box(node, i, colors, scale) {
    const c = this.context;
    const stat = this.stats[i];
    c.globalAlpha = stat?.state === 'unused' ? 0.55 : 1;
    c.fillStyle = colors.raised;
    c.strokeStyle = node.name === this.selected ? colors.accent : i === this.hover ? colors.dim : colors.line;
    c.lineWidth = node.name === this.selected ? 2.5 : 1;
    c.beginPath();
    c.roundRect(node.x, node.y, W, H, 9);
    c.fill();
    c.stroke();
    if (scale < 0.05) return;
    // From afar the thumbnail is all there is to see.
    const high = scale < 0.3 ? H - 12 : 52;
    const thumb = this.thumbs.get(node.name);
    c.save();
    c.beginPath();
    c.roundRect(node.x + 6, node.y + 6, W - 12, high, 5);
    c.clip();
    c.fillStyle = colors.stage;
    c.fillRect(node.x + 6, node.y + 6, W - 12, high);
    if (thumb?.image) {
      const share = high / (W - 12);
      c.drawImage(thumb.image, 0, thumb.image.height * (0.5 - share / 2), thumb.image.width, thumb.image.height * share, node.x + 6, node.y + 6, W - 12, high);
    } else if (thumb) this.sketch(node, colors);
    c.restore();
    if (!this.asked.has(i)) { this.asked.add(i); this.queue.push(i); }
    if (scale < 0.3) return;
    c.fillStyle = node.output ? colors.accent : colors.text;
    c.font = '600 12px system-ui, sans-serif';
    c.fillText(node.name, node.x + 9, node.y + 73, W - 18);
    c.fillStyle = colors.dim;
    c.font = '11px system-ui, sans-serif';
    c.fillText(node.kind, node.x + 9, node.y + 88, W - 66);
    if (stat) {
      c.fillStyle = colors[stat.state];
      c.beginPath();
      c.arc(node.x + W - 12, node.y + 84, 3.5, 0, 7);
      c.fill();
      if (stat.state === 'computed') {
        const ms = stat.seconds * 1000;
        c.fillStyle = colors.dim;
        c.textAlign = 'right';
        c.fillText(ms >= 999.5 ? `${(ms / 1000).toFixed(1)} s` : `${ms < 9.95 ? ms.toFixed(1) : ms.toFixed(0)} ms`, node.x + W - 20, node.y + 88);
        c.textAlign = 'left';
      }
    }
  }

  // Objects have no picture: some of their points and lines stand for them.
  sketch(node, colors) {
    const c = this.context;
    const { object } = this.thumbs.get(node.name);
    if (!object) {
      c.fillStyle = colors.dim;
      c.font = '11px system-ui, sans-serif';
      c.textAlign = 'center';
      c.fillText(node.ports[0]?.type ?? '', node.x + W / 2, node.y + 36);
      c.textAlign = 'left';
      return;
    }
    const [width] = object.size_mm;
    const count = Math.max(1, object.count);
    // A part of what covers the canvas; the whole of what does not.
    const part = Math.min(1, Math.sqrt(500 / count));
    const k = object.own ? Math.min((W - 12) / width, 52 / object.size_mm[1]) : (W - 12) / (width * part);
    const left = object.own ? (W - 12 - width * k) / 2 : 0;
    const at = (x, y) => [node.x + 6 + left + x * k, node.y + 6 + y * k];
    c.strokeStyle = c.fillStyle = node.color ?? colors.accent;
    c.lineWidth = 1;
    c.beginPath();
    for (const [x0, y0, x1, y1] of object.lines ?? []) {
      if (Math.min(x0, x1) * k > W || Math.min(y0, y1) * k > 60) continue;
      c.moveTo(...at(x0, y0));
      c.lineTo(...at(x1, y1));
    }
    c.stroke();
    for (const [x, y] of object.points ?? []) if (x * k < W && y * k < 60) c.fillRect(...at(x, y).map((v) => v - 1), 2, 2);
  }

  // Fetches the thumbnails that came into view, a few at a time.
  async fetch() {
    while (this.queue.length && !this.patient && (this.working ?? 0) < 3) {
      const i = this.queue.shift();
      const node = this.nodes[i];
      if (!node) continue;
      this.working = (this.working ?? 0) + 1;
      this.thumbnail(i, node, this.generation).catch(() => {}).finally(() => { this.working -= 1; this.draw(); });
    }
  }

  async thumbnail(i, node, generation) {
    const image = await bitmap('thumb', { g: generation, n: i });
    const object = image ? null : await ask('object', { g: generation, t: `@${node.name}` });
    if (this.generation !== generation) return;
    this.thumbs.get(node.name)?.image?.close();
    this.thumbs.set(node.name, { image, object });
    for (const name of this.thumbs.keys()) {
      if (this.thumbs.size <= KEPT) break;
      this.thumbs.delete(name);
    }
  }
}
