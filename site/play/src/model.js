// @ts-check
// The graph and its values. The editor's worker opens texts; see work.js for their pictures.
import { Work } from './work.js';

/** @typedef {import('./work.js').Made} Made */
/** @typedef {import('./work.js').Chosen} Chosen */

export class Model extends Work {
  /** @param {import('./pool.js').Pool} pool */
  constructor(pool) {
    super(pool);
    /** @type {Map<string, { name: string, text: string }>} texts by their hashes, with the graph that had each */
    this.texts = new Map();
    /** @type {number | undefined} */
    this.later = undefined;
    // Failures of the editor's engine with a text; after two of them it is not opened again.
    this.defects = { text: '', count: 0 };
    // After the second one, until the next change.
    this.isResting = false;
    pool.editor.ondefect = (message) => this.defect(message);
    // Called after the editor's engine was started again, and whether the text is opened again.
    this.onrestart = (/** @type {boolean} */ _isAgain, /** @type {string} */ _message) => {};
    // Called at the first change after a rest.
    this.onresume = () => {};
    // Called with the description of a node whose line is to be shown.
    this.onjump = (/** @type {About & { line?: number, column?: number }} */ _about) => {};
    // Called with a text that the page has made, after the model has taken its name.
    this.ontext = (/** @type {string} */ _text, /** @type {boolean} */ _isOther) => {};
  }

  // Takes a new text, and opens it once it rests for `wait` ms.
  /** @param {string} text @param {{ name?: string, values?: Chosen, wait?: number }} [of] */
  setText(text, { name, values, wait = 0 } = {}) {
    if (name) this.name = name;
    if (values) {
      this.forget();
      this.values = values;
    }
    this.text = text;
    this.edit += 1;
    this.paused = false;
    if (this.isResting) {
      this.isResting = false;
      // The change may come from the editor.
      queueMicrotask(() => this.onresume());
    }
    clearTimeout(this.later);
    this.opening = true;
    this.later = setTimeout(() => this.open(), wait);
    this.onchange();
  }

  /** @param {string} name @param {string} base64 */
  setFile(name, base64) {
    this.files = { ...this.files, [name]: base64 };
    this.setText(this.text);
  }

  /** @param {string} name */
  dropFile(name) {
    const { [name]: _, ...files } = this.files;
    this.files = files;
    this.setText(this.text);
  }

  // With values that wait for a step.
  get latest() { return { name: this.name, text: this.text, size: this.size, values: this.wanted ?? this.values }; }

  async open() {
    const { edit, text, files, name } = this;
    const hand = this.pool.editor;
    this.opening = true;
    if (!this.opened) this.prepare();
    try {
      const opened = await hand.ask(this.request).done;
      const { runs } = hand;
      const old = edit === this.edit ? this.opened : { ...opened, runs };
      // An engine that was started again may give the name of an older graph to another one.
      if (old && old.runs === runs) hand.ask({ op: 'close', graph: old.graph }).done.catch(() => {});
      if (edit !== this.edit) return;
      // A material in space is shown by one picture, a cut.
      const outputs = opened.outputs.map((/** @type {any} */ o) => (o.type === 'Material' ? o : { ...o, channels: undefined }));
      this.opened = { ...opened, outputs, text, files, name, runs };
      this.texts.set(opened.sha256, { name, text });
      this.errors = [];
      this.values = this.fitting(this.values);
      // The text may make something else of an output that was an object.
      this.objects.clear();
      this.begin();
      this.tries.again();
      const [output, channel] = this.focus.split('.');
      const channels = opened.outputs.find((/** @type {any} */ o) => o.name === output)?.channels;
      if (channel && channels?.length && !channels.includes(channel)) this.news.tell('look', { target: `${output}.${channels[0]}` });
    } catch (error) {
      if (edit !== this.edit) return;
      this.complain(/** @type {import('./pool.js').Failure} */ (error), text);
    }
    if (edit === this.edit) this.opening = false;
    this.onchange();
    this.work();
  }

  // The editor's engine has failed and was started again, without the text. A text that makes it fail again is left alone.
  /** @param {string} message */
  defect(message) {
    const { text } = this;
    this.defects = { text, count: this.defects.text === text ? this.defects.count + 1 : 1 };
    const isAgain = this.defects.count < 2;
    this.onrestart(isAgain, message);
    if (isAgain) {
      if (text) this.setText(text);
      return;
    }
    clearTimeout(this.later);
    // An answer to the request that failed says nothing more.
    this.edit += 1;
    this.opening = false;
    this.isResting = true;
    this.complain({ code: 'defect', message: `the engine failed twice with this text, which is not opened again; change it to go on: ${message.replace(/^the engine failed and was started again: /, '')}` }, text);
    this.work();
  }

  /** @param {Chosen} values */
  setValues(values) {
    this.wanted = values;
    this.take();
  }

  /** @param {number} size */
  setSize(size) {
    this.size = size;
    this.paused = false;
    if (this.opened) this.begin();
  }

  // Writes values into the text, as *Save to file*. Gives the hash of the new text.
  /**
   * @param {{ set?: [string, string][], preset?: string | null, add?: boolean, comment?: string, edits?: FieldEdit[], promote?: { node: string, field: string } }} change
   * @param {Chosen | null} after
   */
  async keep({ set = [], preset = null, ...how }, after) {
    const { graph, sha256, text, name } = this.opened;
    if (this.text !== text) throw new Error('the text has errors, or is being read; nothing was written');
    const values = Object.fromEntries(set.map(([name, value]) => [name, plain(value, this.param(name)?.type)]));
    const kept = await this.pool.editor.ask({ op: 'keep', graph, sha256, values, preset: preset ?? undefined, ...how }).done;
    // The user's own text counts more than the one of the values.
    if (this.text !== text || this.name !== name) throw new Error('the text has changed meanwhile: it stays as you typed it, and the values were not written; write them again');
    this.replace(kept.text, after);
    return kept.sha256;
  }

  // Replaces the text, also by one of another graph.
  /** @param {string} text @param {Chosen | null} after @param {string} [name] */
  replace(text, after, name = this.name) {
    const isOther = name !== this.name;
    const { values } = this.latest;
    this.name = name;
    if (isOther) this.news.known = {};
    this.ontext(text, isOther);
    this.setText(text, { values: after ?? values });
  }

  /** @param {string} name */
  param(name) { return this.opened?.params.find((/** @type {any} */ p) => p.name === name); }
}

// A value in RON as JSON.
/** @param {string} ron @param {string} type */
export function plain(ron, type) {
  if (type === 'Choice') return ron;
  const list = /^\((.*)\)$/s.exec(ron.trim());
  try { return JSON.parse(list ? `[${list[1]}]` : ron); } catch { return ron; }
}
