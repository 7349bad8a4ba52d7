// @ts-check
// History of looks: each changed value and each save is a step that can be undone, redone, restored and compared.
import { $, element, isShown, notice } from './dom.js';
import { change } from './net.js';
import { same, sent } from './values.js';

const MOST = 200;
// Keys that step a value within this time are one step, in ms.
const REST = 900;
const SIZE = 84;
export class Looks {
  // `apply` sets values; `compare` shows two steps together; `settle` waits until values on their way to the server have
  // arrived.
  /**
   * @param {HTMLElement} root
   * @param {{ apply: (values: Values, tell: boolean) => void, compare: (steps: Look[] | null) => void, settle: () => Promise<unknown> }} on
   */
  constructor(root, { apply, compare, settle }) {
    this.root = root;
    this.apply = apply;
    this.compare = compare;
    this.settle = settle;
    /** @type {Look[]} */
    this.steps = [];
    /** @type {Look | null} */
    this.at = null;
    /** @type {string | null} */
    this.sha = null;
    // The content before the last write, until a state of the new one has come.
    /** @type {string | null} */
    this.replaced = null;
    /** @type {Promise<void>} */
    this.turns = Promise.resolve();
    /** @type {Look[]} */
    this.marked = [];
    this.touched = 0;
    this.writing = false;
    /** @type {State | undefined} */
    this.last = undefined;
    /** @type {number | undefined} */
    this.known = undefined;
    /** @type {Look | null} */
    this.late = null;
    /** @type {number | undefined} */
    this.soon = undefined;
    $('undo').onclick = () => this.undo();
    $('redo').onclick = () => this.redo();
  }

  /** @param {Omit<Look, 'parent' | 'pictures' | 'number'>} step */
  add(step) {
    this.steps.push({ ...step, parent: this.at, pictures: {}, number: (this.steps.at(-1)?.number ?? 0) + 1 });
    const made = /** @type {Look} */ (this.steps.at(-1));
    if (this.at) this.at.next = made;
    if (this.steps.length > MOST) { const gone = this.steps.shift() ?? null; for (const s of this.steps) if (s.parent === gone) s.parent = null; }
    this.at = made;
    this.draw();
  }

  // Records values set by the user. A drag of one control is one step, however long it takes: its group has a number.
  /** @param {Values} values @param {string} label @param {string | null} group */
  record(values, label, group) {
    const now = Date.now();
    // A value that is set again, or that a limit brings back, is no step.
    if (this.at && same(values, this.at.values)) return;
    if (group && this.at?.group === group && (group.includes(' #') || now - this.touched < REST)) {
      Object.assign(this.at, { values, label });
      this.draw();
    } else {
      this.add({ values, label, group, sha: this.sha });
    }
    this.touched = now;
  }

  // Corrects the values of the present step after a refusal; a step that then changes nothing is no step.
  /** @param {Values} values */
  correct(values) {
    const { at } = this;
    if (!at) return;
    at.values = values;
    if (at.parent && !at.own && !at.external && same(values, at.parent.values) && this.steps.at(-1) === at) {
      this.steps.pop();
      this.at = at.parent;
      delete this.at.next;
    }
    this.draw();
  }

  // Changes the file as one step. The resulting content counts as the user's own.
  /** @param {unknown} what @param {Values} values @param {string} label */
  async save(what, values, label) {
    const sha = await this.write(what, values);
    this.add({ values, label, sha, own: true });
  }

  /** @param {unknown} what @param {Values} values */
  async write(what, values) {
    this.writing = true;
    try {
      await this.settle();
      const replaced = this.sha;
      this.sha = await change(replaced, what, sent(values));
      this.replaced = replaced;
      return this.sha;
    } finally {
      this.writing = false;
      if (this.last) this.seen(this.last);
    }
  }

  // Handles the shown state: a step for the first content and for a save by another program; otherwise only pictures
  // change.
  /** @param {State} state */
  seen(state) {
    this.last = state;
    const { scene, values } = state;
    // Until the answer arrives, the author of a content is unknown, and an old content may still be on its way.
    if (!scene || this.writing || scene.generation === this.known) return;
    this.known = scene.generation;
    // States of the content before a write may come until the first state of the new one.
    if (scene.sha256 === this.sha) this.replaced = null;
    if (!this.at) {
      this.sha = scene.sha256;
      this.add({ values, label: 'Opened', sha: scene.sha256 });
    } else if (scene.sha256 !== this.sha && scene.sha256 !== this.replaced) {
      this.sha = scene.sha256;
      // Texts that an editor sends while it follows are one step.
      const label = state.unsaved ? 'Typed' : 'File saved';
      if (state.unsaved && this.at.label === label) this.at.sha = this.sha;
      // The server may not yet use values that were just set here.
      else this.add({ values: this.at.values, label, sha: this.sha, external: true });
    }
  }

