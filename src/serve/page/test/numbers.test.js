// Numbers of formulas: their ranges, and their texts after a drag.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { dragged, range } from '../numbers.js';

test('gives numbers a range', () => {
  assert.deepEqual(range('0.5'), { value: 0.5, lo: 0, hi: 1, step: 0.001 });
  assert.deepEqual(range('2'), { value: 2, lo: 0, hi: 4, step: 0.01 });
  assert.deepEqual(range('0'), { value: 0, lo: 0, hi: 1, step: 0.001 });
  assert.equal(range('1_000').hi, 2000);
});

test('drags numbers within their range', () => {
  assert.equal(dragged('0.5', 0), '0.5');
  assert.equal(dragged('.50', 0), '.50');
  assert.equal(dragged('0.5', 50), '0.75');
  assert.equal(dragged('0.5', -1000), '0');
  assert.equal(dragged('2', 1000), '4');
  assert.equal(dragged('0.07', 10), '0.077');
  assert.equal(dragged('1e-3', 100), '0.002');
});
