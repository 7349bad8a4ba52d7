// @ts-check
// The state of the model in the form of the server's messages: see types.d.ts of the page.

/** @type {Record<string, string>} */
const TYPES = { color: 'Rgb', normal: 'Normal', number: 'Gray' };
/** @type {Record<string, [boolean, boolean]>} */
const TILES = { Both: [true, true], X: [true, false], Y: [false, true], None: [false, false] };

// An error with the lines around it.
/** @param {any} error @param {string} text */
export function described(error, text) {
  const lines = text.split('\n').map((line, i) => ({ n: i + 1, text: line.slice(0, 240) }));
  const isOwn = !error.file || !/^shibo:\/lib\//.test(error.file);
  return {
    help: null, related: [], end_line: error.line, end_column: error.column, file: 'graph.ron', ...error,
    lines: isOwn ? lines.slice(Math.max(0, error.line - 3), error.line + 1) : [],
  };
}

// A value of JSON as RON.
/** @param {any} value @param {string} type @returns {string} */
export function ron(value, type) {
  if (Array.isArray(value)) return `(${value.map((one) => ron(one, type)).join(', ')})`;
  return typeof value === 'string' && type !== 'Choice' ? JSON.stringify(value) : String(value);
}

// Pictures of `size` pixels along the longer side of a canvas.
/** @param {[number, number]} resolution @param {number} size @returns {[number, number]} */
export function scaled(resolution, size) {
  const longer = Math.max(...resolution);
  return /** @type {[number, number]} */ (resolution.map((n) => Math.max(1, Math.round((n * size) / longer))));
}

export class News {
  constructor() {
    /** @type {(kind: string, data: any) => void} */
    this.listener = () => {};
    /** @type {[string, any][]} */
    this.early = [];
    this.listening = false;
    /** @type {Record<string, any>} */
    this.known = {};
  }

  /** @param {(kind: string, data: any) => void} listener */
  listen(listener) {
    this.listener = listener;
    this.listening = true;
    for (const [kind, data] of this.early.splice(0)) listener(kind, data);
  }

  /** @param {string} kind @param {any} data */
  tell(kind, data) {
    if (this.listening) this.listener(kind, data); else this.early.push([kind, data]);
  }

  /** @param {import('./work.js').Work} model @param {import('./work.js').Made} made @returns {Shown} */
  shown(model, made) {
    const { json, target, id, range } = made;
    const isOwn = json.own ?? false;
    return {
      target, picture: id, size: /** @type {Vec2} */ ([json.width, json.height]), final: made.size >= model.size, range, type: TYPES[json.meaning] ?? json.type ?? 'Gray',
      unit: json.unit ?? '', own: isOwn,
    };
  }

  // The state without a graph.
  /** @param {import('./work.js').Work} model */
  empty({ name, values }) {
    const file = name.startsWith('shibo:') ? `${name.slice(6)}.ron` : name;
    return { file, scene: null, errors: [], warnings: [], busy: false, progress: null, done: null, values };
  }

  // The state with the last sound graph.
  /** @param {import('./work.js').Work} model */
  state(model) {
    const { opened, values, generation, size } = model;
    const preset = opened.presets[values.preset ?? ''] ?? {};
    const set = new Map(values.set);
    const params = opened.params.map((/** @type {any} */ param) => {
      const { value: _, default: __, source, options, ...rest } = param;
      const value = set.get(param.name) ?? (param.name in preset ? ron(preset[param.name], param.type) : source.default);
      return { ...rest, value, default: source.default, before: source.line[0], after: source.line[1], options: options ?? [] };
    });
    /** @type {Record<string, any>} */
    const pictures = {};
    for (const { name, channels } of opened.outputs) {
      for (const target of channels ? channels.map((/** @type {string} */ c) => `${name}.${c}`) : [name]) {
        const before = this.known[target];
        // The picture of before stays until there is a new one; the selected one is awaited.
        pictures[target] = before && target !== model.focus ? { ...before, final: false } : { target, picture: `${generation} ${target}`, size: [1, 1], final: false, range: [0, 1], type: 'Gray', unit: '', own: false };
      }
    }
    const outputs = opened.outputs.map((/** @type {any} */ { name, type }) => ({ name, type }));
    return {
      ...this.empty(model), busy: model.isBusy, warnings: opened.warnings.map((/** @type {any} */ e) => described(e, opened.text)),
      scene: {
        generation, sha256: opened.sha256, outputs, params, presets: Object.keys(opened.presets), pictures, nodes: opened.nodes, breaks: opened.breaks,
        canvas: { size_mm: opened.canvas.size_mm, resolution: scaled(opened.canvas.resolution, size), tile: TILES[opened.canvas.tile] ?? [false, false] },
        mesh: opened.mesh ? JSON.stringify([opened.sha256, values]) : null, solid: opened.solid, bodies: opened.bodies,
      },
    };
  }
}