  // Adds a picture of the current look; its thumbnail is made once pictures stop arriving in quick succession.
  /** @param {Shown} now @param {ImageBitmap} image */
  shown(now, image) {
    if (!this.at) return;
    this.at.pictures[now.target] = now;
    this.at.target = now.target;
    const { at } = this;
    clearTimeout(this.soon);
    if (this.late && this.late !== at) this.late.paint?.();
    this.late = at;
    at.paint = () => { this.late = null; this.thumbnail(at, image); };
    this.soon = setTimeout(() => { at.paint?.(); this.draw(); }, 120);
  }

  /** @param {Look} step @param {ImageBitmap} image */
  thumbnail(step, image) {
    // A released image has no size.
    if (!image.width) return;
    const canvas = step.canvas ??= element('canvas', { width: SIZE, height: SIZE });
    const k = Math.max(SIZE / image.width, SIZE / image.height);
    const c = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    c.imageSmoothingQuality = 'high';
    c.drawImage(image, (SIZE - image.width * k) / 2, (SIZE - image.height * k) / 2, image.width * k, image.height * k);
  }

  /** @param {Record<string, Shown>} all */
  pictures(all) { if (this.at) Object.assign(this.at.pictures, all); }

  get canUndo() { return !!this.before(); }

  // The step to which undo leads; saves by other programs are not undone.
  before() {
    let { at } = this;
    while (at?.external && at.parent && same(at.values, at.parent.values)) at = at.parent;
    return at?.parent ?? null;
  }

  // Undo and redo begin when the one before has ended, however fast the keys follow each other.
  /** @param {() => Promise<void>} work */
  turn(work) {
    this.turns = this.turns.then(work);
    return this.turns;
  }

  undo() { return this.turn(() => this.back()); }

  redo() { return this.turn(() => this.forth()); }

  async back() {
    const to = this.before();
    if (!to) return;
    // `to` lies above the present step.
    let from = /** @type {Look} */ (this.at);
    for (let s = from; s !== to; s = /** @type {Look} */ (s.parent)) /** @type {Look} */ (s.parent).next = s;
    while (from.external && from.parent !== to) from = /** @type {Look} */ (from.parent);
    await this.go(to, from.own && this.sha === from.sha ? to.sha : this.sha, `Undone: ${from.label}`);
  }

  async forth() {
    const to = this.at?.next;
    if (to) await this.go(to, to.own ? to.sha : this.sha, `Done again: ${to.label}`);
  }

  // Goes to a step and restores the file content `sha`.
  /** @param {Look} to @param {string | null} sha @param {string} text */
  async go(to, sha, text) {
    try {
      if (sha !== this.sha) {
        await this.write({ restore: { to: sha } }, to.values);
        this.apply(to.values, false);
      } else {
        this.apply(to.values, true);
      }
    } catch (error) {
      notice(/** @type {Error} */ (error).message, true);
      return;
    }
    this.at = to;
    if (to.own) to.sha = this.sha;
    this.touched = 0;
    notice(text);
    this.draw();
  }

  draw() {
    $('undo').disabled = !this.canUndo;
    $('redo').disabled = !this.at?.next;
    if (!isShown(this.root)) return;
    /** @param {Look} step */
    const row = (step) => {
      const go = element('button', { className: 'look', title: 'Go back to this look' }, step.canvas, element('span', { textContent: `${step.number}. ${step.label}` }));
      go.ariaPressed = String(step === this.at);
      go.onclick = () => this.go(step, step.sha, `Back at: ${step.label}`);
      const mark = element('button', { textContent: 'Compare', ariaLabel: `Compare look ${step.number}` });
      mark.ariaPressed = String(this.marked.includes(step));
      mark.onclick = () => this.mark(step);
      return element('li', {}, go, mark);
    };
    const focused = [...this.root.querySelectorAll('button')].indexOf(/** @type {HTMLButtonElement} */ (document.activeElement));
    this.root.replaceChildren(
      element('p', { className: 'doc', textContent: 'Click a look to go back to it; mark two to compare them.' }),
      element('ol', { className: 'looks' }, ...[...this.steps].reverse().map(row)),
    );
    if (focused >= 0) this.root.querySelectorAll('button')[focused]?.focus();
  }

  // Compares two marked steps.
  /** @param {Look} step */
  mark(step) {
    this.marked = this.marked.includes(step) ? this.marked.filter((s) => s !== step) : [...this.marked, step].slice(-2);
    this.draw();
    const [a, b] = [...this.marked].sort((x, y) => x.number - y.number);
    this.compare(b ? [a, b] : null);
  }
}
