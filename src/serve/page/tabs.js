// @ts-check
// The tabs of the panel. The code of a tab is loaded when it is first shown.
import { $, keep, setting } from './dom.js';

const TABS = ['parameters', 'look', 'measure', 'history', 'export'];
/** @type {Record<string, number>} */
const KEYS = { ArrowRight: 1, ArrowLeft: -1 };

export class Tabs {
  // `load` loads the code of a tab once; `onshow` is called each time a tab is shown.
  /** @param {{ load: (name: string) => Promise<unknown> | void, onshow: (name: string) => void }} on */
  constructor({ load, onshow }) {
    this.load = load;
    this.onshow = onshow;
    this.now = '';
    /** @type {Map<string, Promise<unknown>>} */
    this.loaded = new Map();
    TABS.forEach((name, i) => {
      const tab = this.tab(name);
      tab.onclick = () => this.show(name);
      tab.onkeydown = (e) => {
        const to = { Home: 0, End: TABS.length - 1 }[e.key] ?? (KEYS[e.key] ? (i + KEYS[e.key] + TABS.length) % TABS.length : undefined);
        if (to === undefined) return;
        e.preventDefault();
        e.stopPropagation();
        this.show(TABS[to]);
        this.tab(TABS[to]).focus();
      };
    });
  }

  /** @param {string} name */
  tab(name) { return $(`tab-${name}`); }

  // Shows a tab; the promise ends when its code is there.
  /** @param {string} name */
  async show(name) {
    const wanted = TABS.includes(name) ? name : TABS[0];
    if (this.now !== wanted) {
      this.now = wanted;
      keep('tab', wanted);
      for (const other of TABS) {
        const on = other === wanted;
        this.tab(other).ariaSelected = String(on);
        this.tab(other).tabIndex = on ? 0 : -1;
        $(`pane-${other}`).hidden = !on;
      }
      $('panel').scrollTop = 0;
    }
    if (!this.loaded.has(wanted)) this.loaded.set(wanted, Promise.resolve(this.load(wanted)));
    await this.loaded.get(wanted);
    if (this.now !== wanted) return;
    this.onshow(wanted);
    document.documentElement.dataset.tab = wanted;
  }

  // Shows the tab of the last visit.
  start() { this.show(setting('tab') ?? TABS[0]); }
}
