// Number fields: their texts as numbers, and the steps of their keys.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { evaluate, step, within } from '../entry.js';

test('reads numbers with a point or a comma', () => {
  const texts = { '0.7': 0.7, '0,7': 0.7, ' -2 ': -2, '.5': 0.5, ',5': 0.5, '1e-3': 0.001, '1_000': 1000, '−3': -3, '2.': 2 };
  for (const [text, wanted] of Object.entries(texts)) assert.equal(evaluate(text), wanted, text);
});

test('evaluates arithmetic', () => {
  const texts = { '0.5*2': 1, '1 + 2 * 3': 7, '(1 + 2) * 3': 9, '10 / 4': 2.5, '-2^2': -4, '2^-1': 0.5, '0,1 + 0,2': 0.3, '3 - -1': 4, '2×3÷4': 1.5, '1 - 2 - 3': -4 };
  for (const [text, wanted] of Object.entries(texts)) assert.equal(evaluate(text), wanted, text);
});

test('refuses other texts', () => {
  for (const text of ['', ' ', 'abc', '1 +', '(1', '1)', '1.2.3', '1,000,000', '0x10', '1/0', '2 3', 'inf', '*']) assert.ok(Number.isNaN(evaluate(text)), text);
});

test('steps by a hundredth of the range, or of the number', () => {
  assert.equal(step(0.5, [0, 1], false), 0.01);
  assert.equal(step(25, [-90, 90], false), 1);
  assert.equal(step(5, [0, 99], true), 1);
  assert.equal(step(0.22, null, false), 0.001);
  assert.equal(step(0, null, false), 0.01);
  assert.equal(step(40, null, false), 0.1);
});

test('keeps numbers within the range, and whole', () => {
  assert.equal(within(7, [0, 1], false), 1);
  assert.equal(within(-1, [0.05, 1], false), 0.05);
  assert.equal(within(2.6, null, true), 3);
  assert.equal(within(2.6, null, false), 2.6);
});
