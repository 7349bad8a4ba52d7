// @ts-check
// A photograph beside the picture. A worker of its own has it, compares it and fits the graph to it, while the renderer makes pictures.
import { base64 } from './base64.js';
import { Hand } from './pool.js';

/** @typedef {{ name: string, comment: string, set: [string, string][], report: any }} Found */

// The largest file, as for `shibo watch`; and the length of a part of it, a multiple of 3.
const MOST = 64 << 20;
const PART = 6 << 20;
// Longest side of the picture that is compared, in pixels.
const SIDE = 512;

export class Photos {
  /** @param {import('./model.js').Model} model */
  constructor(model, make = () => new Hand(model.pool.module)) {
    this.model = model;
    this.make = make;
    /** @type {Hand | null} the worker that has the photograph */
    this.hand = null;
    /** @type {Found | null} the result of the last fit */
    this.found = null;
    this.count = 0;
    /** @type {{ id: number, request: import('./pool.js').Request | null, isStopped: boolean } | null} the fit that is at work */
    this.fit = null;
  }

  // Takes a photograph; without one, the page has put it away. Its worker ends with it, so that its memory is free.
  /** @param {File | null} file @returns {Promise<{ name: string, size: Vec2 }>} */
  async take(file) {
    if (file && file.size > MOST) throw new Error(`the file has more than ${MOST >> 20} MiB; scale it down`);
    this.hand?.end();
    this.hand = null;
    this.found = null;
    if (!file) return { name: '', size: [0, 0] };
    const hand = this.make();
    this.hand = hand;
    try {
      for (let at = 0; ; at += PART) {
        const more = at + PART < file.size;
        const answer = await hand.ask({ op: 'photo', name: file.name, content: await base64(file.slice(at, at + PART)), more }).done;
        if (!more) return answer;
      }
    } catch (error) {
      if (this.hand === hand) this.hand = null;
      hand.end();
      throw error;
    }
  }

  // Opens the graph in the worker of the photograph.
  /** @param {Hand} hand */
  async open(hand) {
    await hand.ready;
    await this.model.reopen(hand, { opened: this.model.opened });
    return hand.has?.graph;
  }

  // The differences of the shown picture from the photograph, in words; undefined if the graph changes before.
  /** @param {{ g: number, t: string, mm?: number }} of @returns {Promise<{ words?: string[] } | undefined>} */
  async beside({ g, t, mm }) {
    const { hand, model } = this;
    if (!hand || g !== model.generation) return undefined;
    const { chosen } = model;
    try {
      const graph = await this.open(hand);
      const found = await hand.ask({ op: 'beside', graph, target: t, mm, size: Math.min(SIDE, model.size), ...chosen }).done;
      return g === model.generation ? found : undefined;
    } catch (error) {
      const { code, message } = /** @type {import('./pool.js').Failure} */ (error);
      return code === 'cancelled' || g !== model.generation ? undefined : { words: [message] };
    }
  }

  // Begins a fit, and answers as the server of `shibo watch`. A fit that is at work ends.
  /** @param {{ g: number, mm?: number }} wish */
  begin({ g, mm }) {
    const { hand, model } = this;
    if (!hand) return new Response('no photograph is on the page', { status: 422 });
    if (g !== model.generation) return new Response(null, { status: 204 });
    this.fit?.request?.stop();
    this.count += 1;
    this.found = null;
    const fit = { id: this.count, request: null, isStopped: false };
    this.fit = fit;
    this.run(hand, fit, { g, mm });
    return new Response(JSON.stringify({ id: fit.id }), { status: 200 });
  }

  // Runs a fit. Any change of the graph ends it.
  /** @param {Hand} hand @param {NonNullable<Photos['fit']>} fit @param {{ g: number, mm?: number }} wish */
  async run(hand, fit, { g, mm }) {
    const { model } = this;
    const { id } = fit;
    const isOver = () => this.fit !== fit || g !== model.generation;
    /** @param {any} what */
    const tell = (what) => model.news.tell('fit', { id, ...what });
    const { chosen } = model;
    try {
      const graph = await this.open(hand);
      if (isOver()) { tell({ state: 'cancelled' }); return; }
      fit.request = hand.ask({ op: 'fit', graph, mm, ...chosen }, ({ json: { event, done, total, best, floor, set } }) => {
        if (isOver()) fit.request?.stop(); else if (event === 'fit') tell({ state: 'running', done, total, best, floor, set });
      });
      if (fit.isStopped) fit.request.finish();
      const found = await fit.request.done;
      if (isOver()) { tell({ state: 'cancelled' }); return; }
      this.found = found;
      tell({ state: 'done', set: found.set, name: found.name, report: found.report });
    } catch (error) {
      const { code, message } = /** @type {import('./pool.js').Failure} */ (error);
      if (code !== 'cancelled') tell({ state: 'failed', message });
      else if (fit.isStopped) tell({ state: 'failed', message: 'cancelled before the first render' });
      else tell({ state: 'cancelled' });
    } finally {
      if (this.fit === fit) this.fit = null;
    }
  }

  // Ends the fit; its best values so far are the result.
  stop() {
    const { fit } = this;
    if (!fit) return;
    fit.isStopped = true;
    fit.request?.finish();
  }
}
