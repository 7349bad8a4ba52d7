// The extension: recognises graphs, starts the language server for them, and connects the cursor with the preview.
import * as vscode from 'vscode';
import { LANGUAGE, isGraph, isUndecided } from './recognize';
import { OWN, SERVER } from './settings';

type Client = typeof import('./client');

/** The client; it is loaded for the first graph. */
let client: Client | undefined;
let loading: Promise<Client> | undefined;

/** Time without edits after which a text is looked at again, in ms. */
const REST = 300;
/** Documents that were recognised once. A user who then chooses another language keeps it. */
const recognised = new WeakSet<vscode.TextDocument>();
const waiting = new Map<vscode.TextDocument, NodeJS.Timeout>();

/** Makes a document a graph if its text is one, and starts the server for the first graph. */
async function look(document: vscode.TextDocument): Promise<void> {
  if (document.languageId === LANGUAGE) {
    recognised.add(document);
    await start();
  } else if (!recognised.has(document) && isUndecided(document.fileName, document.languageId) && isGraph(document.getText())) {
    recognised.add(document);
    // The editor then opens the document again, in that language.
    await vscode.languages.setTextDocumentLanguage(document, LANGUAGE);
  }
}

/** Looks at a document once its text rests: a new file becomes a graph while it is written. */
function lookSoon(document: vscode.TextDocument): void {
  if (recognised.has(document) || !isUndecided(document.fileName, document.languageId)) return;
  clearTimeout(waiting.get(document));
  waiting.set(document, setTimeout(() => { waiting.delete(document); void look(document); }, REST));
}

function forget(document: vscode.TextDocument): void {
  clearTimeout(waiting.get(document));
  waiting.delete(document);
}

async function start(): Promise<void> {
  if (loading) return;
  loading = import('./client');
  client = await loading;
  await client.start();
}

async function restart(): Promise<void> {
  await client?.stop();
  await client?.start();
}

async function ask(command: string, ...rest: unknown[]): Promise<void> {
  await client?.ask(command, ...rest);
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
    if (event.textEditor.document.languageId !== LANGUAGE) return;
    if (!vscode.workspace.getConfiguration('shibo').get('showOnCursorMove', false)) return;
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
    vscode.commands.registerCommand(OWN.follow, () => ask(SERVER.follow)),
    vscode.commands.registerCommand(OWN.unfollow, () => ask(SERVER.unfollow)),
    vscode.commands.registerCommand(OWN.restart, restart),
    vscode.workspace.onDidChangeConfiguration(async (event) => {
      if (event.affectsConfiguration('shibo.path')) await restart();
      else if (event.affectsConfiguration('shibo')) await client?.configure();
    }),
    vscode.workspace.onDidOpenTextDocument(look),
    vscode.workspace.onDidChangeTextDocument((event) => lookSoon(event.document)),
    vscode.workspace.onDidCloseTextDocument(forget),
    follow(),
  );
  await Promise.all(vscode.workspace.textDocuments.map(look));
}

export async function deactivate(): Promise<void> {
  await client?.stop();
}
