// @ts-check
// Values in the texts of nodes are tried by the editor's worker before they are taken: the page hears which ones the text refuses.

/** @typedef {import('./work.js').Chosen} Chosen */
/** @typedef {{ edit: FieldEdit, why: string }} Refused */

/** @type {(edit: FieldEdit) => string} */
const keyOf = ({ node, field, index }) => JSON.stringify([node, field, index ?? null]);

/** @type {(edits: FieldEdit[], refused: Refused[]) => FieldEdit[]} */
function without(edits, refused) {
  const keys = new Set(refused.map(({ edit }) => keyOf(edit)));
  return edits.filter((edit) => !keys.has(keyOf(edit)));
}

export class Tries {
  /** @param {import('./work.js').Work} work */
  constructor(work) {
    this.work = work;
    this.isRunning = false;
    // Counts values that were taken or forgotten: older ones that were tried are not wanted any more.
    this.era = 0;
    /** @type {{ wanted: Chosen, values: Chosen, refused: Refused[], era: number, opened: any } | null} values that were tried, and are not taken yet */
    this.ready = null;
  }

  // The values to take: those that were tried, or the wanted ones if there is nothing to try. Otherwise they are tried.
  /** @param {Chosen} wanted @returns {{ wanted: Chosen, values: Chosen, refused: Refused[] } | null} */
  of(wanted) {
    const { ready, work: { opened, values } } = this;
    this.ready = null;
    if (ready && ready.era === this.era && ready.opened === opened) return ready;
    if (!opened || !wanted.edits?.length || JSON.stringify(wanted.edits) === JSON.stringify(values.edits)) return { wanted, values: wanted, refused: [] };
    this.run(wanted);
    return null;
  }

  // Tries values. Newer ones wait meanwhile.
  /** @param {Chosen} wanted */
  async run(wanted) {
    if (this.isRunning) return;
    this.isRunning = true;
    const { work, era } = this;
    const { opened } = work;
    const edits = wanted.edits ?? [];
    const refused = await this.refusals(edits);
    this.isRunning = false;
    this.ready = { wanted, values: { ...wanted, edits: without(edits, refused) }, refused, era, opened };
    work.take();
    work.work();
  }

  // Drops the values that a new text does not take.
  async again() {
    const { work } = this;
    const { generation, values: { edits } } = work;
    if (!edits) return;
    const refused = await this.refusals(edits);
    if (generation !== work.generation || !refused.length) return;
    work.values = work.fitting({ ...work.values, edits: without(edits, refused) });
    for (const one of refused) work.news.tell('refused', one);
  }

  /** @param {FieldEdit[]} edits @returns {Promise<Refused[]>} */
  async refusals(edits) {
    const { pool, opened } = this.work;
    const found = await pool.editor.ask({ op: 'try', graph: opened.graph, edits }).done.catch(() => null);
    return found?.refused ?? [];
  }
}
