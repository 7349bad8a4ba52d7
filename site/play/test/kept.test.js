import assert from 'node:assert/strict';
import { test } from 'node:test';
import { bytesOf, trim } from '../src/kept.js';
import { fake, open, opened } from './fake.js';

const made = (n) => ({ data: new Float32Array(3 * n), pixels: new Uint8ClampedArray(4 * n) });

test('a buffer counts once, with exact values and half precision', () => {
  const one = { ...made(100), halves: new Uint16Array(100) };
  const bytes = bytesOf(new Map([['a', one]]), new Map([['a 1', { pixels: one.pixels }], ['a 0', { pixels: new Uint8ClampedArray(40) }]]));
  assert.equal(bytes, 1200 + 400 + 200 + 40);
});

test('the oldest looks go first, then exact values of other targets', () => {
  const [a, b] = [made(100), made(100)];
  const kept = new Map([['old', { pixels: new Uint8ClampedArray(400) }], ['a', { pixels: a.pixels }], ['new', { pixels: new Uint8ClampedArray(400) }], ['b', { pixels: b.pixels }]]);
  const pictures = new Map([['a', a], ['b', b]]);
  trim(pictures, kept, 'a', 3600);
  assert.deepEqual([...kept.keys()], ['a', 'new', 'b']);
  trim(pictures, kept, 'a', 2000);
  assert.deepEqual([...kept.keys()], ['a', 'b']);
  assert.deepEqual([!!pictures.get('a').data, pictures.get('b').data], [true, null]);
  assert.equal(b.data.length, 300, 'a picture that someone has got stays whole');
  assert.equal(bytesOf(pictures, kept), 2000);
});

test('pictures of any size stay within the limit', async () => {
  for (const size of [8, 64, 256]) {
    const it = fake();
    Object.assign(it.model, { size: 64, focus: 'a', most: 40 * 8 * size * size });
    await open(it, 'one', opened('1', ['a'], [{ name: 'gain', source: { default: '1', line: [1, 1] } }]));
    await it.pool.renderer.draw({ width: size, height: size });
    for (let i = 0; i < 100; i += 1) {
      it.model.setValues({ preset: null, set: [['gain', `${i}`]] });
      await it.pool.renderer.draw({ width: size, height: size });
      assert.ok(bytesOf(it.model.pictures, it.model.kept) <= it.model.most, `${size}: ${i}`);
    }
    assert.equal(it.model.kept.size, 79);
    assert.equal(it.model.pictures.size, 1);
  }
});

test('a selected target whose exact values were dropped is made again, sharp at once', async () => {
  const it = fake();
  const { model, pool: { renderer } } = it;
  Object.assign(model, { size: 300, focus: 'a', most: 0, costs: { 256: 1, 300: 1 } });
  await open(it, 'one', opened('1', ['a', 'b']));
  await renderer.draw();
  model.look('b');
  await renderer.draw();
  assert.equal(model.best('a').data, null);
  model.look('a');
  assert.equal((await renderer.draw()).size, 300);
  assert.ok(model.best('a').data);
  assert.equal(renderer.waits('look'), 0);
  // Another part of the page asks for exact values.
  const exact = model.picture('b', true);
  assert.equal((await renderer.draw()).target, 'b');
  assert.ok((await exact).data);
  assert.equal(renderer.waits('look'), 0);
});
