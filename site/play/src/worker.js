// @ts-check
// One instance of the module in a worker. It takes { module }, then requests { n, request, form, range }, { stop: n } and { finish: n }. It gives { ready },
// and the messages of each request as { n, json, bytes, … }; messages without a request have no n.
import { Answers } from './answers.js';
import { Engine } from './engine.js';

/** @type {Answers} */
let answers;

/** @type {import('./answers.js').Tell} */
const tell = (message, transfer = []) => /** @type {any} */ (self).postMessage(message, transfer);

/** @param {MessageEvent} event */
onmessage = ({ data }) => {
  if (data.module) {
    const engine = new Engine(data.module);
    answers = new Answers(engine, tell);
    engine.ready.then(() => tell({ ready: true }), (error) => tell({ failed: String(error) }));
  } else if (data.stop !== undefined) {
    answers.stop(data.stop);
  } else if (data.finish !== undefined) {
    answers.finish(data.finish);
  } else {
    answers.take(data);
  }
};
