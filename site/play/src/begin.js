// @ts-check
// Begins to load the module and the workers before the rest of the page is there.
import { Pool, load } from './pool.js';

/** @type {Set<(json: any) => void>} */
const listeners = new Set();
// Calls `listener` with messages that the language server sends by itself.
/** @param {(json: any) => void} listener */
export const onserver = (listener) => { listeners.add(listener); };

export const pool = new Pool(load(new URL('./shibo.wasm', import.meta.url)), (json) => { for (const listener of listeners) listener(json); });
// The version and the shipped graphs.
export const hello = pool.editor.ask({ op: 'hello' }).done;
// A failure is told where the answer is used.
hello.catch(() => {});
// The first request prepares the engine.
pool.renderer.ask({ op: 'check', text: '' }).done.catch(() => {});
