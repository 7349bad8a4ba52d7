// @ts-check
// The picture view: pan, zoom to the texel, repeat, planes, comparison, values. Positions are in pixels of the full
// size.
import { bitmap } from './net.js';
import { Comparison } from './compare.js';
import { $ } from './dom.js';
import { drawObject } from './objects.js';
import { isNeutral, neutral, toned } from './tone.js';

const TILE = 512;
const KEPT = 160;
// Tiles fetched at once.
const AT_ONCE = 4;
// Pictures that follow each other within this many ms are drawn with fast smoothing, and finely when none follows.
const HURRY = 250;

/** @typedef {{ g: number, t: string }} TileSource */

/** @param {Picture} picture */
const withObject = (picture) => /** @type {Picture & { object: Sketch }} */ (picture);

export class Picture {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{
   *   onview: (scale: number | null) => void,
   *   oncursor: (pixel: Vec2 | null) => void,
   *   online: (ends: Line | null) => void,
   * }} on
   */
  constructor(canvas, { onview, oncursor, online }) {
    this.canvas = canvas;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    this.onview = onview;
    /** @type {Vec2} */
    this.size = [1, 1];
    // The shown picture, and the one it is compared with.
    /** @type {Source | null} */
    this.now = null;
    this.comparison = new Comparison();
    this.tone = neutral();
    this.seam = false;
    /** @type {Line | null} */
    this.line = null;
    /** @type {Path2D | null} */
    this.wire = null;
    this.online = online;
    this.plane = 'all';
    this.repeat = false;
    this.fitted = true;
    this.scale = 1;
    this.center = [0.5, 0.5];
    /** @type {WeakMap<object, { plane: string, canvas: OffscreenCanvas }>} */
    this.planes = new WeakMap();
    /** @type {Map<string, ImageBitmap>} */
    this.tiles = new Map();
    // Tiles that are on their way.
    /** @type {Set<string>} */
    this.wanted = new Set();
    // Tiles that the server does not have.
    /** @type {Set<string>} */
    this.none = new Set();
    // Tiles of the view to be fetched next, with their distance from its middle.
    /** @type {{ key: string, args: Record<string, string | number>, far: number }[]} */
    this.missing = [];
    /** @type {Sketch | null} */
    this.object = null;
    /** @type {TileSource | null} */
    this.source = null;
    this.queued = false;
    this.hurried = false;
    /** @type {number | undefined} */
    this.rest = undefined;
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.listen(oncursor);
  }

  /** @param {(pixel: Vec2 | null) => void} oncursor */
  listen(oncursor) {
    const { canvas } = this;
    /** @type {Vec2 | null} */
    let from = null;
    canvas.addEventListener('pointerdown', (e) => {
      from = [e.clientX, e.clientY];
      canvas.setPointerCapture(e.pointerId);
      if (e.shiftKey) this.line = [this.place(...from), this.place(...from)];
    });
    const end = () => { if (from && this.line?.open) this.online(this.line); from = null; };
    canvas.addEventListener('pointerup', end);
    canvas.addEventListener('pointercancel', end);
    canvas.addEventListener('pointerleave', () => oncursor(null));
    canvas.addEventListener('pointermove', (e) => {
      if (from && e.shiftKey && this.line) {
        this.line[1] = this.place(e.clientX, e.clientY);
        this.line.open = true;
        this.draw();
      } else if (from) {
        const k = this.ratio / this.scale;
        this.center[0] -= (e.clientX - from[0]) * k;
        this.center[1] -= (e.clientY - from[1]) * k;
        from = [e.clientX, e.clientY];
        this.fitted = false;
        this.draw();
      }
      oncursor(this.pixel(e.clientX, e.clientY));
    });
    canvas.addEventListener('wheel', (e) => {
      e.preventDefault();
      this.zoom(Math.exp(-e.deltaY * (e.ctrlKey ? 0.01 : 0.0018)), e.clientX, e.clientY);
    }, { passive: false });
    canvas.addEventListener('dblclick', () => this.fit());
    canvas.addEventListener('keydown', (e) => {
      const by = /** @type {Record<string, Vec2>} */ ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] })[e.key];
      if (!by || e.ctrlKey || e.altKey || e.metaKey) return;
      e.preventDefault();
      this.center = this.center.map((c, i) => c + (by[i] * 0.1 * canvas.width) / this.scale);
      this.fitted = false;
      this.draw();
    });
  }

  get ratio() { return devicePixelRatio || 1; }

  // Position under a point of the window, in pixels of the full size.
  /** @param {number} x @param {number} y @returns {Vec2} */
  place(x, y) {
    const box = this.canvas.getBoundingClientRect();
    let dx = (x - box.left) * this.ratio - this.canvas.width / 2;
    // Side by side, each half has its own middle.
    if (this.comparison.before && this.comparison.mode === 'side') dx += (dx < 0 ? 0.25 : -0.25) * this.canvas.width;
    const dy = (y - box.top) * this.ratio - this.canvas.height / 2;
    return [this.center[0] + dx / this.scale, this.center[1] + dy / this.scale];
  }

  /** @param {number} x @param {number} y @returns {Vec2 | null} */
  pixel(x, y) {
    const [w, h] = this.size;
    const [px, py] = this.place(x, y).map(Math.floor);
    const n = this.repeat ? 2 : 1;
    if (px < 0 || py < 0 || px >= w * n || py >= h * n) return null;
    return [px % w, py % h];
  }

  resize() {
    const { canvas } = this;
    const [w, h] = [Math.round(canvas.clientWidth * this.ratio), Math.round(canvas.clientHeight * this.ratio)];
    if (w && h && (w !== canvas.width || h !== canvas.height)) {
      [canvas.width, canvas.height] = [w, h];
      if (this.fitted) this.fit(); else this.draw();
    }
  }

  fit() {
    const n = this.repeat ? 2 : 1;
    const [w, h] = [this.size[0] * n, this.size[1] * n];
    const { height } = this.canvas;
    // Side by side, each picture has half of the width.
    const width = this.canvas.width / (this.comparison.before && this.comparison.mode === 'side' ? 2 : 1);
    /** @param {number} high */
    const within = (high) => Math.min(width / w, high / h) * (this.repeat ? 1 : 0.96);
    // The tools over the bottom must not cover the picture. In narrow windows they stand below it.
    const tools = $('picture-tools');
    const floats = getComputedStyle(tools).position === 'absolute';
    const room = (tools.offsetHeight + 20) * this.ratio;
    const covered = floats && tools.offsetHeight && (height + h * within(height)) / 2 > height - room && height > 3 * room;
    this.scale = within(covered ? height - room : height);
    this.center = [w / 2, h / 2 + (covered ? room / 2 / this.scale : 0)];
    this.fitted = true;
    this.draw();
  }

  /** @param {number} factor @param {number} [x] @param {number} [y] */
  zoom(factor, x, y) {
    const box = this.canvas.getBoundingClientRect();
    /** @type {Vec2} */
    const at = [x ?? box.left + box.width / 2, y ?? box.top + box.height / 2];
    const before = this.place(...at);
    const least = Math.min(this.canvas.width / this.size[0], this.canvas.height / this.size[1]) / 8;
    this.scale = Math.min(Math.max(this.scale * factor, least), 96);
    const after = this.place(...at);
    this.center[0] += before[0] - after[0];
    this.center[1] += before[1] - after[1];
    this.fitted = false;
    this.draw();
  }

  /** @param {number} scale */
  zoomTo(scale) { this.zoom(scale / this.scale); }

  get bitmap() { return this.now?.image ?? null; }

  // Shows a whole picture of full size `size`, with its image, range and type; `source` provides its tiles.
  /** @param {Source} now @param {Vec2} size @param {TileSource | null} source */
  show(now, size, source) {
    const began = performance.now();
    // Without a graphics card, fine smoothing takes most of the time.
    this.hurried = began - (this.shownAt ?? -Infinity) < HURRY;
    this.shownAt = began;
    clearTimeout(this.rest);
    if (this.hurried) this.rest = setTimeout(() => { this.hurried = false; this.draw(); }, HURRY);
    this.now = now;
    this.object = null;
    this.source = source;
    this.none.clear();
    this.resized(size);
  }

  // Shows points or lines in mm.
  /** @param {Sketch} object @param {Vec2} size */
  showObject(object, size) {
    this.object = object;
    this.now = null;
    this.source = null;
    this.resized(size);
  }

  /** @param {Vec2} size */
  resized(size) {
    const other = size[0] !== this.size[0] || size[1] !== this.size[1];
    this.size = size;
    if (other || this.fitted) this.fit(); else this.draw();
  }

  // Two height pictures share one range, so that equal depths look equal.
  /** @returns {Vec2 | null} */
  get sharedRange() {
    const other = this.comparison.before;
    if (this.tone.range || !other || !this.now || other.type !== this.now.type || other.type === 'Rgb') return this.tone.range;
    const [a, b] = [this.comparison.after ?? this.now, other].map((s) => s.range);
    return a && b ? [Math.min(a[0], b[0]), Math.max(a[1], b[1])] : null;
  }

  draw() {
    if (this.queued) return;
    this.queued = true;
    requestAnimationFrame(() => { this.queued = false; this.paint(); });
  }

  paint() {
    const { canvas, context: c } = this;
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.clearRect(0, 0, canvas.width, canvas.height);
    this.missing = [];
    const { comparison } = this;
    const after = comparison.after ?? this.now;
    const source = comparison.after ? null : this.source;
    const { before } = comparison;
    if (before && (after || this.object)) {
      comparison.paint(this, (area, side) => (side ? (after ? this.layer(after, area, source) : drawObject(withObject(this))) : this.layer(before, area, null)));
    } else if (this.object) {
      drawObject(withObject(this));
    } else if (after) {
      this.layer(after, [0, canvas.width], source);
    }
    if (this.wire && this.now) this.outline(this.wire);
    if (this.line) this.mark(this.line);
    this.missing.sort((a, b) => a.far - b.far);
    this.fetch();
    this.onview(this.bitmap || this.object ? this.scale : null);
  }

  // Triangles of a mesh, as its atlas lays them out.
  /** @param {Path2D} wire */
  outline(wire) {
    const { canvas, context: c, scale } = this;
    const [w, h] = this.size.map((n) => n * scale);
    const path = new Path2D();
    path.addPath(wire, new DOMMatrix([w, 0, 0, h, canvas.width / 2 - this.center[0] * scale, canvas.height / 2 - this.center[1] * scale]));
    for (const [style, width] of /** @type {[string, number][]} */ ([['rgba(0, 0, 0, 0.55)', 2.2], ['#ffd21a', 0.9]])) {
      c.strokeStyle = style;
      c.lineWidth = width * this.ratio;
      c.stroke(path);
    }
  }

  // The line of a profile.
  /** @param {Line} line */
  mark(line) {
    const { canvas, context: c, scale } = this;
    /** @type {(place: Vec2) => Vec2} */
    const at = ([x, y]) => [(x - this.center[0]) * scale + canvas.width / 2, (y - this.center[1]) * scale + canvas.height / 2];
    for (const [style, width] of /** @type {[string, number][]} */ ([['#000', 4], ['#fff', 1.5]])) {
      c.strokeStyle = style;
      c.lineWidth = width * this.ratio;
      c.beginPath();
      c.moveTo(...at(line[0]));
      c.lineTo(...at(line[1]));
      c.stroke();
    }
  }

  // Draws a picture into an area of the canvas, shifted sideways by `shift`.
  /** @param {Source} from @param {[number, number, number?]} area @param {TileSource | null} tiles */
  layer(from, [left, right, shift = 0], tiles) {
    const range = this.sharedRange;
    const own = range && from.range && range[0] === from.range[0] && range[1] === from.range[1];
    const tone = { ...this.tone, range: own ? null : range };
    const image = isNeutral(tone) ? from.image : toned(from, tone);
    const source = isNeutral(tone) && !this.seam ? tiles : null;
    const { canvas, context: c, scale } = this;
    const [w, h] = this.size;
    c.save();
    c.beginPath();
    c.rect(left, 0, right - left, canvas.height);
    c.clip();
    const shown = this.inPlane(image);
    const n = this.repeat ? 2 : 1;
    const texel = scale * w / image.width;
    /** @type {(x: number, y: number) => Vec2} */
    const place = (x, y) => [Math.round((x - this.center[0]) * scale + canvas.width / 2 + shift), Math.round((y - this.center[1]) * scale + canvas.height / 2)];
    if (this.seam) {
      const [[x0, y0], [x1, y1]] = [place(0, 0), place(n * w, n * h)];
      c.beginPath();
      c.rect(x0, y0, x1 - x0, y1 - y0);
      c.clip();
    }
    // With the seams in the middle, each side shows half a repeat more.
    const from2 = this.seam ? -0.5 : 0;
    for (let j = from2; j < n; j += 1) {
      for (let i = from2; i < n; i += 1) {
        const [[x0, y0], [x1, y1]] = [place(i * w, j * h), place((i + 1) * w, (j + 1) * h)];
        if (x1 < left || y1 < 0 || x0 > right || y0 > canvas.height) continue;
        c.imageSmoothingEnabled = texel < 2 || image.width < w;
        c.imageSmoothingQuality = this.hurried ? (texel < 0.7 ? 'medium' : 'low') : 'high';
        c.drawImage(shown, x0, y0, x1 - x0, y1 - y0);
        if (source && texel > 1.01 && image.width < w) this.paintTiles(source, x0, y0);
      }
    }
    if (scale >= 24 && image.width === w) this.grid();
    c.restore();
  }

  // Draws tiles of the level that suits the zoom over the coarser whole picture.
  /** @param {TileSource} source @param {number} x0 @param {number} y0 */
  paintTiles(source, x0, y0) {
    const { canvas, context: c, scale } = this;
    const [w, h] = this.size;
    const level = Math.max(0, Math.min(6, Math.floor(-Math.log2(scale) + 0.001)));
    const step = TILE * 2 ** level;
    const [first, last] = [[-x0, -y0], [canvas.width - x0, canvas.height - y0]].map((p) => p.map((v) => Math.floor(v / scale / step)));
    for (let y = Math.max(0, first[1]); y <= last[1] && y * step < h; y += 1) {
      for (let x = Math.max(0, first[0]); x <= last[0] && x * step < w; x += 1) {
        const [a, b] = [Math.round(x0 + x * step * scale), Math.round(y0 + y * step * scale)];
        const half = (step * scale) / 2;
        const tile = this.tile(source, level, x, y, Math.hypot(a + half - canvas.width / 2, b + half - canvas.height / 2));
        if (!tile) continue;
        const right = Math.round(x0 + Math.min((x + 1) * step, w) * scale);
        const bottom = Math.round(y0 + Math.min((y + 1) * step, h) * scale);
        c.imageSmoothingEnabled = scale * 2 ** level < 2;
        c.drawImage(this.inPlane(tile), a, b, right - a, bottom - b);
      }
    }
  }

  // A tile, if it is there; otherwise it is fetched, `far` tells in which order.
  /** @param {TileSource} source @param {number} level @param {number} x @param {number} y @param {number} far */
  tile(source, level, x, y, far) {
    const key = `${source.g}|${source.t}|${level}|${x}|${y}`;
    const known = this.tiles.get(key);
    if (known) {
      this.tiles.delete(key);
      this.tiles.set(key, known);
      return known;
    }
    if (!this.wanted.has(key) && !this.none.has(key)) this.missing.push({ key, args: { ...source, l: level, x, y }, far });
    return null;
  }

  // Fetches the tiles of the view from its middle outwards, a few at a time: after a move, those of the new view come next.
  fetch() {
    while (this.missing.length && this.wanted.size < AT_ONCE) {
      const { key, args } = /** @type {(typeof this.missing)[0]} */ (this.missing.shift());
      this.wanted.add(key);
      bitmap('tile', args).then((image) => {
        if (!image) { this.none.add(key); return; }
        this.tiles.set(key, image);
        for (const old of this.tiles.keys()) {
          if (this.tiles.size <= KEPT) break;
          this.tiles.get(old)?.close();
          this.tiles.delete(old);
        }
        this.draw();
      }).catch(() => this.none.add(key)).finally(() => { this.wanted.delete(key); this.fetch(); });
    }
  }

  /** @param {ImageBitmap | OffscreenCanvas} image */
  inPlane(image) {
    if (this.plane === 'all') return image;
    const known = this.planes.get(image);
    if (known?.plane === this.plane) return known.canvas;
    const made = new OffscreenCanvas(image.width, image.height);
    const c = /** @type {OffscreenCanvasRenderingContext2D} */ (made.getContext('2d', { willReadFrequently: true }));
    c.drawImage(image, 0, 0);
    const pixels = c.getImageData(0, 0, image.width, image.height);
    const words = pixels.data;
    const from = /** @type {Record<string, number>} */ ({ r: 0, g: 1, b: 2 })[this.plane];
    for (let i = 0; i < words.length; i += 4) words[i] = words[i + 1] = words[i + 2] = words[i + from];
    c.putImageData(pixels, 0, 0);
    this.planes.set(image, { plane: this.plane, canvas: made });
    return made;
  }

  grid() {
    const { canvas, context: c, scale } = this;
    c.strokeStyle = 'rgba(128, 128, 128, 0.35)';
    c.lineWidth = 1;
    c.beginPath();
    /** @param {number} i @param {number} length */
    const start = (i, length) => ((i - this.center[length]) * scale) + (length ? canvas.height : canvas.width) / 2;
    const [left, top] = [Math.floor(this.center[0] - canvas.width / 2 / scale), Math.floor(this.center[1] - canvas.height / 2 / scale)];
    for (let x = left; start(x, 0) < canvas.width; x += 1) { const at = Math.round(start(x, 0)) + 0.5; c.moveTo(at, 0); c.lineTo(at, canvas.height); }
    for (let y = top; start(y, 1) < canvas.height; y += 1) { const at = Math.round(start(y, 1)) + 0.5; c.moveTo(0, at); c.lineTo(canvas.width, at); }
    c.stroke();
  }
}
