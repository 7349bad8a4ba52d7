// @ts-check
// Information about the selected node, and its values. They are set like parameters: the graph is shown with them at once,
// and Save writes them into the file.
import { $, element, say, short } from './dom.js';
import { field, softRange } from './field.js';
import { keyOf } from './values.js';

/** @type {(tag: keyof HTMLElementTagNameMap, className: string, content?: string) => HTMLElement} */
const text = (tag, className, content = '') => element(tag, { className, textContent: content });
/** @type {(text: string) => boolean} */
const isNumber = (written) => /^-?[\d._]+(e-?\d+)?$/i.test(written);
/** @type {(text: string) => number} */
const numberOf = (written) => Number(written.replaceAll('_', ''));
/** @type {(text: string) => boolean} */
const isColor = (written) => /^"#[0-9a-f]{6}"$/i.test(written);

/**
 * @typedef {{
 *   node: Box | null,
 *   stat?: Stat,
 *   target: string,
 *   parameters: import('./params.js').Parameters,
 *   onport: (name: string) => void,
 *   onclose: () => void,
 *   onjump: () => void,
 *   onchange: (change: unknown, label: string) => Promise<boolean>,
 * }} Of
 */

// The form of the panel, and the functions that show new values in it. An element that is dragged stays.
let shape = '';
/** @type {Map<string, (field: Constant) => void>} */
let shows = new Map();

// `node` and `stat` are the node's data from the graph; `onport` selects another output, `onchange` changes the file.
/** @param {About} about @param {Of} of */
export function inspect(about, of) {
  const { node, stat, target } = of;
  const box = $('inspector');
  box.hidden = false;
  for (const now of about.fields ?? []) remember(about.node, now, of.parameters);
  const facts = [about.doc, stat && `${stat.state}${stat.state === 'computed' ? ` in ${(stat.seconds * 1000).toFixed(1)} ms` : ''}`, node?.line && `line ${node.line}`, about.file && `of ${about.file.split('/').slice(-2).join('/')}`].filter(Boolean).join(' · ');
  const now = JSON.stringify([about.node, about.kind, target, node?.ports, node?.broken, (about.fields ?? []).map(formOf)]);
  if (now === shape && box.childElementCount) {
    say(/** @type {HTMLElement} */ (box.querySelector('.facts')), facts);
    say(/** @type {HTMLElement} */ (box.querySelector('pre')), about.text);
    for (const found of about.fields ?? []) shows.get(found.name)?.(found);
    return;
  }
  shape = now;
  shows = new Map();
  const close = element('button', { textContent: '✕', ariaLabel: 'Back to the outputs' });
  close.onclick = of.onclose;
  const jump = element('button', { textContent: 'In the editor', title: 'Show its line in the editor' });
  jump.onclick = of.onjump;
  const parts = [element('h2', {}, 'Node', text('div', 'spring'), jump, close), text('div', 'name', about.node), text('div', 'kind', about.kind)];
  if (node && node.ports.length > 1 && !node.use) {
    const ports = element('div', { className: 'ports', role: 'group', ariaLabel: 'Outputs of the node' });
    node.ports.forEach((p, i) => {
      const full = i ? `@${about.node}:${p.name}` : `@${about.node}`;
      const b = element('button', { textContent: p.name, ariaPressed: String(target === full) });
      b.onclick = () => of.onport(full);
      ports.append(b);
    });
    parts.push(ports);
  }
  parts.push(text('div', 'facts', facts));
  if (node?.broken) parts.push(text('div', 'facts bad', node.broken));
  for (const found of about.fields ?? []) { const made = constant(about.node, found, of); if (made) parts.push(made); }
  // The text may be long, so it can be scrolled by keyboard.
  parts.push(element('pre', { textContent: about.text, tabIndex: 0, role: 'region', ariaLabel: 'Text of the node' }));
  box.replaceChildren(...parts);
}

// The form of a field, without its value.
/** @param {Constant} field */
const formOf = ({ name, text: written, fixed, now, formula, choices }) => [
  name, fixed, formula ? formula.filter((_, i) => i % 2 === 0) : isNumber(written) ? 'number' : isColor(written) ? 'color' : choices?.includes(written) ? 'choice' : written, now === null || now === undefined,
];

// Keeps the values of the file, for the ticks of the fields.
/** @param {string} node @param {Constant} field @param {import('./params.js').Parameters} parameters */
function remember(node, { name, text: written, formula }, parameters) {
  /** @param {FieldEdit} edit */
  const keep = (edit) => { const key = keyOf(edit); if (!parameters.edits.has(key)) parameters.written.set(key, edit.value); };
  if (formula) formula.forEach((value, i) => { if (i % 2) keep({ node, field: name, index: (i - 1) / 2, value }); });
  else keep({ node, field: name, value: written });
}

// A number in the text of a node; it is dragged, typed and reset like a parameter.
/** @param {FieldEdit} edit @param {string} id @param {string} said @param {Pick<Constant, 'min' | 'max' | 'unit' | 'whole'>} about @param {Of} of */
function numeral(edit, id, said, { min, max, unit, whole }, { parameters }) {
  const key = keyOf(edit);
  const written = () => numberOf(parameters.written.get(key) ?? edit.value);
  /** @param {number} n @param {string | null} group */
  const set = (n, group) => parameters.edit({ ...edit, value: String(+n.toPrecision(12)) }, group);
  const made = field({
    id, name: said, unit, whole: !!whole, soft: softRange(written(), min, max, unit),
    onset: (n, how) => set(n, how === 'drag' ? parameters.gesture(key) : how === 'key' ? key : null),
    onhold: () => parameters.hold(key),
    onreset: () => set(written(), null),
  });
  /** @param {string} value */
  const show = (value) => {
    made.show(numberOf(parameters.edits.get(key)?.value ?? value), written());
    made.box.classList.toggle('set', parameters.edits.has(key));
  };
  show(edit.value);
  return { box: made.box, show };
}

