// @ts-check
// The list of the folder's graphs: a click shows another graph on this page.
import { $, element, notice } from './dom.js';
import { graphs, openGraph } from './net.js';

/** @param {Page} page */
export async function chooseGraph(page) {
  const box = $('graphs');
  const find = element('input', { type: 'search', id: 'graphs-find', placeholder: 'Find a graph', ariaLabel: 'Find a graph', autocomplete: 'off', spellcheck: false });
  const list = element('ul', { className: 'list' });
  const warning = element('p', { className: 'doc', role: 'status' });
  const close = element('button', { textContent: 'Close' });
  close.onclick = () => box.close();
  box.replaceChildren(element('h2', { id: 'graphs-title', textContent: 'Graphs of this folder' }), find, warning, list, element('div', { className: 'row' }, element('div', { className: 'spring' }), close));
  if (!box.open) box.showModal();
  const found = await graphs().catch(() => null);
  if (!found) { warning.textContent = 'The list cannot be read: is `shibo watch` running?'; return; }
  const unsaved = page.parameters.byHand;
  if (unsaved) warning.textContent = `Not in the file, and lost by a switch: ${unsaved}`;
  const rows = found.names.map((name) => {
    const made = element('button', { textContent: name, value: name, ariaPressed: String(name === found.shown) });
    made.onclick = async () => {
      if (name === found.shown) { box.close(); return; }
      const answer = await openGraph(name).catch(() => null);
      if (answer?.ok) box.close(); else notice(`${name} cannot be opened`, true);
    };
    return element('li', {}, made);
  });
  list.replaceChildren(...rows);
  const buttons = () => rows.filter((row) => !row.hidden).map((row) => /** @type {HTMLButtonElement} */ (row.firstElementChild));
  find.oninput = () => {
    const text = find.value.trim().toLowerCase();
    for (const row of rows) row.hidden = !(row.textContent ?? '').toLowerCase().includes(text);
  };
  // Arrows go through the list, also from the field above it; Enter there takes the first one.
  box.onkeydown = (e) => {
    const all = buttons();
    const at = all.indexOf(/** @type {HTMLButtonElement} */ (document.activeElement));
    const by = { ArrowDown: 1, ArrowUp: -1 }[e.key];
    if (by && all.length) { e.preventDefault(); all[Math.min(Math.max(at + by, 0), all.length - 1)].focus(); }
    if (e.key === 'Enter' && document.activeElement === find) { e.preventDefault(); all[0]?.click(); }
  };
}
