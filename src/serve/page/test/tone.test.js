// Tone mapping and the values of pictures. A stand-in replaces the canvas of browsers.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { difference, histogram, isNeutral, neutral, profile, toned, valueAt, values } from '../tone.js';

/** Holds the pixels of an image, or those that were put there. */
class Canvas {
  constructor(width, height) { Object.assign(this, { width, height }); }
  getContext() { return this; }
  drawImage(image) { this.bytes = image.bytes; }
  getImageData() { return { data: this.bytes }; }
  createImageData(width, height) { return { data: new Uint8ClampedArray(4 * width * height) }; }
  putImageData(image) { this.bytes = image.data; }
}
globalThis.OffscreenCanvas = Canvas;

const gray = (width, height, data, range = [0, 1]) => ({ type: 'Gray', range, samples: { width, height, channels: 1, type: 'Gray', data: Float32Array.from(data) } });
const rgb = (data) => ({ type: 'Rgb', range: null, samples: { width: data.length / 3, height: 1, channels: 3, type: 'Rgb', data: Float32Array.from(data) } });
const pixels = (source, tone) => [...toned(source, { ...neutral(), ...tone }).bytes];
const close = (a, b) => assert.ok(Math.abs(a - b) < 1e-5, `${a} is not ${b}`);

test('only an unchanged tone is neutral', () => {
  assert.ok(isNeutral(neutral()));
  for (const tone of [{ range: [0, 2] }, { exposure: 1 }, { heat: true }, { contours: 0.5 }]) assert.ok(!isNeutral({ ...neutral(), ...tone }));
});

test('values of a height are decoded to its range', () => {
  const image = { width: 2, height: 1, bytes: Uint8ClampedArray.from([0, 0, 0, 255, 255, 255, 255, 255]) };
  const source = { image, type: 'Gray', range: [-1, 3] };
  assert.deepEqual([...values(source).data], [-1, 3]);
  assert.equal(values(source), values(source), 'decoded once');
});

test('values of a colour are decoded to linear light', () => {
  const image = { width: 1, height: 1, bytes: Uint8ClampedArray.from([0, 128, 255, 255]) };
  const { data, channels } = values({ image, type: 'Rgb', range: null });
  assert.equal(channels, 3);
  [0, 0.21586, 1].forEach((v, k) => close(data[k], v));
});

test('exact values come before decoded ones', () => {
  const source = gray(1, 1, [0.25]);
  source.decoded = { data: [7] };
  assert.equal(values(source), source.samples);
});

test('black and white point, and exposure, scale a height', () => {
  const source = gray(3, 1, [0, 1, 2], [0, 2]);
  assert.deepEqual(pixels(source, {}).filter((_, i) => i % 4 === 0), [0, 128, 255]);
  assert.deepEqual(pixels(source, { range: [1, 2] }).filter((_, i) => i % 4 === 0), [0, 0, 255]);
  assert.deepEqual(pixels(source, { exposure: 1 }).filter((_, i) => i % 4 === 0), [0, 255, 255]);
  assert.ok(pixels(source, {}).every((v, i) => i % 4 !== 3 || v === 255), 'opaque');
});

test('colours go back to their codes', () => {
  assert.deepEqual(pixels(rgb([0, 0.21586, 1]), {}), [0, 128, 255, 255]);
});

test('false colour is dark blue at black and dark red at white', () => {
  const [low, high] = [pixels(gray(1, 1, [0]), { heat: true }), pixels(gray(1, 1, [1]), { heat: true })];
  assert.ok(low[2] > low[1] && low[2] < 60 && high[0] > 100 && high[2] < 20, `${low} ${high}`);
});

test('contour lines lie where a multiple is crossed', () => {
  const source = gray(4, 1, [0.1, 0.2, 0.6, 0.7]);
  const lines = [0, 1, 2, 3].map((x) => pixels(source, { contours: 0.5 }).slice(4 * x, 4 * x + 3).join() === '235,120,40');
  // The last pixel borders on the first, since pictures repeat.
  assert.deepEqual(lines, [false, true, false, true]);
});

test('a toned picture is kept until the tone or the values change', () => {
  const source = gray(1, 1, [0.5]);
  const first = toned(source, neutral());
  assert.equal(toned(source, neutral()), first);
  assert.notEqual(toned(source, { ...neutral(), exposure: 1 }), first);
});

test('the histogram counts every finite value once', () => {
  const { bins, least, greatest, mean } = histogram(gray(4, 1, [0, 0.5, 1, NaN]), [0, 1], 4);
  assert.deepEqual([...bins[0]], [1, 0, 1, 1]);
  assert.deepEqual([least, greatest, mean], [0, 1, 0.5]);
  const outside = histogram(gray(2, 1, [-5, 9]), [0, 1], 4);
  assert.deepEqual([...outside.bins[0]], [1, 0, 0, 1], 'values outside of the range fall into the outer bins');
  assert.equal(histogram(gray(1, 1, [NaN]), [0, 1]).mean, 0);
  assert.equal(histogram(rgb([0, 0.5, 1]), [0, 1]).bins.length, 3);
});

test('a profile goes from one end to the other and wraps at the edges', () => {
  const source = gray(4, 1, [0, 1, 2, 3]);
  assert.deepEqual(profile(source, [0, 0], [0.75, 0], 4).flat(), [0, 1, 2, 3]);
  assert.deepEqual(profile(source, [-0.25, 0], [1, 0], 2).flat(), [3, 0]);
  assert.deepEqual(valueAt(source, [0.5, 0]), [2]);
});

test('differences are measured at the positions of the larger picture', () => {
  const { mean, rms, most } = difference(gray(2, 1, [1, 5]), gray(4, 1, [1, 1, 5, 9]));
  close(mean, 1);
  close(rms, 2);
  assert.equal(most, 4);
  assert.deepEqual(difference(gray(1, 1, [NaN]), gray(1, 1, [NaN])), { mean: 0, rms: 0, most: 0 });
  assert.equal(difference(gray(2, 1, [NaN, 1]), gray(2, 1, [0, 1])).most, Infinity);
});
