// @ts-check
// Links: the graph and its values in the fragment of the address. A fragment is a stranger's, and has limits.

// Maximum length of a fragment, and of the text in it, in bytes.
export const MOST_FRAGMENT = 65536;
export const MOST_TEXT = 1 << 20;

// `of` is the shipped graph from which a text was made: paths in the text mean shipped files.
/** @typedef {{ graph?: string, of?: string, text?: string, preset: string | null, set: [string, string][] }} Linked */

/** @param {Uint8Array} bytes */
function base64url(bytes) {
  let text = '';
  for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
  return btoa(text).replaceAll('+', '-').replaceAll('/', '_').replace(/=+$/, '');
}

/** @param {string} text */
function bytesOf(text) {
  if (!/^[\w-]+$/.test(text)) throw new Error('the link is damaged');
  try {
    return Uint8Array.from(atob(text.replaceAll('-', '+').replaceAll('_', '/')), (c) => c.charCodeAt(0));
  } catch {
    throw new Error('the link is damaged');
  }
}

/** @param {string} text */
async function deflate(text) {
  const stream = new Blob([text]).stream().pipeThrough(new CompressionStream('deflate-raw'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Packed bytes are given in pieces of this length: each becomes at most half a MiB, so little is unpacked beyond the limit.
const PIECE = 512;

// Unpacks a text, and stops at the limit.
/** @param {Uint8Array<ArrayBuffer>} bytes */
export async function inflate(bytes) {
  let at = 0;
  const pieces = new ReadableStream({
    pull(control) {
      if (at < bytes.length) control.enqueue(bytes.slice(at, at += PIECE)); else control.close();
    },
  }, { highWaterMark: 0 });
  const reader = pieces.pipeThrough(new DecompressionStream('deflate-raw')).getReader();
  const decoder = new TextDecoder('utf-8', { fatal: true });
  let [text, length] = ['', 0];
  for (;;) {
    /** @type {ReadableStreamReadResult<Uint8Array>} */
    let part;
    try { part = await reader.read(); } catch { throw new Error('the link is damaged'); }
    if (part.done) break;
    length += part.value.length;
    if (length > MOST_TEXT) {
      reader.cancel().catch(() => {});
      throw new Error('the graph in the link has more than 1 MiB');
    }
    try { text += decoder.decode(part.value, { stream: true }); } catch { throw new Error('the link is damaged'); }
  }
  try { return text + decoder.decode(); } catch { throw new Error('the link is damaged'); }
}

/** @param {string} text */
const decoded = (text) => { try { return decodeURIComponent(text); } catch { throw new Error('the link is damaged'); } };

// Reads a fragment; null if it is empty.
/** @param {string} fragment @returns {Promise<Linked | null>} */
export async function read(fragment) {
  const text = fragment.replace(/^#/, '');
  if (!text) return null;
  if (text.length > MOST_FRAGMENT) throw new Error('the link has more than 64 KiB');
  const [head, ...rest] = text.split('&');
  /** @type {Linked} */
  const linked = { preset: null, set: [] };
  for (const one of rest) {
    const [kind, value = ''] = /** @type {[string, string]} */ (one.split(/=(.*)/s));
    if (kind === 'preset') linked.preset = decoded(value);
    if (kind === 'of' && /^[\w-]+$/.test(value)) linked.of = value;
    if (kind !== 'p') continue;
    const found = /^([^:]+):(.+)$/s.exec(decoded(value));
    if (found) linked.set.push([found[1], found[2]]);
  }
  if (head.startsWith('g=')) linked.text = await inflate(bytesOf(head.slice(2)));
  else if (/^shibo:[\w-]+$/.test(decoded(head))) linked.graph = decoded(head);
  else throw new Error('the link names no graph');
  return linked;
}

// The fragment of a graph and its values.
/** @param {Linked} of */
export async function fragment({ graph, of, text, preset, set }) {
  const head = graph ?? `g=${base64url(await deflate(text ?? ''))}`;
  const values = set.map(([name, value]) => `&p=${encodeURIComponent(`${name}:${value}`)}`);
  const made = [head, of ? `&of=${of}` : '', preset ? `&preset=${encodeURIComponent(preset)}` : '', ...values].join('');
  if (made.length > MOST_FRAGMENT) throw new Error('the graph is too long for a link: its packed text has more than 64 KiB');
  return `#${made}`;
}
