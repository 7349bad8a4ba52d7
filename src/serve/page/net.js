// @ts-check
// Everything that the page asks of the server. Only this module and stream.js talk to it.
import { meshShape } from './shapes.js';
export { latest } from './latest.js';

/** @typedef {Record<string, string | number | boolean>} Args */

/** @type {(path: string, args: Args) => string} */
const query = (path, args) => `${path}?${new URLSearchParams(/** @type {Record<string, string>} */ (args))}`;

/** @type {(response: Response, name: string) => string[]} */
const header = (response, name) => /** @type {string} */ (response.headers.get(name)).split(' ');

// A request whose failure says that there is no connection.
/** @param {string} path @param {RequestInit} [options] */
async function request(path, options) {
  try {
    return await fetch(path, options);
  } catch {
    throw new Error('no connection: is `shibo watch` running?');
  }
}

// Undefined where there is no answer, as about a graph that is no longer shown.
/** @param {string} path @param {Args} args */
export async function ask(path, args) {
  const response = await request(query(path, args));
  return response.status === 200 ? response.json() : undefined;
}

/** @param {string} path @param {Args} [args] */
export async function bitmap(path, args) {
  const response = await request(args ? query(path, args) : path);
  if (response.status !== 200) return null;
  return createImageBitmap(await response.blob(), { colorSpaceConversion: 'none', premultiplyAlpha: 'none' });
}

/** @param {Args} args @returns {Promise<Samples | null>} */
export async function samples(args, path = 'map') {
  const response = await request(query(path, args));
  if (response.status !== 200) return null;
  const [width, height, form, scale = 1] = header(response, 'x-map');
  return { width: +width, height: +height, form, scale: +scale, data: await response.arrayBuffer() };
}

// Texture of a channel, on the canvas or a shape.
/** @param {Scene} scene @param {ChannelMap} map @param {number} s */
export function worn(scene, { t, solid }, s) {
  const about = { g: scene.generation, t, s };
  return solid ? samples({ ...about, shape: solid }, 'wear') : samples(about);
}

// Unconverted values of a field, by rows.
/** @param {Args} args @returns {Promise<PictureValues | null>} */
export async function exact(args) {
  const response = await request(query('map', { ...args, exact: true }));
  if (response.status !== 200) return null;
  const [width, height, form, type, unit] = header(response, 'x-map');
  const data = new Float32Array(await response.arrayBuffer());
  return { width: +width, height: +height, channels: +form.slice(4), type, unit: unit === 'deg' ? '°' : unit ?? '', data };
}

/** @param {Response} response @returns {Promise<[Shape, ArrayBuffer]>} */
async function shape(response) {
  const [vertices, indices, perMm, ...middle] = header(response, 'x-mesh').map(Number);
  const bytes = await response.arrayBuffer();
  return [meshShape(bytes, vertices, indices, perMm, middle), bytes.slice(vertices * 44 + indices * 4)];
}

// The mesh that shows the material.
/** @param {Args} args @returns {Promise<Shape | null>} */
export async function mesh(args) {
  const response = await request(query('mesh', args));
  return response.status === 200 ? (await shape(response))[0] : null;
}

// The body of an output, and its report.
/** @param {Args} args @returns {Promise<(Shape & { report: BodyReport }) | null>} */
export async function body(args) {
  const response = await request(query('body', args));
  if (!response.ok) throw new Error((await response.text()) || 'it could not be made');
  if (response.status !== 200) return null;
  const [made, report] = await shape(response);
  return { ...made, report: JSON.parse(new TextDecoder().decode(report)) };
}

// Light of a panorama: of a file, or of the last one sent in this run, if any. With a name, that of an environment of
// Relief. See serve/environment.rs.
/** @param {File | null} file @param {string} [scene] */
export async function environment(file, scene) {
  const response = await request(scene ? query('environment', { scene }) : 'environment', file ? { method: 'POST', headers: { 'content-type': 'application/octet-stream' }, body: file } : {});
  if (response.status === 200) return response.arrayBuffer();
  if (response.status === 503) throw new Error('another panorama is being read');
  if (!response.ok) throw new Error((await response.text()) || 'it could not be read');
  return null;
}

// Sends a photograph to compare with; without a file, the page has put it away.
/** @param {File | null} file @returns {Promise<{ name: string, size: Vec2 }>} */
export async function sendPhoto(file) {
  const path = query('photo', { name: file?.name ?? '' });
  const response = await request(path, { method: 'POST', headers: { 'content-type': 'application/octet-stream' }, body: file ?? '' });
  if (!response.ok) throw new Error((await response.text()) || 'it could not be read');
  return response.status === 200 ? response.json() : { name: '', size: [0, 0] };
}

/** @param {string} path @param {unknown} what */
export function post(path, what) {
  return request(path, { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify(what) });
}

/** @param {SentValues} values */
export const send = (values) => post('values', values);

// Changes the graph file, given the content it is based on, the change, and the parameter values to set afterwards.
// Returns the new content.
/** @param {string | null} base @param {unknown} what @param {SentValues | null} then @returns {Promise<string>} */
export async function change(base, what, then = null) {
  const response = await post('change', { base, change: what, then });
  if (!response.ok) throw new Error((await response.text()) || 'the file could not be changed');
  return (await response.json()).sha256;
}

// The graphs of the folder, and the shown one.
/** @returns {Promise<{ names: string[], shown: string }>} */
export async function graphs() {
  const response = await request('graphs');
  if (!response.ok) throw new Error(await response.text());
  return response.json();
}

// Shows another graph of the folder; the page is loaded again when the server has it.
/** @param {string} name */
export const openGraph = (name) => post('open', { name });

// The formats of a map.
export const formats = ['png', 'tiff', 'exr'];

// The formats for other programs.
/** @returns {Promise<{ name: string, doc: string }[]>} */
export async function targets() {
  const response = await request('targets');
  return response.ok ? response.json() : [];
}

// Shows the line of a node in the editor, if there is one.
/** @param {string} node */
export const jump = (node) => post('jump', { node }).catch(() => {});

// The target that the address of the page names.
export const addressed = () => decodeURIComponent(location.hash.slice(1));

// Loads the page again, for another graph. False if the page shows it as it is.
export function again() {
  location.replace(location.pathname);
  return true;
}

// Address of a finished export.
/** @param {string} id */
export const exported = (id) => `export/${id}`;

// Texts of modules of the page.
/** @param {string[]} names */
export const sources = (names) => Promise.all(names.map(async (name) => (await request(name)).text()));

// Returns whether `shibo watch` runs, but no longer at the address of this page.
export async function moved() {
  const response = await fetch('state').catch(() => null);
  return response?.status === 404;
}

// Receives news, through a shared worker if the browser has them.
/** @param {(kind: string, data: any) => void} tell */
export async function news(tell) {
  /** @param {string} kind @param {string} data */
  const told = (kind, data) => tell(kind, JSON.parse(data));
  if (window.SharedWorker) {
    try {
      const worker = new SharedWorker('stream.js', { type: 'module' });
      worker.port.onmessage = (e) => told(.../** @type {[string, string]} */ (e.data));
      worker.port.start();
      addEventListener('pagehide', () => worker.port.postMessage('bye'));
      // A page restored from the browser's cache has already disconnected.
      addEventListener('pageshow', (e) => { if (e.persisted) location.reload(); });
      return;
    } catch { /* as below */ }
  }
  const { listen } = await import('./stream.js');
  listen(told);
}
