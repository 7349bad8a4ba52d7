// @ts-check
// The work for each node: that of the sharpest pictures of the present graph.

/** @type {Stat['state'][]} */
const ORDER = ['computed', 'disk', 'memory', 'folded', 'unused'];

export class Stats {
  constructor() {
    this.generation = -1;
    this.size = 0;
    /** @type {Stat[]} in the order of the graph */
    this.nodes = [];
  }

  // Adds the work for a picture. A node has the first of its states.
  /** @param {number} generation @param {number} size @param {Stat[]} [nodes] */
  add(generation, size, nodes = []) {
    const isSame = generation === this.generation;
    if (isSame && size < this.size) return;
    const before = isSame && size === this.size ? this.nodes : [];
    Object.assign(this, { generation, size });
    this.nodes = nodes.map((node, i) => {
      const known = before[i];
      if (!known) return node;
      const state = ORDER[Math.min(ORDER.indexOf(known.state), ORDER.indexOf(node.state))];
      return { ...node, state, seconds: known.seconds + node.seconds };
    });
  }
}
