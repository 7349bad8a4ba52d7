// @ts-check
// A sheet of variations: a parameter over its range, or several seeds; a click chooses one. Two parameters fill the stage.
import { element, isShown, notice, short } from './dom.js';
import { bitmap } from './net.js';
import { sent } from './values.js';

const SIZE = 120;
// The most values of each of two parameters.
const ACROSS = 9;

export class Sheet {
  /** @param {HTMLElement} root @param {Page} page */
  constructor(root, page) {
    this.root = root;
    this.page = page;
    this.turn = 0;
    /** @type {import('./contact.js').Contact | undefined} */
    this.contact = undefined;
    this.param = element('select', { id: 'sheet-param' });
    this.second = element('select', { id: 'sheet-second' });
    this.count = element('select', { id: 'sheet-count' }, ...[4, 6, 9, 12, 16].map((n) => element('option', { value: n, textContent: n, selected: n === 9 })));
    this.make = element('button', { id: 'sheet-make', textContent: 'Make sheet' });
    this.make.onclick = () => this.run();
    this.grid = element('div', { className: 'sheet' });
    this.note = element('p', { className: 'doc', textContent: 'Pictures of what is shown, one for each value; click one to take it. With a second parameter, the sheet fills the stage.' });
    root.replaceChildren(
      element('div', { className: 'fields' },
        element('label', { htmlFor: 'sheet-param', textContent: 'Parameter' }), this.param,
        element('label', { htmlFor: 'sheet-second', textContent: 'And' }), this.second,
        element('label', { htmlFor: 'sheet-count', textContent: 'How many' }), this.count),
      element('div', { className: 'row' }, this.make), this.note, this.grid,
    );
  }

  // Offers parameters that have a range or options, or are integers such as seeds.
  show() {
    const params = this.page.parameters.params.filter((p) => p.range || p.options.length || p.type === 'Integer' || p.type === 'Bool');
    const { value } = this.param;
    this.param.replaceChildren(...params.map((p) => element('option', { value: p.name, textContent: p.name.replaceAll('_', ' '), selected: p.name === value })));
    const second = this.second.value;
    this.second.replaceChildren(element('option', { value: '', textContent: 'no second one' }), ...params.map((p) => element('option', { value: p.name, textContent: p.name.replaceAll('_', ' '), selected: p.name === second })));
    this.make.disabled = !params.length;
    if (!params.length) this.note.textContent = 'The graph has no parameter with a range.';
  }

  stale() { if (isShown(this.root)) this.show(); }

  /** @param {Param} param @param {number} count */
  values(param, count) {
    if (param.type === 'Bool') return ['false', 'true'];
    if (param.options.length) return param.options.slice(0, count);
    const whole = param.type === 'Integer';
    if (/seed/i.test(param.name) || !param.range) {
      const [lo, hi] = param.range ?? [0, 2 ** 31];
      const start = Math.min(Math.max(lo, +param.value), hi - count + 1);
      return Array.from({ length: count }, (_, i) => String(Math.max(lo, start) + i));
    }
    const [lo, hi] = param.range;
    const list = Array.from({ length: count }, (_, i) => lo + ((hi - lo) * i) / (count - 1));
    return [...new Set(list.map((v) => (whole ? String(Math.round(v)) : String(+v.toPrecision(4)))))];
  }

  // Two parameters: a sheet on the stage, with all pairs of their values.
  /** @param {Param} param @param {Param} second */
  async cross(param, second) {
    const { Contact } = await import('./contact.js');
    this.contact ??= new Contact(this.page);
    const count = Math.min(+this.count.value, ACROSS);
    await this.contact.open({ param, values: this.values(param, count) }, { param: second, values: this.values(second, count) });
  }

  async run() {
    const { page } = this;
    const param = page.parameters.params.find((p) => p.name === this.param.value);
    if (!param || !page.state?.scene) return;
    const second = page.parameters.params.find((p) => p.name === this.second.value && p !== param);
    if (second) { await this.cross(param, second); return; }
    this.turn += 1;
    const mine = this.turn;
    const { values } = page.parameters;
    const cells = this.values(param, +this.count.value).map((value) => {
      const canvas = element('canvas', { width: SIZE, height: SIZE });
      const text = Number.isFinite(+value) && param.type !== 'Choice' ? short(+value) : value;
      const button = element('button', { className: 'look', title: `${param.name} ${value}` }, canvas, element('span', { textContent: text }));
      button.onclick = () => { page.parameters.change(param.name, value, null); notice(`${param.name} ${text}`); };
      return { value, canvas, button };
    });
    this.grid.replaceChildren(...cells.map((c) => c.button));
    for (const { value, canvas } of cells) {
      const set = [...values.set].filter(([name]) => name !== param.name);
      const wish = JSON.stringify(sent({ ...values, set: [...set, [param.name, value]] }));
      // All variations use the black and white values of the shown picture, so that equal depths look equal.
      const [lo, hi] = page.shown?.range ?? [0, 1];
      const image = await bitmap('vary', { g: page.state.scene.generation, t: page.target, v: wish, lo, hi }).catch(() => null);
      if (mine !== this.turn) { image?.close(); return; }
      if (!image) continue;
      const k = SIZE / Math.max(image.width, image.height);
      /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d')).drawImage(image, (SIZE - image.width * k) / 2, (SIZE - image.height * k) / 2, image.width * k, image.height * k);
      canvas.dataset.drawn = value;
      image.close();
    }
    this.grid.dataset.done = String(this.turn);
  }
}
