// @ts-check
// The connection to the server. While it is lost, a banner names the unsaved values; afterwards the values are sent
// again.
import { $, element, notice } from './dom.js';
import { moved } from './net.js';
import { same } from './values.js';

// A shorter loss is not told, in ms.
const PATIENCE = 600;
// Time between two questions whether the server has another address now, in ms.
const ASK = 2000;

export class Connection {
  /** @param {Page} page @param {(values: Values) => void} send */
  constructor(page, send) {
    this.page = page;
    this.send = send;
    this.lost = false;
    /** @type {number | undefined} */
    this.soon = undefined;
    /** @type {number | undefined} */
    this.asking = undefined;
  }

  lose() {
    if (this.lost) return;
    this.lost = true;
    this.soon = setTimeout(() => this.tell(), PATIENCE);
  }

  // Handles the first state after a loss. Values that the page alone knows are sent again.
  /** @param {Values} values */
  find(values) {
    if (!this.lost) return;
    this.lost = false;
    clearTimeout(this.soon);
    clearInterval(this.asking);
    if (!$('offline').hidden) notice('Connected again');
    $('offline').hidden = true;
    const { parameters } = this.page;
    const own = parameters.values;
    if (same(own, values)) return;
    if (!parameters.count && !own.preset) return;
    parameters.settle(4000);
    this.send(own);
  }

  tell() {
    const { state, parameters } = this.page;
    const unsaved = parameters.byHand;
    const copy = element('button', { id: 'offline-copy', textContent: 'Copy as RON', title: 'The lines to put into the graph file' });
    copy.onclick = () => parameters.copy(copy);
    const why = element('p', { textContent: '`shibo watch` has ended, or cannot be reached. The page connects again by itself when it runs again at this address.' });
    $('offline').replaceChildren(
      element('h2', { textContent: 'Connection lost' }), why,
      element('p', { className: 'unsaved', textContent: unsaved ? `Unsaved: ${unsaved}` : `Nothing is unsaved${state ? ` in ${state.file}` : ''}.` }),
      ...(unsaved ? [copy] : []),
    );
    $('offline').hidden = false;
    this.asking = setInterval(() => this.ask(why), ASK);
  }

  // A run without `--port`, or of another user, has another address.
  /** @param {HTMLElement} why */
  async ask(why) {
    if (await moved()) why.textContent = '`shibo watch` runs again, at another address: it is on its terminal. With --port, the address stays.';
  }
}
