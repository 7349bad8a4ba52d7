// @ts-check
// Fields of numbers: dragged, typed into, stepped by keys, and reset by a double click. A bar shows the place in the range, a
// tick the value of the file.
import { element, short } from './dom.js';
import { numberField, within } from './entry.js';

// A drag begins after this many pixels; until then it is a click.
const SLACK = 3;
// Pixels of a drag over the whole range, for fields that are narrower.
const LENGTH = 120;

// A whole range from end to end is dragged if it is at most this many times the number.
const WIDE = 40;

// The range over which a number is dragged. If it has none, or a very wide one, it goes to twice the number.
/** @param {number} value @param {number | null} [min] @param {number | null} [max] @param {string | null} [unit] @returns {Vec2} */
export function softRange(value, min = null, max = null, unit = null) {
  if (min !== null && max !== null) {
    if (max - min <= Math.max(2, WIDE * Math.abs(value)) || unit === '°') return [min, max];
    return softRange(value, Math.max(min, Math.min(0, 2 * value)), value > 0 ? Math.min(max, 2 * value) : value < 0 ? Math.min(max, 0) : Math.min(max, min + 1));
  }
  const lo = min ?? Math.min(0, 2 * value);
  const hi = max ?? (value > 0 ? 2 * value : value < 0 ? Math.max(0, lo) : lo + 1);
  return lo < hi ? [lo, hi] : [lo, lo + 1];
}

// The number after a drag, at a step that suits the range.
/** @param {number} at @param {Vec2} range @param {boolean} whole @param {boolean} fine */
export function dragged(at, [lo, hi], whole, fine) {
  const step = whole ? 1 : 10 ** (Math.floor(Math.log10((hi - lo) / 200)) - (fine ? 1 : 0));
  return +(Math.round(at / step) * step).toPrecision(10);
}

/**
 * `onset` gets each number, and whether a key or a drag made it; `onhold` tells the begin of a drag, `onreset` a double click.
 * Numbers keep to `range`; without one, `soft` is the range of the drag.
 * @param {{
 *   id: string, name: string, unit?: string | null, whole?: boolean, range?: Vec2 | null, soft?: Vec2,
 *   onset: (n: number, how: 'typed' | 'key' | 'drag') => void, onhold: () => void, onreset: () => void,
 * }} of
 */
export function field({ id, name, unit = '', whole = false, range = null, soft, onset, onhold, onreset }) {
  const [lo, hi] = range ?? soft ?? [0, 1];
  const entry = numberField({ id, name, unit: unit ?? '', whole, range, span: hi - lo, onset: (n, stepped) => { paint(n); onset(n, stepped ? 'key' : 'typed'); } });
  const { box } = entry;
  const ends = `${short(lo)} … ${short(hi)}${unit ? ` ${unit}` : ''}`;
  box.title = `${range ? ends : `drag over ${ends}`}\nDrag, or click to type; Shift: fine steps; double click: reset`;
  const tick = element('b');
  const made = element('span', { className: 'field' }, element('i'), tick, box, unit ? element('span', { className: 'unit', textContent: unit }) : null);
  let value = NaN;
  /** @param {number} n */
  const share = (n) => `${100 * Math.min(Math.max((n - lo) / (hi - lo), 0), 1)}%`;
  /** @param {number} n */
  const paint = (n) => { value = n; made.style.setProperty('--at', share(n)); };
  let from = 0;
  let last = 0;
  let at = 0;
  let state = '';
  box.onpointerdown = (e) => {
    // A field that is being typed into is a text.
    if (e.button || document.activeElement === box || Number.isNaN(value)) return;
    e.preventDefault();
    if (e.isTrusted) box.setPointerCapture(e.pointerId);
    from = last = e.clientX;
    at = value;
    state = 'pressed';
  };
  box.onpointermove = (e) => {
    if (!state || (state === 'pressed' && Math.abs(e.clientX - from) < SLACK)) return;
    if (state === 'pressed') { state = 'dragged'; made.classList.add('held'); onhold(); }
    at += ((e.clientX - last) * (hi - lo) * (e.shiftKey ? 0.1 : 1)) / Math.max(made.clientWidth, LENGTH);
    last = e.clientX;
    at = Math.min(Math.max(at, lo), Math.max(hi, value));
    const n = within(dragged(at, [lo, hi], whole, e.shiftKey), range ?? null, whole);
    if (n === value) return;
    entry.show(n, true);
    paint(n);
    onset(n, 'drag');
  };
  const end = () => { state = ''; made.classList.remove('held'); };
  box.onpointerup = () => { if (state === 'pressed') { box.focus(); box.select(); } end(); };
  box.onpointercancel = end;
  box.ondblclick = (e) => { e.preventDefault(); delete box.dataset.typed; box.blur(); onreset(); };
  return {
    box: made,
    // Shows a number; the tick is at the number of the file.
    /** @param {number} n @param {number} written */
    show(n, written, force = false) {
      if (state === 'dragged' && !force) return;
      entry.show(n, force);
      paint(n);
      made.style.setProperty('--file', share(written));
      tick.hidden = Number.isNaN(written);
    },
  };
}
