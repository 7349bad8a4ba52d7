import assert from 'node:assert/strict';
import { test } from 'node:test';
import { openAddress } from '../src/opening.js';
import { turn } from './fake.js';

// A page whose addresses are read once the test says so.
function page() {
  const made = { address: '#a', shown: [], refused: [], reading: new Map() };
  made.open = () => openAddress({
    address: () => made.address,
    read: (address) => new Promise((resolve, reject) => made.reading.set(address, { resolve, reject })),
    show: (graph) => made.shown.push(graph.text),
    refuse: (error) => { made.refused.push(error.message); },
  });
  return made;
}

test('an address is opened, or refused', async () => {
  const made = page();
  const first = made.open();
  made.reading.get('#a').resolve({ text: 'a' });
  assert.equal(await first, true);
  const second = made.open();
  made.reading.get('#a').reject(new Error('it is damaged'));
  assert.equal(await second, false);
  const none = made.open();
  made.reading.get('#a').resolve(null);
  assert.equal(await none, false);
  assert.deepEqual([made.shown, made.refused], [['a'], ['it is damaged']]);
});

test('answers for an address that is no longer shown are ignored', async () => {
  const made = page();
  const first = made.open();
  made.address = '#b';
  const second = made.open();
  made.reading.get('#b').resolve({ text: 'b' });
  await turn();
  made.reading.get('#a').resolve({ text: 'a' });
  assert.deepEqual(await Promise.all([first, second]), [false, true]);
  const third = made.open();
  made.address = '#c';
  made.reading.get('#b').reject(new Error('it is damaged'));
  assert.equal(await third, false);
  assert.deepEqual([made.shown, made.refused], [['b'], []]);
});
