// @ts-check
// Exports frames of the lit view as pictures in one archive: a turn of the shape, or a moving line of a comparison.

const table = Uint32Array.from({ length: 256 }, (_, n) => { let c = n; for (let k = 0; k < 8; k += 1) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1; return c; });
/** @param {Uint8Array} bytes */
function crc32(bytes) {
  let c = 0xffffffff;
  for (const b of bytes) c = table[(c ^ b) & 255] ^ (c >>> 8);
  return (c ^ 0xffffffff) >>> 0;
}

// Makes a ZIP archive without compression, since pictures are compressed already.
/** @param {{ name: string, bytes: Uint8Array<ArrayBuffer> }[]} files */
export function zip(files) {
  const parts = [];
  const directory = [];
  let at = 0;
  for (const { name, bytes } of files) {
    const title = new TextEncoder().encode(name);
    /** @param {boolean} central */
    const head = (central) => {
      const view = new DataView(new ArrayBuffer(central ? 46 : 30));
      const from = central ? 6 : 4;
      view.setUint32(0, central ? 0x02014b50 : 0x04034b50, true);
      if (central) view.setUint16(4, 20, true);
      for (const [i, v] of [20, 0x800, 0, 0, 0x21].entries()) view.setUint16(from + 2 * i, v, true);
      for (const [i, v] of [crc32(bytes), bytes.length, bytes.length].entries()) view.setUint32(from + 10 + 4 * i, v, true);
      view.setUint16(from + 22, title.length, true);
      if (central) view.setUint32(42, at, true);
      return new Uint8Array(view.buffer);
    };
    directory.push(head(true), title);
    parts.push(head(false), title, bytes);
    at += 30 + title.length + bytes.length;
  }
  const length = directory.reduce((sum, p) => sum + p.length, 0);
  const end = new DataView(new ArrayBuffer(22));
  end.setUint32(0, 0x06054b50, true);
  for (const place of [8, 10]) end.setUint16(place, files.length, true);
  end.setUint32(12, length, true);
  end.setUint32(16, at, true);
  return new Blob([...parts, ...directory, new Uint8Array(end.buffer)], { type: 'application/zip' });
}

// Draws `count` frames of `side` pixels; `step` is called for each, and stops the export by returning false.
/** @param {import('./lit.js').Lit} lit @param {number} count @param {number} side @param {(share: number) => boolean} step */
export async function frames(lit, count, side, step) {
  const { turn, wipe } = lit;
  const files = [];
  for (let i = 0; i < count; i += 1) {
    if (!step(i / count)) break;
    if (lit.pinned) lit.wipe = i / (count - 1); else lit.turn = turn + (2 * Math.PI * i) / count;
    lit.render(side, side);
    /** @type {Blob | null} */
    const blob = await new Promise((done) => { lit.canvas.toBlob(done); });
    files.push({ name: `frame_${String(i).padStart(3, '0')}.png`, bytes: new Uint8Array(await /** @type {Blob} */ (blob).arrayBuffer()) });
  }
  Object.assign(lit, { turn, wipe });
  lit.draw();
  return files.length === count ? files : null;
}
