// @ts-check
// The library: all shipped graphs, with pictures and a search.
import { element } from './dom.js';
import { PICTURES } from './pictures.js';

export class Library {
  /** @param {HTMLDialogElement} dialog @param {(name: string) => void} onchoose */
  constructor(dialog, onchoose) {
    this.dialog = dialog;
    this.onchoose = onchoose;
    /** @type {{ name: string, doc: string, part: boolean }[]} */
    this.graphs = [];
    // With sub-graphs.
    /** @type {Set<string>} */
    this.names = new Set();
    this.search = element('input', { type: 'search', placeholder: 'Search graphs', ariaLabel: 'Search graphs', autocomplete: 'off', spellcheck: false });
    this.list = element('div', { className: 'cards' });
    this.count = element('p', { className: 'doc', role: 'status' });
    const close = element('button', { textContent: 'Close' });
    close.onclick = () => dialog.close();
    dialog.replaceChildren(element('div', { className: 'row top' }, element('h2', { id: 'library-title', textContent: 'Library' }), this.search, close), this.count, this.list);
    dialog.setAttribute('aria-labelledby', 'library-title');
    this.search.oninput = () => this.filter();
  }

  /** @param {{ name: string, doc: string, part: boolean }[]} graphs */
  follow(graphs) {
    this.names = new Set(graphs.map((graph) => graph.name));
    this.graphs = graphs.filter((graph) => !graph.part);
    this.list.replaceChildren();
    if (this.dialog.open) this.build();
  }

  open() {
    if (!this.list.children.length) this.build();
    this.dialog.showModal();
    this.search.select();
    this.search.focus();
  }

  // Pictures are loaded when they come into view.
  build() {
    this.list.replaceChildren(...this.graphs.map(({ name, doc }) => {
      const picture = PICTURES.includes(name) ? element('img', { src: `../docs/gallery/${name}.png`, alt: '', loading: 'lazy', width: 132, height: 132 }) : element('span', { className: 'none', ariaHidden: 'true', textContent: name.slice(0, 2) });
      const card = element('button', { className: 'card', title: doc, dataset: { graph: name } }, picture, element('b', { textContent: name.replaceAll('_', ' ') }), element('span', { className: 'doc', textContent: first(doc) }));
      card.onclick = () => { this.dialog.close(); this.onchoose(name); };
      return card;
    }));
    this.filter();
  }

  filter() {
    const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const [i, card] of [.../** @type {Iterable<HTMLElement>} */ (this.list.children)].entries()) {
      const { name, doc } = this.graphs[i];
      const text = `${name} ${doc}`.toLowerCase();
      card.hidden = !words.every((word) => text.includes(word));
      if (!card.hidden) shown += 1;
    }
    this.count.textContent = `${shown} of ${this.graphs.length} graphs`;
  }
}

// The first sentence of a description.
/** @param {string} doc */
const first = (doc) => (/^.*?[.:;](?=\s|$)/s.exec(doc)?.[0] ?? doc).replace(/[.:;]$/, '');
