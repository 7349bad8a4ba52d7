// @ts-check
// Nine slots that keep looks: values with their pictures. A kept look is taken again, or compared with the present one.
import { element, notice, press } from './dom.js';
import { bitmap } from './net.js';
import { same } from './values.js';

const COUNT = 9;
const SIZE = 84;
/** @typedef {{ values: Values, pictures: Record<string, Shown>, canvas: HTMLCanvasElement | null }} Slot */

export class Slots {
  /** @param {HTMLElement} root @param {Page} page */
  constructor(root, page) {
    this.page = page;
    /** @type {(Slot | null)[]} */
    this.slots = Array.from({ length: COUNT }, () => null);
    this.mode = 'take';
    this.modes = element('div', { className: 'segments', role: 'group', ariaLabel: 'A click on a kept look' });
    for (const [mode, text, title] of [['take', 'Take', 'Its values are set'], ['compare', 'Compare', 'Its picture stands beside the present one'], ['clear', 'Empty', 'The slot is emptied']]) {
      const made = element('button', { value: mode, textContent: text, title });
      made.onclick = () => { this.mode = mode; this.draw(); };
      this.modes.append(made);
    }
    this.row = element('div', { className: 'slots', role: 'group', ariaLabel: 'Slots' });
    root.replaceChildren(
      element('p', { className: 'doc', textContent: 'A click on an empty slot keeps the present look, a click on a kept one brings it back (Shift+1 … 9).' }),
      this.row, element('div', { className: 'row' }, this.modes),
    );
    this.draw();
  }

  // Keeps the present look in an empty slot; takes or compares a kept one.
  /** @param {number} number */
  use(number) {
    const slot = this.slots[number - 1];
    if (!slot) this.keep(number);
    else if (this.mode === 'clear') { this.slots[number - 1] = null; notice(`Slot ${number} is empty`); }
    else if (this.mode === 'compare') this.compare(number, slot);
    else this.take(number, slot);
    this.draw();
  }

  /** @param {number} number */
  keep(number) {
    const { picture, parameters, looks } = this.page;
    if (!looks.at || !picture.bitmap) { notice('There is no picture to keep yet', true); return; }
    const canvas = element('canvas', { width: SIZE, height: SIZE });
    const image = picture.bitmap;
    const k = Math.max(SIZE / image.width, SIZE / image.height);
    /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d')).drawImage(image, (SIZE - image.width * k) / 2, (SIZE - image.height * k) / 2, image.width * k, image.height * k);
    this.slots[number - 1] = { values: parameters.values, pictures: { ...looks.at.pictures }, canvas };
    notice(`Kept in slot ${number}`);
  }

  /** @param {number} number @param {Slot} slot */
  take(number, { values }) {
    const { parameters } = this.page;
    if (same(values, parameters.values)) return;
    parameters.take(values);
    parameters.tell(`Slot ${number}`);
  }

  /** @param {number} number @param {Slot} slot */
  async compare(number, { pictures }) {
    const { picture, target, controls } = this.page;
    const now = pictures[target];
    const image = now && await bitmap(now.picture).catch(() => null);
    if (!image) { notice(`${target} is not kept in slot ${number}`, true); return; }
    Object.assign(picture.comparison, { before: { image, range: now.range, type: now.type, unit: now.unit, label: `slot ${number}` }, after: null });
    controls.compared();
    this.page.sharpen();
  }

  draw() {
    press(this.modes, (b) => /** @type {HTMLButtonElement} */ (b).value === this.mode);
    const { activeElement } = document;
    const focused = [...this.row.children].findIndex((b) => b === activeElement);
    this.row.replaceChildren(...this.slots.map((slot, i) => {
      const on = !!slot && same(slot.values, this.page.parameters.values);
      const made = element('button', { ariaPressed: String(on), ariaLabel: `Slot ${i + 1}, ${slot ? 'kept' : 'empty'}`, title: `Slot ${i + 1} (Shift+${i + 1})` }, slot?.canvas, element('span', { textContent: String(i + 1) }));
      made.onclick = () => this.use(i + 1);
      return made;
    }));
    if (focused >= 0) /** @type {HTMLElement} */ (this.row.children[focused]).focus();
  }
}
