// @ts-check
// Shapes that carry the material. A vertex: position, normal, tangent (towards +u), uv. v grows downwards, as in
// pictures. `k` is the fineness of the mesh, 1 for displaced surfaces.

// A grid of (nu + 1) × (nv + 1) vertices; `at` returns position, normal, tangent and uv for u, v in 0..1.
/**
 * @param {number} nu
 * @param {number} nv
 * @param {(u: number, v: number) => number[]} at
 */
function grid(nu, nv, at, flip = false) {
  /** @type {number[]} */
  const data = [];
  /** @type {number[]} */
  const index = [];
  for (let j = 0; j <= nv; j += 1) for (let i = 0; i <= nu; i += 1) data.push(...at(i / nu, j / nv));
  for (let j = 0; j < nv; j += 1) {
    for (let i = 0; i < nu; i += 1) {
      const a = j * (nu + 1) + i;
      const [b, c, d] = [a + 1, a + nu + 1, a + nu + 2];
      if (flip) index.push(a, b, c, b, d, c); else index.push(a, c, b, b, c, d);
    }
  }
  return { data, index };
}

/** @param {{ data: number[], index: number[] }[]} parts @returns {Mesh} */
function join(parts) {
  /** @type {number[]} */
  const data = [];
  /** @type {number[]} */
  const index = [];
  for (const part of parts) {
    const base = data.length / 11;
    for (const value of part.data) data.push(value);
    for (const value of part.index) index.push(value + base);
  }
  return { data: new Float32Array(data), index: new Uint32Array(index) };
}

const { PI, sin, cos } = Math;

/** @param {number} k */
function plane(k) {
  return join([grid(Math.round(320 * k), Math.round(320 * k), (u, v) => [2 * u - 1, 1 - 2 * v, 0, 0, 0, 1, 1, 0, 0, u, v])]);
}

/** @param {number} k */
function sphere(k) {
  /** @param {number} u @param {number} v */
  const at = (u, v) => {
    const [t, p] = [2 * PI * (u - 0.25), PI * v];
    const n = [sin(p) * sin(t + PI / 2), cos(p), sin(p) * cos(t + PI / 2)];
    return [...n, ...n, cos(t + PI / 2), 0, -sin(t + PI / 2), 2 * u, v];
  };
  return join([grid(Math.round(512 * k), Math.round(256 * k), at)]);
}

// The rims are rounded, so that edges catch highlights.
/** @param {number} k */
function cylinder(k) {
  const [r, h, e] = [0.78, 0.92, 0.07];
  const around = 3;
  const perimeter = (2 * PI * r) / around;
  /** @param {number} s */
  const profile = (s) => {
    // From the top centre over the rim, down the side, over the lower rim to the centre:
    // [radius, y, normal r, normal y].
    const [cap, arc, side] = [r - e, (PI / 2) * e, 2 * (h - e)];
    let d = s * (2 * cap + 2 * arc + side);
    if (d < cap) return [d, h, 0, 1, d];
    d -= cap;
    if (d < arc) { const a = d / e; return [r - e + e * sin(a), h - e + e * cos(a), sin(a), cos(a), cap + d]; }
    d -= arc;
    if (d < side) return [r, h - e - d, 1, 0, cap + arc + d];
    d -= side;
    if (d < arc) { const a = d / e; return [r - e + e * cos(a), -(h - e) - e * sin(a), cos(a), -sin(a), cap + arc + side + d]; }
    d -= arc;
    return [r - e - d, -h, 0, -1, cap + 2 * arc + side + d];
  };
  /** @param {number} u @param {number} s */
  const at = (u, s) => {
    const t = 2 * PI * u;
    const [radius, y, nr, ny, d] = profile(s);
    return [radius * sin(t), y, radius * cos(t), nr * sin(t), ny, nr * cos(t), cos(t), 0, -sin(t), around * u, d / perimeter];
  };
  return join([grid(Math.round(384 * k), Math.round(320 * k), at)]);
}

