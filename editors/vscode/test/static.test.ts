// Checks the manifest, the grammar and the snippets.
import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { test } from 'node:test';
import { createOnigScanner, createOnigString, loadWASM } from 'vscode-oniguruma';
import { INITIAL, Registry, parseRawGrammar } from 'vscode-textmate';
import { OWN, options } from '../src/settings';

const home = resolve(__dirname, '../..');
const json = (path: string) => JSON.parse(readFileSync(join(home, path), 'utf8'));

test('all settings and commands are declared', () => {
  const { contributes } = json('package.json');
  const asked: string[] = [];
  options((key, fallback) => { asked.push(`shibo.${key}`); return fallback; });
  for (const key of asked) assert.ok(key in contributes.configuration.properties, key);
  const declared = contributes.commands.map((one: { command: string }) => one.command);
  assert.deepEqual([...declared].sort(), Object.values(OWN).sort());
});

test('the grammar colours a graph', async () => {
  await loadWASM(readFileSync(require.resolve('vscode-oniguruma/release/onig.wasm')).buffer as ArrayBuffer);
  const path = join(home, 'syntaxes/shibo.tmLanguage.json');
  const registry = new Registry({
    onigLib: Promise.resolve({ createOnigScanner, createOnigString }),
    loadGrammar: async () => parseRawGrammar(readFileSync(path, 'utf8'), path),
  });
  const grammar = await registry.loadGrammar('source.shibo');
  const scope = (line: string, word: string) => {
    const at = line.indexOf(word);
    const { tokens } = grammar!.tokenizeLine(line, INITIAL);
    return tokens.find((token) => token.startIndex <= at && at < token.endIndex)?.scopes.at(-1) ?? '';
  };
  assert.match(scope('  "a": Perlin(size: 3), // end', 'Perlin'), /^entity\.name\.type/);
  assert.match(scope('  "a": Perlin(size: 3), // end', '"a"'), /^entity\.name\.function/);
  assert.match(scope('  "a": Perlin(size: 3), // end', 'size'), /^variable\.parameter/);
  assert.match(scope('  "a": Perlin(size: 3), // end', '3'), /^constant\.numeric/);
  assert.match(scope('  "a": Perlin(size: 3), // end', '// end'), /^comment/);
  assert.match(scope('  "a": Blur(radius: "= $pitch * 2")', '$pitch'), /^variable\.other\.constant/);
  const formula = '  "a": r#"= let f = lines.ridge(u, 2) * point.x"#,';
  assert.match(scope(formula, 'let'), /^keyword\.control/);
  assert.match(scope(formula, 'lines.ridge'), /^support\.function/);
  assert.match(scope(formula, 'u, 2'), /^support\.variable/);
  assert.match(scope(formula, 'point.x'), /^support\.variable/);
  assert.match(scope(formula, '* point'), /^keyword\.operator/);
  assert.match(scope('  nodes: {', 'nodes'), /^keyword/);
  assert.match(scope('  functions: {', 'functions'), /^keyword/);
  // Every shipped graph ends outside of strings and comments.
  const graphs = resolve(home, '../../graphs');
  for (const name of readdirSync(graphs).filter((file) => file.endsWith('.ron'))) {
    let state = INITIAL;
    for (const line of readFileSync(join(graphs, name), 'utf8').split('\n')) state = grammar!.tokenizeLine(line, state).ruleStack;
    assert.equal(state.depth, 1, name);
  }
});

test('snippets are complete', () => {
  for (const [name, snippet] of Object.entries(json('snippets/shibo.json')) as [string, { prefix: string; body: string | string[] }][]) {
    const body = [snippet.body].flat().join('\n');
    const count = (c: string) => body.split(c).length;
    assert.ok(snippet.prefix && count('(') === count(')') && count('{') === count('}'), name);
  }
});
