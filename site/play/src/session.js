// @ts-check
// The model of this tab. The module is loaded once; other modules of the page import the model.
import { Model } from './model.js';
import { Pool, load } from './pool.js';

/** @type {Set<(json: any) => void>} */
const listeners = new Set();
// Calls `listener` with messages that the language server sends by itself.
/** @param {(json: any) => void} listener */
export const onserver = (listener) => { listeners.add(listener); };

/** @type {Pool | null} */
let pool = null;
/** @type {Model} */
export const model = new Model(/** @type {any} */ ({ get editor() { return pool?.editor; }, get renderer() { return pool?.renderer; }, replace: () => pool?.replace() }));

// Loads the module and starts the workers.
export async function start() {
  const module = await load(new URL('./shibo.wasm', import.meta.url));
  pool = new Pool(module, (json) => { for (const listener of listeners) listener(json); });
  await pool.editor.ready;
  return pool;
}