// A cube with rounded edges: each face point is clamped to a smaller cube and pushed out along the normal.
/** @param {number} k @param {(a: number, b: number, face: number) => number[]} [place] */
function cube(k, place = (a, b) => [(a + 1) / 2, (b + 1) / 2]) {
  const [half, round] = [0.8, 0.09];
  const axes = [
    [[1, 0, 0], [0, -1, 0], [0, 0, 1]], [[-1, 0, 0], [0, -1, 0], [0, 0, -1]], [[0, 0, -1], [0, -1, 0], [1, 0, 0]],
    [[0, 0, 1], [0, -1, 0], [-1, 0, 0]], [[1, 0, 0], [0, 0, 1], [0, 1, 0]], [[1, 0, 0], [0, 0, -1], [0, -1, 0]],
  ];
  // More vertices where the edges are round.
  /** @param {number} s */
  const warp = (s) => { const x = 2 * s - 1; return Math.sign(x) * (1 - (1 - Math.abs(x)) ** 1.35); };
  const faces = axes.map(([x, y, z], face) => grid(Math.round(96 * k), Math.round(96 * k), (u, v) => {
    const [a, b] = [warp(u), warp(v)];
    const p = [0, 1, 2].map((k) => half * (a * x[k] + b * y[k] + z[k]));
    const inner = p.map((c) => Math.max(-(half - round), Math.min(half - round, c)));
    const out = p.map((c, k) => c - inner[k]);
    const length = Math.hypot(...out) || 1;
    const n = out.map((c) => c / length);
    const dot = x.reduce((sum, c, k) => sum + c * n[k], 0);
    const t = x.map((c, k) => c - dot * n[k]);
    const tl = Math.hypot(...t) || 1;
    return [...inner.map((c, k) => c + round * n[k]), ...n, ...t.map((c) => c / tl), ...place(a, b, face)];
  }));
  return join(faces);
}

// Shapes of solids: each point of the surface has its own texel, computed by the server.
/** @type {(make: (k: number) => Mesh) => (k: number) => Mesh} */
const once = (make) => (k) => { const made = make(k); for (let i = 9; i < made.data.length; i += 11) made.data[i] /= 2; return made; };
/** @type {(a: number, b: number, face: number) => number[]} */
const inAtlas = (a, b, face) => [((face % 3) + 0.5 + 0.497 * a) / 3, (Math.floor(face / 3) + 0.5 + 0.497 * b) / 2];

/** @param {number} k */
function leg(k) {
  /** @param {number} y */
  const radius = (y) => (0.28 + 0.1 * cos(4.2 * y) + 0.05 * cos(13 * y)) * Math.sqrt(Math.max(0, 1 - y ** 16));
  /** @param {number} u @param {number} s */
  const at = (u, s) => {
    // More rings of vertices near the ends, where the surface closes.
    const v = 0.5 - 0.5 * cos(PI * s);
    const [t, y] = [2 * PI * u, 1 - 2 * v];
    const e = 1e-4;
    const slope = (radius(Math.min(1, y + e)) - radius(Math.max(-1, y - e))) / (Math.min(1, y + e) - Math.max(-1, y - e));
    const length = Math.hypot(1, slope);
    return [radius(y) * sin(t), y, radius(y) * cos(t), sin(t) / length, -slope / length, cos(t) / length, cos(t), 0, -sin(t), u, v];
  };
  return join([grid(Math.round(256 * Math.max(k, 0.5)), Math.round(360 * Math.max(k, 0.5)), at)]);
}

// A mesh of the engine: 11 numbers a vertex.
/** @param {ArrayBuffer} bytes @param {number} vertices @param {number} indices @param {number} perMm @param {number[]} middle @returns {Shape} */
export function meshShape(bytes, vertices, indices, perMm, middle) {
  const made = { data: new Float32Array(bytes, 0, vertices * 11), index: new Uint32Array(bytes, vertices * 44, indices) };
  let foot = 0;
  for (let i = 1; i < made.data.length; i += 11) foot = Math.min(foot, made.data[i]);
  return { make: () => made, perMm, middle, foot, view: [0.5, 0.3, 3.2] };
}

// `span`: length of one turn of u in units of the shape; `foot`: height at which it touches the ground.
/** @type {Record<string, Shape>} */
export const SHAPES = {
  sphere: { make: sphere, foot: -1, span: PI, view: [0.5, 0.12, 3.3] },
  plane: { make: plane, span: 2, view: [-0.35, 0.3, 3.2] },
  cylinder: { make: cylinder, foot: -0.92, span: (2 * PI * 0.78) / 3, view: [0.3, 0.28, 3.7] },
  cube: { make: cube, foot: -0.8, span: 1.6, view: [0.62, 0.42, 4.0] },
  'solid-sphere': { make: once(sphere), foot: -1, span: 2 * PI, solid: 'sphere', view: [0.5, 0.5, 3.3] },
  'solid-cube': { make: (k) => cube(k, inAtlas), foot: -0.8, span: 4.8, solid: 'cube', view: [0.62, 0.52, 4.0] },
  'solid-leg': { make: leg, foot: -1, span: 2, solid: 'leg', view: [0.5, 0.25, 3.4] },
};
