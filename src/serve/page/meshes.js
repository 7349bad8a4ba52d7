// @ts-check
// Reads meshes: OBJ and glb. Loaded when the first mesh is dropped.

const MOST = 2e6;

// Reads an OBJ file: faces with any number of corners, positive or negative indices. v points up in this format.
/** @typedef {{ positions: number[], uvs: number[], normals: number[], index: number[] }} Triangles */

/** @param {string} text */
export function obj(text) {
  /** @type {Record<string, number[][]>} */
  const lists = { v: [], vt: [], vn: [] };
  /** @type {Triangles} */
  const found = { positions: [], uvs: [], normals: [], index: [] };
  const known = new Map();
  /** @type {(word: string) => number} */
  const corner = (word) => {
    if (known.has(word)) return known.get(word);
    const [p, t, n] = word.split('/').map((w, i) => {
      const list = lists[['v', 'vt', 'vn'][i]];
      const at = w ? (+w < 0 ? list.length + +w : +w - 1) : null;
      if (at !== null && !list[at]) throw new Error(`a face names \`${word}\`, which is not there`);
      return at === null ? null : list[at];
    });
    found.positions.push(.../** @type {number[]} */ (p).slice(0, 3));
    if (t) found.uvs.push(t[0], 1 - (t[1] ?? 0));
    if (n) found.normals.push(...n.slice(0, 3));
    known.set(word, known.size);
    return known.size - 1;
  };
  for (const line of text.replace(/\\\r?\n/g, ' ').split('\n')) {
    const [kind, ...words] = line.trim().split(/\s+/);
    if (lists[kind]) lists[kind].push(words.map(Number));
    else if (kind === 'f') {
      const corners = words.map(corner);
      for (let i = 2; i < corners.length; i += 1) found.index.push(corners[0], corners[i - 1], corners[i]);
    }
  }
  return found;
}

/** @type {(a: number[], b: number[]) => number[]} */
const times = (a, b) => Array.from({ length: 16 }, (_, i) => [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + (i % 4)] * b[4 * (i >> 2) + k], 0));

/** @param {{ matrix?: number[], translation?: number[], rotation?: number[], scale?: number[] }} node */
function matrix({ matrix: given, translation: [x, y, z] = [0, 0, 0], rotation: [a, b, c, d] = [0, 0, 0, 1], scale: [p, q, r] = [1, 1, 1] }) {
  return given ?? [
    p * (1 - 2 * (b * b + c * c)), p * 2 * (a * b + c * d), p * 2 * (a * c - b * d), 0,
    q * 2 * (a * b - c * d), q * (1 - 2 * (a * a + c * c)), q * 2 * (b * c + a * d), 0,
    r * 2 * (a * c + b * d), r * 2 * (b * c - a * d), r * (1 - 2 * (a * a + b * b)), 0, x, y, z, 1,
  ];
}

// Triangles of the scene of a binary glTF file.
/** @param {ArrayBuffer} buffer */
export function glb(buffer) {
  const view = new DataView(buffer);
  const length = view.getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, length)));
  const start = 28 + length;
  /** @type {(at: number) => number[]} */
  const accessor = (at) => {
    const { bufferView, byteOffset = 0, componentType, count, type, normalized, sparse } = json.accessors[at];
    const part = json.bufferViews[bufferView];
    if (!part || sparse || part.buffer || json.buffers[0].uri) throw new Error('only what is in the file itself can be read, without sparse accessors');
    const n = /** @type {Record<string, number>} */ ({ SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 })[type];
    const [size, get, most] = /** @type {Record<number, [number, 'getFloat32' | 'getUint32' | 'getUint16' | 'getUint8', number]>} */ ({ 5126: [4, 'getFloat32', 1], 5125: [4, 'getUint32', 1], 5123: [2, 'getUint16', 65535], 5121: [1, 'getUint8', 255] })[componentType] ?? [];
    if (!n || !get) throw new Error('it has values of a kind that cannot be read');
    const stride = part.byteStride ?? size * n;
    const from = start + (part.byteOffset ?? 0) + byteOffset;
    return Array.from({ length: count * n }, (_, i) => view[get](from + Math.floor(i / n) * stride + (i % n) * size, true) / (normalized ? most : 1));
  };
  /** @type {Triangles} */
  const found = { positions: [], uvs: [], normals: [], index: [] };
  /** @type {(at: number, above: number[], depth: number) => void} */
  const visit = (at, above, depth) => {
    const node = json.nodes[at];
    const here = times(above, matrix(node));
    /** @type {(list: number[], w: number) => number[]} */
    const moved = (list, w) => list.map((_, i) => {
      const [o, k] = [i - (i % 3), i % 3];
      return here[k] * list[o] + here[4 + k] * list[o + 1] + here[8 + k] * list[o + 2] + w * here[12 + k];
    });
    for (const { attributes: a, indices, mode = 4, extensions } of json.meshes?.[node.mesh]?.primitives ?? []) {
      if (extensions?.KHR_draco_mesh_compression) throw new Error('it is compressed by Draco');
      if (mode !== 4) continue;
      const base = found.positions.length / 3;
      const positions = moved(accessor(a.POSITION), 1);
      for (const v of positions) found.positions.push(v);
      for (const v of a.TEXCOORD_0 === undefined ? [] : accessor(a.TEXCOORD_0)) found.uvs.push(v);
      for (const v of a.NORMAL === undefined ? [] : moved(accessor(a.NORMAL), 0)) found.normals.push(v);
      const list = indices === undefined ? positions.slice(0, positions.length / 3).map((_, i) => i) : accessor(indices);
      for (const i of list) found.index.push(base + i);
    }
    if (depth < 64) for (const child of node.children ?? []) visit(child, here, depth + 1);
  };
  const roots = json.scenes?.[json.scene ?? 0]?.nodes ?? (json.nodes ?? []).map((/** @type {unknown} */ _, /** @type {number} */ i) => i);
  for (const root of roots) visit(root, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], 0);
  return found;
}

