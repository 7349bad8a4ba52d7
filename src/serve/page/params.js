// The parameters of the graph: sliders, presets, and the text to put back into the file.
const element = (tag, props = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), props);
  made.append(...children);
  return made;
};

const unquote = (text) => { try { return JSON.parse(text); } catch { return text.replace(/^"|"$/g, ''); } };
const digits = (n) => String(Math.abs(n) >= 100 ? +n.toFixed(1) : +n.toPrecision(4));

export class Parameters {
  constructor(root, onchange) {
    this.root = root;
    this.onchange = onchange;
    this.rows = new Map();
    this.preset = null;
    this.set = new Map();
    this.shape = '';
  }

  // Follows the graph; what somebody is moving at the moment is left alone.
  update(scene, values) {
    const shape = JSON.stringify([scene.presets, scene.params.map(({ value, before, after, ...rest }) => rest)]);
    if (!this.busy) {
      this.preset = values.preset;
      this.set = new Map(values.set);
    }
    this.params = scene.params;
    if (shape !== this.shape) {
      this.shape = shape;
      this.build(scene);
    }
    for (const param of scene.params) this.rows.get(param.name)?.(param);
    this.mark();
  }

  get changed() { return this.params.filter((p) => p.value !== p.default); }

  mark() {
    for (const button of this.root.querySelectorAll('.presets button')) {
      button.classList.toggle('on', button.value === (this.preset ?? ''));
    }
    for (const button of this.root.querySelectorAll('h2 button')) button.disabled = !this.changed.length;
  }

  change(name, value) {
    if (value === null) this.set.delete(name); else this.set.set(name, value);
    this.tell();
  }

  tell() {
    this.busy = true;
    clearTimeout(this.rest);
    this.rest = setTimeout(() => { this.busy = false; }, 600);
    this.onchange({ preset: this.preset, set: [...this.set] });
  }

  build(scene) {
    this.rows.clear();
    const copy = element('button', { id: 'copy', textContent: 'Copy as RON', title: 'The lines to put into the graph file' });
    copy.onclick = () => this.copy(copy);
    const reset = element('button', { id: 'reset', textContent: 'Reset', title: 'The values of the file' });
    reset.onclick = () => { this.set.clear(); this.preset = null; this.tell(); };
    this.root.replaceChildren(element('h2', {}, 'Parameters', element('div', { className: 'spring' }), copy, reset));
    if (scene.presets.length) {
      const button = (name, text) => {
        const made = element('button', { value: name ?? '', textContent: text });
        made.onclick = () => { this.preset = name; this.set.clear(); this.tell(); this.mark(); };
        return made;
      };
      this.root.append(element('div', { className: 'presets' }, button(null, 'as written'), ...scene.presets.map((p) => button(p, p))));
    }
    if (!scene.params.length) {
      this.root.append(element('p', { className: 'doc', textContent: 'The graph declares no parameters. Add some to its params: { … }.' }));
    }
    for (const param of scene.params) this.root.append(this.row(param));
  }

  row(param) {
    const id = `param-${param.name}`;
    const label = element('label', { htmlFor: id, textContent: param.name.replaceAll('_', ' '), title: param.doc });
    const reset = element('button', { className: 'reset', textContent: '↺', title: 'The value of the file', ariaLabel: `Reset ${param.name}` });
    const head = element('div', { className: 'head' }, label, reset);
    const row = element('div', { className: 'param' }, head);
    row.dataset.param = param.name;
    reset.onclick = () => { this.preset = null; this.set.delete(param.name); if (param.value !== param.default) this.tell(); };
    const make = { Number: 'number', Integer: 'number', Bool: 'bool', Color: 'color', Choice: 'choice' }[param.type] ?? 'text';
    const show = this[make](param, id, head, row);
    if (param.doc) row.append(element('div', { className: 'doc', textContent: param.doc }));
    this.rows.set(param.name, (now) => {
      row.classList.toggle('changed', now.value !== now.default);
      if (!row.contains(document.activeElement) || !this.busy) show(now.value);
    });
    return row;
  }

  number(param, id, head, row) {
    const whole = param.type === 'Integer';
    const step = whole ? 1 : 'any';
    const box = element('input', { type: 'number', id, step });
    head.append(box, element('span', { className: 'unit', textContent: param.unit ?? '' }));
    let slider = null;
    const send = (n) => {
      if (!Number.isFinite(n)) return;
      const [lo, hi] = param.range ?? [-Infinity, Infinity];
      const within = Math.min(Math.max(whole ? Math.round(n) : n, lo), hi);
      this.change(param.name, whole ? String(within) : String(+within.toPrecision(6)));
    };
    if (param.range) {
      const [lo, hi] = param.range;
      slider = element('input', { type: 'range', min: lo, max: hi, step: whole ? 1 : (hi - lo) / 1000, ariaLabel: param.name });
      slider.oninput = () => { box.value = digits(slider.valueAsNumber); send(whole ? slider.valueAsNumber : +slider.valueAsNumber.toPrecision(4)); };
      slider.title = `${lo} … ${hi} ${param.unit ?? ''}`;
      row.append(slider);
    }
    box.onchange = () => send(box.valueAsNumber);
    return (value) => { const n = Number(value); box.value = digits(n); if (slider) slider.value = n; };
  }

  bool(param, id, head) {
    const box = element('input', { type: 'checkbox', id });
    box.onchange = () => this.change(param.name, String(box.checked));
    head.append(box);
    return (value) => { box.checked = value === 'true'; };
  }

  color(param, id, head) {
    const box = element('input', { type: 'color', id });
    box.oninput = () => this.change(param.name, `"${box.value}"`);
    head.append(box);
    return (value) => {
      if (value.startsWith('"')) { box.value = unquote(value); return; }
      const code = (v) => Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
      const numbers = value.replace(/[()\s]/g, '').split(',').map(Number);
      box.value = `#${numbers.slice(0, 3).map((v) => Math.min(255, Math.max(0, code(v))).toString(16).padStart(2, '0')).join('')}`;
    };
  }

  choice(param, id, head, row) {
    const box = element('select', { id }, ...param.options.map((o) => element('option', { value: o, textContent: o })));
    box.onchange = () => this.change(param.name, box.value);
    row.append(box);
    return (value) => { box.value = unquote(value); };
  }

  text(param, id, head, row) {
    const box = element('input', { type: 'text', id, spellcheck: false });
    box.onchange = () => this.change(param.name, JSON.stringify(box.value));
    row.append(box);
    return (value) => { box.value = unquote(value); };
  }

  // The declarations with their new defaults, as they stand in the file.
  text_of_changes() {
    return this.changed.map((p) => `${p.before}${p.value}${p.after}`).join('\n');
  }

  async copy(button) {
    const text = this.text_of_changes();
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
    button.classList.add('copied');
    setTimeout(() => { button.textContent = 'Copy as RON'; button.classList.remove('copied'); }, 1200);
  }
}
