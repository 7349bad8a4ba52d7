// The language client. It is loaded when the first graph is recognised, so RON files of other programs start nothing.
import * as vscode from 'vscode';
import { ExecuteCommandRequest, LanguageClient, type LanguageClientOptions, type ServerOptions } from 'vscode-languageclient/node';
import { LANGUAGE } from './recognize';
import { ARGUMENTS, options } from './settings';

let client: LanguageClient | undefined;

function settings() {
  const section = vscode.workspace.getConfiguration('shibo');
  return { path: section.get('path', 'shibo'), server: options((key, fallback) => section.get(key, fallback)) };
}

/** Starts the server. */
export async function start(): Promise<void> {
  const { path, server } = settings();
  const run: ServerOptions = { command: path, args: ARGUMENTS };
  const clientOptions: LanguageClientOptions = {
    documentSelector: [{ language: LANGUAGE }],
    initializationOptions: server,
    // Graphs import other files, and not all of these are open.
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

/** Ends the server. */
export async function stop(): Promise<void> {
  const old = client;
  client = undefined;
  await old?.dispose();
}

/** Tells the server of changed settings. */
export async function configure(): Promise<void> {
  if (client?.isRunning()) await client.sendNotification('workspace/didChangeConfiguration', { settings: { shibo: settings().server } });
}

/** Lets the server run a command about the graph in the editor. */
export async function ask(command: string, ...rest: unknown[]): Promise<void> {
  const editor = vscode.window.activeTextEditor;
  if (!client?.isRunning() || editor?.document.languageId !== LANGUAGE) return;
  const uri = client.code2ProtocolConverter.asUri(editor.document.uri);
  await client.sendRequest(ExecuteCommandRequest.type, { command, arguments: [uri, ...rest] });
}
