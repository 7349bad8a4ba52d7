// @ts-check
// The measuring panel: histogram, black and white point, exposure, false colour, contour lines, profile.
import { $, element, isShown, short } from './dom.js';
import { evaluate, numberField } from './entry.js';
import { histogram, profile } from './tone.js';

const COLORS = ['#e0655f', '#58a866', '#5b8fe0'];
const [WIDTH, HEIGHT] = [258, 92];

// Nearest number of the series 1, 2, 5, 10 …
/** @param {number} v */
function nice(v) {
  const ten = 10 ** Math.floor(Math.log10(Math.max(v, 1e-9)));
  return +(/** @type {number} */ ([1, 2, 5, 10].find((n) => n * ten >= v * 0.75)) * ten).toPrecision(2);
}

export class Measure {
  // `ontone` is called with a new tone; `source` returns the shown picture, `facts` the canvas of the graph.
  /**
   * @param {HTMLElement} root
   * @param {{
   *   ontone: (tone: Tone) => void,
   *   source: () => Source | null,
   *   facts: () => CanvasFacts,
   *   online: (ends: Line | null) => void,
   * }} of
   */
  constructor(root, { ontone, source, facts, online }) {
    this.root = root;
    this.ontone = ontone;
    this.source = source;
    this.facts = facts;
    this.online = online;
    /** @type {Tone} */
    this.tone = { range: null, exposure: 0, heat: false, contours: 0 };
    this.locked = false;
    this.ranged = false;
    this.stepped = false;
    /** @type {ReturnType<typeof histogram> | undefined} */
    this.found = undefined;
    /** @type {Line | null | undefined} */
    this.ends = undefined;
    this.plot = element('canvas', { width: WIDTH * 2, height: HEIGHT * 2, className: 'plot', role: 'img', ariaLabel: 'Histogram' });
    this.line = element('canvas', { width: WIDTH * 2, height: HEIGHT * 2, className: 'plot', role: 'img', ariaLabel: 'Profile' });
    this.note = element('p', { className: 'doc', id: 'histogram-note' });
    this.lineNote = element('p', { className: 'doc', id: 'profile-note', textContent: 'Shift-drag on the picture, or:' });
    this.fields = this.build();
  }

  get open() { return isShown(this.root); }

  build() {
    /** @type {(id: string, text: string, onset: () => void) => [HTMLInputElement, HTMLLabelElement]} */
    const number = (id, text, onset) => {
      const { box } = numberField({ id, name: text, onset });
      return [box, element('label', { htmlFor: id, textContent: text })];
    };
    /** @type {(id: string, text: string) => [HTMLInputElement, HTMLLabelElement]} */
    const check = (id, text) => {
      const box = element('input', { type: 'checkbox', id });
      return [box, element('label', { htmlFor: id, className: 'check' }, box, text)];
    };
    const ranged = () => { this.ranged = true; set(); };
    const [black, blackLabel] = number('black-point', 'Black point', ranged);
    const [white, whiteLabel] = number('white-point', 'White point', ranged);
    const [lock, lockLabel] = check('lock-range', 'Lock the range');
    const [heat, heatLabel] = check('false-colour', 'False colour');
    const [lines, linesLabel] = check('contours', 'Contour lines, every');
    const [step] = number('contour-step', 'Contour step', () => { this.stepped = true; set(); });
    step.ariaLabel = 'Step of the contour lines';
    const exposure = element('input', { type: 'range', id: 'picture-exposure', min: -6, max: 6, step: 0.25, value: 0 });
    const ev = element('span', { className: 'unit', textContent: '0 EV' });
    const auto = element('button', { textContent: 'Auto', title: 'From the least value to the greatest' });
    const reset = element('button', { id: 'tone-reset', textContent: 'Reset tone' });
    const set = () => {
      this.locked = lock.checked;
      const [lo, hi] = [evaluate(black.value), evaluate(white.value)];
      const given = Number.isFinite(lo) && Number.isFinite(hi) && hi > lo;
      this.tone = {
        range: given && (this.locked || this.ranged) ? [lo, hi] : null,
        exposure: exposure.valueAsNumber,
        heat: heat.checked,
        contours: lines.checked && evaluate(step.value) > 0 ? evaluate(step.value) : 0,
      };
      ev.textContent = `${exposure.value} EV`;
      this.ontone(this.tone);
      this.show();
    };
    for (const box of [lock, heat, lines]) box.onchange = set;
    exposure.oninput = set;
    auto.onclick = () => {
      const found = this.found;
      if (!found) return;
      [black.value, white.value] = [short(found.least), short(found.greatest)];
      this.ranged = true;
      set();
    };
    reset.onclick = () => {
      for (const box of [lock, heat, lines]) box.checked = false;
      exposure.value = '0';
      this.ranged = false;
      set();
    };
    /** @param {string} text @param {() => Line | null} ends */
    const cut = (text, ends) => {
      const made = element('button', { textContent: text });
      made.onclick = () => this.online(ends());
      return made;
    };
    const size = () => this.facts().resolution;
    this.root.replaceChildren(
      element('h3', { textContent: 'Histogram' }), this.plot, this.note,
      element('div', { className: 'fields' }, blackLabel, black, whiteLabel, white),
      element('div', { className: 'row' }, auto, reset), lockLabel,
      element('div', { className: 'param' }, element('div', { className: 'head' }, element('label', { htmlFor: 'picture-exposure', textContent: 'Exposure' }), ev), exposure),
      heatLabel, element('div', { className: 'head' }, linesLabel, step, element('span', { className: 'unit', id: 'contour-unit' })),
      element('h3', { textContent: 'Profile' }), this.line, this.lineNote,
      element('div', { className: 'row' },
        cut('Across', () => { const [w, h] = size(); return [[0, h / 2], [w - 1, h / 2]]; }),
        cut('Down', () => { const [w, h] = size(); return [[w / 2, 0], [w / 2, h - 1]]; }),
        cut('None', () => null)),
    );
    return { black, white, step };
  }

