// @ts-check
/** Shibo in Node and in browsers. The types are in `index.d.ts`, the messages in docs/protocol.md of the project. */

/** @typedef {import("./index.d.ts").Picture} Picture */
/** @typedef {{ json: any, bytes: Uint8Array<ArrayBuffer> }} Message */

/** A request that failed. `code` is that of the protocol, `diagnostics` has the errors of a graph. */
export class ShiboError extends Error {
  /** @param {{ code: string, message: string, errors?: any[] }} error */
  constructor({ code, message, errors = [] }) {
    const first = errors[0];
    super(first ? `${message}: line ${first.line}: ${first.message}` : message);
    this.name = "ShiboError";
    this.code = code;
    this.diagnostics = errors;
  }
}

/**
 * Gives other tasks a turn. Unlike `setTimeout`, a message waits no 4 ms.
 * @returns {Promise<void>}
 */
function turn() {
  if (typeof setImmediate === "function") return new Promise((resolve) => setImmediate(resolve));
  return new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = () => {
      port1.close();
      resolve();
    };
    port2.postMessage(null);
  });
}

/** One instance of the module, and the requests that wait for it. */
class Engine {
  /** @param {WebAssembly.Module} module */
  constructor(module) {
    this.module = module;
    this.count = 0;
    /** @type {Promise<unknown>} */
    this.last = Promise.resolve();
    this.ready = this.start();
  }

  // Browsers refuse large modules on the main thread, unless they are instantiated without waiting.
  async start() {
    this.panic = "";
    const instance = await WebAssembly.instantiate(this.module, {
      shibo: {
        now: () => performance.now(),
        /** @param {number} at @param {number} length */
        told: (at, length) => {
          this.panic = new TextDecoder().decode(new Uint8Array(this.exports.memory.buffer, at, length));
        },
      },
    });
    this.exports = /** @type {any} */ (instance.exports);
  }

  /** Runs `work` after all requests before it. @template T @param {() => Promise<T>} work @returns {Promise<T>} */
  queued(work) {
    const done = this.last.then(work);
    this.last = done.catch(() => {});
    return done;
  }

  /** @param {Record<string, unknown>} request */
  send(request) {
    const bytes = new TextEncoder().encode(JSON.stringify(request));
    const at = this.exports.alloc(bytes.length);
    new Uint8Array(this.exports.memory.buffer, at, bytes.length).set(bytes);
    this.exports.ask(at, bytes.length);
    this.exports.free(at, bytes.length);
  }

  /**
   * All messages of a request. Gives other tasks a turn after each of them.
   * @param {Record<string, unknown>} request @param {AbortSignal} [signal] @returns {AsyncGenerator<Message>}
   */
  async *messages(request, signal) {
    await this.ready;
    const { exports } = this;
    this.contained(() => this.send({ ...request, id: ++this.count }));
    const id = this.count;
    let ended = false;
    try {
      for (;;) {
        signal?.throwIfAborted();
        const message = this.contained(() => this.message(this.exports.step()));
        ended = !message || Boolean(message.json.ok || message.json.error);
        if (!message) return;
        yield message;
        await turn();
      }
    } finally {
      // The caller was aborted, or wants no more messages. After a panic there is nothing to stop.
      if (!ended && this.exports === exports) this.stop(id);
    }
  }

  /** Stops a request whose messages nobody wants any more. @param {number} id */
  stop(id) {
    this.contained(() => {
      this.send({ op: "cancel", of: id, id: ++this.count });
      while (this.exports.step() !== 0);
    });
  }

  /** @param {number} at @returns {Message | null} */
  message(at) {
    if (at === 0) return null;
    const { buffer } = this.exports.memory;
    const [text, data] = [0, 4].map((offset) => new DataView(buffer).getUint32((at >>> 0) + offset, true));
    const start = (at >>> 0) + 8;
    const json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, start, text)));
    // The memory of the module changes with the next call, so the bytes are copied.
    return { json, bytes: new Uint8Array(buffer).slice(start + text, start + text + data) };
  }

  /** A panic ends an instance: it is replaced, and graphs must be opened again. @template T @param {() => T} call @returns {T} */
  contained(call) {
    try {
      return call();
    } catch (error) {
      if (!(error instanceof WebAssembly.RuntimeError)) throw error;
      const message = this.panic || error.message;
      this.exports = undefined;
      this.ready = this.start();
      throw new ShiboError({ code: "defect", message: `the engine failed and was started again: ${message}` });
    }
  }

  /** The answer of a request without events. @param {Record<string, unknown>} request */
  async answer(request) {
    for await (const { json } of this.messages(request)) {
      if (json.error) throw new ShiboError(json.error);
      if (json.ok) return json.ok;
    }
    throw new ShiboError({ code: "defect", message: "the engine gave no answer" });
  }
}

/** @type {Promise<Engine> | undefined} */
let engine;

/** @param {import("./index.d.ts").Source} [source] */
async function compiled(source) {
  if (source instanceof WebAssembly.Module) return source;
  if (source instanceof ArrayBuffer || ArrayBuffer.isView(source)) {
    return WebAssembly.compile(/** @type {BufferSource} */ (source));
  }
  // Bundlers recognise this form and copy the module.
  const own = new URL("./shibo.wasm", import.meta.url);
  const url = source === undefined ? own : new URL(source, globalThis.location?.href ?? import.meta.url);
  if (url.protocol === "file:") {
    const { readFile } = await import(/* @vite-ignore */ "node:fs/promises");
    return WebAssembly.compile(await readFile(url));
  }
  const response = await fetch(url);
  if (!response.ok) throw new ShiboError({ code: "load", message: `${url} cannot be loaded: ${response.status}` });
  return WebAssembly.compile(await response.arrayBuffer());
}

