// @ts-check
// Answers the requests of a worker, one after the other.
import { paint } from './paint.js';

/** @typedef {(message: any, transfer?: Transferable[]) => void} Tell */

export class Answers {
  /** @param {import('./engine.js').Engine} engine @param {Tell} tell */
  constructor(engine, tell) {
    this.engine = engine;
    this.tell = tell;
    /** @type {Map<number, { stop: AbortController, finish: AbortController }>} */
    this.running = new Map();
    this.last = Promise.resolve();
  }

  /** @param {{ n: number, request: any, form?: string, range?: [number, number] }} asked */
  take(asked) {
    this.running.set(asked.n, { stop: new AbortController(), finish: new AbortController() });
    this.last = this.last.then(() => this.answer(asked));
    return this.last;
  }

  /** @param {number} n */
  stop(n) { this.running.get(n)?.stop.abort(); }

  // Ends a request with its result so far.
  /** @param {number} n */
  finish(n) { this.running.get(n)?.finish.abort(); }

  /** @param {{ n: number, request: any, form?: string, range?: [number, number] }} asked */
  async answer({ n, request, form, range }) {
    const { stop: { signal }, finish } = /** @type {{ stop: AbortController, finish: AbortController }} */ (this.running.get(n));
    try {
      for await (const { json, bytes } of this.engine.messages(request, signal, finish.signal)) {
        // Messages of the language server belong to no request.
        if (json.event === 'lsp') { this.tell({ json }); continue; }
        const painted = form && json.event === 'picture' && json.components ? paint(json, bytes, form, range) : null;
        if (painted) this.tell({ n, json, ...painted }, [painted.data.buffer, painted.pixels.buffer, ...(painted.halves ? [painted.halves.buffer] : [])]);
        else this.tell({ n, json, bytes }, [bytes.buffer]);
      }
    } catch (error) {
      const { message } = /** @type {Error} */ (error);
      this.tell({ n, json: { error: { code: codeOf(error) ?? (signal.aborted ? 'cancelled' : 'defect'), message, errors: [] } } });
    }
    this.running.delete(n);
    // Requests that wait come before the diagnostics of a text.
    if (this.running.size) return;
    try {
      for (const { json } of this.engine.others()) this.tell({ json });
    } catch (error) {
      // Without a code, the instance has failed before, which is told, and the next one is not ready yet.
      if (codeOf(error)) this.tell({ json: { event: 'defect', message: /** @type {Error} */ (error).message } });
    }
  }
}

// The code of a failed request. That of an aborted one is a number of the browser.
/** @param {any} error @returns {string | undefined} */
const codeOf = ({ code }) => (typeof code === 'string' ? code : undefined);
