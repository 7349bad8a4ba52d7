// The bundle as the editor loads it, with a stand-in for the editor.
import assert from 'node:assert/strict';
import Module from 'node:module';
import { resolve } from 'node:path';
import { test } from 'node:test';

interface Document { fileName: string; languageId: string; getText(): string }
type Listener = (event: unknown) => unknown;

const BUNDLE = resolve(__dirname, '../../dist/extension.js');
const GRAPH = '(\n  canvas: (size_mm: 4),\n  nodes: { "a": Perlin() },\n)';
const SCENE = '(\n  resources: {},\n  entities: { 0: (components: {}) },\n)';

const loader = Module as unknown as { _load: (name: string, ...more: unknown[]) => unknown };
const load = loader._load;

/** Loads the bundle into an editor that has documents open. */
async function editor(open: Document[]) {
  const listeners: Record<string, Listener> = {};
  const messages: string[] = [];
  // The first listener is that of the extension; the client adds others.
  const on = (name: string) => (listener: Listener) => { listeners[name] ??= listener; return { dispose() {} }; };
  // The client uses further classes and functions of the editor, and their results do not matter here.
  class Any { event() { return this; } fire() {} dispose() {} append() {} appendLine() {} show() {} }
  const other = (name: string | symbol) => (/^[A-Z]/.test(String(name)) ? Any : () => new Any());
  const rest = <T extends object>(parts: T) => new Proxy(parts, { get: (target, name) => Reflect.get(target, name) ?? other(name) });
  const vscode = rest({
    version: '1.82.0',
    workspace: rest({
      textDocuments: open,
      onDidOpenTextDocument: on('open'),
      onDidChangeTextDocument: on('change'),
      onDidCloseTextDocument: on('close'),
      onDidChangeConfiguration: on('configuration'),
      createFileSystemWatcher: () => ({}),
      getConfiguration: () => ({ get: (key: string, fallback: unknown) => (key === 'path' ? '/nowhere/shibo' : fallback) }),
    }),
    languages: rest({
      async setTextDocumentLanguage(document: Document, language: string) {
        await listeners.close?.(document);
        document.languageId = language;
        await listeners.open?.(document);
      },
    }),
    window: rest({
      onDidChangeTextEditorSelection: on('selection'),
      showErrorMessage: async (text: string) => { messages.push(text); },
    }),
    commands: rest({ registerCommand: () => ({ dispose() {} }) }),
  });
  loader._load = (name, ...more) => (name === 'vscode' ? vscode : load(name, ...more));
  delete require.cache[BUNDLE];
  await require(BUNDLE).activate({ subscriptions: [] });
  return { listeners, messages };
}

const document = (fileName: string, text: string): Document & { text: string } => ({ fileName, languageId: 'plaintext', text, getText() { return this.text; } });
const pause = () => new Promise((done) => { setTimeout(done, 400); });

test('a file of Bevy is left alone, and starts nothing', async () => {
  const scene = document('/game/scene.ron', SCENE);
  const { listeners, messages } = await editor([scene]);
  const other = document('/game/other.ron', SCENE);
  await listeners.open?.(other);
  other.text += '\n// an edit';
  listeners.change?.({ document: other });
  await pause();
  assert.deepEqual([scene.languageId, other.languageId, messages], ['plaintext', 'plaintext', []]);
});

test('a graph gets its language, and the server is started once', async () => {
  const graph = document('/home/ada/goat.ron', GRAPH);
  const { listeners, messages } = await editor([graph]);
  assert.equal(graph.languageId, 'shibo');
  // The server cannot be started here, and the extension says so.
  const failures = () => messages.filter((text) => text.includes('`/nowhere/shibo lsp` cannot be started')).length;
  assert.equal(failures(), 1);
  await listeners.open?.(document('/home/ada/oak.ron', GRAPH));
  assert.equal(failures(), 1);
});

test('a new file becomes a graph while it is written', async () => {
  const { listeners } = await editor([]);
  const fresh = document('/home/ada/new.ron', '');
  await listeners.open?.(fresh);
  assert.equal(fresh.languageId, 'plaintext');
  fresh.text = GRAPH;
  listeners.change?.({ document: fresh });
  await pause();
  assert.equal(fresh.languageId, 'shibo');
});

test('a language that the user chooses stays', async () => {
  const graph = document('/home/ada/goat.ron', GRAPH);
  const { listeners } = await editor([graph]);
  graph.languageId = 'ron';
  await listeners.open?.(graph);
  listeners.change?.({ document: graph });
  await pause();
  assert.equal(graph.languageId, 'ron');
});
