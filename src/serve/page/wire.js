// @ts-check
// Draws the triangles of the graph's mesh over the picture, as its atlas lays them out.
import { latest, mesh } from './net.js';

// For meshes with more triangles, only the chart borders are drawn.
const MOST = 60_000;

// Lines between the corners of triangles, in shares of the picture.
/** @param {Mesh} mesh */
export function lines({ data, index }) {
  const path = new Path2D();
  /** @type {(n: number) => Vec2} */
  const at = (n) => [data[11 * n + 9], data[11 * n + 10]];
  const sides = new Map();
  for (let n = 0; n < index.length; n += 3) {
    for (let k = 0; k < 3; k += 1) {
      const [a, b] = [index[n + k], index[n + ((k + 1) % 3)]];
      const key = Math.min(a, b) * 2 ** 26 + Math.max(a, b);
      sides.set(key, (sides.get(key) ?? 0) + 1);
    }
  }
  for (const [key, count] of sides) {
    if (index.length > 3 * MOST && count > 1) continue;
    path.moveTo(...at(Math.floor(key / 2 ** 26)));
    path.lineTo(...at(key % 2 ** 26));
  }
  return path;
}

export class Wire {
  /** @param {HTMLElement} button @param {import('./picture.js').Picture} picture */
  constructor(button, picture) {
    this.button = button;
    this.picture = picture;
    this.on = false;
    /** @type {string | null} */
    this.id = null;
    this.generation = -1;
    /** @type {Path2D | null} */
    this.path = null;
    /** @type {string | null} */
    this.of = null;
    button.onclick = () => { this.on = !this.on; this.tell(); };
    this.fetch = latest(async () => {
      const { id, generation } = this;
      const found = await mesh({ g: generation });
      if (found && id === this.id) { [this.path, this.of] = [lines(found.make(1)), id]; this.tell(); }
    });
  }

  // Handles a new graph.
  /** @param {Scene} scene */
  follow(scene) {
    [this.id, this.generation] = [scene.mesh ?? null, scene.generation];
    this.button.hidden = !this.id;
    this.tell();
  }

  tell() {
    const shown = this.on && !!this.id;
    this.button.ariaPressed = String(shown);
    if (shown && this.of !== this.id) this.fetch();
    this.picture.wire = shown && this.of === this.id ? this.path : null;
    this.picture.draw();
  }
}
