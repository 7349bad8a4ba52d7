// Nodes, levels, variations, shapes and meshes, as the page asks for them.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { meshShape } from '../../../src/serve/page/shapes.js';
import { Stats } from '../src/stats.js';
import { Views } from '../src/views.js';
import { fake, open, opened, turn } from './fake.js';

// Browsers make pictures smaller.
globalThis.ImageData = class { constructor(data, width, height) { Object.assign(this, { data, width, height }); } };
globalThis.createImageBitmap = async (image, { resizeWidth, resizeHeight }) => ({ width: resizeWidth, height: resizeHeight, of: image });

const gain = { name: 'gain', source: { default: '1', line: [1, 1] } };

// A model at rest that shows the output `a`.
async function rested() {
  const made = fake();
  Object.assign(made.model, { size: 64, focus: 'a' });
  await open(made, 'one', { ...opened('1', ['a'], [gain]), mesh: true });
  await made.pool.renderer.draw();
  return { ...made, renderer: made.pool.renderer, editor: made.pool.editor, views: new Views(made.model, meshShape) };
}

// Answers the next picture that is no part of the page.
async function paint(renderer, { width = 200, height = 100, event = 'picture', ...more } = {}) {
  await turn();
  const one = renderer.next('look');
  const json = { event, key: 'k', width, height, components: 3, meaning: 'color', ...more };
  one.heard(event === 'picture' ? { json, pixels: new Uint8ClampedArray(4 * width * height), data: new Float32Array(3), scale: 2 } : { json });
  one.resolve({});
  await turn();
  return one;
}

test('a variation has other values and the given black and white, and is small', async () => {
  const { model, renderer, views } = await rested();
  const made = views.vary({ g: model.generation, t: 'a', v: JSON.stringify({ preset: null, set: [['gain', '3']] }), lo: -1, hi: 2, s: 50 });
  const { request, range } = await paint(renderer);
  assert.deepEqual([request.target, request.set, request.size, range], ['a', { gain: '3' }, 64, [-1, 2]]);
  const { width, height } = await made;
  assert.deepEqual([width, height], [50, 25]);
  assert.equal(await views.vary({ g: model.generation + 1, t: 'a', v: '{"set":[]}' }), null, 'of another graph there is none');
});

test('variations wait for the pictures of the page, and a change ends them', async () => {
  const { model, renderer, views, told } = await rested();
  const vary = () => views.vary({ g: model.generation, t: 'a', v: '{"preset":null,"set":[]}' });
  const [first, second] = [vary(), vary()];
  await turn();
  assert.equal(renderer.waits('look'), 1, 'one at a time');
  assert.deepEqual(told.filter(([kind]) => kind === 'busy').at(-1)[1], { busy: false }, 'the page does not wait for them');
  const running = renderer.next('look');
  model.setValues({ preset: null, set: [['gain', '2']] });
  assert.ok(running.stopped, 'the older one is stopped');
  running.resolve({});
  assert.deepEqual([await first, await second], [null, null]);
  await turn();
  const { set } = await renderer.draw();
  assert.deepEqual(set, { gain: '2' });
  assert.equal(model.best('a').generation, model.generation);
  assert.equal(renderer.waits('look'), 0);
});

test('a node is described by the editor with the values that are set, and shown by the renderer', async () => {
  const { model, renderer, editor, views } = await rested();
  const edits = [{ node: 'n', field: 'size', index: null, value: '2' }];
  model.values = { preset: null, set: [], edits };
  const about = views.about('@n');
  const fields = [{ name: 'size', text: '2', fixed: false, formula: null }];
  assert.deepEqual(editor.asked.at(-1).request.edits, edits);
  await editor.answer('about', { node: 'n', kind: 'Perlin', fields });
  assert.deepEqual((await about).fields, fields);
  // Its place is that in the text as it is.
  const place = views.place('n');
  assert.equal(editor.asked.at(-1).request.edits, undefined);
  await editor.answer('about', { node: 'n', line: 4, column: 7 });
  assert.equal((await place).line, 4);
  model.look('@n');
  assert.equal((await renderer.draw()).target, '@n');
  assert.equal(model.best('@n').target, '@n');
  // In light, the channels of its material are made, too.
  model.inLight = () => true;
  model.channels = ['@n.base_color'];
  model.work();
  assert.equal((await renderer.draw()).target, '@n.base_color');
  assert.equal(renderer.waits('look'), 0);
});

test('a node that fails stops no output', async () => {
  const { model, renderer } = await rested();
  model.look('@bad');
  await turn();
  await renderer.fail('look', { code: 'graph', message: 'broken', errors: [] });
  assert.equal(model.errors[0].message, 'broken');
  assert.equal(renderer.waits('look'), 0, 'it is asked for once');
  model.setValues({ preset: null, set: [['gain', '2']] });
  await turn();
  await renderer.fail('look', { code: 'no-output', message: 'gone' });
  model.look('a');
  assert.equal((await renderer.draw()).target, 'a');
});