// Texture coordinates for a mesh without them: each triangle is projected along the axis that its normal is nearest to,
// so that the material repeats once over the largest side. Vertices of several projections are split.
/** @param {Triangles} triangles @returns {Triangles} */
export function projected({ positions: p, normals: given, index }) {
  const side = [0, 1, 2].map((k) => p.reduce(([a, b], v, i) => (i % 3 === k ? [Math.min(a, v), Math.max(b, v)] : [a, b]), [Infinity, -Infinity]));
  const size = Math.max(...side.map(([a, b]) => b - a)) || 1;
  /** @type {(list: number[], at: number) => number[]} */
  const of = (list, at) => [list[3 * at], list[3 * at + 1], list[3 * at + 2]];
  const faces = [];
  const smooth = given.length === p.length ? given : p.map(() => 0);
  for (let i = 0; i + 2 < index.length; i += 3) {
    const corners = index.slice(i, i + 3);
    const [a, b, c] = corners.map((at) => of(p, at));
    const [x, y] = [b, c].map((to) => to.map((v, k) => v - a[k]));
    const n = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
    if (smooth !== given) for (const at of corners) for (let k = 0; k < 3; k += 1) smooth[3 * at + k] += n[k];
    faces.push({ corners, n });
  }
  /** @type {Triangles} */
  const found = { positions: [], uvs: [], normals: [], index: [] };
  const known = new Map();
  for (const { corners, n } of faces) {
    const axis = n.reduce((best, v, k) => (Math.abs(v) > Math.abs(n[best]) ? k : best), 0);
    const sign = Math.sign(n[axis]) || 1;
    for (const at of corners) {
      const key = 6 * at + 2 * axis + Number(sign > 0);
      if (!known.has(key)) {
        const [x, y, z] = of(p, at);
        const [u, v] = [[-sign * z, y], [x, -sign * z], [sign * x, y]][axis];
        known.set(key, known.size);
        found.positions.push(x, y, z);
        found.normals.push(...of(smooth, at));
        found.uvs.push(u / size, -v / size);
      }
      found.index.push(known.get(key));
    }
  }
  return found;
}

// Converts a mesh to a shape: inside a ball of radius 1, with normals and tangents. `span` is the mean length of one
// turn of u.
/** @param {Triangles} triangles @returns {Shape} */
export function shape(triangles) {
  const { positions: p, uvs, normals, index } = triangles;
  const count = p.length / 3;
  if (!index.length) throw new Error('it has no triangles');
  if (index.length / 3 > MOST) throw new Error(`it has more than ${MOST} triangles`);
  if (!p.every(Number.isFinite) || !uvs.every(Number.isFinite) || !index.every((i) => i < count)) throw new Error('it has numbers that are none');
  const sides = [0, 1, 2].map((k) => p.reduce(([a, b], v, i) => (i % 3 === k ? [Math.min(a, v), Math.max(b, v)] : [a, b]), [Infinity, -Infinity]));
  const middle = sides.map(([a, b]) => (a + b) / 2);
  let reach = 0;
  for (let i = 0; i < count; i += 1) reach = Math.max(reach, Math.hypot(...middle.map((m, k) => p[3 * i + k] - m)));
  if (!(reach > 0)) throw new Error('it is a point');
  const data = new Float32Array(11 * count);
  for (let i = 0; i < count; i += 1) {
    for (let k = 0; k < 3; k += 1) data[11 * i + k] = (p[3 * i + k] - middle[k]) / reach;
    if (normals.length === p.length) for (let k = 0; k < 3; k += 1) data[11 * i + 3 + k] = normals[3 * i + k];
    data[11 * i + 9] = uvs[2 * i];
    data[11 * i + 10] = uvs[2 * i + 1];
  }
  let [area, flat] = [0, 0];
  for (let i = 0; i < index.length; i += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => 11 * index[i + k]);
    const [x, y] = [b, c].map((to) => [0, 1, 2].map((k) => data[to + k] - data[a + k]));
    const [s, t] = [b, c].map((to) => [data[to + 9] - data[a + 9], data[to + 10] - data[a + 10]]);
    const n = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
    const turn = s[0] * t[1] - t[0] * s[1];
    area += Math.hypot(...n);
    flat += Math.abs(turn);
    for (const to of [a, b, c]) {
      for (let k = 0; k < 3; k += 1) {
        if (normals.length !== p.length) data[to + 3 + k] += n[k];
        data[to + 6 + k] += Math.sign(turn) * (x[k] * t[1] - y[k] * s[1]);
      }
    }
  }
  let foot = 0;
  for (let o = 0; o < data.length; o += 11) {
    const n = [...data.subarray(o + 3, o + 6)];
    const long = Math.hypot(...n) || 1;
    const dot = n.reduce((sum, v, k) => sum + v * data[o + 6 + k], 0) / (long * long);
    const t = n.map((v, k) => data[o + 6 + k] - dot * v);
    const wide = Math.hypot(...t) || 1;
    for (let k = 0; k < 3; k += 1) { data[o + 3 + k] = n[k] / long; data[o + 6 + k] = t[k] / wide; }
    foot = Math.min(foot, data[o + 1]);
  }
  const made = { data, index: Uint32Array.from(index) };
  return { make: () => made, span: Math.sqrt(area / Math.max(flat, 1e-9)), foot, view: [0.5, 0.3, 3.2] };
}
