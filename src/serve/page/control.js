// @ts-check
// Controls for the values of parameters.
import { element } from './dom.js';
import { field, softRange } from './field.js';

/** @type {(text: string) => string} */
export const unquote = (text) => { try { return JSON.parse(text); } catch { return text.replace(/^"|"$/g, ''); } };
/** @type {(v: number) => number} */
const code = (v) => Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));

// Formats a colour as browsers expect it.
/** @param {string} value */
function hex(value) {
  if (value.startsWith('"')) return unquote(value);
  const numbers = value.replace(/[()\s]/g, '').split(',').map(Number);
  return `#${numbers.slice(0, 3).map((v) => Math.min(255, Math.max(0, code(v))).toString(16).padStart(2, '0')).join('')}`;
}

// `show` shows a value; its second text is the value of the file.
/** @typedef {{ box: HTMLElement, show: (value: string, written: string) => void }} Control */

/** @param {import('./params.js').Parameters} parameters @param {Param} param @param {string} id @returns {Control} */
export function control(parameters, param, id) {
  const { name, type } = param;
  if (type === 'Number' || type === 'Integer') return number(parameters, param, id);
  if (type === 'Bool') {
    const box = element('input', { type: 'checkbox', id });
    box.onchange = () => parameters.change(name, String(box.checked), null);
    return { box, show: (value) => { box.checked = value === 'true'; } };
  }
  if (type === 'Color') {
    const box = element('input', { type: 'color', id });
    // All colours until the picker closes are one step.
    box.oninput = () => {
      if (parameters.held !== name) parameters.hold(name);
      parameters.change(name, `"${box.value}"`, parameters.gesture(name));
    };
    box.onchange = () => parameters.release();
    return { box, show: (value) => { box.value = hex(value); } };
  }
  if (type === 'Choice') {
    const box = element('select', { id }, ...param.options.map((o) => element('option', { value: o, textContent: o })));
    box.onchange = () => parameters.change(name, box.value, null);
    return { box, show: (value) => { box.value = unquote(value); } };
  }
  const box = element('input', { type: 'text', id, spellcheck: false });
  box.onchange = () => parameters.change(name, JSON.stringify(box.value), null);
  return { box, show: (value) => { box.value = unquote(value); } };
}

/** @param {import('./params.js').Parameters} parameters @param {Param} param @param {string} id @returns {Control} */
function number(parameters, { name, type, range, unit, default: written }, id) {
  const whole = type === 'Integer';
  const made = field({
    id, name: name.replaceAll('_', ' '), unit, whole, range, soft: range ?? softRange(Number(written)),
    onset: (n, how) => parameters.change(name, whole ? String(n) : String(+n.toPrecision(12)), how === 'drag' ? parameters.gesture(name) : how === 'key' ? name : null),
    onhold: () => parameters.hold(name),
    onreset: () => parameters.reset(name),
  });
  return { box: made.box, show: (value, of) => made.show(Number(value), Number(of)) };
}
