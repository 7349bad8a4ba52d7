// @ts-check
// Exports: one map, all maps or a glTF file, as files that the browser saves.
import { zip } from './frames.js';
import { MOST_SIZE } from './work.js';
import { model } from './session.js';

/** @typedef {{ name: string, bytes: Uint8Array<ArrayBuffer> }} Written */

/** @type {Map<string, { url?: string, cancel?: () => void, stopped?: boolean }>} */
const all = new Map();
let count = 0;

// Begins an export, and answers as the server of `shibo watch`.
/** @param {{ set?: string, target?: string, resolution?: number, format?: string }} wish */
export function begin(wish) {
  count += 1;
  const id = String(count);
  all.set(id, {});
  run(id, wish).catch((error) => {
    const stopped = all.get(id)?.stopped;
    model.news.tell('export', stopped ? { id, state: 'cancelled' } : { id, state: 'failed', message: error.message });
  });
  return new Response(JSON.stringify({ id }), { status: 200 });
}

/** @param {string} id */
export function stop(id) {
  const found = all.get(id);
  if (!found) return;
  found.stopped = true;
  found.cancel?.();
}

/** @param {string} id */
export const exported = (id) => all.get(id)?.url ?? '';

/** @param {string} id @param {{ set?: string, target?: string, resolution?: number, format?: string }} wish */
async function run(id, { set, target, resolution, format }) {
  const { chosen } = model;
  // A stranger's canvas may be very large: more than the usual is made on the user's wish only.
  const size = resolution ?? Math.min(MOST_SIZE, Math.max(...model.opened.canvas.resolution));
  /** @type {Written[]} */
  const files = [];
  const task = model.task((hand) => {
    files.length = 0;
    const request = format && !set
      ? { op: 'render', graph: hand.has?.graph, output: target, sizes: [size], as: format, ...chosen }
      : { op: 'write', graph: hand.has?.graph, outputs: target ? [target] : [], target: set, size, ...chosen };
    return hand.ask(request, ({ json, bytes }) => {
      if (!bytes?.length) return;
      const name = json.name ?? `${[json.output, json.channel].filter(Boolean).join('_')}.${format}`;
      files.push({ name, bytes: /** @type {Uint8Array<ArrayBuffer>} */ (bytes) });
    });
  });
  /** @type {{ cancel?: () => void }} */ (all.get(id)).cancel = task.cancel;
  await task;
  if (!files.length) throw new Error(target ? `\`${target}\` is the same everywhere: it has no file in this format` : 'there is nothing to write');
  const base = model.news.state(model).file.replace(/\.ron$/, '');
  const [name, blob] = files.length === 1 ? [files[0].name, new Blob([files[0].bytes])] : [`${base}.zip`, zip(files)];
  const url = URL.createObjectURL(blob);
  /** @type {{ url?: string }} */ (all.get(id)).url = url;
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
  model.news.tell('export', { id, state: 'done', name, bytes: blob.size });
}