// A value of a node. Values that are computed, or that stand in the file of a sub-graph, are only shown.
/** @param {string} node @param {Constant} found @param {Of} of */
function constant(node, found, of) {
  const { name, text: written } = found;
  const id = `field-${name}`;
  const said = name.replaceAll('_', ' ');
  const number = isNumber(written);
  // The value of a computed number.
  const now = found.now ?? (found.fixed && number ? numberOf(written) : null);
  const value = now === null ? null : text('span', 'now');
  /** @param {Constant} f */
  const showNow = (f) => { if (value) say(value, `${short(f.now ?? numberOf(f.text))} ${f.unit ?? ''}`.trim()); };
  showNow(found);
  const head = element('div', { className: 'head' });
  const row = element('div', { className: 'param constant', dataset: { field: name } }, head);
  if (found.formula) {
    if (name) head.append(element('span', { className: 'label', textContent: said, title: found.doc }), value ?? '');
    const parts = found.formula.map((piece, i) => {
      if (i % 2 === 0) return { box: piece, show: null };
      // A number of a formula has no unit: it is one with the others.
      const made = numeral({ node, field: name, index: (i - 1) / 2, value: piece }, `${id}-${i}`, `Number in ${said || node}`, {}, of);
      made.box.classList.add('number');
      const input = made.box.querySelector('input');
      if (input) input.ariaLabel = `Number in ${said || node}`;
      made.box.style.setProperty('--wide', `${Math.max(piece.length, 3) + 3}ch`);
      return made;
    });
    row.append(element('div', { className: 'formula', role: 'group', ariaLabel: `Formula of ${said || node}` }, ...parts.map((part) => part.box)));
    shows.set(name, (f) => { showNow(f); f.formula?.forEach((piece, i) => parts[i]?.show?.(piece)); });
    return row;
  }
  if (found.fixed || now !== null) {
    head.append(element('span', { className: 'label', textContent: said, title: found.doc }), value ?? '');
    if (!number) row.append(element('code', { textContent: written }));
    shows.set(name, showNow);
    return row;
  }
  const made = control(node, found, id, said, of);
  if (!made) return null;
  head.append(element('label', { htmlFor: id, textContent: said, title: found.doc }), made.box);
  shows.set(name, made.show);
  const key = keyOf({ node, field: name, value: '' });
  if (!found.choices?.includes(written)) {
    const make = element('button', { textContent: 'Make parameter', ariaLabel: `Make a parameter of ${name}`, title: 'A parameter of the graph, with a slider here' });
    make.onclick = () => of.onchange({ promote: { node, field: name } }, `Parameter of ${node}: ${name}`);
    // The value of the file becomes the default.
    const settle = () => { make.disabled = of.parameters.edits.has(key); };
    settle();
    shows.set(name, (f) => { made.show(f); settle(); });
    row.append(element('div', { className: 'below' }, text('div', 'doc', found.doc), make));
  } else {
    row.append(element('div', { className: 'below' }, text('div', 'doc', found.doc)));
  }
  return row;
}

/** @param {string} node @param {Constant} found @param {string} id @param {string} said @param {Of} of @returns {{ box: HTMLElement, show: (field: Constant) => void } | null} */
function control(node, found, id, said, of) {
  const { name, text: written } = found;
  const { parameters } = of;
  const edit = { node, field: name, value: written };
  const key = keyOf(edit);
  /** @param {string} value */
  const set = (value) => parameters.edit({ ...edit, value }, key);
  /** @param {Constant} f */
  const wanted = (f) => parameters.edits.get(key)?.value ?? f.text;
  if (isNumber(written)) {
    const made = numeral(edit, id, said, found, of);
    return { box: made.box, show: (f) => made.show(f.text) };
  }
  if (found.choices?.includes(written)) {
    const made = element('select', { id }, ...found.choices.map((c) => element('option', { value: c, textContent: c })));
    made.onchange = () => set(made.value);
    /** @param {Constant} f */
    const show = (f) => { made.value = wanted(f); };
    show(found);
    return { box: made, show };
  }
  if (written === 'true' || written === 'false') {
    const made = element('input', { id, type: 'checkbox' });
    made.onchange = () => set(String(made.checked));
    /** @param {Constant} f */
    const show = (f) => { made.checked = wanted(f) === 'true'; };
    show(found);
    return { box: made, show };
  }
  if (!isColor(written)) return null;
  const made = element('input', { id, type: 'color' });
  // All colours until the picker closes are one step.
  made.oninput = () => {
    if (parameters.held !== key) parameters.hold(key);
    parameters.edit({ ...edit, value: `"${made.value}"` }, parameters.gesture(key));
  };
  made.onchange = () => parameters.release();
  /** @param {Constant} f */
  const show = (f) => { if (parameters.held !== key) made.value = wanted(f).slice(1, -1); };
  show(found);
  return { box: made, show };
}
