// @ts-check
// Number fields: texts that are read as numbers or as arithmetic, and that arrow keys step.
import { element, notice, short } from './dom.js';

/** @typedef {{ text: string, at: number }} Rest */

// Reads a number or arithmetic with `+ - * / ^` and brackets; a comma is a decimal point. NaN if the text is neither.
/** @param {string} text */
export function evaluate(text) {
  const plain = text.trim().replaceAll(',', '.').replace(/[−–]/g, '-').replace(/[×·]/g, '*').replaceAll('÷', '/').replaceAll(':', '/');
  /** @type {Rest} */
  const rest = { text: plain, at: 0 };
  const value = sum(rest);
  return peek(rest) === '' && Number.isFinite(value) ? +value.toPrecision(12) : NaN;
}

/** @param {Rest} rest */
function peek(rest) {
  while (rest.text[rest.at] === ' ') rest.at += 1;
  return rest.text[rest.at] ?? '';
}

/** @param {Rest} rest @param {string} signs */
function take(rest, signs) {
  const sign = peek(rest);
  if (!sign || !signs.includes(sign)) return '';
  rest.at += 1;
  return sign;
}

/** @param {Rest} rest @returns {number} */
function sum(rest) {
  let value = product(rest);
  for (let sign = take(rest, '+-'); sign; sign = take(rest, '+-')) {
    const next = product(rest);
    value = sign === '+' ? value + next : value - next;
  }
  return value;
}

/** @param {Rest} rest @returns {number} */
function product(rest) {
  let value = signed(rest);
  for (let sign = take(rest, '*/'); sign; sign = take(rest, '*/')) {
    const next = signed(rest);
    value = sign === '*' ? value * next : value / next;
  }
  return value;
}

/** @param {Rest} rest @returns {number} */
function signed(rest) {
  const sign = take(rest, '+-');
  if (sign) return sign === '-' ? -signed(rest) : signed(rest);
  const base = atom(rest);
  return take(rest, '^') ? base ** signed(rest) : base;
}

/** @param {Rest} rest @returns {number} */
function atom(rest) {
  if (take(rest, '(')) {
    const value = sum(rest);
    return take(rest, ')') ? value : NaN;
  }
  peek(rest);
  const found = /^(\d[\d_]*\.?\d*|\.\d+)(e[+-]?\d+)?/i.exec(rest.text.slice(rest.at));
  if (!found) return NaN;
  rest.at += found[0].length;
  return Number(found[0].replaceAll('_', ''));
}

// Step of arrow keys: about a hundredth of the range, or of the number if it has no range.
/** @param {number} value @param {Vec2 | null} range @param {boolean} whole */
export function step(value, range, whole) {
  if (whole) return 1;
  const span = range ? range[1] - range[0] : Math.abs(value) || 1;
  return fine(span);
}

/** @param {number} span */
const fine = (span) => 10 ** Math.floor(Math.log10(span / 50));

// The number that a field takes for `n`: within the range, and whole if it must be.
/** @param {number} n @param {Vec2 | null} range @param {boolean} whole */
export function within(n, range, whole) {
  const [lo, hi] = range ?? [-Infinity, Infinity];
  return Math.min(Math.max(whole ? Math.round(n) : n, lo), hi);
}

// A number field. `onset` gets its number, and true if a key has stepped it. Without a range, `span` gives the steps.
/**
 * @param {{ id: string, name: string, unit?: string, whole?: boolean, range?: Vec2 | null, span?: number, onset: (n: number, stepped: boolean) => void }} of
 * @returns {{ box: HTMLInputElement, show: (n: number, force?: boolean) => void }}
 */
export function numberField({ id, name, unit = '', whole = false, range = null, span, onset }) {
  const box = element('input', { type: 'text', inputMode: 'decimal', className: 'number-box', id, autocomplete: 'off', spellcheck: false });
  let exact = NaN;
  // The text that a refused entry gives way to.
  let before = '';
  /** @param {number} n */
  const put = (n) => {
    exact = n;
    before = box.value = short(n);
    box.role = 'spinbutton';
    box.ariaValueNow = String(n);
    if (range) [box.ariaValueMin, box.ariaValueMax] = range.map(String);
    delete box.dataset.typed;
  };
  const limits = () => (range ? `${name} goes from ${range.map(short).join(' to ')}${unit ? ` ${unit}` : ''}` : '');
  box.onfocus = () => { if (!box.dataset.typed) before = box.value; };
  box.oninput = () => { box.dataset.typed = 'yes'; };
  box.onchange = () => {
    const text = box.value;
    const n = evaluate(text);
    if (Number.isNaN(n)) {
      box.value = before;
      delete box.dataset.typed;
      if (text.trim()) notice(`“${text}” is no number, and no arithmetic such as 0.5*2`, true);
      return;
    }
    const taken = within(n, range, whole);
    if (taken !== n) notice(range && (n < range[0] || n > range[1]) ? `${limits()}: ${short(taken)} is taken` : `${name} is a whole number: ${short(taken)} is taken`, true);
    put(taken);
    onset(taken, false);
  };
  box.onkeydown = (e) => {
    if (e.key === 'Escape' && box.dataset.typed) {
      e.stopPropagation();
      box.value = before;
      delete box.dataset.typed;
    }
    const by = /** @type {Record<string, number>} */ ({ ArrowUp: 1, ArrowDown: -1, PageUp: 10, PageDown: -10 })[e.key];
    if (!by || e.ctrlKey || e.metaKey || e.altKey) return;
    e.preventDefault();
    const from = box.dataset.typed || Number.isNaN(exact) ? evaluate(box.value) : exact;
    if (Number.isNaN(from)) return;
    const size = span && !whole ? fine(span) : step(from, range, whole);
    const next = +(from + by * (e.shiftKey && !whole ? 0.1 : 1) * size).toPrecision(10);
    const taken = within(next, range, whole);
    if (taken === from) { notice(limits()); return; }
    put(taken);
    onset(taken, true);
  };
  // A text that the user types stays, unless it is refused.
  return { box, show: (n, force = false) => { if (force || !box.dataset.typed) put(n); } };
}
