// The digests of tests/golden/digests.ron: of a picture's samples, as bridge/src/lock/sample.rs makes them.
import { readFile } from "node:fs/promises";

const IV = [0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a, 0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19];
const ORDER = [2, 6, 3, 10, 7, 0, 4, 13, 1, 11, 12, 5, 9, 14, 15, 8];
const [START, END, PARENT, ROOT] = [1, 2, 4, 8];

/** The compression function of BLAKE3: the first eight words. */
function compress(chain, block, counter, length, flags) {
  const s = [...chain, ...IV.slice(0, 4), counter, 0, length, flags];
  const turn = (x, n) => (x >>> n) | (x << (32 - n));
  const mix = (a, b, c, d, x, y) => {
    s[a] = (s[a] + s[b] + x) | 0;
    s[d] = turn(s[d] ^ s[a], 16);
    s[c] = (s[c] + s[d]) | 0;
    s[b] = turn(s[b] ^ s[c], 12);
    s[a] = (s[a] + s[b] + y) | 0;
    s[d] = turn(s[d] ^ s[a], 8);
    s[c] = (s[c] + s[d]) | 0;
    s[b] = turn(s[b] ^ s[c], 7);
  };
  let m = block;
  for (let round = 0; round < 7; round++) {
    mix(0, 4, 8, 12, m[0], m[1]);
    mix(1, 5, 9, 13, m[2], m[3]);
    mix(2, 6, 10, 14, m[4], m[5]);
    mix(3, 7, 11, 15, m[6], m[7]);
    mix(0, 5, 10, 15, m[8], m[9]);
    mix(1, 6, 11, 12, m[10], m[11]);
    mix(2, 7, 8, 13, m[12], m[13]);
    mix(3, 4, 9, 14, m[14], m[15]);
    m = ORDER.map((at) => m[at]);
  }
  return s.slice(0, 8).map((x, i) => (x ^ s[i + 8]) | 0);
}

/** The output of a part of the input: a function of further flags. */
function part(bytes, chunk) {
  if (bytes.length > 1024) {
    const left = 1024 * 2 ** Math.floor(Math.log2((bytes.length - 1) / 1024));
    const block = [part(bytes.subarray(0, left), chunk)(0), part(bytes.subarray(left), chunk + left / 1024)(0)].flat();
    return (flags) => compress(IV, block, 0, 64, PARENT | flags);
  }
  const blocks = Math.max(1, Math.ceil(bytes.length / 64));
  let chain = IV;
  for (let at = 0; ; at++) {
    const taken = bytes.subarray(64 * at, 64 * at + 64);
    const padded = new Uint8Array(64);
    padded.set(taken);
    const block = [...new Int32Array(padded.buffer)];
    const flags = (at ? 0 : START) | (at === blocks - 1 ? END : 0);
    const before = chain;
    if (at === blocks - 1) return (more) => compress(before, block, chunk, taken.length, flags | more);
    chain = compress(chain, block, chunk, 64, flags);
  }
}

export function blake3(bytes) {
  return Buffer.from(new Int32Array(part(bytes, 0)(ROOT)).buffer).toString("hex");
}

const TYPES = { color: "Rgb", normal: "Normal", number: "Gray" };

/** The digest of a picture with `meaning`, `width`, `height`, `channels` and `data`. */
export function digest({ meaning, width, height, channels, data }) {
  // The planes of a tile come one after the other.
  const planes = new Float32Array(data.length);
  const count = width * height;
  for (let i = 0; i < data.length; i++) planes[(i % channels) * count + Math.floor(i / channels)] = data[i];
  const number = (value) => {
    const bytes = new Uint8Array(8);
    new DataView(bytes.buffer).setBigUint64(0, BigInt(value), true);
    return bytes;
  };
  const parts = [new TextEncoder().encode(TYPES[meaning]), number(width), number(height), new Uint8Array(planes.buffer)];
  return blake3(Buffer.concat(parts.flatMap((one) => [number(one.length), one]))).slice(0, 16);
}

/** The newest digests of each graph, by output. */
export async function golden() {
  const digests = new Map();
  const text = await readFile(new URL("../golden/digests.ron", import.meta.url), "utf8");
  let [graph, outputs] = ["", new Map()];
  for (const line of text.slice(text.indexOf("\n    graphs: {")).split("\n")) {
    const [, indent, name, value] = line.match(/^( +)"?([^":]+)"?: (.+)$/) ?? [];
    if (indent?.length === 8) graph = name;
    if (indent?.length === 12) digests.set(graph, (outputs = new Map()));
    if (indent?.length === 16) outputs.set(name, JSON.parse(value.replace(/,$/, "")));
  }
  return digests;
}
