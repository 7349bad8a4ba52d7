// Fields of numbers: the ranges and the steps of drags.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { dragged, softRange } from '../field.js';
import { keyOf, same, sent } from '../values.js';

test('numbers without a range go to twice their value', () => {
  assert.deepEqual(softRange(4), [0, 8]);
  assert.deepEqual(softRange(-2), [-4, 0]);
  assert.deepEqual(softRange(0), [0, 1]);
  assert.deepEqual(softRange(4, 1), [1, 8]);
  assert.deepEqual(softRange(4, null, 5), [0, 5]);
  assert.deepEqual(softRange(0.5, 0, 1), [0, 1]);
  assert.deepEqual(softRange(2.5, 0, 1e5), [0, 5]);
  assert.deepEqual(softRange(2, 1, 16), [1, 16]);
  assert.deepEqual(softRange(0, -180, 180, '°'), [-180, 180]);
  assert.deepEqual(softRange(0, 0, 1e9), [0, 1]);
  for (const value of [-1e9, -3, 0, 1e-9, 7, 1e9]) assert.ok(softRange(value)[0] < softRange(value)[1]);
});

test('a drag keeps to steps, which are finer with Shift', () => {
  assert.equal(dragged(0.38281, [0, 0.5], false, false), 0.383);
  assert.equal(dragged(0.38281, [0, 0.5], false, true), 0.3828);
  assert.equal(dragged(37.4, [0, 100], true, false), 37);
  assert.equal(dragged(-12.34, [-90, 90], false, false), -12.3);
});

test('values are compared and sent without their order', () => {
  const edit = { node: 'noise', field: 'size', index: null, value: '3' };
  const a = { preset: null, set: new Map([['a', '1'], ['b', '2']]), edits: [{ ...edit, before: '2' }] };
  assert.ok(same(a, { preset: null, set: [['b', '2'], ['a', '1']], edits: [edit] }));
  assert.ok(!same(a, { preset: null, set: a.set, edits: [{ ...edit, value: '4' }] }));
  assert.ok(!same(a, { preset: null, set: a.set }));
  assert.deepEqual(sent(a), { preset: null, set: [['a', '1'], ['b', '2']], edits: [edit] });
  assert.equal(keyOf({ ...edit, field: '', index: 0 }), 'noise  0');
});
