// @ts-check
// The parameters of the graph: sliders, presets, the origin of each value, and saving to the file.
import { element, notice, say } from './dom.js';
import { numberField, within } from './entry.js';

/** @type {(text: string) => string} */
const unquote = (text) => { try { return JSON.parse(text); } catch { return text.replace(/^"|"$/g, ''); } };
/** @type {(v: number) => number} */
const code = (v) => Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));

// Formats a colour as browsers expect it.
/** @param {string} value */
function hex(value) {
  if (value.startsWith('"')) return unquote(value);
  const numbers = value.replace(/[()\s]/g, '').split(',').map(Number);
  return `#${numbers.slice(0, 3).map((v) => Math.min(255, Math.max(0, code(v))).toString(16).padStart(2, '0')).join('')}`;
}

/** @typedef {(value: string) => void} Setter */

export class Parameters {
  // `onchange` is called with values, a label and the control that changed them; `onsave` with changes of the file.
  /**
   * @param {HTMLElement} root
   * @param {{
   *   onchange: (values: { preset: string | null, set: Map<string, string> }, label: string, group: string | null) => void,
   *   onsave: (change: unknown, after: Values, label: string) => void,
   * }} on
   */
  constructor(root, { onchange, onsave }) {
    this.root = root;
    this.onchange = onchange;
    this.onsave = onsave;
    /** @type {Map<string, (param: Param, trial?: string) => void>} */
    this.rows = new Map();
    /** @type {string | null} */
    this.preset = null;
    /** @type {Map<string, string>} */
    this.set = new Map();
    /** @type {Param[]} */
    this.params = [];
    this.busy = false;
    this.resync = false;
    this.moving = false;
    // The control that is being dragged, and the number of drags so far.
    /** @type {string | null} */
    this.held = null;
    this.drags = 0;
    addEventListener('pointerup', () => this.release());
    addEventListener('pointercancel', () => this.release());
    /** @type {string | undefined} */
    this.sha = undefined;
    /** @type {Values | undefined} */
    this.told = undefined;
    /** @type {number | undefined} */
    this.rest = undefined;
    this.shape = '';
    // Errors of values that a fit found.
    /** @type {Map<string, { text: string, loose: boolean }>} */
    this.errors = new Map();
  }

  get values() { return { preset: this.preset, set: new Map(this.set) }; }

  // Shows a new graph; a control that is being moved is left alone.
  /** @param {Scene} scene @param {Values} values */
  update(scene, values) {
    const shape = JSON.stringify([scene.presets, scene.params.map(({ value, default: _, before, after, ...rest }) => rest)]);
    // The new file may not allow a value that was just set.
    this.resync ||= this.busy && this.sha !== undefined && this.sha !== scene.sha256;
    this.sha = scene.sha256;
    this.told = values;
    if (!this.busy) this.follow();
    this.params = scene.params;
    if (shape !== this.shape) {
      this.shape = shape;
      this.build(scene);
    }
    this.show();
  }

  follow() {
    this.resync = false;
    const told = /** @type {Values} */ (this.told);
    this.preset = told.preset;
    this.set = new Map(told.set);
  }

  // Begins a drag of a control: until it is released, all its values are one step of the history.
  /** @param {string} name */
  hold(name) {
    this.held = name;
    this.drags += 1;
  }

  release() {
    if (this.held !== null) this.moving = false;
    this.held = null;
  }

  // The step to which a new value of a control belongs. Key presses in quick succession are one step, too.
  /** @param {string} name */
  gesture(name) { return this.held === name ? `${name} #${this.drags}` : name; }

  // For a moment after a change, news of the server may be outdated.
  settle(time = 600) {
    this.busy = true;
    clearTimeout(this.rest);
    this.rest = setTimeout(() => {
      this.busy = false;
      if (this.resync) { this.follow(); this.show(); }
    }, time);
  }

  // Requested value: set by hand, or else the shown one.
  /** @param {Param} param */
  value(param) { return this.set.get(param.name) ?? param.value; }

  // The values set by hand, as a text.
  get byHand() { return [...this.set].map(([name, value]) => `${name} ${unquote(value)}`).join(', '); }

  get changed() { return this.params.filter((p) => this.value(p) !== p.default); }

  // Shows the values; those of a running fit come first.
  /** @param {Map<string, string>} [trial] */
  show(trial) {
    for (const param of this.params) this.rows.get(param.name)?.(param, trial?.get(param.name));
    for (const button of /** @type {NodeListOf<HTMLButtonElement>} */ (this.root.querySelectorAll('.presets button'))) {
      const on = button.value === (this.preset ?? '');
      if (button.ariaPressed !== String(on)) button.ariaPressed = String(on);
    }
    const note = this.root.querySelector('.by-hand');
    if (note) {
      say(/** @type {HTMLElement} */ (note), `+ ${this.set.size} by hand`);
      note.classList.toggle('on', this.set.size > 0);
    }
    const none = !this.changed.length;
    for (const button of /** @type {NodeListOf<HTMLButtonElement>} */ (this.root.querySelectorAll('[data-needs=changed]'))) if (button.disabled !== none) button.disabled = none;
  }

