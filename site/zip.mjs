// Packs a folder with fixed times and in a fixed order: node zip.mjs FOLDER FILE.
import { readFile, readdir, writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { crc32 as known, deflateRawSync } from 'node:zlib';

const [folder, file] = process.argv.slice(2);
const TABLE = Int32Array.from({ length: 256 }, (_, n) => { let c = n; for (let k = 0; k < 8; k += 1) c = c & 1 ? (c >>> 1) ^ 0xedb88320 : c >>> 1; return c; });
/** @param {Uint8Array} bytes */
function slow(bytes) {
  let c = -1;
  for (const byte of bytes) c = TABLE[(c ^ byte) & 255] ^ (c >>> 8);
  return ~c >>> 0;
}
const crc32 = known ?? slow;

/** @type {(path: string) => Promise<string[]>} */
async function names(path) {
  const all = await readdir(join(folder, path), { withFileTypes: true });
  const lists = await Promise.all(all.map((one) => (one.isDirectory() ? names(join(path, one.name)) : [join(path, one.name)])));
  return lists.flat();
}

const [parts, directory] = [[], []];
let at = 0;
const list = (await names('')).sort((a, b) => (a < b ? -1 : 1));
for (const path of list) {
  const bytes = await readFile(join(folder, path));
  // Pictures do not become smaller.
  const packed = /\.(png|jpg)$/.test(path) ? null : deflateRawSync(bytes, { level: 9 });
  const body = packed && packed.length < bytes.length ? packed : bytes;
  const name = Buffer.from(path);
  const head = Buffer.alloc(26);
  // Version, UTF-8 names, method, the first day of 1980.
  [20, 0x800, body === bytes ? 0 : 8, 0, 0x21].forEach((value, i) => head.writeUInt16LE(value, 2 * i));
  [crc32(bytes), body.length, bytes.length].forEach((value, i) => head.writeUInt32LE(value, 10 + 4 * i));
  head.writeUInt16LE(name.length, 22);
  parts.push(Buffer.from('PK\x03\x04'), head, name, body);
  const rest = Buffer.alloc(14);
  rest.writeUInt32LE((0o100644 << 16) >>> 0, 6);
  rest.writeUInt32LE(at, 10);
  directory.push(Buffer.from('PK\x01\x02'), Buffer.from([20, 3]), head, rest, name);
  at += 30 + name.length + body.length;
}
const length = directory.reduce((sum, part) => sum + part.length, 0);
const end = Buffer.alloc(22);
end.write('PK\x05\x06', 'latin1');
for (const place of [8, 10]) end.writeUInt16LE(list.length, place);
end.writeUInt32LE(length, 12);
end.writeUInt32LE(at, 16);
await writeFile(file, Buffer.concat([...parts, ...directory, end]));
