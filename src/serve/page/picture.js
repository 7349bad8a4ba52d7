// The picture: move, zoom to the texel, repeat, planes, comparison, values. Places are pixels of the full size.
import { bitmap } from './net.js';

const TILE = 512;
const KEPT = 160;

export class Picture {
  constructor(canvas, { onview, oncursor }) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
    this.onview = onview;
    this.size = [1, 1];
    this.bitmap = null;
    this.pinned = null;
    this.wipe = 0.5;
    this.plane = 'all';
    this.repeat = false;
    this.fitted = true;
    this.scale = 1;
    this.center = [0.5, 0.5];
    this.planes = new WeakMap();
    this.tiles = new Map();
    this.wanted = new Map();
    this.object = null;
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.listen(oncursor);
  }

  listen(oncursor) {
    const { canvas } = this;
    let from = null;
    canvas.addEventListener('pointerdown', (e) => { from = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
    canvas.addEventListener('pointerup', () => { from = null; });
    canvas.addEventListener('pointercancel', () => { from = null; });
    canvas.addEventListener('pointerleave', () => oncursor(null));
    canvas.addEventListener('pointermove', (e) => {
      if (from) {
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
  }

  get ratio() { return devicePixelRatio || 1; }

  // The place under a point of the window, in pixels of the full size.
  place(x, y) {
    const box = this.canvas.getBoundingClientRect();
    const dx = (x - box.left) * this.ratio - this.canvas.width / 2;
    const dy = (y - box.top) * this.ratio - this.canvas.height / 2;
    return [this.center[0] + dx / this.scale, this.center[1] + dy / this.scale];
  }

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
    this.scale = Math.min(this.canvas.width / w, this.canvas.height / h) * (this.repeat ? 1 : 0.96);
    this.center = [w / 2, h / 2];
    this.fitted = true;
    this.draw();
  }

  zoom(factor, x, y) {
    const box = this.canvas.getBoundingClientRect();
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

  zoomTo(scale) { this.zoom(scale / this.scale); }

  // Shows a bitmap of a whole picture whose full size is `size`; `source` says where tiles of it come from.
  show(image, size, source) {
    const resized = size[0] !== this.size[0] || size[1] !== this.size[1];
    this.size = size;
    this.bitmap = image;
    this.object = null;
    this.source = source;
    this.wanted.clear();
    if (resized || this.fitted) this.fit(); else this.draw();
  }

  // Shows points or lines in mm instead.
  showObject(object, size) {
    const resized = size[0] !== this.size[0] || size[1] !== this.size[1];
    this.size = size;
    this.object = object;
    this.bitmap = null;
    this.source = null;
    if (resized || this.fitted) this.fit(); else this.draw();
  }

  pin() { this.pinned = this.pinned ? null : this.bitmap && { bitmap: this.bitmap, size: this.size }; this.draw(); return !!this.pinned; }

  draw() {
    if (this.queued) return;
    this.queued = true;
    requestAnimationFrame(() => { this.queued = false; this.paint(); });
  }

  paint() {
    const { canvas, context: c } = this;
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.clearRect(0, 0, canvas.width, canvas.height);
    const split = this.pinned ? Math.round(canvas.width * this.wipe) : 0;
    if (this.pinned) this.layer(this.pinned.bitmap, [0, split], null);
    if (this.object) this.paintObject();
    else if (this.bitmap) this.layer(this.bitmap, [split, canvas.width], this.source);
    this.onview(this.bitmap || this.object ? this.scale : null);
  }

  layer(image, [left, right], source) {
    const { canvas, context: c, scale } = this;
    const [w, h] = this.size;
    c.save();
    c.beginPath();
    c.rect(left, 0, right - left, canvas.height);
    c.clip();
    const shown = this.inPlane(image);
    const n = this.repeat ? 2 : 1;
    const texel = scale * w / image.width;
    for (let j = 0; j < n; j += 1) {
      for (let i = 0; i < n; i += 1) {
        const x0 = Math.round((i * w - this.center[0]) * scale + canvas.width / 2);
        const y0 = Math.round((j * h - this.center[1]) * scale + canvas.height / 2);
        const x1 = Math.round(((i + 1) * w - this.center[0]) * scale + canvas.width / 2);
        const y1 = Math.round(((j + 1) * h - this.center[1]) * scale + canvas.height / 2);
        if (x1 < left || y1 < 0 || x0 > right || y0 > canvas.height) continue;
        c.imageSmoothingEnabled = texel < 2 || image.width < w;
        c.imageSmoothingQuality = 'high';
        c.drawImage(shown, x0, y0, x1 - x0, y1 - y0);
        if (source && texel > 1.01 && image.width < w) this.paintTiles(source, x0, y0);
      }
    }
    if (scale >= 24 && image.width === w) this.grid();
    c.restore();
  }

  // Tiles of the level that suits the zoom, over the whole picture, which is coarser.
  paintTiles(source, x0, y0) {
    const { canvas, context: c, scale } = this;
    const [w, h] = this.size;
    const level = Math.max(0, Math.min(6, Math.floor(-Math.log2(scale) + 0.001)));
    const step = TILE * 2 ** level;
    const [first, last] = [[-x0, -y0], [canvas.width - x0, canvas.height - y0]].map((p) => p.map((v) => Math.floor(v / scale / step)));
    for (let y = Math.max(0, first[1]); y <= last[1] && y * step < h; y += 1) {
      for (let x = Math.max(0, first[0]); x <= last[0] && x * step < w; x += 1) {
        const tile = this.tile(source, level, x, y);
        if (!tile) continue;
        const [a, b] = [Math.round(x0 + x * step * scale), Math.round(y0 + y * step * scale)];
        const right = Math.round(x0 + Math.min((x + 1) * step, w) * scale);
        const bottom = Math.round(y0 + Math.min((y + 1) * step, h) * scale);
        c.imageSmoothingEnabled = scale * 2 ** level < 2;
        c.drawImage(this.inPlane(tile), a, b, right - a, bottom - b);
      }
    }
  }

  tile(source, level, x, y) {
    const key = `${source.g}|${source.t}|${level}|${x}|${y}`;
    const known = this.tiles.get(key);
    if (known) {
      this.tiles.delete(key);
      this.tiles.set(key, known);
      return known;
    }
    if (!this.wanted.has(key) && this.wanted.size < 64) {
      this.wanted.set(key, true);
      bitmap('tile', { ...source, l: level, x, y }).then((image) => {
        if (!image) return;
        this.tiles.set(key, image);
        for (const old of this.tiles.keys()) {
          if (this.tiles.size <= KEPT) break;
          this.tiles.get(old).close();
          this.tiles.delete(old);
        }
        this.wanted.delete(key);
        this.draw();
      }, () => this.wanted.delete(key));
    }
    return null;
  }

  inPlane(image) {
    if (this.plane === 'all') return image;
    const known = this.planes.get(image);
    if (known?.plane === this.plane) return known.canvas;
    const made = new OffscreenCanvas(image.width, image.height);
    const c = made.getContext('2d', { willReadFrequently: true });
    c.drawImage(image, 0, 0);
    const pixels = c.getImageData(0, 0, image.width, image.height);
    const words = pixels.data;
    const from = { r: 0, g: 1, b: 2 }[this.plane];
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
    const start = (i, length) => ((i - this.center[length]) * scale) + (length ? canvas.height : canvas.width) / 2;
    const [left, top] = [Math.floor(this.center[0] - canvas.width / 2 / scale), Math.floor(this.center[1] - canvas.height / 2 / scale)];
    for (let x = left; start(x, 0) < canvas.width; x += 1) { const at = Math.round(start(x, 0)) + 0.5; c.moveTo(at, 0); c.lineTo(at, canvas.height); }
    for (let y = top; start(y, 1) < canvas.height; y += 1) { const at = Math.round(start(y, 1)) + 0.5; c.moveTo(0, at); c.lineTo(canvas.width, at); }
    c.stroke();
  }

  paintObject() {
    const { canvas, context: c, scale } = this;
    const { object } = this;
    const style = getComputedStyle(document.documentElement);
    const mm = (this.size[0] * scale) / object.size_mm[0];
    const x0 = canvas.width / 2 - this.center[0] * scale;
    const y0 = canvas.height / 2 - this.center[1] * scale;
    c.fillStyle = style.getPropertyValue('--back');
    c.fillRect(x0, y0, this.size[0] * scale, this.size[1] * scale);
    const width = Math.max(1, Math.min(3, mm * 0.05)) * Math.sqrt(this.ratio);
    c.lineWidth = width;
    for (const [alive, color] of [[0, '--bad'], [1, '--accent']]) {
      c.strokeStyle = style.getPropertyValue(color);
      c.beginPath();
      for (const line of object.lines ?? []) {
        if ((line[4] ?? 1) !== alive) continue;
        c.moveTo(x0 + line[0] * mm, y0 + line[1] * mm);
        c.lineTo(x0 + line[2] * mm, y0 + line[3] * mm);
      }
      c.stroke();
    }
    c.fillStyle = style.getPropertyValue('--accent');
    const dot = Math.max(1.5, Math.min(5, mm * 0.1));
    for (const [x, y] of object.points ?? []) c.fillRect(x0 + x * mm - dot / 2, y0 + y * mm - dot / 2, dot, dot);
  }
}