test('a level names the nodes of thumbnails, and objects are drawn once', async () => {
  const { model, renderer, editor, views } = await rested();
  const level = views.level(model.generation, 'use');
  assert.deepEqual([editor.asked[0].request.path, editor.asked[0].request.graph], ['use', 'graph of 1']);
  await editor.answer('level', { names: ['x', 'dots'], nodes: [], wires: [] });
  assert.deepEqual((await level).names, ['x', 'dots']);
  assert.deepEqual((await views.level(model.generation, 'use')).names, ['x', 'dots'], 'a level is asked for once');
  const thumb = views.thumb({ g: model.generation, n: 0, o: 1 });
  const { request } = await paint(renderer);
  assert.deepEqual([request.target, request.port], ['@x', 1]);
  assert.deepEqual((({ width, height }) => [width, height])(await thumb), [96, 48]);
  const none = views.thumb({ g: model.generation, n: 1, o: 0 });
  await paint(renderer, { event: 'object', type: 'Points', drawing: { count: 3, size_mm: [1, 1] } });
  assert.equal(await none, null);
  assert.deepEqual(await views.drawing('@dots'), { count: 3, size_mm: [1, 1] });
  assert.equal(renderer.waits('look'), 0);
  assert.equal(await views.thumb({ g: model.generation, n: 7, o: 0 }), null);
});

test('a texture on a shape is made once for a graph', async () => {
  const { model, renderer, views } = await rested();
  const ask = () => views.cut(model.generation, 'm.emission', 'leg', 1024);
  const [first, second] = [ask(), ask()];
  const { request } = await paint(renderer);
  assert.deepEqual([request.target, request.shape, request.size], ['m.emission', 'leg', 512]);
  assert.deepEqual((({ width, form, scale }) => [width, form, scale])(await first), [200, 'rgba8', 2]);
  assert.equal(await first, await second);
  assert.equal(renderer.waits('look'), 0);
  model.setValues({ preset: null, set: [['gain', '2']] });
  await renderer.draw();
  const third = ask();
  await paint(renderer);
  assert.notEqual(await third, await first);
});

test('a mesh that did not change is not sent again', async () => {
  const { model, renderer, views, told } = await rested();
  const bytes = new Uint8Array(3 * 44 + 3 * 4);
  new Float32Array(bytes.buffer)[1] = -0.5;
  const first = views.mesh(model.generation);
  await turn();
  const one = renderer.next('shape');
  assert.equal(one.request.known, undefined);
  one.heard({ json: { event: 'mesh', key: 'k', vertices: 3, indices: 3, per_mm: 0.1, middle: [0, 0, 1] }, bytes });
  one.resolve({});
  const shape = await first;
  assert.deepEqual([shape.foot, shape.perMm, shape.make().index.length], [-0.5, 0.1, 3]);
  const mesh = () => told.filter(([kind]) => kind === 'state').at(-1)[1].scene.mesh;
  const before = mesh();
  model.setValues({ preset: null, set: [['gain', '2']] });
  assert.notEqual(mesh(), before, 'values may change the mesh');
  await renderer.draw();
  const again = views.mesh(model.generation);
  await turn();
  const two = renderer.next('shape');
  assert.equal(two.request.known, 'k');
  two.heard({ json: { event: 'same', key: 'k' } });
  two.resolve({});
  assert.equal(await again, shape);
});

test('a body has its report, and the reason why there is none', async () => {
  const { model, renderer, views } = await rested();
  const made = views.body(model.generation, 'plate');
  await turn();
  const one = renderer.next('shape');
  assert.deepEqual([one.request.output, one.request.size], ['plate', 64]);
  one.heard({ json: { event: 'mesh', vertices: 0, indices: 0, per_mm: 1, middle: [0, 0, 0], report: { kind: 'Plate' } }, bytes: new Uint8Array(4) });
  one.resolve({});
  assert.deepEqual((await made).report, { kind: 'Plate' });
  const refused = assert.rejects(views.body(model.generation, 'plate'), /too steep/);
  await turn();
  await renderer.fail('shape', { code: 'graph', message: 'too steep' });
  await refused;
});

test('the work for nodes is that of the sharpest pictures', () => {
  const stats = new Stats();
  const node = (state, seconds) => [{ name: 'n', state, seconds }];
  stats.add(1, 128, node('computed', 1));
  stats.add(1, 512, node('memory', 2));
  stats.add(1, 256, node('computed', 4));
  assert.deepEqual(stats.nodes, node('memory', 2));
  stats.add(1, 512, node('computed', 3));
  assert.deepEqual(stats.nodes, node('computed', 5));
  stats.add(2, 128, node('unused', 0));
  assert.deepEqual(stats.nodes, node('unused', 0));
});