  /** @param {string} name @param {string | null} value @param {string | null} [group] */
  change(name, value, group = name) {
    if (value === null) this.set.delete(name); else this.set.set(name, value);
    this.tell(value === null ? `${name} reset` : `${name} ${unquote(value)}`, group);
  }

  /** @param {string} label @param {string | null} [group] */
  tell(label, group = null) {
    this.errors = new Map();
    this.settle();
    this.show();
    this.onchange(this.values, label, group);
  }

  // Shows the errors of values that a fit found, until a value is changed.
  /** @param {Map<string, { text: string, loose: boolean }>} errors */
  mark(errors) {
    this.errors = errors;
    this.show();
  }

  // Takes values from elsewhere, for example from the history.
  /** @param {Values} values */
  take(values) {
    this.preset = values.preset;
    this.set = new Map(values.set);
    this.errors = new Map();
    this.settle();
    this.show();
  }

  /** @param {Scene} scene */
  build(scene) {
    this.rows.clear();
    const copy = element('button', { id: 'copy', textContent: 'Copy as RON', title: 'The lines to put into the graph file' });
    copy.onclick = () => this.copy(copy);
    const reset = element('button', { id: 'reset', textContent: 'Reset', title: 'The values of the file' });
    reset.onclick = () => { this.set.clear(); this.preset = null; this.tell('Reset'); };
    for (const b of [copy, reset]) b.dataset.needs = 'changed';
    this.root.replaceChildren(element('h2', {}, 'Parameters', element('div', { className: 'spring' }), copy, reset));
    const presets = element('div', { className: 'presets', role: 'group', ariaLabel: 'Presets' });
    for (const name of scene.presets.length ? [null, ...scene.presets] : []) {
      const made = element('button', { value: name ?? '', textContent: name ?? 'as written' });
      made.onclick = () => { this.preset = name; this.set.clear(); this.tell(name ? `Preset ${name}` : 'As written'); };
      presets.append(made);
    }
    // Its room is always there, so that the first movement of a slider does not move the panel.
    if (scene.presets.length) presets.append(element('span', { className: 'by-hand' }));
    this.root.append(presets);
    if (!scene.params.length) {
      this.root.append(element('p', { className: 'doc', textContent: 'The graph declares no parameters. Look at a node, and make parameters of its values.' }));
      return;
    }
    for (const param of scene.params) this.root.append(this.row(param));
    const name = element('input', { type: 'text', id: 'preset-name', placeholder: 'Name', ariaLabel: 'Name of the new preset', spellcheck: false });
    const add = element('button', { textContent: 'New preset', title: 'Write the present values into the file as a preset' });
    add.dataset.needs = 'changed';
    add.onclick = () => this.add(name);
    name.onkeydown = (e) => { if (e.key === 'Enter') add.click(); };
    this.root.append(element('div', { className: 'row' }, name, add));
  }

  /** @param {HTMLInputElement} box */
  add(box) {
    const name = box.value.trim();
    if (!name) { box.focus(); notice('Give the preset a name', true); return; }
    const set = this.changed.map((p) => [p.name, this.value(p)]);
    this.onsave({ preset: { name, set } }, { preset: name, set: new Map() }, `Preset ${name} made`);
    box.value = '';
  }

  // Saves values set by hand to the file, or to the active preset.
  save() {
    if (!this.set.size) return;
    const preset = this.preset?.split('+').at(-1) ?? null;
    this.onsave({ values: { set: [...this.set], preset } }, { preset: this.preset, set: new Map() }, `Saved to ${preset ? `preset ${preset}` : 'file'}: ${this.byHand}`);
  }

