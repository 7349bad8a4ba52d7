// @ts-check
// The export panel: this map, all maps, or files for another program, at a chosen resolution.
import { $, element, short } from './dom.js';
import { exported, formats, post, targets } from './net.js';
import { frames, zip } from './frames.js';
import { html } from './share.js';

const SIZES = [256, 512, 1024, 2048, 4096, 8192];

export class Exporter {
  /** @param {HTMLElement} root @param {Page} page */
  constructor(root, page) {
    this.root = root;
    this.page = page;
    /** @type {string | null} */
    this.id = null;
    /** @type {ExportNews[] | undefined} */
    this.early = undefined;
    this.stopped = false;
    this.begin = element('button', { id: 'export-begin', textContent: 'Export' });
    this.cancel = element('button', { id: 'export-cancel', textContent: 'Cancel', hidden: true });
    this.bar = element('progress', { max: 1, value: 0, hidden: true, ariaLabel: 'Progress of the export' });
    this.note = element('p', { className: 'doc', id: 'export-note', role: 'status' });
    this.share = element('button', { id: 'share', textContent: 'Share 3D view', title: 'One HTML file with the material in light, which opens without Shibo' });
    this.film = element('button', { id: 'turntable', textContent: 'Turntable', title: 'The 3D view as 36 pictures: a turn, or the line of a comparison' });
    this.build();
  }

  build() {
    /** @type {(id: string, text: string, options: [string | number, string][]) => [HTMLSelectElement, ...HTMLElement[]]} */
    const select = (id, text, options) => {
      const made = element('select', { id }, ...options.map(([value, name]) => element('option', { value, textContent: name })));
      return [made, element('label', { htmlFor: id, textContent: text }), made];
    };
    const [what, ...whatRow] = select('export-what', 'What', [['map', 'This map'], ['maps', 'All maps']]);
    const about = element('p', { className: 'doc' });
    this.sets(what, about);
    const [size, ...sizeRow] = select('export-size', 'Resolution', [['', 'as in the graph'], ...SIZES.map((n) => /** @type {[number, string]} */ ([n, `${n} px`]))]);
    const [format, ...formatRow] = select('export-format', 'Format', [['', 'as in the graph'], ...formats.map((name) => /** @type {[string, string]} */ ([name, name.toUpperCase()]))]);
    this.share.onclick = () => this.shared();
    this.film.onclick = () => this.sequence();
    this.begin.onclick = () => this.start(what.value, size.value, format.value);
    this.cancel.onclick = () => { this.stopped = true; if (this.id) post(`export/${this.id}/stop`, {}); };
    this.root.replaceChildren(
      element('div', { className: 'fields' }, ...whatRow, ...sizeRow, ...formatRow), about,
      element('div', { className: 'row' }, this.begin, this.cancel), element('div', { className: 'row' }, this.share, this.film), this.bar, this.note,
    );
  }

  // Adds the formats for other programs to the menu; `about` describes the chosen one.
  /** @param {HTMLSelectElement} menu @param {HTMLElement} about */
  async sets(menu, about) {
    const found = await targets().catch(() => []);
    const group = element('optgroup', { label: 'Materials for another program' }, ...found.map(({ name }) => element('option', { value: name, textContent: name })));
    if (found.length) menu.append(group);
    const docs = new Map(found.map(({ name, doc }) => [name, doc]));
    menu.onchange = () => {
      about.textContent = docs.get(menu.value) ?? '';
      // These formats say themselves what their files are.
      /** @type {HTMLSelectElement} */ ($('export-format')).disabled = docs.has(menu.value);
    };
  }

  // Exports the lit view as an HTML file.
  async shared() {
    const { lit, state } = this.page;
    if (!lit.asked) { this.page.controls.setView('lit'); }
    if (!lit.asked) { this.note.textContent = 'There is nothing in light yet.'; return; }
    this.share.disabled = true;
    this.note.textContent = 'Putting the file together …';
    try {
      const blob = new Blob([await html(lit, state.file)], { type: 'text/html' });
      this.save(blob, `${state.file.replace(/\.ron$/, '')}.html`);
    } catch {
      this.note.textContent = 'The graph has changed meanwhile; try again.';
    }
    this.share.disabled = false;
  }

  // Exports a turn of the shape as a sequence of pictures.
  async sequence() {
    const { lit, state } = this.page;
    if (!lit.now) this.page.controls.setView('lit');
    if (!lit.now) { this.note.textContent = 'There is nothing in light yet.'; return; }
    this.busy(true);
    this.stopped = false;
    const made = await frames(lit, 36, 1024, (share) => { this.bar.value = share; return !this.stopped; });
    this.busy(false);
    if (made) this.save(zip(made), `${state.file.replace(/\.ron$/, '')}_frames.zip`); else this.note.textContent = 'Cancelled';
  }

  /** @param {Blob} blob @param {string} name */
  save(blob, name) {
    const link = element('a', { href: URL.createObjectURL(blob), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
    this.note.textContent = `${name}, ${short(blob.size / 1048576)} MiB`;
  }

  /** @param {string} what @param {string} size @param {string} format */
  async start(what, size, format) {
    const { state, target } = this.page;
    if (!state?.scene || this.id) return;
    /** @type {Record<string, unknown>} */
    const wish = { g: state.scene.generation };
    if (what === 'map') wish.target = target;
    else if (what !== 'maps') wish.set = what;
    if (size) wish.resolution = +size;
    if (format && !wish.set) wish.format = format;
    this.busy(true);
    this.note.textContent = 'Rendering …';
    this.early = [];
    const answer = await post('export', wish).catch(() => null);
    if (answer?.status !== 200) {
      this.busy(false);
      this.note.textContent = answer ? (await answer.text()) || 'Too much is being made at the moment; try again.' : 'Not connected.';
      return;
    }
    this.id = (await answer.json()).id;
    // The export may have finished before the answer arrived.
    for (const news of this.early) this.heard(news);
  }

  /** @param {boolean} on */
  busy(on) {
    this.begin.disabled = on;
    this.cancel.hidden = this.bar.hidden = !on;
    this.bar.removeAttribute('value');
    if (!on) this.id = null;
  }

  /** @param {ExportNews} news */
  heard(news) {
    if (!this.id) { this.early?.push(news); return; }
    if (news.id !== this.id) return;
    if (news.state === 'running') { this.bar.value = news.done / Math.max(1, news.total); return; }
    const { id } = this;
    this.busy(false);
    this.root.dataset.last = news.state;
    if (news.state === 'done') {
      this.note.textContent = `${news.name}, ${short(news.bytes / 1048576)} MiB`;
      const link = element('a', { href: exported(id), download: news.name });
      this.root.append(link);
      link.click();
      link.remove();
    } else {
      this.note.textContent = news.state === 'cancelled' ? 'Cancelled' : news.message;
    }
  }
}