/** Loads the module; all other functions do it by themselves. A later call returns the first module. @param {import("./index.d.ts").Source} [source] */
export async function load(source) {
  engine ??= compiled(source).then(async (module) => {
    const made = new Engine(module);
    await made.ready;
    return made;
  });
  // After a failure, another source may be given.
  engine.catch(() => (engine = undefined));
  await engine;
}

/** @returns {Promise<Engine>} */
async function loaded() {
  await load();
  return /** @type {Promise<Engine>} */ (engine);
}

/** @param {Uint8Array | ArrayBuffer | string} content */
function base64(content) {
  const bytes = typeof content === "string" ? new TextEncoder().encode(content) : new Uint8Array(content);
  let text = "";
  for (let at = 0; at < bytes.length; at += 0x8000) text += String.fromCharCode(...bytes.subarray(at, at + 0x8000));
  return btoa(text);
}

/** The fields of a request that name a graph. @param {string} text @param {Record<string, Uint8Array | ArrayBuffer | string>} [files] */
function named(text, files = {}) {
  if (text.startsWith("shibo:")) return { graph: text };
  return { text, files: Object.fromEntries(Object.entries(files).map(([name, content]) => [name, base64(content)])) };
}

/** @param {Message} message @returns {Picture} */
function picture({ json, bytes }) {
  const { output, channel, width, height, components = 0, value, unit, meaning, size_mm } = json;
  const data = value ? new Float32Array(width * height * components) : new Float32Array(bytes.buffer);
  if (value) for (let at = 0; at < data.length; at++) data[at] = value[at % components];
  const name = channel ? `${output}.${channel}` : output;
  return { name, width, height, channels: components, data, unit: unit ?? null, meaning, sizeMm: size_mm };
}

/**
 * @param {string} text @param {import("./index.d.ts").RenderOptions} [options]
 * @returns {Promise<Record<string, Picture>>}
 */
export async function renderAll(text, options = {}) {
  const { output, resolution, set, preset, seed, files, signal } = options;
  const own = await loaded();
  return own.queued(async () => {
    signal?.throwIfAborted();
    const { graph } = await own.answer({ op: "open", ...named(text, files) });
    try {
      const sizes = resolution === undefined ? [] : [resolution];
      const request = { op: "render", graph, output, set, preset, seed, sizes };
      /** @type {Record<string, Picture>} */
      const pictures = {};
      for await (const message of own.messages(request, signal)) {
        if (message.json.error) throw new ShiboError(message.json.error);
        // Points, meshes and other objects have no pixels.
        if (message.json.components) {
          const made = picture(message);
          pictures[made.name] = made;
        }
      }
      return pictures;
    } finally {
      // The instance may be another one after a panic.
      await own.answer({ op: "close", graph }).catch(() => {});
    }
  });
}

/** @param {string} text @param {import("./index.d.ts").RenderOptions & { output: string }} options @returns {Promise<Picture>} */
export async function render(text, options) {
  if (!options?.output) throw new TypeError("`output` is missing: `render` makes one picture, `renderAll` makes all");
  const pictures = Object.values(await renderAll(text, options));
  if (pictures.length !== 1) {
    const names = pictures.map((one) => `\`${one.name}\``).join(", ");
    const message = `\`${options.output}\` has ${names ? `several pictures, ${names}` : "no pixels"}; name one picture`;
    throw new ShiboError({ code: "no-output", message });
  }
  return pictures[0];
}

/**
 * @param {string} text @param {import("./index.d.ts").WriteOptions} [options]
 * @returns {Promise<import("./index.d.ts").WrittenFile[]>}
 */
export async function write(text, options = {}) {
  const { target, outputs, resolution, set, preset, seed, files, signal } = options;
  const own = await loaded();
  return own.queued(async () => {
    signal?.throwIfAborted();
    const { graph } = await own.answer({ op: "open", ...named(text, files) });
    try {
      const request = { op: "write", graph, target, outputs, set, preset, seed, size: resolution };
      const written = [];
      for await (const { json, bytes } of own.messages(request, signal)) {
        if (json.error) throw new ShiboError(json.error);
        if (json.event === "file") written.push({ name: json.name, bytes });
      }
      return written;
    } finally {
      await own.answer({ op: "close", graph }).catch(() => {});
    }
  });
}

/** @param {Record<string, unknown> & { op: string }} request */
export async function ask(request) {
  const own = await loaded();
  return own.queued(async () => {
    const messages = [];
    for await (const message of own.messages(request)) messages.push(message);
    return messages;
  });
}

/** @param {string} text @param {Record<string, Uint8Array | ArrayBuffer | string>} [files] */
export async function check(text, files) {
  const own = await loaded();
  return (await own.queued(() => own.answer({ op: "check", ...named(text, files) }))).diagnostics;
}

/** @param {string} text @param {Record<string, Uint8Array | ArrayBuffer | string>} [files] */
export async function params(text, files) {
  const own = await loaded();
  return own.queued(async () => {
    const opened = await own.answer({ op: "open", ...named(text, files) });
    await own.answer({ op: "close", graph: opened.graph });
    return opened.params;
  });
}

export async function graphs() {
  const own = await loaded();
  return (await own.queued(() => own.answer({ op: "hello" }))).graphs;
}