  // Draws the current state.
  show() {
    const source = this.source();
    if (!this.open || !source) return;
    const { black, white } = this.fields;
    $('contour-unit').textContent = source.unit ?? '';
    const range = this.tone.range ?? source.range ?? [0, 1];
    if (!this.locked && !this.ranged) [black.value, white.value] = range.map(short);
    // The default step gives about eight contour lines.
    if (!this.stepped) this.fields.step.value = String(nice((range[1] - range[0]) / 8));
    const found = histogram(source, range);
    this.found = found;
    this.draw(found.bins.map((bins) => Array.from(bins)), this.plot, true);
    const unit = source.unit ? ` ${source.unit}` : '';
    this.note.textContent = `least ${short(found.least)}${unit} · mean ${short(found.mean)}${unit} · greatest ${short(found.greatest)}${unit}`;
    this.cut(this.ends);
  }

  /** @param {number[][]} rows @param {HTMLCanvasElement} canvas @param {boolean} filled @param {Vec2 | null} [range] */
  draw(rows, canvas, filled, range = null) {
    const c = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    const { width, height } = canvas;
    c.clearRect(0, 0, width, height);
    const flat = rows.flat().filter(Number.isFinite);
    // Limits the scale so that a single tall bar does not flatten the others.
    const sorted = filled ? [...flat].sort((a, b) => a - b) : [];
    const [lo, hi] = range ?? [0, filled ? Math.max(1, sorted[Math.floor(sorted.length * 0.985)] * 1.3) : 1];
    rows.forEach((row, k) => {
      c.strokeStyle = c.fillStyle = rows.length > 1 ? COLORS[k] : getComputedStyle(document.documentElement).getPropertyValue('--accent');
      c.globalAlpha = filled && rows.length > 1 ? 0.55 : 1;
      c.lineWidth = 3;
      c.beginPath();
      /** @param {number} v */
      const y = (v) => height - 2 - ((Math.min(Math.max(v, lo), hi) - lo) / Math.max(hi - lo, 1e-30)) * (height - 6);
      if (filled) c.moveTo(0, height);
      row.forEach((v, i) => c.lineTo((i / (row.length - 1)) * width, y(v)));
      if (filled) { c.lineTo(width, height); c.fill(); } else { c.stroke(); }
    });
    c.globalAlpha = 1;
  }

  // Draws the profile along a line, in mm.
  /** @param {Line | null | undefined} ends */
  cut(ends) {
    this.ends = ends;
    const source = this.source();
    if (!this.open || !source || !ends) {
      this.line.hidden = !ends;
      this.lineNote.textContent = 'Shift-drag on the picture, or:';
      return;
    }
    this.line.hidden = false;
    const { resolution, size_mm } = this.facts();
    const share = /** @type {[Vec2, Vec2]} */ (ends.map((p) => p.map((v, i) => v / resolution[i])));
    const mm = Math.hypot(...[0, 1].map((i) => (share[1][i] - share[0][i]) * size_mm[i]));
    const points = profile(source, ...share, 256);
    const rows = points[0].map((_, k) => points.map((p) => p[k]));
    const all = rows.flat().filter(Number.isFinite);
    const [lo, hi] = [Math.min(...all), Math.max(...all)];
    this.draw(rows, this.line, false, [lo, hi]);
    const unit = source.unit ? ` ${source.unit}` : '';
    this.lineNote.textContent = `${short(mm)} mm long · from ${short(lo)}${unit} to ${short(hi)}${unit}, ${short(hi - lo)}${unit} apart`;
  }
}
