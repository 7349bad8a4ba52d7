// @ts-check
/** Shibo in Node and in browsers. The types are in `index.d.ts`, the messages in docs/protocol.md of the project. */

import { Engine, ShiboError } from "./engine.js";

export { ShiboError };

/** @typedef {import("./index.d.ts").Picture} Picture */
/** @typedef {import("./engine.js").Message} Message */

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
    // Messages that the language server sends by itself come last.
    messages.push(...own.others());
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
