// @ts-check
// The numbers of a formula: each is a slider within the text, and is written into the file after a drag.
import { element } from './dom.js';

// Pixels that a number is dragged over its whole range.
const LENGTH = 200;

// The range of a number that declares none: from 0 to twice the number.
/** @param {string} text */
export function range(text) {
  const value = Number(text.replaceAll('_', ''));
  const hi = value > 0 ? 2 * value : 1;
  return { value, lo: 0, hi, step: 10 ** Math.floor(Math.log10(hi / LENGTH)) };
}

// The text of a number that is dragged by some pixels.
/** @param {string} text @param {number} pixels */
export function dragged(text, pixels) {
  const { value, lo, hi, step } = range(text);
  if (!pixels) return text;
  const moved = Math.min(Math.max(value + (pixels * (hi - lo)) / LENGTH, lo), hi);
  return String(+(Math.round(moved / step) * step).toPrecision(6));
}

// A formula with its numbers. `pieces` are its parts, of which every second one is a number; `onchange` gets the index
// of a number and its new text.
/** @param {string} name @param {string[]} pieces @param {(index: number, value: string) => Promise<boolean>} onchange */
export function formula(name, pieces, onchange) {
  const parts = pieces.map((piece, i) => (i % 2 ? number(name, piece, (value) => onchange((i - 1) / 2, value)) : piece));
  return element('div', { className: 'formula', role: 'group', ariaLabel: `Formula of ${name}` }, ...parts);
}

/** @param {string} name @param {string} text @param {(value: string) => Promise<boolean>} onchange */
function number(name, text, onchange) {
  const { value, lo, hi } = range(text);
  const made = element('span', { className: 'number', role: 'slider', tabIndex: 0, textContent: text, title: `Drag to change: ${lo} … ${+hi.toPrecision(6)}`,
    ariaLabel: `Number in ${name}`, ariaValueMin: String(lo), ariaValueMax: String(hi), ariaValueNow: String(value) });
  let from = 0;
  let pixels = 0;
  let held = false;
  /** @param {number} by */
  const move = (by) => {
    pixels = Math.min(Math.max(by, -LENGTH), LENGTH);
    made.textContent = dragged(text, pixels);
    made.ariaValueNow = made.textContent;
  };
  const leave = () => { held = false; move(0); };
  const write = async () => {
    held = false;
    const wanted = dragged(text, pixels);
    // A number that the file refuses gives way to the one that stands there.
    if (Number(wanted) !== value && !await onchange(wanted)) leave();
  };
  made.onpointerdown = (e) => { if (e.button) return; e.preventDefault(); made.focus(); made.setPointerCapture(e.pointerId); from = e.clientX - pixels; held = true; };
  made.onpointermove = (e) => { if (held) move(e.clientX - from); };
  made.onpointerup = () => { if (held) write(); };
  made.onpointercancel = leave;
  made.onkeydown = (e) => {
    const by = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 20, PageDown: -20, Home: -LENGTH, End: LENGTH }[e.key];
    if (e.key === 'Escape') leave();
    if (!by) return;
    e.preventDefault();
    held = true;
    move(pixels + by);
  };
  // A key that is held down writes once.
  made.onkeyup = () => { if (held) write(); };
  return made;
}
