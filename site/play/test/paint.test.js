import assert from 'node:assert/strict';
import { test } from 'node:test';
import { halves, paint, range } from '../src/paint.js';

const bytes = (...values) => new Uint8Array(Float32Array.from(values).buffer);

test('colours have the sRGB curve', () => {
  const json = { width: 2, height: 1, components: 3, meaning: 'color' };
  const { pixels } = paint(json, bytes(0, 0.0021, 0.2122307, 0.5, 1, 7), 'plain');
  assert.deepEqual([...pixels], [0, 7, 127, 255, 188, 255, 255, 255]);
});

test('numbers outside 0 to 1 are scaled', () => {
  const json = { width: 3, height: 1, components: 1, meaning: 'number' };
  const made = paint(json, bytes(-1, 0, 1), 'plain');
  assert.deepEqual(made.range, [-1, 1]);
  assert.deepEqual([...made.pixels].filter((_, i) => i % 4 === 0), [0, 128, 255]);
  assert.deepEqual([...made.halves], [0xbc00, 0, 0x3c00]);
  assert.deepEqual(range(Float32Array.of(0.2, NaN, 0.9), 'number'), [0, 1]);
  assert.deepEqual(range(Float32Array.of(-3, 1), 'data'), [-3, 3]);
});

test('given numbers become black and white, but not for colours', () => {
  const made = paint({ width: 3, height: 1, components: 1, meaning: 'number' }, bytes(0, 1, 4), 'plain', [0, 2]);
  assert.deepEqual([made.range, [...made.pixels].filter((_, i) => i % 4 === 0)], [[0, 2], [0, 128, 255]]);
  assert.deepEqual(paint({ width: 1, height: 1, components: 3, meaning: 'color' }, bytes(0, 1, 1), 'plain', [0, 2]).range, [0, 1]);
});

test('a picture that is the same everywhere is filled', () => {
  const json = { width: 2, height: 2, components: 3, meaning: 'color', value: [1, 0, 0] };
  const made = paint(json, new Uint8Array(0), 'plain');
  assert.deepEqual([made.data.length, ...made.pixels.slice(12)], [12, 255, 0, 0, 255]);
});

test('light brighter than white is scaled', () => {
  const made = paint({ width: 2, height: 1, components: 3, meaning: 'color' }, bytes(4, 0, 2, 0, Infinity, 1), 'light');
  assert.equal(made.scale, 4);
  assert.deepEqual([...made.pixels], [255, 0, 188, 255, 0, 255, 137, 255]);
});

test('half precision rounds to the nearest', () => {
  const values = [0, -0, 1, -2, 65504, 1e6, 6e-8, 5.9604645e-8, 1e-9, 0.1, 1 / 3, NaN, Infinity, 1.00048828125, 1.0009765625];
  const found = [...halves(Float32Array.from(values))];
  assert.deepEqual(found, [0, 0x8000, 0x3c00, 0xc000, 0x7bff, 0x7c00, 1, 1, 0, 0x2e66, 0x3555, 0x7e00, 0x7c00, 0x3c00, 0x3c01]);
});
