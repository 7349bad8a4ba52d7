import assert from 'node:assert/strict';
import { test } from 'node:test';
import { fake, open, opened, turn } from './fake.js';

const params = ['gain', 'tint'].map((name) => ({ name, source: { default: '1', line: [1, 1] } }));
const one = opened('1', ['a'], params);
const values = (...set) => ({ preset: null, set });

async function shown() {
  const made = fake();
  Object.assign(made.model, { size: 64, focus: 'a' });
  await open(made, 'one', one, { name: 'shibo:oak' });
  made.texts = [];
  made.model.ontext = (text, isOther) => made.texts.push([text, isOther, made.model.name]);
  return made;
}

test('values are written into the text', async () => {
  const { model, pool, texts } = await shown();
  const kept = model.keep(values(['gain', '2']), values());
  await pool.editor.answer('keep', { text: 'one with 2', sha256: '2' });
  assert.equal(await kept, '2');
  assert.deepEqual(texts, [['one with 2', false, 'shibo:oak']]);
  assert.equal(model.text, 'one with 2');
});

test('text that is typed while values are written stays', async () => {
  const { model, pool, texts } = await shown();
  const kept = assert.rejects(model.keep(values(['gain', '2']), values()), /stays as you typed it/);
  model.setText('one, typed');
  await pool.editor.answer('keep', { text: 'one with 2', sha256: '2' });
  await kept;
  assert.equal(model.text, 'one, typed');
  assert.deepEqual(texts, []);
});

test('a graph that is opened while values are written stays', async () => {
  const { model, pool } = await shown();
  const kept = assert.rejects(model.keep(values(['gain', '2']), values()), /not written/);
  model.setText('one', { name: 'graph.ron', values: values() });
  await pool.editor.answer('keep', { text: 'one with 2', sha256: '2' });
  await kept;
  assert.deepEqual([model.text, model.name], ['one', 'graph.ron']);
});

// Values that wait for the step that makes the first picture.
async function waiting() {
  const made = await shown();
  made.model.setValues(values(['gain', '3']));
  assert.deepEqual(made.model.wanted, values(['gain', '3']));
  return made;
}

test('values that wait do not outlive a save, other values and another graph', async () => {
  for (const [name, change] of [
    ['save', async ({ model, pool }) => { const kept = model.keep(values(), values(['tint', '5'])); await pool.editor.answer('keep', { text: 'kept', sha256: '9' }); await kept; }],
    ['values', async ({ model }) => model.setText('other', { values: values(['tint', '5']) })],
    ['graph', async ({ model }) => model.setText('other', { name: 'shibo:calf', values: values(['tint', '5']) })],
    ['restored', async ({ model }) => model.replace('older', values(['tint', '5']), 'shibo:calf')],
  ]) {
    const made = await waiting();
    const began = made.model.generation;
    await change(made);
    assert.equal(made.model.wanted, null, name);
    // The time after which the values would have been taken.
    await new Promise((done) => setTimeout(done, 450));
    assert.deepEqual(made.model.values, values(['tint', '5']), name);
    assert.equal(made.model.generation, began, name);
  }
});

test('values that wait stay while the user types, as far as the new text has them', async () => {
  const made = await waiting();
  const { model, pool } = made;
  model.setValues(values(['gain', '3'], ['tint', '5']));
  await open(made, 'typed', opened('2', ['a'], [params[0]]));
  await pool.renderer.draw();
  assert.equal(model.wanted, null);
  assert.deepEqual(model.values, values(['gain', '3']));
});

test('a text is restored under the name of its graph', async () => {
  const made = await shown();
  const { model, texts } = made;
  await open(made, 'calf text', opened('2'), { name: 'shibo:calf', values: values() });
  const found = model.texts.get('1');
  assert.deepEqual(found, { name: 'shibo:oak', text: 'one' });
  model.replace(found.text, null, found.name);
  assert.deepEqual([model.name, model.text], ['shibo:oak', 'one']);
  assert.deepEqual(texts, [['one', true, 'shibo:oak']]);
  await turn();
  assert.equal(made.pool.editor.next('open').request.graph, 'shibo:oak');
});
