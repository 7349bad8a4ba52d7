// @ts-check
// A larger picture of a node, beside its box: while the mouse rests on it, or with the space bar.
import { element } from './dom.js';
import { bitmap } from './net.js';
import { sent } from './values.js';
import { W } from './nodes.js';

// Side of the picture, and time that the mouse must rest, in ms.
const SIDE = 280;
const REST = 450;

export class Peek {
  // `values` returns the values of the graph.
  /** @param {import('./nodes.js').Graph} graph @param {HTMLElement} box @param {() => Values} values */
  constructor(graph, box, values) {
    this.graph = graph;
    this.box = box;
    this.values = values;
    this.turn = 0;
    this.index = -1;
    /** @type {number | undefined} */
    this.soon = undefined;
  }

  // Shows a box's picture after a moment; -1 for none.
  /** @param {number} index */
  rest(index) {
    clearTimeout(this.soon);
    if (index !== this.index) this.hide();
    if (index >= 0) this.soon = setTimeout(() => this.show(index), REST);
  }

  hide() {
    clearTimeout(this.soon);
    this.turn += 1;
    this.index = -1;
    this.box.hidden = true;
  }

  /** @param {number} index */
  toggle(index) { if (this.index === index) this.hide(); else if (index >= 0) this.show(index); }

  /** @param {number} index */
  async show(index) {
    const { graph } = this;
    const node = graph.nodes[index];
    if (!node || node.index === null || node.index === undefined || graph.patient) return;
    this.hide();
    const mine = this.turn;
    this.index = index;
    const name = graph.names[node.index];
    const target = node.use && node.output ? `@${name}:${node.ports[0].name}` : `@${name}`;
    const image = await bitmap('vary', { g: graph.generation, t: target, v: JSON.stringify(sent(this.values())), s: 2 * SIDE }).catch(() => null);
    if (!image || mine !== this.turn) { image?.close(); return; }
    const canvas = element('canvas', { width: image.width, height: image.height });
    canvas.getContext('2d')?.drawImage(image, 0, 0);
    image.close();
    this.box.replaceChildren(canvas, element('span', { textContent: `${node.label} · ${node.ports.map((p) => `${p.name} ${p.type}`).join(', ')}` }));
    this.box.hidden = false;
    // Beside the box, within the window.
    const at = graph.canvas.getBoundingClientRect();
    const x = at.left + at.width / 2 + (node.x + W - graph.center[0]) * graph.scale + 12;
    const y = at.top + at.height / 2 + (node.y - graph.center[1]) * graph.scale;
    const left = x + SIDE + 20 < innerWidth ? x : x - SIDE - 2 * 12 - W * graph.scale;
    this.box.style.left = `${Math.max(4, left)}px`;
    this.box.style.top = `${Math.max(4, Math.min(y, innerHeight - this.box.offsetHeight - 8))}px`;
    this.box.dataset.node = node.name;
  }
}
