// @ts-check
// The parameters of the graph: sliders, presets, the origin of each value, and saving to the file.
import { element, notice, say, short } from './dom.js';
import { control, unquote } from './control.js';
import { keyOf, sent } from './values.js';

/** @param {FieldEdit[] | undefined} edits @returns {Map<string, FieldEdit>} */
const byKey = (edits) => new Map((edits ?? []).map((edit) => [keyOf(edit), edit]));

// Graphs with at most this number of parameters need no search.
const FEW = 8;

export class Parameters {
  // `onchange` is called with values, a label and the control that changed them; `onsave` with changes of the file.
  /**
   * @param {HTMLElement} root
   * @param {{
   *   onchange: (values: Values, label: string, group: string | null) => void,
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
    // Values in the texts of nodes, by their keys; those that the server has taken; and the values of the file.
    /** @type {Map<string, FieldEdit>} */
    this.edits = new Map();
    /** @type {Map<string, FieldEdit>} */
    this.accepted = new Map();
    /** @type {Map<string, string>} */
    this.written = new Map();
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
    /** @type {Map<string, HTMLDetailsElement>} */
    this.groups = new Map();
    // Names of the groups that the user has folded.
    /** @type {Set<string>} */
    this.folded = new Set();
    this.sought = '';
    // Called with the values that remain after a refusal, and whether an earlier one returns.
    /** @type {((values: Values, returns: boolean) => void) | undefined} */
    this.onrefuse = undefined;
    // Errors of values that a fit found.
    /** @type {Map<string, { text: string, loose: boolean }>} */
    this.errors = new Map();
  }

  /** @returns {Values & { edits: FieldEdit[] }} */
  get values() { return { preset: this.preset, set: new Map(this.set), edits: [...this.edits.values()] }; }

  // Shows a new graph; a control that is being moved is left alone.
  /** @param {Scene} scene @param {Values} values */
  update(scene, values) {
    const shape = JSON.stringify([scene.presets, scene.params.map(({ value, default: _, before, after, ...rest }) => rest)]);
    // The new file may not allow a value that was just set.
    this.resync ||= this.busy && this.sha !== undefined && this.sha !== scene.sha256;
    if (this.sha !== scene.sha256) for (const key of this.written.keys()) if (!this.edits.has(key)) this.written.delete(key);
    this.sha = scene.sha256;
    this.told = values;
    this.accepted = byKey(values.edits);
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
    this.edits = byKey(told.edits);
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

  // Requested value: set by hand, or else that of the preset or of the file. The shown one may be older.
  /** @param {Param} param */
  value(param) { return this.set.get(param.name) ?? (this.preset ? param.value : param.default); }

  // The number of values set by hand.
  get count() { return this.set.size + this.edits.size; }

  // The values set by hand, as a text.
  get byHand() {
    const nodes = [...this.edits.values()].map(({ node, field: name, value }) => `${[node, name].filter(Boolean).join(' ')} ${unquote(value)}`);
    return [...[...this.set].map(([name, value]) => `${name} ${unquote(value)}`), ...nodes].join(', ');
  }

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
      say(/** @type {HTMLElement} */ (note), `+ ${this.count} by hand`);
      note.classList.toggle('on', this.count > 0);
    }
    this.countGroups();
    const none = !this.changed.length && !this.edits.size;
    for (const button of /** @type {NodeListOf<HTMLButtonElement>} */ (this.root.querySelectorAll('[data-needs=changed]'))) if (button.disabled !== none) button.disabled = none;
  }

  /** @param {string} name @param {string | null} value @param {string | null} [group] */
  change(name, value, group = name) {
    if (value === null) this.set.delete(name); else this.set.set(name, value);
    this.tell(value === null ? `${name} reset` : `${name} ${unquote(value)}`, group);
  }

  // Sets a value in the text of a node, without a change of the file.
  /** @param {FieldEdit} edit @param {string | null} group */
  edit(edit, group) {
    const key = keyOf(edit);
    const reset = edit.value === this.written.get(key) || (Number.isFinite(Number(edit.value)) && Number(edit.value) === Number(this.written.get(key)));
    // The newest is the last one: the server drops it first if the graph does not accept it.
    this.edits.delete(key);
    if (!reset) this.edits.set(key, edit);
    this.tell(`${[edit.node, edit.field].filter(Boolean).join(' ')} ${reset ? 'reset' : unquote(edit.value)}`, group);
  }

  // Handles a value that the graph does not accept: the one before it comes back.
  /** @param {FieldEdit} edit @param {string} why */
  refuse(edit, why) {
    const key = keyOf(edit);
    if (this.edits.get(key)?.value !== edit.value) return;
    const before = this.accepted.get(key);
    const returns = before && before.value !== edit.value;
    if (returns) this.edits.set(key, before); else this.edits.delete(key);
    notice(`${edit.node}: ${edit.field || 'formula'} ${unquote(edit.value)} is not taken: ${why}`, true);
    this.onrefuse?.(this.values, Boolean(returns));
    this.show();
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
    this.edits = byKey(values.edits);
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
    reset.onclick = () => { this.set.clear(); this.edits.clear(); this.preset = null; this.tell('Reset'); };
    for (const b of [copy, reset]) b.dataset.needs = 'changed';
    const find = element('input', { type: 'search', id: 'param-find', placeholder: 'Find a parameter', ariaLabel: 'Find a parameter', hidden: scene.params.length <= FEW, autocomplete: 'off', spellcheck: false });
    find.oninput = () => this.find(find.value);
    this.root.replaceChildren(element('h2', {}, 'Parameters', element('div', { className: 'spring' }), copy, reset), find);
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
    this.root.append(...this.grouped(scene.params));
    const name = element('input', { type: 'text', id: 'preset-name', placeholder: 'Name', ariaLabel: 'Name of the new preset', spellcheck: false });
    const add = element('button', { textContent: 'New preset', title: 'Write the present values into the file as a preset' });
    add.dataset.needs = 'changed';
    add.onclick = () => this.add(name);
    name.onkeydown = (e) => { if (e.key === 'Enter') add.click(); };
    this.root.append(element('div', { className: 'row' }, name, add));
  }

  // The rows of parameters; those with the same group stand together under its name, which folds them.
  /** @param {Param[]} params */
  grouped(params) {
    this.groups = new Map();
    const rows = [];
    for (const param of params) {
      const row = this.row(param);
      if (!param.group) { rows.push(row); continue; }
      const known = this.groups.get(param.group);
      if (known) { known.append(row); continue; }
      const group = param.group;
      const made = element('details', { className: 'group', open: !this.folded.has(group) }, element('summary', {}, group, element('span', { className: 'set' })), row);
      // A search opens groups for a while.
      made.ontoggle = () => { if (!this.sought) this.folded[made.open ? 'delete' : 'add'](group); };
      this.groups.set(group, made);
    }
    return [...rows, ...this.groups.values()];
  }

  // Shows only the parameters whose name, description or group contains a text.
  /** @param {string} text */
  find(text) {
    this.sought = text.trim().toLowerCase();
    for (const param of this.params) {
      const row = /** @type {HTMLElement | null} */ (this.root.querySelector(`[data-param="${param.name}"]`));
      const words = [param.name, param.name.replaceAll('_', ' '), param.doc, param.group].join(' ').toLowerCase();
      if (row) row.hidden = !words.includes(this.sought);
    }
    for (const [name, group] of this.groups) {
      group.open = this.sought ? true : !this.folded.has(name);
      group.hidden = !group.querySelector('.param:not([hidden])');
    }
  }

  // Says beside the name of each group how many of its values are set.
  countGroups() {
    for (const [name, group] of this.groups) {
      const set = this.params.filter((p) => p.group === name && (this.set.has(p.name) || this.value(p) !== p.default)).length;
      say(/** @type {HTMLElement} */ (group.querySelector('.set')), set ? `${set} set` : '');
    }
  }

  /** @param {HTMLInputElement} box */
  add(box) {
    const name = box.value.trim();
    if (!name) { box.focus(); notice('Give the preset a name', true); return; }
    const set = this.changed.map((p) => [p.name, this.value(p)]);
    this.onsave({ preset: { name, set } }, { ...this.values, preset: name, set: new Map() }, `Preset ${name} made`);
    box.value = '';
  }

  // Saves values set by hand to the file, or to the active preset.
  save() {
    if (!this.count) return;
    const { edits } = sent(this.values);
    const preset = this.preset?.split('+').at(-1) ?? null;
    this.onsave({ values: { set: [...this.set], preset, edits } }, { preset: this.preset, set: new Map(), edits: [] }, `Saved to ${preset ? `preset ${preset}` : 'file'}: ${this.byHand}`);
  }

  /** @param {Param} param */
  row(param) {
    const id = `param-${param.name}`;
    const label = element('label', { htmlFor: id, textContent: param.name.replaceAll('_', ' '), title: param.doc });
    const reset = element('button', { className: 'reset', textContent: '↺', ariaLabel: `Reset ${param.name}`, disabled: true });
    const head = element('div', { className: 'head' }, label);
    const row = element('div', { className: 'param', dataset: { param: param.name } }, head);
    const made = control(this, param, id);
    head.append(made.box);
    head.append(reset);
    // The origin of a value takes the place of the description, so that the panel does not move.
    const from = element('div', { className: 'from' });
    const range = param.range ? element('span', { className: 'range', textContent: param.range.map(short).join(' … ') }) : null;
    row.append(element('div', { className: 'below' }, from, element('div', { className: 'doc' }, param.doc), range));
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
      reset.onclick = () => this.reset(now.name);
      // The overridden value stays visible.
      const origin = byHand ? `by hand; the file says ${unquote(now.default)}` : changed ? `by the preset; the file says ${unquote(now.default)}` : '';
      const error = this.errors.get(now.name);
      row.classList.toggle('loose', error?.loose ?? false);
      say(from, trial ? 'tried by the fit' : error ? `fitted: ${error.text}` : origin);
      from.title = [origin, param.doc].filter(Boolean).join('\n');
      if (!row.contains(document.activeElement) || !this.moving) made.show(value, now.default);
    });
    row.addEventListener('pointerdown', (e) => { this.moving = /** @type {Element} */ (e.target).matches('[type=color]'); });
    row.addEventListener('change', () => { this.moving = false; });
    return row;
  }

  // Takes back the value set by hand, or else that of the preset.
  /** @param {string} name */
  reset(name) {
    const param = this.params.find((p) => p.name === name);
    if (!param) return;
    if (this.set.has(name)) this.change(name, null, null); else if (param.value !== param.default) this.change(name, param.default, null);
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
