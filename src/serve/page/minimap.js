// @ts-check
// A small map of the level in a corner of the graph, with the part in view; and the areas of groups of nodes.
import { H, W } from './nodes.js';

/** @typedef {import('./nodes.js').Graph} Graph */

const [WIDE, HIGH, EDGE] = [180, 110, 12];

// Bounds of all boxes.
/** @param {Box[]} nodes */
export function bounds(nodes) {
  const found = { left: Infinity, top: Infinity, right: -Infinity, bottom: -Infinity };
  for (const { x, y } of nodes) {
    found.left = Math.min(found.left, x);
    found.top = Math.min(found.top, y);
    found.right = Math.max(found.right, x + W);
    found.bottom = Math.max(found.bottom, y + H);
  }
  return found;
}

export class Minimap {
  /** @param {Graph} graph */
  constructor(graph) {
    this.graph = graph;
    // Place of the map in the window of the graph, and its scale; null while all boxes are in view.
    /** @type {{ x: number, y: number, k: number, left: number, top: number, wide: number, high: number } | null} */
    this.place = null;
  }

  /** @param {number[]} view @param {Record<string, string>} colors */
  paint(view, colors) {
    const { graph } = this;
    const { nodes, canvas, context: c } = graph;
    const { left, top, right, bottom } = bounds(nodes);
    const whole = left >= view[0] && top >= view[1] && right <= view[2] && bottom <= view[3];
    this.place = null;
    if (!nodes.length || whole || canvas.clientWidth < 500 || canvas.clientHeight < 180) return;
    const k = Math.min((WIDE - 12) / (right - left), (HIGH - 12) / (bottom - top));
    const [wide, high] = [(right - left) * k + 12, (bottom - top) * k + 12];
    const [x, y] = [canvas.clientWidth - wide - EDGE, canvas.clientHeight - high - EDGE];
    this.place = { x, y, k, left, top, wide, high };
    c.setTransform(graph.ratio, 0, 0, graph.ratio, 0, 0);
    c.globalAlpha = 0.92;
    c.fillStyle = colors.bar;
    c.strokeStyle = colors.line;
    c.lineWidth = 1;
    c.beginPath();
    c.roundRect(x, y, wide, high, 6);
    c.fill();
    c.stroke();
    c.save();
    c.clip();
    c.globalAlpha = 1;
    const near = graph.at();
    nodes.forEach((node, i) => {
      c.fillStyle = i === near ? colors.accent : node.broken ? colors.bad : node.color ?? colors.dim;
      c.fillRect(x + 6 + (node.x - left) * k, y + 6 + (node.y - top) * k, Math.max(W * k, 1.5), Math.max(H * k, 1.5));
    });
    c.strokeStyle = colors.accent;
    c.lineWidth = 1.5;
    c.strokeRect(x + 6 + (view[0] - left) * k, y + 6 + (view[1] - top) * k, (view[2] - view[0]) * k, (view[3] - view[1]) * k);
    c.restore();
  }

  // The place of the level under a point of the map; null beside it.
  /** @param {MouseEvent} e @returns {Vec2 | null} */
  hit(e) {
    const { place } = this;
    const box = this.graph.canvas.getBoundingClientRect();
    const [x, y] = [e.clientX - box.left, e.clientY - box.top];
    if (!place || x < place.x || y < place.y || x > place.x + place.wide || y > place.y + place.high) return null;
    return [place.left + (x - place.x - 6) / place.k, place.top + (y - place.y - 6) / place.k];
  }
}

const MARGIN = 14;

// Areas behind the nodes that stand together in the text, with the name of each above its leftmost node. A level with one
// group has none.
/** @param {Graph} graph @param {Record<string, string>} colors */
export function paintGroups(graph, colors) {
  /** @type {Map<string, Box[]>} */
  const groups = new Map();
  for (const node of graph.nodes) if (node.group) groups.set(node.group, [...(groups.get(node.group) ?? []), node]);
  if (groups.size < 2) return;
  const c = graph.context;
  let turn = 0;
  for (const [name, nodes] of groups) {
    const hue = (turn * 137.5) % 360;
    turn += 1;
    c.fillStyle = `hsl(${hue} 45% 55% / .14)`;
    c.beginPath();
    for (const { x, y } of nodes) c.roundRect(x - MARGIN, y - MARGIN - 8, W + 2 * MARGIN, H + 2 * MARGIN + 8, 12);
    c.fill('nonzero');
    if (graph.scale < 0.35) continue;
    const first = nodes.reduce((best, node) => (node.x < best.x || (node.x === best.x && node.y < best.y) ? node : best));
    c.fillStyle = colors.text;
    c.globalAlpha = 0.85;
    c.font = '600 12px system-ui, sans-serif';
    c.fillText(name, first.x - 4, first.y - 8, W + MARGIN);
    c.globalAlpha = 1;
  }
}
