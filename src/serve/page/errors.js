// @ts-check
// Lists of errors and warnings of the file.
import { $, element } from './dom.js';

/** @type {(tag: keyof HTMLElementTagNameMap, className: string, content?: string) => HTMLElement} */
const text = (tag, className, content = '') => element(tag, { className, textContent: content });

/** @type {(className: string) => (e: Complaint) => [Complaint, string]} */
const named = (className) => (e) => [e, className];

// The list that the user closed; it stays closed until it changes.
let closed = '';

/** @param {State} state */
export function complain({ errors, warnings, scene }) {
  const box = $('errors');
  /** @type {[Complaint, string][]} */
  const list = [...errors.map(named('error')), ...(errors.length ? [] : warnings.map(named('error warning')))];
  const now = JSON.stringify(list.map(([e]) => [e.message, e.file, e.line]));
  document.documentElement.dataset.errors = String(errors.length);
  if (now !== closed) closed = '';
  box.hidden = !list.length || now === closed;
  if (box.hidden) return;
  const many = list.length > 1 ? 's' : '';
  const title = text('h2', '', errors.length ? `${list.length} error${many}` : 'Worth knowing');
  if (errors.length && scene) title.append(text('span', '', 'what you see is the last good result'));
  const more = text('button', '', 'More');
  more.ariaPressed = 'false';
  more.onclick = () => { more.ariaPressed = String(box.classList.toggle('tall')); };
  const close = element('button', { textContent: '✕', ariaLabel: 'Close' });
  close.onclick = () => { closed = now; box.hidden = true; box.classList.remove('tall'); };
  title.append(text('div', 'spring'), more, close);
  box.replaceChildren(title, ...list.map(([e, className]) => complaint(e, className)));
}

/** @param {Complaint} e @param {string} className */
function complaint(e, className) {
  const made = text('div', className);
  made.append(text('p', '', e.message));
  const pre = text('pre', '');
  for (const { n, text: content } of e.lines) {
    const at = n === e.line;
    const line = text('div', at ? 'at' : 'other');
    line.append(text('b', '', String(n)));
    if (at) {
      const chars = [...content];
      const end = e.end_line === e.line ? Math.max(e.end_column, e.column + 1) : chars.length + 1;
      line.append(chars.slice(0, e.column - 1).join(''), text('mark', '', chars.slice(e.column - 1, end - 1).join('') || ' '), chars.slice(end - 1).join(''));
    } else {
      line.append(content);
    }
    pre.append(line);
  }
  // The faulty line comes right after the message: the closed box has room for no more.
  made.append(pre, text('div', 'where', `${e.file}:${e.line}:${e.column}   ${e.code}`));
  if (e.help) made.append(text('div', 'help', e.help));
  for (const r of e.related) made.append(text('div', 'where', `${r.file}:${r.line}:${r.column}   ${r.message}`));
  return made;
}
