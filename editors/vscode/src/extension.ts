// The extension: starts the language server, and connects the cursor with the preview.
import * as vscode from 'vscode';
import { ExecuteCommandRequest, LanguageClient, type LanguageClientOptions, type ServerOptions } from 'vscode-languageclient/node';
import { ARGUMENTS, OWN, SERVER, options } from './settings';

let client: LanguageClient | undefined;

function settings() {
  const section = vscode.workspace.getConfiguration('shibo');
  return { path: section.get('path', 'shibo'), onMove: section.get('showOnCursorMove', false), server: options((key, fallback) => section.get(key, fallback)) };
}

async function start(): Promise<void> {
  const { path, server } = settings();
  const run: ServerOptions = { command: path, args: ARGUMENTS };
  const clientOptions: LanguageClientOptions = {
    documentSelector: [{ language: 'ron' }],
    initializationOptions: server,
    synchronize: { fileEvents: vscode.workspace.createFileSystemWatcher('**/*.ron') },
    markdown: { isTrusted: false, supportHtml: false },
  };
  client = new LanguageClient('shibo', 'Shibo', run, clientOptions);
  try {
    await client.start();
  } catch (error) {
    const open = 'Open the settings';
    const chosen = await vscode.window.showErrorMessage(`\`${path} lsp\` cannot be started: ${String(error)}. Set shibo.path.`, open);
    if (chosen === open) await vscode.commands.executeCommand('workbench.action.openSettings', 'shibo.path');
  }
}

async function stop(): Promise<void> {
  const old = client;
  client = undefined;
  await old?.dispose();
}

/** Lets the server run a command about the graph in the editor. */
async function ask(command: string, ...rest: unknown[]): Promise<void> {
  const editor = vscode.window.activeTextEditor;
  if (!client?.isRunning() || editor?.document.languageId !== 'ron') return;
  const uri = client.code2ProtocolConverter.asUri(editor.document.uri);
  await client.sendRequest(ExecuteCommandRequest.type, { command, arguments: [uri, ...rest] });
}

function show(): Promise<void> {
  const at = vscode.window.activeTextEditor?.selection.active;
  return at ? ask(SERVER.show, { line: at.line, character: at.character }) : Promise.resolve();
}

/** Shows the node of the cursor's line, once the cursor rests there. */
function follow(): vscode.Disposable {
  let timer: NodeJS.Timeout | undefined;
  let last = '';
  return vscode.window.onDidChangeTextEditorSelection((event) => {
    if (!settings().onMove || event.textEditor.document.languageId !== 'ron') return;
    const here = `${event.textEditor.document.uri} ${event.selections[0]?.active.line}`;
    if (here === last) return;
    last = here;
    clearTimeout(timer);
    timer = setTimeout(() => void show().catch(() => undefined), 150);
  });
}

export async function activate(context: vscode.ExtensionContext): Promise<void> {
  context.subscriptions.push(
    vscode.commands.registerCommand(OWN.preview, () => ask(SERVER.preview)),
    vscode.commands.registerCommand(OWN.show, show),
    vscode.commands.registerCommand(OWN.restart, async () => { await stop(); await start(); }),
    vscode.workspace.onDidChangeConfiguration(async (event) => {
      if (event.affectsConfiguration('shibo.path')) {
        await stop();
        await start();
      } else if (event.affectsConfiguration('shibo') && client?.isRunning()) {
        await client.sendNotification('workspace/didChangeConfiguration', { settings: { shibo: settings().server } });
      }
    }),
    follow(),
  );
  await start();
}

export const deactivate = stop;
