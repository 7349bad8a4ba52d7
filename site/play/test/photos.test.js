// A photograph: its worker, comparisons and fits.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Photos } from '../src/photos.js';
import { FakeHand, fake, open, opened, turn } from './fake.js';

globalThis.FileReader = class {
  async readAsDataURL(blob) {
    this.result = `data:;base64,${Buffer.from(await blob.arrayBuffer()).toString('base64')}`;
    this.onload();
  }
};
const fileOf = (bytes, name = 'felt.png') => new File([bytes], name);
const news = ({ told }) => told.filter(([kind]) => kind === 'fit').map(([, one]) => one);

// A model with a graph, and workers for photographs.
async function begun() {
  const made = fake();
  Object.assign(made.model, { size: 64, focus: 'a' });
  await open(made, 'one', opened('1'));
  await made.pool.renderer.draw();
  const hands = [];
  const photos = new Photos(made.model, () => { hands.push(new FakeHand()); return hands.at(-1); });
  return { ...made, photos, hands };
}

async function held() {
  const made = await begun();
  const taken = made.photos.take(fileOf('abc'));
  await turn();
  await made.hands[0].answer('photo', { name: 'felt.png', size: [4, 3] });
  await taken;
  return { ...made, hand: made.hands[0] };
}

// A fit whose graph is open.
async function fitting(made, wish = { g: made.model.generation, mm: 8 }) {
  const answer = made.photos.begin(wish);
  await turn();
  if (made.hand.waits('open')) await made.hand.answer('open', { graph: 'p1' });
  return answer;
}

test('a photograph is sent in parts, and its worker ends with it', async () => {
  const { photos, hands } = await begun();
  const taken = photos.take(fileOf(new Uint8Array((6 << 20) + 5)));
  for (const more of [true, false]) {
    while (!hands[0].waits('photo')) await turn();
    const { request, resolve } = hands[0].next('photo');
    assert.deepEqual([request.name, request.more, Buffer.from(request.content, 'base64').length], ['felt.png', more, more ? 6 << 20 : 5]);
    resolve(more ? {} : { name: 'felt.png', size: [4, 3] });
  }
  assert.deepEqual(await taken, { name: 'felt.png', size: [4, 3] });
  assert.deepEqual(await photos.take(null), { name: '', size: [0, 0] });
  assert.ok(hands[0].ended);
  assert.equal(photos.hand, null);
});

test('a file that is too large is refused before it is read, and the photograph of before stays', async () => {
  const { photos, hands, hand } = await held();
  await assert.rejects(photos.take({ name: 'a.png', size: (64 << 20) + 1 }), /more than 64 MiB; scale it down/);
  assert.equal(photos.hand, hand);
  // A refused file leaves no worker.
  const taken = assert.rejects(photos.take(fileOf('x')), /no picture/);
  await turn();
  await hands[1].fail('photo', { code: 'file', message: 'no picture' });
  await taken;
  assert.ok(hands[1].ended && photos.hand === null);
});

test('a comparison is about the graph that is shown, with its values', async () => {
  const made = await held();
  const { model, photos, hand } = made;
  model.values = { preset: null, set: [['gain', '2']], edits: [{ node: 'n', field: 'f', index: null, value: '1' }] };
  const words = photos.beside({ g: model.generation, t: 'a', mm: 8 });
  await turn();
  await hand.answer('open', { graph: 'p1' });
  const one = hand.next('beside');
  const { graph, target, mm, size, set, edits } = one.request;
  assert.deepEqual({ graph, target, mm, size, set, edits }, { graph: 'p1', target: 'a', mm: 8, size: 64, set: { gain: '2' }, edits: model.values.edits });
  one.resolve({ words: ['1.2 × coarser'] });
  assert.deepEqual(await words, { words: ['1.2 × coarser'] });
  // The reason is shown where they cannot be compared.
  const failed = photos.beside({ g: model.generation, t: 'a' });
  await turn();
  await hand.fail('beside', { code: 'usage', message: 'take larger ones' });
  assert.deepEqual(await failed, { words: ['take larger ones'] });
  assert.equal(await photos.beside({ g: model.generation + 1, t: 'a' }), undefined);
});

test('a fit tells its progress and its result', async () => {
  const made = await held();
  const answer = await fitting(made);
  assert.deepEqual(await answer.json(), { id: 1 });
  const fit = made.hand.next('fit');
  assert.deepEqual([fit.request.graph, fit.request.mm], ['p1', 8]);
  fit.heard({ json: { event: 'fit', done: 1, total: 40, best: 2, floor: null, set: [['gain', '1.5']] } });
  const found = { name: 'felt', comment: 'fitted to felt.png', set: [['gain', '1.25']], report: { distance: 1 } };
  fit.resolve(found);
  await turn();
  assert.deepEqual(news(made), [
    { id: 1, state: 'running', done: 1, total: 40, best: 2, floor: null, set: [['gain', '1.5']] },
    { id: 1, state: 'done', set: found.set, name: 'felt', report: found.report },
  ]);
  assert.equal(made.photos.found, found);
});

test('a fit that is stopped is asked for its result; a change of the graph drops it', async () => {
  const made = await held();
  await fitting(made);
  const first = made.hand.next('fit');
  made.photos.stop();
  assert.ok(first.finished && !first.stopped);
  first.reject(Object.assign(new Error('cancelled'), { code: 'cancelled' }));
  await turn();
  assert.deepEqual(news(made).at(-1), { id: 1, state: 'failed', message: 'cancelled before the first render' });
  await fitting(made);
  const second = made.hand.next('fit');
  made.model.setValues({ preset: null, set: [] });
  second.heard({ json: { event: 'fit', done: 3, total: 40 } });
  assert.ok(second.stopped && !second.finished);
  second.reject(Object.assign(new Error('cancelled'), { code: 'cancelled' }));
  await turn();
  assert.deepEqual(news(made).at(-1), { id: 2, state: 'cancelled' });
  assert.equal(made.photos.begin({ g: made.model.generation - 1 }).status, 204);
});
