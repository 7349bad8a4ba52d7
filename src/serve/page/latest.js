// @ts-check
// Order of requests: one at a time. Of several waiting ones, the newest runs.

// Runs one `work` at a time; of the calls made meanwhile, only the last one runs. `forget` drops that call.
/**
 * @template {unknown[]} A
 * @param {(...args: A) => Promise<void>} work
 * @returns {((...args: A) => Promise<void>) & { forget: () => void }}
 */
export function latest(work) {
  let running = false;
  /** @type {A | null} */
  let next = null;
  /** @param {A} args */
  const run = async (args) => {
    if (running) { next = args; return; }
    running = true;
    try { await work(...args); } catch { /* the server has ended, or the graph has changed */ }
    running = false;
    if (next) { const args = next; next = null; run(args); }
  };
  return Object.assign((/** @type {A} */ ...args) => run(args), { forget: () => { next = null; } });
}
