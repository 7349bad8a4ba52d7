// @ts-check
/** One instance of the module `shibo.wasm`, and its requests. */

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
  const { setImmediate: soon } = /** @type {any} */ (globalThis);
  if (soon) return new Promise((resolve) => soon(resolve));
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
export class Engine {
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
   * All messages of a request. Gives other tasks a turn after each of them. With `signal` aborted, the request is dropped; with `finish`
   * aborted, it is asked for its result so far.
   * @param {Record<string, unknown>} request @param {AbortSignal} [signal] @param {AbortSignal} [finish] @returns {AsyncGenerator<Message>}
   */
  async *messages(request, signal, finish) {
    await this.ready;
    const { exports } = this;
    this.contained(() => this.send({ ...request, id: ++this.count }));
    const id = this.count;
    let [ended, isAsked] = [false, false];
    try {
      for (;;) {
        signal?.throwIfAborted();
        if (finish?.aborted && !isAsked) {
          isAsked = true;
          this.contained(() => this.send({ op: "cancel", of: id, id: ++this.count }));
        }
        const message = this.contained(() => this.message(this.exports.step()));
        // The answer to the line above.
        if (isAsked && message?.json.ok && message.json.id !== id) continue;
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

  /** Messages that answer no request, such as the diagnostics of a text that the language server was given. @returns {Generator<Message>} */
  *others() {
    for (;;) {
      const message = this.contained(() => this.message(this.exports.step()));
      if (!message) return;
      yield message;
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
