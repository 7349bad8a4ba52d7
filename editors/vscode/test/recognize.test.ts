// Tests which RON files are recognised as graphs.
import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { test } from 'node:test';
import { isGraph, isUndecided } from '../src/recognize';

const graphs = resolve(__dirname, '../../../../graphs');

/** Files of Bevy: a scene, the settings of an asset, an animation graph, and a list. */
const BEVY = {
  scene: `(
  resources: {
    "bevy_pbr::light::AmbientLight": (color: (red: 1.0, green: 1.0, blue: 1.0, alpha: 1.0), brightness: 0.05),
  },
  entities: {
    0: (components: { "bevy_core::name::Name": "nodes: { canvas: (", }), // nodes: {
  },
)`,
  meta: `(
  meta_format_version: "1.0",
  asset: Load(loader: "bevy_render::texture::image_loader::ImageLoader", settings: (format: FromExtension, is_srgb: true)),
)`,
  animation: `(
  graph: (nodes: [(clip: Some("walk.gltf#Animation0"), mask: 0, weight: 1.0)], edges: [(0, 1)]),
  root: 0,
  mask_groups: {},
)`,
  list: '[(name: "a", nodes: {}), (name: "b", canvas: ())]',
  named: 'Level(nodes: { "a": 1 }, canvas: (width: 3))',
  menu: '(title: "Menu", buttons: [], layout: Column, canvas: (width: 800, height: 600))',
};

test('every shipped graph is recognised', () => {
  const files = readdirSync(graphs, { recursive: true, encoding: 'utf8' }).filter((file) => file.endsWith('.ron'));
  assert.ok(files.length > 50);
  for (const file of files) assert.ok(isGraph(readFileSync(join(graphs, file), 'utf8')), file);
});

test('files of Bevy are left alone', () => {
  for (const [name, text] of Object.entries(BEVY)) assert.ok(!isGraph(text), name);
});

test('a graph is recognised while it is written', () => {
  for (const text of ['(nodes: {', '( canvas: (size_mm: 40', '(version: 1, nodes: { "a": Perlin(', '(\n  outputs: {},\n  nodes: {\n']) assert.ok(isGraph(text), text);
  for (const text of ['', '(', '(\n  ', '(version: 1,', '(nodes', '(nodes:', 'nodes: {']) assert.ok(!isGraph(text), text);
});

test('comments, texts and attributes may stand before the fields', () => {
  const values = '"a\\"(", r#"b" ("#, \'(\', /* nodes: { /* ( */ */';
  for (const before of ['// nodes\n', '/* ( */ ', '\uFEFF', '#![enable(implicit_some)]\n']) assert.ok(isGraph(`${before}(params: { "t": [${values}] }, nodes: {})`), before);
  assert.ok(!isGraph('// (nodes: {})\n(a: 1)') && !isGraph('(a: "(nodes: {", b: r"(canvas: (")'));
});

test('one unknown field does not hide a graph', () => {
  assert.ok(isGraph('(version: 1, canvsa: (size_mm: 4), nodes: {})'));
});

test('only files whose language is open are looked at', () => {
  assert.ok(isUndecided('/a/goat.ron', 'plaintext') && isUndecided('C:\\a\\GOAT.RON', 'ron'));
  assert.ok(!isUndecided('/a/goat.txt', 'plaintext') && !isUndecided('/a/goat.ron', 'json') && !isUndecided('/a/goat.ron', 'shibo'));
});
