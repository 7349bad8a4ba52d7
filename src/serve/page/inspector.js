// @ts-check
// Information about the selected node, and its constants.
import { $, element } from './dom.js';
import { formula } from './numbers.js';

/** @type {(tag: keyof HTMLElementTagNameMap, className: string, content?: string) => HTMLElement} */
const text = (tag, className, content = '') => element(tag, { className, textContent: content });

// `node` and `stat` are the node's data from the graph; `onport` selects another output, `onchange` changes the file.
/**
 * @param {About} about
 * @param {{
 *   node: Box | null,
 *   stat?: Stat,
 *   target: string,
 *   onport: (name: string) => void,
 *   onclose: () => void,
 *   onjump: () => void,
 *   onchange: (change: unknown, label: string) => void,
 * }} of
 */
export function inspect(about, { node, stat, target, onport, onclose, onjump, onchange }) {
  const box = $('inspector');
  box.hidden = false;
  const close = element('button', { textContent: '✕', ariaLabel: 'Back to the outputs' });
  close.onclick = onclose;
  const jump = element('button', { textContent: 'In the editor', title: 'Show its line in the editor' });
  jump.onclick = onjump;
  const parts = [element('h2', {}, 'Node', text('div', 'spring'), jump, close), text('div', 'name', about.node), text('div', 'kind', about.kind)];
  if (node && node.ports.length > 1 && !node.use) {
    const ports = element('div', { className: 'ports', role: 'group', ariaLabel: 'Outputs of the node' });
    node.ports.forEach((p, i) => {
      const full = i ? `@${about.node}:${p.name}` : `@${about.node}`;
      const b = element('button', { textContent: p.name, ariaPressed: String(target === full) });
      b.onclick = () => onport(full);
      ports.append(b);
    });
    parts.push(ports);
  }
  const facts = [about.doc, stat && `${stat.state}${stat.state === 'computed' ? ` in ${(stat.seconds * 1000).toFixed(1)} ms` : ''}`, node?.line && `line ${node.line}`];
  parts.push(text('div', 'facts', facts.filter(Boolean).join(' · ')));
  if (node?.broken) parts.push(text('div', 'facts bad', node.broken));
  for (const field of about.fields ?? []) { const made = constant(about.node, field, onchange); if (made) parts.push(made); }
  // The text may be long, so it can be scrolled by keyboard.
  parts.push(element('pre', { textContent: about.text, tabIndex: 0, role: 'region', ariaLabel: 'Text of the node' }));
  box.replaceChildren(...parts);
}

// A number, switch, choice or colour in the node's text: edited in place, or turned into a parameter. The numbers of a
// formula are dragged in its text.
/** @param {string} node @param {Constant} field @param {(change: unknown, label: string) => void} onchange */
function constant(node, field, onchange) {
  const { name, text: written } = field;
  const id = `field-${name}`;
  if (field.formula) {
    const made = formula(name || node, field.formula, (index, value) => onchange({ number: { node, field: name, index, value } }, `${node}: ${name} ${value}`.replace('  ', ' ')));
    const label = element('div', { className: 'head', textContent: name.replaceAll('_', ' '), title: field.doc });
    return element('div', { className: 'param constant', dataset: { field: name } }, ...(name ? [label] : []), made);
  }
  const number = /^-?[\d._]+(e-?\d+)?$/i.test(written);
  const color = /^"#[0-9a-f]{6}"$/i.test(written);
  const bool = written === 'true' || written === 'false';
  const choices = field.choices ?? [];
  const choice = choices.includes(written);
  if (!number && !color && !bool && !choice) return null;
  // A select has no `checked`, `min` and `max`; they are used for inputs only.
  const box = /** @type {HTMLInputElement} */ (choice
    ? /** @type {HTMLElement} */ (element('select', { id }, ...choices.map((c) => element('option', { value: c, textContent: c }))))
    : element('input', { id, type: bool ? 'checkbox' : color ? 'color' : 'number', step: field.whole ? 1 : 'any' }));
  let value = () => box.value;
  if (bool) { box.checked = written === 'true'; value = () => String(box.checked); }
  else if (color) { box.value = written.slice(1, -1); value = () => `"${box.value}"`; }
  else box.value = number ? written.replaceAll('_', '') : written;
  if (number && field.min !== null && field.min !== undefined) box.min = String(field.min);
  if (number && field.max !== null && field.max !== undefined) box.max = String(field.max);
  box.onchange = () => { if (box.value !== '') onchange({ field: { node, field: name, value: value() } }, `${node}: ${name} ${value()}`); };
  const head = element('div', { className: 'head' }, element('label', { htmlFor: id, textContent: name.replaceAll('_', ' '), title: field.doc }), box, element('span', { className: 'unit', textContent: field.unit ?? '' }));
  if (!choice) {
    const make = element('button', { textContent: 'Make parameter', ariaLabel: `Make a parameter of ${name}`, title: 'A parameter of the graph, with a slider here' });
    make.onclick = () => onchange({ promote: { node, field: name } }, `Parameter of ${node}: ${name}`);
    head.append(make);
  }
  return element('div', { className: 'param constant', dataset: { field: name } }, head);
}
