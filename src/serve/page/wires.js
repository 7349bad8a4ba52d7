// @ts-check
// Wires of the graph: their lines, the names of their ports, the colours of their types, and ways along them by keyboard.
import { $, element } from './dom.js';
import { DX, DY, H, W } from './nodes.js';

/** @typedef {import('./nodes.js').Graph} Graph */

/** @param {Graph} graph @param {GraphWire} wire @param {number[]} view @param {number} near */
export function paintWire(graph, wire, view, near) {
  const { context: c, scale } = graph;
  const [a, b] = [graph.nodes[wire.from], graph.nodes[wire.to]];
  /** @type {Vec2[]} */
  const points = [[a.x + W, a.y + H / 2], ...wire.bends.map(([x, y]) => /** @type {Vec2} */ ([x * DX + W / 2, y * DY + H / 2])), [b.x, b.y + H / 2]];
  const [low, high] = [Math.min(...points.map((p) => p[1])), Math.max(...points.map((p) => p[1]))];
  if (points[0][0] > view[2] || points[points.length - 1][0] < view[0] || low > view[3] || high < view[1]) return;
  const touched = wire.from === near || wire.to === near;
  c.globalAlpha = touched ? 1 : near < 0 ? 0.55 : 0.28;
  c.strokeStyle = wire.color ?? '#777';
  c.lineWidth = (touched ? 2.4 : 1.5) * Math.max(1, 0.5 / scale);
  c.beginPath();
  c.moveTo(...points[0]);
  for (let i = 1; i < points.length; i += 1) {
    const [[x0, y0], [x1, y1]] = [points[i - 1], points[i]];
    const mid = (x0 + x1) / 2;
    c.bezierCurveTo(mid, y0, mid, y1, x1, y1);
  }
  c.stroke();
}

// Names of the ports at the wires of a node: beside the node at the other end of each, with the type.
/** @param {Graph} graph @param {number} near @param {Record<string, string>} colors */
export function paintPorts(graph, near, colors) {
  if (near < 0 || graph.scale < 0.5) return;
  const c = graph.context;
  c.font = '11px system-ui, sans-serif';
  /** @type {Map<string, { x: number, y: number, right: boolean, words: string[], color: string }>} */
  const labels = new Map();
  for (const wire of graph.wires) {
    if (wire.from !== near && wire.to !== near) continue;
    const into = wire.to === near;
    const other = graph.nodes[into ? wire.from : wire.to];
    const key = `${other.name} ${into}`;
    const known = labels.get(key);
    // Inputs of a formula have no names of their own.
    const port = wire.port === 'inputs' ? '' : wire.port ?? '';
    const words = [wire.output && wire.output !== port && port ? `${wire.output} → ${port}` : port || wire.output, wire.type ?? ''].filter(Boolean).join(', ');
    if (known) known.words.push(words);
    else labels.set(key, { x: into ? other.x + W + 5 : other.x - 5, y: other.y + H / 2, right: !into, words: [words], color: wire.color ?? colors.dim });
  }
  for (const { x, y, right, words: all, color } of labels.values()) {
    const words = all.filter(Boolean);
    words.slice(0, 4).forEach((text, i) => {
      const wide = c.measureText(text).width + 8;
      const left = right ? x - wide : x;
      const top = y - 9 + 19 * (i - (Math.min(words.length, 4) - 1) / 2);
      c.globalAlpha = 0.94;
      c.fillStyle = colors.raised;
      c.strokeStyle = color;
      c.lineWidth = 1;
      c.beginPath();
      c.roundRect(left, top, wide, 17, 4);
      c.fill();
      c.stroke();
      c.fillStyle = colors.text;
      c.fillText(text, left + 4, top + 12);
    });
  }
  c.globalAlpha = 1;
}

// Names the colours of the types of the wires.
/** @param {GraphWire[]} wires */
export function typeLegend(wires) {
  const colors = new Map(wires.filter((w) => w.type && w.color).map((w) => [/** @type {string} */ (w.type), /** @type {string} */ (w.color)]));
  $('types').replaceChildren(...[...colors].sort().map(([type, color]) => {
    const dot = element('i');
    dot.style.background = color;
    return element('span', {}, dot, type);
  }));
}

// The way along the wires: with ArrowLeft to what a node reads, with ArrowRight to its readers, up and down to the others of
// these.
export class Way {
  /** @param {Graph} graph */
  constructor(graph) {
    this.graph = graph;
    /** @type {number[]} */
    this.list = [];
  }

  /** @param {string} key @param {number} at @returns {Box | undefined} */
  go(key, at) {
    const { nodes, wires } = this.graph;
    /** @param {number[]} ends */
    const sorted = (ends) => [...new Set(ends)].sort((a, b) => nodes[a].y - nodes[b].y);
    if (key === 'ArrowLeft') this.list = sorted(wires.filter((w) => w.to === at).map((w) => w.from));
    else if (key === 'ArrowRight') this.list = sorted(wires.filter((w) => w.from === at).map((w) => w.to));
    else if (this.list.includes(at)) return nodes[this.list[(this.list.indexOf(at) + (key === 'ArrowDown' ? 1 : -1) + this.list.length) % this.list.length]];
    else return undefined;
    // Of several, the one at the same height comes first.
    const nearest = this.list.reduce((best, i) => (best < 0 || Math.abs(nodes[i].y - nodes[at].y) < Math.abs(nodes[best].y - nodes[at].y) ? i : best), -1);
    return nodes[nearest];
  }
}
