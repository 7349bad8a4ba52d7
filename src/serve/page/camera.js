// @ts-check
// Camera of the lit view, and intersection of rays with a mesh.
const F = 1 / Math.tan((Math.PI / 180) * 20);

/** @type {(a: Vec, b: Vec) => number} */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @type {(a: Vec, b: Vec) => Vec3} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @type {(a: number[]) => Vec3} */
export const unit = (a) => { const l = Math.hypot(...a) || 1; return /** @type {Vec3} */ (a.map((c) => c / l)); };

// Axes of the camera: right, up and backward; and the scale of its picture in x and y.
/** @param {Vec3} eye @param {number} aspect */
function axes(eye, aspect) {
  const z = unit(eye);
  const x = unit([z[2], 0, -z[0]]);
  const scale = aspect >= 1 ? [F / aspect, F] : [F, F * aspect];
  return { x, y: cross(z, x), z, scale };
}

// Matrix of a camera at `eye` that looks at the origin.
/** @param {Vec3} eye @param {number} aspect */
export function camera(eye, aspect) {
  const length = Math.hypot(...eye);
  const { x, y, z, scale: [px, py] } = axes(eye, aspect);
  const [near, far] = [0.05, 40];
  const [pz, pw] = [(far + near) / (near - far), (2 * far * near) / (near - far)];
  return [
    px * x[0], py * y[0], pz * z[0], -z[0],
    px * x[1], py * y[1], pz * z[1], -z[1],
    px * x[2], py * y[2], pz * z[2], -z[2],
    0, 0, pz * -length + pw, length,
  ];
}

// Direction of the ray through a point of the picture, whose corners are ±1, y up; it is linear in the point.
/** @param {Vec3} eye @param {number} aspect @param {number[]} place */
export function rays(eye, aspect, [across, up]) {
  const { x, y, z, scale: [px, py] } = axes(eye, aspect);
  return [0, 1, 2].map((k) => x[k] * (across / px) + y[k] * (up / py) - z[k]);
}

// The same direction, normalised.
/** @type {(eye: Vec3, aspect: number, place: number[]) => Vec3} */
export const ray = (eye, aspect, place) => unit(rays(eye, aspect, place));

// First intersection of a ray with a mesh: position, normal, triangle and barycentric weights; null without one.
/** @param {Mesh} mesh @param {Vec3} from @param {Vec3} way */
export function hit({ data, index }, from, way) {
  let best = Infinity;
  /** @type {Hit | null} */
  let found = null;
  /** @type {(n: number) => Vec3} */
  const corner = (n) => { const at = index[n] * 11; return [data[at], data[at + 1], data[at + 2]]; };
  for (let n = 0; n < index.length; n += 3) {
    const a = corner(n);
    const b = corner(n + 1);
    const c = corner(n + 2);
    const [ab, ac] = [[b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]];
    const normal = cross(ab, ac);
    const facing = dot(normal, way);
    if (facing >= 0) continue;
    const t = (dot(normal, a) - dot(normal, from)) / facing;
    if (!(t > 0 && t < best)) continue;
    const p = [from[0] + way[0] * t - a[0], from[1] + way[1] * t - a[1], from[2] + way[2] * t - a[2]];
    const whole = dot(normal, normal);
    const [v, w] = [dot(cross(p, ac), normal) / whole, dot(cross(ab, p), normal) / whole];
    if (v < -1e-9 || w < -1e-9 || v + w > 1 + 1e-9) continue;
    best = t;
    found = { at: /** @type {Vec3} */ (p.map((x, k) => x + a[k])), normal: unit(normal), triangle: n / 3, weights: [1 - v - w, v, w] };
  }
  return found;
}
