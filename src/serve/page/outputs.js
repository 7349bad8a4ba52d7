// @ts-check
// The outputs of the graph, and the channels of a material, as buttons; outputs that have no button are in a menu.
import { $, element } from './dom.js';

// Outputs that have a button.
const MOST = 8;

export class Outputs {
  // `choose` selects an output or a channel, `outputOf` returns the output of a target, `channelsOf` the channels of an output.
  /**
   * @param {Page} page
   * @param {{
   *   choose: (name: string) => void,
   *   outputOf: (name: string) => { name: string, type: string } | undefined,
   *   channelsOf: (output: string) => string[],
   * }} of
   */
  constructor(page, { choose, outputOf, channelsOf }) {
    this.page = page;
    this.choose = choose;
    this.outputOf = outputOf;
    this.channelsOf = channelsOf;
    this.key = '';
    $('more').onchange = () => { if ($('more').value) choose($('more').value); };
  }

  show() {
    const { state, target, about } = this.page;
    const { scene } = state ?? {};
    if (!scene) return;
    const key = [target, about?.channel, about?.channels, ...scene.outputs.map((o) => `${o.name} ${o.type}`), Object.keys(scene.pictures)].join();
    if (key === this.key) return;
    this.key = key;
    /** @param {string} name @param {string} text @param {boolean} on */
    const button = (name, text, on) => {
      const made = element('button', { textContent: text.replaceAll('_', ' '), ariaPressed: String(on), dataset: { target: name } });
      made.onclick = () => this.choose(name);
      return made;
    };
    const node = target?.startsWith('@');
    const current = node ? null : this.outputOf(target);
    // One output too many has a button, too: a menu would take as much room.
    const shown = scene.outputs.length <= MOST + 1 ? scene.outputs.length : MOST;
    const buttons = scene.outputs.slice(0, shown).map((o) => button(o.name, o.name, o === current));
    menu(scene.outputs.slice(shown).map((o) => o.name), current?.name ?? '');
    if (node) buttons.push(button(target, target.slice(1), true));
    replace($('outputs'), buttons);
    const channels = current?.type === 'Material' ? this.channelsOf(current.name) : node && about?.channels ? about.channels : [];
    const base = node ? target.replace(/\.[a-z_]+$/, '') : current?.name;
    const now = about?.channel ?? target?.slice((base?.length ?? 0) + 1);
    replace($('channels'), channels.map((c) => button(`${base}.${c}`, c, c === now)));
  }
}

/** @param {string[]} names @param {string} now */
function menu(names, now) {
  const box = $('more');
  box.hidden = !names.length;
  if (box.options.length !== names.length + 1 || names.some((name, i) => box.options[i + 1].value !== name)) {
    const none = element('option', { value: '', textContent: `${names.length} more` });
    box.replaceChildren(none, ...names.map((name) => element('option', { value: name, textContent: name.replaceAll('_', ' ') })));
  }
  box.value = names.includes(now) ? now : '';
  box.classList.toggle('on', box.value !== '');
}

// Replaces buttons only if they differ, so that a click does not land between two versions.
/** @param {HTMLElement} parent @param {HTMLElement[]} children */
function replace(parent, children) {
  const old = /** @type {HTMLElement[]} */ ([...parent.children]);
  const same = old.length === children.length && children.every((c, i) => c.dataset.target === old[i].dataset.target);
  if (!same) { parent.replaceChildren(...children); return; }
  children.forEach((c, i) => { if (old[i].ariaPressed !== c.ariaPressed) old[i].ariaPressed = c.ariaPressed; });
}
