// Tests the client's side of the protocol in Node with the real server: the program in $SHIBO, or the one in `target`.
import assert from 'node:assert/strict';
import { type ChildProcess, spawn } from 'node:child_process';
import { existsSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import {
  type CompletionList, CompletionRequest, DidOpenTextDocumentNotification, DocumentSymbolRequest, ExecuteCommandRequest, ExitNotification,
  type Hover, HoverRequest, InitializeRequest, InitializedNotification, type MarkupContent, type ProtocolConnection,
  PublishDiagnosticsNotification, type PublishDiagnosticsParams, RenameRequest, ShutdownRequest, StreamMessageReader, StreamMessageWriter,
  createProtocolConnection,
} from 'vscode-languageserver-protocol/node';
import { LANGUAGE } from '../src/recognize';
import { ARGUMENTS, SERVER, options } from '../src/settings';

const root = resolve(__dirname, '../../../..');
const candidates = [process.env.SHIBO, join(process.env.CARGO_TARGET_DIR ?? join(root, 'target'), 'release/shibo'), 'shibo'];
const program = candidates.find((path) => path && (path === 'shibo' || existsSync(path))) ?? 'shibo';

const TEXT = `(
  params: { "size": Number(default: 4, unit: "mm") },
  nodes: {
    "noise": Perlin(size: "$size"),
    "soft": Blur(input: "noise", radius: 0.5),
  },
  outputs: { "soft": "soft" },
)
`;

let server: ChildProcess;
let client: ProtocolConnection;
let folder: string;
let uri: string;
let commands: string[] = [];
const told: PublishDiagnosticsParams[] = [];
let heard: () => void = () => undefined;

async function diagnostics(version: number): Promise<PublishDiagnosticsParams> {
  for (;;) {
    const found = told.find((one) => one.uri === uri && one.version === version);
    if (found) return found;
    await new Promise<void>((resolve) => { heard = resolve; });
  }
}

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'shibo-'));
  const path = join(folder, 'a.ron');
  writeFileSync(path, TEXT);
  uri = pathToFileURL(path).toString();
  server = spawn(program, ARGUMENTS, { stdio: ['pipe', 'pipe', 'inherit'], env: { ...process.env, XDG_CACHE_HOME: join(folder, 'cache') } });
  client = createProtocolConnection(new StreamMessageReader(server.stdout!), new StreamMessageWriter(server.stdin!));
  client.onNotification(PublishDiagnosticsNotification.type, (params) => { told.push(params); heard(); });
  client.listen();
  const answer = await client.sendRequest(InitializeRequest.type, {
    processId: process.pid,
    rootUri: pathToFileURL(folder).toString(),
    capabilities: { textDocument: { completion: { completionItem: { snippetSupport: true } } } },
    initializationOptions: options((_, fallback) => fallback),
  });
  commands = answer.capabilities.executeCommandProvider?.commands ?? [];
  await client.sendNotification(InitializedNotification.type, {});
});

after(async () => {
  await client.sendRequest(ShutdownRequest.type);
  await client.sendNotification(ExitNotification.type);
  const code = await new Promise((resolve) => server.once('exit', resolve));
  rmSync(folder, { recursive: true, force: true });
  assert.equal(code, 0);
});

test('the server knows the commands of the extension', () => {
  for (const command of Object.values(SERVER)) assert.ok(commands.includes(command), command);
});

test('an error is told at its place', async () => {
  const text = TEXT.replace('Blur', 'Blurr');
  await client.sendNotification(DidOpenTextDocumentNotification.type, { textDocument: { uri, languageId: LANGUAGE, version: 1, text } });
  const { diagnostics: found } = await diagnostics(1);
  const error = found.find((one) => one.code === 'unknown-kind');
  assert.deepEqual(error?.range, { start: { line: 4, character: 12 }, end: { line: 4, character: 17 } });
});

test('completion offers the node that fits', async () => {
  const position = { line: 6, character: 23 };
  const list = (await client.sendRequest(CompletionRequest.type, { textDocument: { uri }, position })) as CompletionList;
  assert.equal(list.items[0]?.label, 'soft');
  const kinds = (await client.sendRequest(CompletionRequest.type, { textDocument: { uri }, position: { line: 4, character: 16 } })) as CompletionList;
  assert.equal(kinds.items[0]?.label, 'Blur');
});

test('hover, outline and rename answer', async () => {
  const hover = (await client.sendRequest(HoverRequest.type, { textDocument: { uri }, position: { line: 3, character: 15 } })) as Hover;
  assert.match((hover.contents as MarkupContent).value, /### Perlin/);
  const symbols = await client.sendRequest(DocumentSymbolRequest.type, { textDocument: { uri } });
  assert.equal(symbols?.length, 3);
  const edit = await client.sendRequest(RenameRequest.type, { textDocument: { uri }, position: { line: 3, character: 7 }, newName: 'grain' });
  assert.equal(edit?.changes?.[uri]?.length, 2);
});

test('commands without a file are refused', async () => {
  await assert.rejects(client.sendRequest(ExecuteCommandRequest.type, { command: SERVER.show, arguments: [] }));
});
