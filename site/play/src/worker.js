// @ts-check
// One instance of the module in a worker. It takes { module }, then requests { n, request, paint }, and { stop: n }. It gives { ready },
// and the messages of each request as { n, json, bytes, … }; messages without a request have no n.
import { Engine, ShiboError } from './engine.js';
import { paint } from './paint.js';

/** @type {Engine} */
let engine;
/** @type {Map<number, AbortController>} */
const running = new Map();
let last = Promise.resolve();

/** @type {(message: any, transfer?: Transferable[]) => void} */
const tell = (message, transfer = []) => /** @type {any} */ (self).postMessage(message, transfer);

/** @param {{ n: number, request: any, form?: string }} asked */
async function answer({ n, request, form }) {
  const { signal } = /** @type {AbortController} */ (running.get(n));
  try {
    for await (const { json, bytes } of engine.messages(request, signal)) {
      // Messages of the language server belong to no request.
      if (json.event === 'lsp') { tell({ json }); continue; }
      const painted = form && json.event === 'picture' && json.components ? paint(json, bytes, form) : null;
      if (painted) tell({ n, json, ...painted }, [painted.data.buffer, painted.pixels.buffer, ...(painted.halves ? [painted.halves.buffer] : [])]);
      else tell({ n, json, bytes }, [bytes.buffer]);
    }
  } catch (error) {
    const code = error instanceof ShiboError ? error.code : signal.aborted ? 'cancelled' : 'defect';
    tell({ n, json: { error: { code, message: /** @type {Error} */ (error).message, errors: [] } } });
  }
  running.delete(n);
  // Requests that wait come before the diagnostics of a text.
  if (running.size) return;
  try {
    for (const { json } of engine.others()) tell({ json });
  } catch { /* the instance was replaced, and the next request tells it */ }
}

/** @param {MessageEvent} event */
onmessage = ({ data }) => {
  if (data.module) {
    engine = new Engine(data.module);
    engine.ready.then(() => tell({ ready: true }), (error) => tell({ failed: String(error) }));
  } else if (data.stop !== undefined) {
    running.get(data.stop)?.abort();
  } else {
    running.set(data.n, new AbortController());
    last = last.then(() => answer(data));
  }
};
