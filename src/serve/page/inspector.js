// @ts-check
// Information about the selected node, and its constants.
import { $, element, short } from './dom.js';
import { numberField } from './entry.js';
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
 *   onchange: (change: unknown, label: string) => Promise<boolean>,
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
  const facts = [about.doc, stat && `${stat.state}${stat.state === 'computed' ? ` in ${(stat.seconds * 1000).toFixed(1)} ms` : ''}`, node?.line && `line ${node.line}`, about.file && `of ${about.file.split('/').slice(-2).join('/')}`];
  parts.push(text('div', 'facts', facts.filter(Boolean).join(' · ')));
  if (node?.broken) parts.push(text('div', 'facts bad', node.broken));
  for (const field of about.fields ?? []) { const made = constant(about.node, field, onchange); if (made) parts.push(made); }
  // The text may be long, so it can be scrolled by keyboard.
  parts.push(element('pre', { textContent: about.text, tabIndex: 0, role: 'region', ariaLabel: 'Text of the node' }));
  box.replaceChildren(...parts);
}

// A number, switch, choice or colour in the node's text: edited in place, or turned into a parameter. The numbers of a
// formula are dragged in its text. Values that are computed, or that stand in the file of a sub-graph, are only shown.
/** @param {string} node @param {Constant} field @param {(change: unknown, label: string) => Promise<boolean>} onchange */
function constant(node, field, onchange) {
  const { name, text: written } = field;
  const id = `field-${name}`;
  const said = name.replaceAll('_', ' ');
  const number = /^-?[\d._]+(e-?\d+)?$/i.test(written);
  // The value of a computed number.
  const now = field.now ?? (field.fixed && number ? Number(written.replaceAll('_', '')) : null);
  const value = now === null ? null : text('span', 'now', `${short(now)} ${field.unit ?? ''}`.trim());
  if (field.formula) {
    const made = formula(name || node, field.formula, (index, value) => onchange({ number: { node, field: name, index, value } }, `${node}: ${name} ${value}`.replace('  ', ' ')));
    const label = element('div', { className: 'head' }, element('span', { className: 'label', textContent: said, title: field.doc }), value);
    return element('div', { className: 'param constant', dataset: { field: name } }, ...(name ? [label] : []), made);
  }
  if (field.fixed || now !== null) {
    const shown = number ? null : element('code', { textContent: written });
    const head = element('div', { className: 'head' }, element('span', { className: 'label', textContent: said, title: field.doc }), value);
    return element('div', { className: 'param constant', dataset: { field: name } }, head, shown);
  }
  const color = /^"#[0-9a-f]{6}"$/i.test(written);
  const bool = written === 'true' || written === 'false';
  const choices = field.choices ?? [];
  const choice = choices.includes(written);
  if (!number && !color && !bool && !choice) return null;
  /** @param {string} value */
  const set = (value) => onchange({ field: { node, field: name, value } }, `${node}: ${name} ${value}`);
  const unit = element('span', { className: 'unit', textContent: field.unit ?? '' });
  const label = element('label', { htmlFor: id, textContent: said, title: field.doc });
  /** @type {HTMLElement} */
  let box;
  if (number) {
    const old = Number(written.replaceAll('_', ''));
    // A value that the file refuses gives way to the one that stands there.
    const made = numberField({ id, name: said, unit: field.unit ?? '', whole: !!field.whole, live: false, onset: async (n) => { if (n !== old && !await set(String(n))) made.show(old, true); } });
    made.show(old);
    box = made.box;
  } else if (choice) {
    const made = element('select', { id }, ...choices.map((c) => element('option', { value: c, textContent: c })));
    made.value = written;
    made.onchange = async () => { if (!await set(made.value)) made.value = written; };
    box = made;
  } else if (bool) {
    const made = element('input', { id, type: 'checkbox', checked: written === 'true' });
    made.onchange = async () => { if (!await set(String(made.checked))) made.checked = written === 'true'; };
    box = made;
  } else {
    const made = element('input', { id, type: 'color', value: written.slice(1, -1) });
    made.onchange = async () => { if (!await set(`"${made.value}"`)) made.value = written.slice(1, -1); };
    box = made;
  }
  const head = element('div', { className: 'head' }, label, box, unit);
  if (!choice) {
    const make = element('button', { textContent: 'Make parameter', ariaLabel: `Make a parameter of ${name}`, title: 'A parameter of the graph, with a slider here' });
    make.onclick = () => onchange({ promote: { node, field: name } }, `Parameter of ${node}: ${name}`);
    head.append(make);
  }
  return element('div', { className: 'param constant', dataset: { field: name } }, head);
}
