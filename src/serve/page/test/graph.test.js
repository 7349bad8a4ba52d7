// The graph and the stage: ways along the wires, bounds, and lengths of the scale bar.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { bounds } from '../minimap.js';
import { nice } from '../overlay.js';
import { H, W } from '../nodes.js';
import { Way } from '../wires.js';

// a and b feed c, which d and e read.
const nodes = [['a', 0, 0], ['b', 0, 130], ['c', 220, 130], ['d', 440, 0], ['e', 440, 260]].map(([name, x, y]) => ({ name, x, y }));
const wires = [[0, 2], [1, 2], [2, 3], [2, 4], [2, 4]].map(([from, to]) => ({ from, to, bends: [] }));

test('keys follow the wires, and go round the ends of the same side', () => {
  const way = new Way({ nodes, wires });
  // The source at the same height comes first.
  assert.equal(way.go('ArrowLeft', 2)?.name, 'b');
  assert.equal(way.go('ArrowUp', 1)?.name, 'a');
  assert.equal(way.go('ArrowUp', 0)?.name, 'b');
  assert.equal(way.go('ArrowRight', 2)?.name, 'd');
  assert.equal(way.go('ArrowDown', 3)?.name, 'e');
  assert.equal(way.go('ArrowDown', 4)?.name, 'd');
  assert.equal(way.go('ArrowRight', 4), undefined);
  // A node that the last step did not reach has no neighbours.
  assert.equal(way.go('ArrowDown', 2), undefined);
});

test('bounds enclose whole boxes', () => {
  assert.deepEqual(bounds(nodes), { left: 0, top: 0, right: 440 + W, bottom: 260 + H });
});

test('lengths of the scale bar are 1, 2 or 5 times a power of ten', () => {
  const wanted = { 0.013: 0.01, 1: 1, 1.99: 1, 2: 2, 4.9: 2, 5: 5, 9.9: 5, 10: 10, 730: 500 };
  for (const [given, length] of Object.entries(wanted)) assert.equal(nice(Number(given)), length, given);
});
