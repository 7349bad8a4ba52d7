// @ts-check
// Everything that the page asks of a server, answered by the model in this tab: it replaces the net.js of `shibo watch`.
import { base64 } from './base64.js';
import { hello } from './begin.js';
import { model, photos, views } from './session.js';
import { samples } from './views.js';
import { begin, exported as made, stop } from './exports.js';
export { latest } from './latest.js';

/** @typedef {Record<string, string | number | boolean>} Args */

const GONE = 'it is not made here; `shibo watch` has it';
/** @type {(text: string, status?: number) => Response} */
const refusal = (text, status = 404) => new Response(text, { status });

/** @param {string} path @param {any} args */
export async function ask(path, args) {
  if (path === 'look') return look(args.t);
  if (path === 'probe') return probe(args);
  if (path === 'object') return views.drawing(args.t);
  if (path === 'graph') return views.level(args.g, args.u);
  if (path === 'stats') return args.g === model.stats.generation ? model.stats.nodes : [];
  if (path === 'marks') return views.marks(args.g);
  if (path === 'photo/beside') return photos.beside(args);
  return null;
}

/** @param {string} target @returns {Promise<About | null | undefined>} */
async function look(target) {
  const isNode = target.startsWith('@');
  const about = isNode ? await views.about(target) : { node: '', kind: '', doc: '', text: '', fields: [] };
  if (!about) return about;
  if (model.focus !== target) model.look(target);
  if (isNode && about.channels) {
    const base = about.channels.includes(target.split('.').at(-1) ?? '') ? target.replace(/\.[a-z_]+$/, '') : target;
    model.channels = about.channels.map((channel) => `${base}.${channel}`);
    model.work();
  }
  const best = model.best(target);
  return { ...about, shown: best ? model.news.shown(model, best) : null, object: model.objects.get(target) ?? null };
}

// The values of a pixel of the canvas.
/** @param {{ t: string, x: number, y: number }} args */
function probe({ t, x, y }) {
  const found = model.best(t);
  if (!found?.data) return null;
  const { canvas } = model.news.state(model).scene;
  const { json: { width, height, components, unit, size_mm }, data } = found;
  const share = [(x + 0.5) / canvas.resolution[0], (y + 0.5) / canvas.resolution[1]];
  const at = Math.min(height - 1, Math.floor(share[1] * height)) * width + Math.min(width - 1, Math.floor(share[0] * width));
  const values = [...data.subarray(at * components, (at + 1) * components)];
  const { type } = model.news.shown(model, found);
  const srgb = type === 'Rgb' ? [...found.pixels.subarray(4 * at, 4 * at + 3)] : null;
  return { mm: share.map((s, i) => s * size_mm[i]), values, type, unit: unit ?? '', srgb };
}

/** @param {string} path @param {Args} [args] */
export async function bitmap(path, args) {
  if (path === 'vary') return views.vary(/** @type {any} */ (args));
  if (path === 'thumb') return views.thumb(/** @type {any} */ (args));
  const found = args ? null : model.kept.get(path);
  if (!found) return null;
  return createImageBitmap(new ImageData(found.pixels, found.width, found.height), { colorSpaceConversion: 'none', premultiplyAlpha: 'none' });
}

// Texture of a channel: on the canvas, or on a shape cut from a solid.
/** @param {Scene} scene @param {ChannelMap} map @param {number} size @returns {Promise<Samples | null>} */
export async function worn(scene, { t, solid }, size) {
  return solid ? views.cut(scene.generation, t, solid, size) : samples(await model.picture(t));
}

// Exact values of a picture.
/** @param {any} args @returns {Promise<PictureValues | null>} */
export async function exact({ t }) {
  const found = await model.picture(t, true);
  if (!found?.data) return null;
  const { type, unit } = model.news.shown(model, found);
  return { width: found.json.width, height: found.json.height, channels: found.json.components, type, unit, data: found.data };
}

/** @param {any} args */
export const mesh = ({ g }) => views.mesh(g);
/** @param {any} args */
export const body = ({ g, o }) => views.body(g, o);

/** @type {ArrayBuffer | null} the light of the user's own panorama */
let own = null;

/** @param {File | null} file @param {string} [scene] @returns {Promise<ArrayBuffer | null>} */
export async function environment(file, scene) {
  if (!file && !scene) return own;
  const content = file ? await base64(file) : undefined;
  const { bytes } = await model.task((hand) => hand.ask({ op: 'light', environment: scene, content }));
  if (file) own = bytes.buffer;
  return bytes.buffer;
}

/** @param {File | null} file */
export const sendPhoto = (file) => photos.take(file);

/** @param {string} path @param {any} what @returns {Promise<Response>} */
export async function post(path, what) {
  if (path === 'values') { model.setValues(what); return refusal('', 200); }
  if (path === 'export') return begin(what);
  if (path === 'photo/fit') return photos.begin(what);
  if (path === 'photo/stop') { photos.stop(); return refusal('', 200); }
  const [, id] = /^export\/([^/]+)\/stop$/.exec(path) ?? [];
  if (id) { stop(id); return refusal('', 200); }
  return refusal(GONE);
}

/** @param {SentValues} values */
export const send = (values) => post('values', values);

// Changes the text: see `change` of the page of `shibo watch`.
/** @param {string | null} base @param {any} what @param {SentValues | null} then @returns {Promise<string>} */
export async function change(base, what, then = null) {
  if (base !== model.opened?.sha256) throw new Error('the text has changed meanwhile; nothing was written');
  if (what.values) return model.keep(what.values, then);
  if (what.preset) return model.keep({ set: what.preset.set, preset: what.preset.name, add: true }, then);
  if (what.promote) return model.keep({ promote: what.promote }, then);
  if (what.fitted) {
    const { found } = photos;
    if (!found) throw new Error('no fit is finished');
    return model.keep({ set: found.set, preset: what.fitted.name, comment: found.comment }, then);
  }
  const found = what.restore && model.texts.get(what.restore.to);
  if (!found) throw new Error(what.restore ? 'that text is no longer known' : GONE);
  model.replace(found.text, then, found.name);
  return what.restore.to;
}

// Shows the line of a node in the text.
/** @param {string} node */
export async function jump(node) {
  const about = await views.place(node);
  if (about) model.onjump(about);
}
export const addressed = () => '';
export const moved = async () => false;
export const again = () => false;
/** @returns {Promise<{ names: string[], shown: string }>} */
export const graphs = async () => { throw new Error(GONE); };
export const openGraph = async () => refusal(GONE);
// The formats of a map: the module writes no TIFF.
export const formats = ['png', 'exr'];
// Formats for other programs.
/** @returns {Promise<{ name: string, doc: string }[]>} */
export const targets = async () => (await hello).targets.map((/** @type {string} */ name) => ({ name, doc: '' }));
/** @param {string} id */
export const exported = (id) => made(id);

// Texts of modules of the page.
/** @param {string[]} names */
export const sources = (names) => Promise.all(names.map(async (name) => (await fetch(new URL(name, import.meta.url))).text()));

/** @param {(kind: string, data: any) => void} tell */
export function news(tell) { model.news.listen(tell); }
