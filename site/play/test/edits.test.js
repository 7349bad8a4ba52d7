// Values of nodes: tried before they are taken, dropped where the text refuses them, and written.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { fake, open, opened, turn } from './fake.js';

const edit = (value, node = 'noise') => ({ node, field: 'size', index: null, value });
const values = (...edits) => ({ preset: null, set: [], edits });
const refused = (told) => told.filter(([kind]) => kind === 'refused').map(([, one]) => one);

// A model at rest that shows the output `a`.
async function rested() {
  const made = fake();
  Object.assign(made.model, { size: 64, focus: 'a' });
  await open(made, 'one', opened('1'));
  await made.pool.renderer.draw();
  return { ...made, renderer: made.pool.renderer, editor: made.pool.editor };
}

test('values of nodes are tried, then shown', async () => {
  const { model, editor, renderer, told } = await rested();
  const before = model.generation;
  model.setValues(values(edit('3')));
  assert.equal(model.generation, before, 'not before they are tried');
  const one = editor.next('try');
  assert.deepEqual([one.request.graph, one.request.edits], ['graph of 1', [edit('3')]]);
  one.resolve({ text: 'one with 3', refused: [] });
  assert.deepEqual((await renderer.draw()).edits, [edit('3')]);
  assert.deepEqual(told.filter(([kind]) => kind === 'state').at(-1)[1].values, values(edit('3')));
  // Without them, nothing is tried.
  model.setValues({ preset: null, set: [], edits: [] });
  assert.equal(editor.waits('try'), 0);
  assert.equal((await renderer.draw()).edits, undefined);
});

test('a value that the text refuses is dropped with the reason', async () => {
  const { model, editor, renderer, told } = await rested();
  model.setValues(values(edit('3'), edit('-1', 'cells')));
  await editor.answer('try', { text: '', refused: [{ edit: edit('-1', 'cells'), why: 'it must be above 0' }] });
  assert.deepEqual(model.values, values(edit('3')));
  assert.deepEqual(refused(told), [{ edit: edit('-1', 'cells'), why: 'it must be above 0' }]);
  // The page has heard the accepted values before the refusal.
  const [state, no] = ['state', 'refused'].map((kind) => told.findLastIndex(([one]) => one === kind));
  assert.ok(state < no);
  assert.deepEqual((await renderer.draw()).edits, [edit('3')]);
});

test('while values are tried, newer ones wait, and the last ones count', async () => {
  const { model, editor, renderer } = await rested();
  for (const value of ['3', '4', '5']) model.setValues(values(edit(value)));
  assert.equal(editor.waits('try'), 1, 'one at a time');
  await editor.answer('try', { text: '', refused: [] });
  assert.deepEqual(model.values, values(edit('3')), 'a drag is followed');
  await renderer.draw();
  const last = editor.next('try');
  assert.deepEqual(last.request.edits, [edit('5')]);
  // Values of the file come meanwhile: those that are tried are not wanted any more.
  model.setValues({ preset: null, set: [], edits: [] });
  last.resolve({ text: '', refused: [] });
  await turn();
  assert.deepEqual(model.values, { preset: null, set: [] });
});

test('values that are tried do not outlive another graph', async () => {
  const made = await rested();
  const { model, editor } = made;
  model.setValues(values(edit('3')));
  const tried = editor.next('try');
  model.setText('two', { name: 'shibo:oak', values: { preset: null, set: [] } });
  tried.resolve({ text: '', refused: [] });
  await turn();
  assert.deepEqual(model.values, { preset: null, set: [] });
});

test('a new text drops the values that it does not take', async () => {
  const made = await rested();
  const { model, editor, renderer, told } = made;
  model.setValues(values(edit('3'), edit('7', 'cells')));
  await editor.answer('try', { text: '', refused: [] });
  await renderer.draw();
  await open(made, 'two', opened('2'));
  await editor.answer('try', { text: '', refused: [{ edit: edit('7', 'cells'), why: 'there is no node `cells`' }] });
  assert.deepEqual(model.values, values(edit('3')));
  assert.deepEqual(refused(told).map(({ why }) => why), ['there is no node `cells`']);
});

test('values of nodes are written, and a parameter is made of one', async () => {
  const { model, editor } = await rested();
  const kept = model.keep({ set: [], preset: null, edits: [edit('3')] }, { preset: null, set: [], edits: [] });
  const one = editor.next('keep');
  assert.deepEqual([one.request.edits, one.request.sha256, one.request.values], [[edit('3')], '1', {}]);
  one.resolve({ text: 'one with 3', sha256: '2' });
  assert.equal(await kept, '2');
  assert.equal(model.text, 'one with 3');
  await turn();
  await editor.answer('open', opened('2'));
  assert.deepEqual(model.values, { preset: null, set: [] });
  const promoted = model.keep({ promote: { node: 'noise', field: 'size' } }, null);
  const second = editor.next('keep');
  assert.deepEqual(second.request.promote, { node: 'noise', field: 'size' });
  second.resolve({ text: 'with a parameter', sha256: '3' });
  await promoted;
  assert.equal(model.text, 'with a parameter');
});
