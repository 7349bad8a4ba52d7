// @ts-check
// The contact sheet: pictures for the values of two parameters, on the stage. A click enlarges one, and Take sets its values.
import { $, element, notice, short } from './dom.js';
import { bitmap } from './net.js';
import { sent } from './values.js';

// Largest and smallest side of a cell, in pixels of the window; side of an enlarged picture.
const [MOST, LEAST, LARGE] = [240, 56, 512];
/** @typedef {{ param: Param, values: string[] }} Axis */

export class Contact {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    this.turn = 0;
    /** @type {HTMLButtonElement[]} */
    this.cells = [];
    $('contact').addEventListener('keydown', (e) => this.key(/** @type {KeyboardEvent} */ (e)));
  }

  /** @param {Axis} rows @param {Axis} columns */
  async open(rows, columns) {
    this.turn += 1;
    const mine = this.turn;
    const { state, target, shown, parameters } = this.page;
    const box = $('contact');
    const close = element('button', { textContent: 'Close', title: 'Close (Esc)' });
    close.onclick = () => this.close();
    const name = (/** @type {Param} */ p) => p.name.replaceAll('_', ' ');
    const title = element('h2', {}, `${name(rows.param)} down, ${name(columns.param)} across`, element('div', { className: 'spring' }), close);
    box.hidden = false;
    const wide = (box.clientWidth - 90) / columns.values.length;
    const high = (box.clientHeight - 110) / rows.values.length;
    const side = Math.round(Math.min(Math.max(Math.min(wide, high) - 6, LEAST), MOST));
    const grid = element('div', { className: 'cells', role: 'group', ariaLabel: 'Variations' });
    grid.style.gridTemplateColumns = `auto repeat(${columns.values.length}, ${side}px)`;
    /** @type {(axis: Axis, value: string) => string} */
    const text = ({ param }, value) => (Number.isFinite(+value) && param.type !== 'Choice' ? short(+value) : value.replaceAll('"', ''));
    grid.append(element('span'), ...columns.values.map((value) => element('span', { textContent: text(columns, value) })));
    this.columns = columns.values.length;
    this.cells = [];
    /** @type {{ canvas: HTMLCanvasElement, set: [string, string][] }[]} */
    const wanted = [];
    for (const row of rows.values) {
      grid.append(element('span', { textContent: text(rows, row) }));
      for (const column of columns.values) {
        const canvas = element('canvas', { width: side * 2, height: side * 2 });
        const said = `${name(rows.param)} ${text(rows, row)}, ${name(columns.param)} ${text(columns, column)}`;
        const cell = element('button', { ariaLabel: said, title: said, tabIndex: this.cells.length ? -1 : 0 }, canvas);
        /** @type {[string, string][]} */
        const set = [[rows.param.name, row], [columns.param.name, column]];
        cell.onclick = () => this.enlarge(cell, set, said);
        this.cells.push(cell);
        wanted.push({ canvas, set });
        grid.append(cell);
      }
    }
    const holder = element('div', { className: 'holder' }, grid);
    box.replaceChildren(title, holder);
    this.cells[0].focus();
    this.ask = { g: state.scene.generation, t: target, range: shown?.range ?? [0, 1], values: parameters.values };
    for (const { canvas, set } of wanted) {
      const image = await this.picture(set, side * 2);
      if (mine !== this.turn) { image?.close(); return; }
      if (!image) continue;
      fill(canvas, image);
      canvas.dataset.drawn = 'yes';
    }
    box.dataset.done = String(this.turn);
  }

  // All pictures have the black and white values of the shown one, so that equal depths look equal.
  /** @param {[string, string][]} set @param {number} s */
  picture(set, s) {
    const { g, t, range, values } = /** @type {NonNullable<typeof this.ask>} */ (this.ask);
    const all = [...values.set].filter(([name]) => !set.some(([other]) => other === name));
    return bitmap('vary', { g, t, v: JSON.stringify(sent({ ...values, set: [...all, ...set] })), lo: range[0], hi: range[1], s: Math.min(s, LARGE) }).catch(() => null);
  }

  // Shows one picture large. Its values are set only by Take.
  /** @param {HTMLButtonElement} cell @param {[string, string][]} set @param {string} said */
  async enlarge(cell, set, said) {
    const box = $('contact');
    box.querySelector('.large')?.remove();
    const canvas = element('canvas', { width: LARGE, height: LARGE });
    fill(canvas, /** @type {HTMLCanvasElement} */ (cell.firstElementChild));
    const take = element('button', { className: 'go', textContent: 'Take', title: 'Set these values' });
    const back = element('button', { textContent: 'Back', title: 'Back to the sheet (Esc)' });
    take.onclick = () => this.take(set, said);
    back.onclick = () => { large.remove(); cell.focus(); };
    const large = element('div', { className: 'large' }, canvas, element('div', { className: 'row' }, element('span', { textContent: said }), element('div', { className: 'spring' }), back, take));
    box.append(large);
    take.focus();
    const image = await this.picture(set, LARGE);
    if (image && large.isConnected) fill(canvas, image);
    image?.close();
  }

  /** @param {[string, string][]} set @param {string} said */
  take(set, said) {
    const { parameters } = this.page;
    for (const [name, value] of set) parameters.set.set(name, value);
    parameters.tell(said);
    this.close();
    notice(said);
  }

  close() {
    this.turn += 1;
    $('contact').hidden = true;
    $('contact').replaceChildren();
    $('sheet-make').focus();
  }

  /** @param {KeyboardEvent} e */
  key(e) {
    const large = /** @type {HTMLElement | null} */ ($('contact').querySelector('.large'));
    const at = this.cells.indexOf(/** @type {HTMLButtonElement} */ (document.activeElement));
    const to = { ArrowRight: at + 1, ArrowLeft: at - 1, ArrowDown: at + (this.columns ?? 1), ArrowUp: at - (this.columns ?? 1) }[e.key];
    if (e.key === 'Escape') { if (large) /** @type {HTMLElement | null} */ (large.querySelector('button'))?.click(); else this.close(); }
    else if (to !== undefined && at >= 0 && this.cells[to]) { this.cells[at].tabIndex = -1; this.cells[to].tabIndex = 0; this.cells[to].focus(); }
    else return;
    e.preventDefault();
    e.stopPropagation();
  }
}

// Draws a whole picture into a canvas.
/** @param {HTMLCanvasElement} canvas @param {ImageBitmap | HTMLCanvasElement} image */
function fill(canvas, image) {
  const k = Math.min(canvas.width / image.width, canvas.height / image.height);
  const c = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
  c.imageSmoothingQuality = 'high';
  c.clearRect(0, 0, canvas.width, canvas.height);
  c.drawImage(image, (canvas.width - image.width * k) / 2, (canvas.height - image.height * k) / 2, image.width * k, image.height * k);
}
