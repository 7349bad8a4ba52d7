// @ts-check
// Workers that share one compiled module: `editor` answers at once, `renderer` makes pictures, and a spare one waits to take over.

/** @typedef {{ json: any, bytes?: Uint8Array, data?: Float32Array, pixels?: Uint8ClampedArray<ArrayBuffer>, halves?: Uint16Array<ArrayBuffer>, range?: [number, number], scale?: number }} Answer */
// `stop` drops a request; `finish` asks for its result so far.
/** @typedef {{ n: number, done: Promise<any>, stop: () => void, finish: () => void }} Request */

// A request that failed.
export class Failure extends Error {
  /** @param {{ code: string, message: string, errors?: any[] }} error */
  constructor({ code, message, errors = [] }) {
    super(message);
    this.code = code;
    this.errors = errors;
  }
}

export class Hand {
  /** @param {Promise<WebAssembly.Module>} module @param {(json: any) => void} [other] gets messages without a request */
  constructor(module, other) {
    this.count = 0;
    /** @type {Map<number, { heard: (answer: Answer) => void, resolve: (ok: any) => void, reject: (error: Error) => void }>} */
    this.waiting = new Map();
    /** @type {{ graph: string, sha256: string, files: unknown, name: string } | null} the graph that is open */
    this.has = null;
    /** @type {Promise<void> | undefined} */
    this.prepared = undefined;
    // Called after the engine has failed and was started again.
    this.ondefect = (/** @type {string} */ _message) => {};
    // Counts the starts of the engine: the names of graphs begin again with each.
    this.runs = 0;
    this.worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
    /** @type {Promise<void>} */
    this.ready = new Promise((resolve, reject) => {
      module.catch(reject);
      this.worker.onerror = (event) => reject(new Error(event.message || 'the worker cannot be loaded'));
      this.worker.onmessage = ({ data }) => {
        if (data.ready) resolve();
        else if (data.failed) reject(new Error(data.failed));
        else if (data.n === undefined && data.json.event === 'defect') this.defect(data.json.message);
        else if (data.n === undefined) other?.(data.json);
        else this.hear(data);
      };
    });
    this.ready.catch((error) => this.refuse({ code: 'load', message: error.message }));
    /** @type {Promise<unknown>} requests come after the module */
    this.begun = module.then((made) => this.worker.postMessage({ module: made }), () => {});
  }

  /** @param {Answer & { n: number }} answer */
  hear(answer) {
    const of = this.waiting.get(answer.n);
    if (!of) return;
    const { ok, error } = answer.json;
    if (!ok && !error) { of.heard(answer); return; }
    this.waiting.delete(answer.n);
    if (error?.code === 'defect') this.defect(error.message);
    // The bytes of an answer come with it.
    if (ok) of.resolve(answer.bytes?.length ? { ...ok, bytes: answer.bytes } : ok); else of.reject(new Failure(error));
  }

  // The engine was started again, without graphs.
  /** @param {string} message */
  defect(message) {
    this.has = null;
    this.runs += 1;
    console.error(message);
    this.ondefect(message);
  }

  // Sends a request. `heard` gets its events; with `form`, pictures are painted, with `range` as black and white. The promise gives the
  // answer.
  /** @param {any} request @param {(answer: Answer) => void} [heard] @param {string} [form] @param {[number, number]} [range] @returns {Request} */
  ask(request, heard = () => {}, form, range) {
    this.count += 1;
    const n = this.count;
    const done = new Promise((resolve, reject) => { this.waiting.set(n, { heard, resolve, reject }); });
    this.begun.then(() => this.worker.postMessage({ n, request, form, range }));
    return { n, done, stop: () => this.worker.postMessage({ stop: n }), finish: () => this.worker.postMessage({ finish: n }) };
  }

  // Ends the worker at once; its requests are cancelled.
  end() {
    this.worker.terminate();
    this.refuse({ code: 'cancelled', message: 'the worker was ended' });
  }

  /** @param {{ code: string, message: string }} error */
  refuse(error) {
    for (const { reject } of this.waiting.values()) reject(new Failure(error));
    this.waiting.clear();
  }
}

export class Pool {
  /** @param {Promise<WebAssembly.Module>} module @param {(json: any) => void} other */
  constructor(module, other) {
    this.module = module;
    this.editor = new Hand(module, other);
    this.renderer = new Hand(module);
    /** @type {Hand | null} */
    this.spare = null;
    this.takeovers = 0;
  }

  // Keeps a worker in reserve, once the first picture is there.
  reserve() { this.spare ??= new Hand(this.module); }

  // Ends the renderer; the spare one takes over.
  replace() {
    this.renderer.end();
    this.renderer = this.spare ?? new Hand(this.module);
    this.spare = new Hand(this.module);
    this.takeovers += 1;
  }
}

// Loads and compiles the module.
/** @param {string | URL} url */
export async function load(url) {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url} cannot be loaded: ${response.status}`);
  const isNamed = response.headers.get('content-type')?.startsWith('application/wasm');
  return isNamed ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer());
}
