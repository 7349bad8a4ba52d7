import assert from 'node:assert/strict';
import { test } from 'node:test';
import { deflateRawSync } from 'node:zlib';
import { MOST_TEXT, fragment, read } from '../src/links.js';

test('a link has the text and the values', async () => {
  const of = { text: '(version: 1) // シボ "x"', preset: 'fine & new', set: [['tint', '"#804020"'], ['gain', '0.5'], ['at', '(1, 2)']] };
  const made = await fragment(of);
  assert.match(made, /^#g=[\w-]+&preset=[^&]+&p=[^&]+&p=[^&]+&p=[^&]+$/);
  assert.deepEqual(await read(made), of);
  assert.deepEqual(await read('#shibo:oak&p=ring_width:2.5'), { graph: 'shibo:oak', preset: null, set: [['ring_width', '2.5']] });
  assert.equal((await read(await fragment({ ...of, of: 'calf' }))).of, 'calf');
  assert.equal(await read(''), null);
});

test('damaged links are refused', async () => {
  for (const [text, why] of [
    ['g=', /damaged/], ['g=!!', /damaged/], ['g=AAAA', /damaged/], ['%zz', /damaged/], ['shibo:../etc', /names no graph/], ['oak', /names no graph/],
    [`g=${deflateRawSync(Buffer.from([0xff, 0xfe])).toString('base64url')}`, /damaged/], [`g=${'A'.repeat(65536)}`, /64 KiB/],
  ]) await assert.rejects(read(`#${text}`), why, text.slice(0, 20));
});

test('unpacking stops at its limit', async () => {
  const packed = (length) => `#g=${deflateRawSync(Buffer.alloc(length, 32), { level: 9 }).toString('base64url')}`;
  assert.equal((await read(packed(MOST_TEXT))).text.length, MOST_TEXT);
  await assert.rejects(read(packed(MOST_TEXT + 1)), /1 MiB/);
  const before = process.memoryUsage().rss;
  await assert.rejects(read(packed(48 << 20)), /1 MiB/);
  assert.ok(process.memoryUsage().rss - before < 32 << 20);
});

test('a text that is too long for a link is refused', async () => {
  let [text, seed] = ['', 1];
  while (text.length < 100_000) { seed = (seed * 48271) % 2147483647; text += seed.toString(36); }
  await assert.rejects(fragment({ text, preset: null, set: [] }), /too long/);
});