  /** @param {Param} param */
  row(param) {
    const id = `param-${param.name}`;
    const label = element('label', { htmlFor: id, textContent: param.name.replaceAll('_', ' '), title: param.doc });
    const reset = element('button', { className: 'reset', textContent: '↺', ariaLabel: `Reset ${param.name}`, disabled: true });
    const head = element('div', { className: 'head' }, label, reset);
    const row = element('div', { className: 'param', dataset: { param: param.name } }, head);
    const make = /** @type {Record<string, 'number' | 'bool' | 'color' | 'choice'>} */ ({ Number: 'number', Integer: 'number', Bool: 'bool', Color: 'color', Choice: 'choice' })[param.type] ?? 'text';
    const show = this[make](param, id, head, row);
    // The origin of a value takes the place of the description, so that the panel does not move.
    const from = element('div', { className: 'from' });
    row.append(element('div', { className: 'below' }, from, element('div', { className: 'doc', textContent: param.doc })));
    this.rows.set(param.name, (now, trial) => {
      const value = trial ?? this.value(now);
      const byHand = this.set.has(now.name);
      const changed = value !== now.default;
      if (row.classList.contains('changed') !== (changed || byHand)) {
        row.classList.toggle('changed', changed || byHand);
        reset.disabled = !changed && !byHand;
      }
      const why = byHand ? 'Without the value set by hand' : 'The value of the file';
      if (reset.title !== why) reset.title = why;
      reset.onclick = () => this.change(now.name, byHand ? null : now.default, null);
      // The overridden value stays visible.
      const origin = byHand ? `by hand; the file says ${unquote(now.default)}` : changed ? `by the preset; the file says ${unquote(now.default)}` : '';
      const error = this.errors.get(now.name);
      row.classList.toggle('loose', error?.loose ?? false);
      say(from, trial ? 'tried by the fit' : error ? `fitted: ${error.text}` : origin);
      from.title = [origin, param.doc].filter(Boolean).join('\n');
      if (!row.contains(document.activeElement) || !this.moving) show(value);
    });
    row.addEventListener('pointerdown', (e) => { this.moving = /** @type {Element} */ (e.target).matches('[type=range], [type=color]'); });
    row.addEventListener('change', () => { this.moving = false; });
    return row;
  }

  /** @param {Param} param @param {string} id @param {HTMLElement} head @param {HTMLElement} row @returns {Setter} */
  number(param, id, head, row) {
    const whole = param.type === 'Integer';
    const { name, range, unit } = param;
    /** @type {HTMLInputElement | null} */
    let slider = null;
    /** @param {number} n @param {string | null} group */
    const send = (n, group) => {
      if (!Number.isFinite(n)) return;
      const taken = within(n, range, whole);
      // Slider and field show the value at once, even if the file cannot be evaluated.
      if (slider) slider.value = String(taken);
      field.show(taken, true);
      this.change(name, whole ? String(taken) : String(+taken.toPrecision(12)), group);
    };
    const field = numberField({ id, name: name.replaceAll('_', ' '), unit: unit ?? '', whole, range, onset: (n, stepped) => send(n, stepped ? name : null) });
    head.append(field.box, element('span', { className: 'unit', textContent: unit ?? '' }));
    if (range) {
      const [lo, hi] = range;
      const made = element('input', { type: 'range', min: lo, max: hi, step: whole ? 1 : 10 ** Math.floor(Math.log10((hi - lo) / 200)), ariaLabel: name.replaceAll('_', ' ') });
      made.oninput = () => send(whole ? made.valueAsNumber : +made.valueAsNumber.toPrecision(4), this.gesture(name));
      made.onpointerdown = () => this.hold(name);
      made.title = `${lo} … ${hi} ${unit ?? ''}`;
      row.append(made);
      slider = made;
    }
    return (value) => { const n = Number(value); field.show(n); if (slider) slider.value = String(n); };
  }

  /** @param {Param} param @param {string} id @param {HTMLElement} head @returns {Setter} */
  bool(param, id, head) {
    const box = element('input', { type: 'checkbox', id });
    box.onchange = () => this.change(param.name, String(box.checked), null);
    head.append(box);
    return (value) => { box.checked = value === 'true'; };
  }

  /** @param {Param} param @param {string} id @param {HTMLElement} head @returns {Setter} */
  color(param, id, head) {
    const box = element('input', { type: 'color', id });
    // All colours until the picker closes are one step.
    box.oninput = () => {
      if (this.held !== param.name) this.hold(param.name);
      this.change(param.name, `"${box.value}"`, this.gesture(param.name));
    };
    box.onchange = () => this.release();
    head.append(box);
    return (value) => { box.value = hex(value); };
  }

  /** @param {Param} param @param {string} id @param {HTMLElement} head @param {HTMLElement} row @returns {Setter} */
  choice(param, id, head, row) {
    const box = element('select', { id }, ...param.options.map((o) => element('option', { value: o, textContent: o })));
    box.onchange = () => this.change(param.name, box.value, null);
    row.append(box);
    return (value) => { box.value = unquote(value); };
  }

  /** @param {Param} param @param {string} id @param {HTMLElement} head @param {HTMLElement} row @returns {Setter} */
  text(param, id, head, row) {
    const box = element('input', { type: 'text', id, spellcheck: false });
    box.onchange = () => this.change(param.name, JSON.stringify(box.value), null);
    row.append(box);
    return (value) => { box.value = unquote(value); };
  }

  // Copies the declarations with their new defaults, as they would be in the file.
  /** @param {HTMLButtonElement} button */
  async copy(button) {
    const text = this.changed.map((p) => `${p.before}${this.value(p)}${p.after}`).join('\n');
    button.dataset.copied = text;
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const area = element('textarea', { value: text });
      document.body.append(area);
      area.select();
      document.execCommand('copy');
      area.remove();
    }
    button.textContent = 'Copied';
    setTimeout(() => { button.textContent = 'Copy as RON'; }, 1200);
  }
}
