import assert from 'node:assert/strict';
import { test } from 'node:test';
import { fake, open, opened, turn } from './fake.js';

// A model that shows the output `a` of the text `one`.
async function shown(outputs) {
  const made = fake();
  made.model.size = 64;
  made.model.focus = 'a';
  await open(made, 'one', opened('1', outputs));
  return made;
}

test('a text that comes while the renderer opens the one before gets its own pictures', async () => {
  const made = await shown();
  const { model, pool: { renderer } } = made;
  await renderer.draw();
  await open(made, 'two', opened('2'));
  const second = renderer.next('open');
  assert.equal(second.request.text, 'two');
  await open(made, 'three', opened('3'));
  second.resolve({ graph: 'graph of 2' });
  await turn();
  assert.equal(renderer.waits('look'), 0, 'no picture of an older text is asked for');
  await renderer.answer('open', { graph: 'graph of 3' });
  assert.equal((await renderer.draw()).graph, 'graph of 3');
  assert.equal(model.best('a').generation, model.generation);
  assert.match(model.best('a').id, /graph of 3/);
});

test('a failure of an older text stops no newer one', async () => {
  const made = await shown();
  const { model, pool: { renderer }, told } = made;
  await renderer.draw();
  // A task has no generation of its own.
  const task = model.task((hand) => hand.ask({ op: 'write', graph: hand.has.graph }));
  await open(made, 'two', opened('2'));
  renderer.next('write').resolve('of one');
  assert.equal(await task, 'of one');
  const again = model.task((hand) => hand.ask({ op: 'write', graph: hand.has.graph }));
  await turn();
  const second = renderer.next('open');
  await open(made, 'three', opened('3'));
  second.reject(Object.assign(new Error('two is broken'), { code: 'defect' }));
  await turn();
  assert.equal(model.paused, false);
  assert.deepEqual(model.errors, []);
  assert.ok(!told.some(([kind]) => kind === 'errors'));
  await renderer.answer('open', { graph: 'graph of 3' });
  const written = renderer.next('write');
  assert.equal(written.request.graph, 'graph of 3');
  written.resolve('of three');
  assert.equal(await again, 'of three');
  await turn();
  assert.equal((await renderer.draw()).graph, 'graph of 3');
});

test('values that come while the renderer waits are used', async () => {
  const made = fake();
  const { model, pool: { renderer } } = made;
  Object.assign(model, { size: 64, focus: 'a' });
  let ready = () => {};
  renderer.ready = new Promise((done) => { ready = done; });
  await open(made, 'one', opened('1', ['a'], [{ name: 'gain', source: { default: '1', line: [1, 1] } }]));
  model.setValues({ preset: null, set: [['gain', '2']] });
  await new Promise((done) => setTimeout(done, 450));
  model.setSize(32);
  ready();
  await turn();
  assert.equal(made.pool.takeovers, 0, 'a worker that loads is not ended');
  const request = await renderer.draw();
  assert.deepEqual([request.set, request.size], [{ gain: '2' }, 32]);
  assert.equal(model.best('a').generation, model.generation);
});

test('an event of an older text makes no object of an output', async () => {
  const made = await shown();
  const { model, pool: { renderer } } = made;
  const first = renderer.next('look');
  await open(made, 'two', opened('2'));
  first.heard({ json: { event: 'object', type: 'Points' } });
  first.resolve({});
  await turn();
  assert.equal(model.objects.size, 0);
  await renderer.answer('open', { graph: 'graph of 2' });
  assert.equal((await renderer.draw()).graph, 'graph of 2');
});

test('an output that was an object is drawn once a text makes a picture of it', async () => {
  const made = await shown();
  const { model, pool: { renderer } } = made;
  const first = renderer.next('look');
  first.heard({ json: { event: 'object', type: 'Points' } });
  first.resolve({});
  await turn();
  assert.equal(model.objects.get('a'), 'Points');
  assert.equal(renderer.waits('look'), 0);
  await open(made, 'two', opened('2'));
  await renderer.answer('open', { graph: 'graph of 2' });
  await renderer.draw();
  assert.equal(model.best('a').target, 'a');
});

test('a channel that a text takes away is not asked for', async () => {
  const made = fake();
  Object.assign(made.model, { size: 64, focus: 'm.height' });
  await open(made, 'one', opened('1', [{ name: 'm', type: 'Material', channels: ['base_color', 'height'] }]));
  assert.equal((await made.pool.renderer.draw()).target, 'm.height');
  await open(made, 'two', opened('2', [{ name: 'm', type: 'Material', channels: ['base_color'] }]));
  assert.ok(made.told.some(([kind, data]) => kind === 'look' && data.target === 'm.base_color'));
  assert.equal(made.pool.renderer.waits('open') + made.pool.renderer.waits('look'), 0);
});

test('a material in space is one picture', async () => {
  const made = fake();
  Object.assign(made.model, { size: 64, focus: 'wood' });
  await open(made, 'one', opened('1', [{ name: 'wood', type: 'SolidMaterial', channels: ['base_color', 'height'] }]));
  assert.equal((await made.pool.renderer.draw()).target, 'wood');
  assert.equal(made.pool.renderer.waits('look'), 0);
  assert.deepEqual(Object.keys(made.told.filter(([kind]) => kind === 'state').at(-1)[1].scene.pictures), ['wood']);
});

test('a task that cannot begin fails once', async () => {
  const made = await shown();
  const { model, pool: { renderer } } = made;
  await renderer.draw();
  renderer.has = null;
  const task = model.task((hand) => hand.ask({ op: 'write' }));
  await turn();
  const refused = assert.rejects(task, /broken/);
  await renderer.fail('open', { code: 'graph', message: 'broken' });
  await refused;
  assert.equal(renderer.waits('open'), 0);
});
