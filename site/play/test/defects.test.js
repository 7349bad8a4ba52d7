import assert from 'node:assert/strict';
import { mock, test } from 'node:test';
import { Answers } from '../src/answers.js';
import { Language } from '../src/language.js';
import { Hand } from '../src/pool.js';
import { FakeHand, fake, open, opened, turn } from './fake.js';

const defect = (message) => Object.assign(new Error(message), { code: 'defect' });

// An engine with prepared messages; functions throw.
const engine = (messages, others = []) => ({
  async* messages() { for (const one of messages) { if (typeof one === 'function') one(); yield { json: one, bytes: new Uint8Array(0) }; } },
  * others() { for (const one of others) { if (typeof one === 'function') one(); yield { json: one }; } },
});

async function answers(made) {
  const told = [];
  await new Answers(made, ({ n, json }) => told.push([n, json])).take({ n: 1, request: {} });
  return told;
}

test('a worker tells a failure while it checks a text', async () => {
  const lsp = { event: 'lsp', message: {} };
  assert.deepEqual(await answers(engine([{ ok: {} }], [lsp, () => { throw defect('it panicked'); }])), [[1, { ok: {} }], [undefined, lsp], [undefined, { event: 'defect', message: 'it panicked' }]]);
});

test('a worker tells the failure of a request once', async () => {
  const told = await answers(engine([() => { throw defect('it panicked'); }], [() => { throw new TypeError('exports is undefined'); }]));
  assert.deepEqual(told, [[1, { error: { code: 'defect', message: 'it panicked', errors: [] } }]]);
});

test('an aborted request is cancelled', async () => {
  const told = [];
  const all = new Answers({ async* messages(_request, signal) { all.stop(7); signal.throwIfAborted(); yield {}; }, others: () => [] }, ({ json }) => told.push(json.error.code));
  await all.take({ n: 7, request: {} });
  assert.deepEqual(told, ['cancelled']);
});

test('a failure without a request reaches the owner of the worker', () => {
  const logged = mock.method(console, 'error', () => {});
  globalThis.Worker = class { postMessage() {} };
  const others = [];
  const hand = new Hand(new Promise(() => {}), (json) => others.push(json));
  hand.has = { graph: 'g1' };
  const told = [];
  hand.ondefect = (message) => told.push(message);
  hand.worker.onmessage({ data: { json: { event: 'defect', message: 'it panicked' } } });
  hand.worker.onmessage({ data: { json: { event: 'lsp' } } });
  assert.deepEqual([told, others, hand.has, hand.runs, logged.mock.callCount()], [['it panicked'], [{ event: 'lsp' }], null, 1, 1]);
  delete globalThis.Worker;
  logged.mock.restore();
});

test('the language server gets files after they change, and again after a failure', async () => {
  const hand = new FakeHand();
  let files = { 'a.png': 'AA' };
  const language = new Language(hand, () => files);
  const send = async (begin) => {
    const done = begin();
    const one = hand.next('lsp');
    one.resolve({ messages: [] });
    await done;
    return one.request;
  };
  language.follow();
  assert.equal(hand.asked.length, 0, 'the first message has the files');
  assert.deepEqual((await send(() => language.send('one'))).files, files);
  assert.equal((await send(() => language.send('two'))).files, undefined);
  language.follow();
  assert.equal(hand.asked.length, 0);
  // A file is removed, and the text does not change.
  files = {};
  const told = await send(() => language.follow());
  assert.deepEqual([told.files, told.message.method], [{}, 'workspace/didChangeWatchedFiles']);
  language.restarted();
  assert.deepEqual((await send(() => language.send('three'))).files, {});
  // Files that did not arrive come again.
  files = { 'b.png': 'BB' };
  const refused = assert.rejects(language.send('four'), /too large/);
  hand.next('lsp').reject(new Error('too large'));
  await refused;
  assert.deepEqual((await send(() => language.send('five'))).files, files);
});

async function broken() {
  const made = fake();
  made.again = [];
  made.resumed = 0;
  made.model.onrestart = (isAgain) => made.again.push(isAgain);
  made.model.onresume = () => { made.resumed += 1; };
  // The engine fails: its owner is told before the request.
  made.panic = async () => {
    made.pool.editor.runs += 1;
    const one = made.pool.editor.next('open');
    made.pool.editor.ondefect('the engine failed and was started again: it panicked');
    one.reject(defect('it panicked'));
    await turn();
  };
  return made;
}

test('a text with which the engine fails twice is not opened again', async () => {
  const made = await broken();
  const { model, pool: { editor }, told } = made;
  model.setText('bad');
  await turn();
  await made.panic();
  assert.deepEqual(model.errors, []);
  await made.panic();
  assert.deepEqual(made.again, [true, false]);
  assert.equal(editor.waits('open'), 0);
  assert.match(model.errors[0].message, /failed twice with this text.*: it panicked$/);
  assert.match(told.at(-1)[1].errors[0].message, /change it to go on/);
  await model.sharp();
  // Another text is opened.
  await open(made, 'good', opened('1'));
  assert.equal(made.resumed, 1);
  assert.equal(model.opened.text, 'good');
  assert.deepEqual(model.errors, []);
  await open(made, 'better', opened('2'));
  assert.equal(made.resumed, 1);
});

test('a changed text is tried again, and rests by itself', async () => {
  const made = await broken();
  for (const text of ['bad', 'worse']) {
    made.model.setText(text);
    await turn();
    await made.panic();
    await made.panic();
    assert.equal(made.pool.editor.waits('open'), 0);
  }
  assert.deepEqual(made.again, [true, false, true, false]);
  // A file of the same text may help; if not, the text rests at once.
  made.model.setFile('a.png', 'AA');
  await turn();
  await made.panic();
  assert.equal(made.pool.editor.waits('open'), 0);
});

test('a graph of an engine that has failed is not closed in the new one', async () => {
  const made = await broken();
  await open(made, 'one', { ...opened('1'), graph: 'g1' });
  made.model.setText('two');
  await turn();
  await made.panic();
  await made.pool.editor.answer('open', { ...opened('2'), graph: 'g1' });
  assert.equal(made.pool.editor.waits('close'), 0);
  await open(made, 'three', { ...opened('3'), graph: 'g2' });
  assert.equal(made.pool.editor.next('close').request.graph, 'g1');
});
