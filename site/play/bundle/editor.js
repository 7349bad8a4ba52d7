// @ts-check
// The editor of the playground: CodeMirror with the language server of the module. It is bundled, and mounted in a shadow root, where
// its styles need no exception in the page's policy.
import { autocompletion, closeBrackets, closeBracketsKeymap, completionKeymap } from '@codemirror/autocomplete';
import { defaultKeymap, history, historyKeymap, isolateHistory } from '@codemirror/commands';
import { HighlightStyle, StreamLanguage, bracketMatching, foldGutter, foldKeymap, indentUnit, syntaxHighlighting } from '@codemirror/language';
import { lintGutter, lintKeymap } from '@codemirror/lint';
import { LSPClient, formatKeymap, hoverTooltips, renameKeymap, serverCompletion, serverDiagnostics, signatureHelp } from '@codemirror/lsp-client';
import { highlightSelectionMatches, searchKeymap } from '@codemirror/search';
import { Annotation, Compartment, EditorState } from '@codemirror/state';
import { EditorView, drawSelection, highlightActiveLine, highlightActiveLineGutter, keymap, lineNumbers } from '@codemirror/view';
import { tags } from '@lezer/highlight';
import { purified } from './purify.js';

// Tokens of a graph file; a text that begins with `=` is a formula, one with `$` a parameter.
const language = StreamLanguage.define({
  name: 'shibo',
  startState: () => ({ comment: false }),
  token(stream, state) {
    if (state.comment) {
      if (stream.skipTo('*/')) { stream.match('*/'); state.comment = false; } else stream.skipToEnd();
      return 'comment';
    }
    if (stream.eatSpace()) return null;
    if (stream.match('//')) { stream.skipToEnd(); return 'comment'; }
    if (stream.match('/*')) { state.comment = true; return 'comment'; }
    if (stream.match(/"(?:[^"\\]|\\.)*"?/)) {
      const text = stream.current();
      if (/^\s*:/.test(stream.string.slice(stream.pos))) return 'propertyName';
      return /^"[=$]/.test(text) ? 'macroName' : 'string';
    }
    if (stream.match(/[-+]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?/)) return 'number';
    if (stream.match(/[A-Za-z_]\w*/)) {
      const rest = stream.string.slice(stream.pos);
      if (/^\s*:/.test(rest)) return 'propertyName';
      return /^[A-Z]/.test(stream.current()) && /^\s*\(/.test(rest) ? 'typeName' : 'atom';
    }
    stream.next();
    return 'punctuation';
  },
  languageData: { commentTokens: { line: '//', block: { open: '/*', close: '*/' } }, closeBrackets: { brackets: ['(', '[', '{', '"'] } },
});

const colors = HighlightStyle.define([
  { tag: tags.comment, color: 'var(--code-comment)', fontStyle: 'italic' },
  { tag: tags.string, color: 'var(--code-string)' },
  { tag: tags.macroName, color: 'var(--code-formula)' },
  { tag: tags.number, color: 'var(--code-number)' },
  { tag: tags.typeName, color: 'var(--code-kind)', fontWeight: '600' },
  { tag: tags.propertyName, color: 'var(--code-key)' },
  { tag: tags.atom, color: 'var(--code-number)' },
  { tag: tags.punctuation, color: 'var(--dim)' },
]);

const theme = EditorView.theme({
  '&': { height: '100%', backgroundColor: 'var(--code-back)', color: 'var(--text)', fontSize: '12.5px' },
  '&.cm-focused': { outline: 'none' },
  '.cm-scroller': { fontFamily: 'ui-monospace, "JetBrains Mono", "DejaVu Sans Mono", monospace', lineHeight: '1.55', scrollbarWidth: 'thin' },
  '.cm-content': { caretColor: 'var(--text)' },
  '.cm-cursor': { borderLeftColor: 'var(--text)' },
  '.cm-gutters': { backgroundColor: 'var(--code-back)', color: 'var(--dim)', border: 'none' },
  '.cm-activeLine, .cm-activeLineGutter': { backgroundColor: 'color-mix(in srgb, var(--text) 5%, transparent)' },
  '&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground': { backgroundColor: 'color-mix(in srgb, var(--accent) 28%, transparent)' },
  '.cm-selectionMatch': { backgroundColor: 'color-mix(in srgb, var(--accent) 16%, transparent)' },
  '.cm-matchingBracket, &.cm-focused .cm-matchingBracket': { backgroundColor: 'color-mix(in srgb, var(--ok) 35%, transparent)' },
  '.cm-tooltip': { backgroundColor: 'var(--bar)', color: 'var(--text)', border: '1px solid var(--line)', borderRadius: '8px', boxShadow: '0 8px 30px #0006', fontFamily: 'system-ui, "Noto Sans", "DejaVu Sans", sans-serif', maxWidth: 'min(520px, 90vw)' },
  '.cm-tooltip.cm-tooltip-autocomplete > ul': { fontFamily: 'ui-monospace, "DejaVu Sans Mono", monospace', maxHeight: '16em' },
  '.cm-tooltip.cm-tooltip-autocomplete > ul > li[aria-selected]': { backgroundColor: 'var(--accent)', color: 'var(--accent-text)' },
  '.cm-completionDetail': { color: 'var(--dim)', fontStyle: 'normal' },
  'li[aria-selected] .cm-completionDetail': { color: 'inherit' },
  '.cm-completionInfo': { padding: '8px 12px', overflow: 'auto', maxHeight: '40vh' },
  '.cm-lsp-hover-tooltip, .cm-lsp-signature-tooltip': { padding: '6px 12px', overflow: 'auto', maxHeight: '40vh', lineHeight: '1.45' },
  '.cm-tooltip :is(p, pre, ul)': { margin: '4px 0' },
  '.cm-tooltip code, .cm-tooltip pre': { fontFamily: 'ui-monospace, "DejaVu Sans Mono", monospace', fontSize: '12px' },
  '.cm-tooltip table': { borderCollapse: 'collapse' },
  '.cm-tooltip :is(td, th)': { borderTop: '1px solid var(--line)', padding: '2px 10px 2px 0', textAlign: 'left', verticalAlign: 'top' },
  '.cm-diagnostic': { whiteSpace: 'pre-wrap' },
  '.cm-panels': { backgroundColor: 'var(--bar)', color: 'var(--text)', borderColor: 'var(--line)' },
  '.cm-panels :is(input, button)': { background: 'var(--raised)', color: 'var(--text)', border: '1px solid var(--line)', borderRadius: '5px' },
  '.cm-foldPlaceholder': { backgroundColor: 'var(--raised)', border: '1px solid var(--line)', color: 'var(--dim)' },
});

// Changes that the page makes, not the user.
const external = Annotation.define();
// A change of the page is a step of its own in the history, however soon it comes after typing.
const own = [external.of(true), isolateHistory.of('full')];

/**
 * @param {ShadowRoot} root
 * @param {{ text: string, uri: string, onchange: (text: string) => void, send: (message: any) => Promise<any[]>, onmessage: (listener: (message: any) => void) => void }} of
 */
export function editor(root, { text, uri, onchange, send, onmessage }) {
  /** @type {Set<(value: string) => void>} */
  const handlers = new Set();
  /** @param {any} message */
  const tell = (message) => { for (const handler of handlers) handler(JSON.stringify(message)); };
  onmessage(tell);
  const client = new LSPClient({
    sanitizeHTML: purified,
    timeout: 20_000,
    extensions: [serverCompletion(), hoverTooltips({ hoverTime: 250 }), signatureHelp(), serverDiagnostics(), keymap.of([...formatKeymap, ...renameKeymap])],
  });
  /** @type {import('@codemirror/lsp-client').Transport} */
  const transport = {
    send: (message) => { send(JSON.parse(message)).then((answers) => answers.forEach(tell), () => {}); },
    subscribe: (handler) => { handlers.add(handler); },
    unsubscribe: (handler) => { handlers.delete(handler); },
  };
  client.connect(transport);
  let address = uri;
  const server = new Compartment();
  const view = new EditorView({
    root,
    parent: root,
    state: EditorState.create({
      doc: text,
      extensions: [
        lineNumbers(), foldGutter(), lintGutter(), history(), drawSelection(), highlightActiveLine(), highlightActiveLineGutter(), bracketMatching(), closeBrackets(),
        autocompletion(), highlightSelectionMatches(), indentUnit.of('  '), EditorView.lineWrapping, language, syntaxHighlighting(colors), theme,
        keymap.of([...closeBracketsKeymap, ...completionKeymap, ...lintKeymap, ...searchKeymap, ...foldKeymap, ...historyKeymap, ...defaultKeymap]),
        EditorView.contentAttributes.of({ tabindex: '0', 'aria-label': 'Text of the graph. Tab leaves it; Ctrl+Space offers entries, F8 goes to the next error.' }),
        EditorView.updateListener.of((update) => {
          if (update.docChanged && !update.transactions.some((one) => one.annotation(external))) onchange(update.state.doc.toString());
        }),
        server.of(client.plugin(uri, 'shibo')),
      ],
    }),
  });
  return {
    view,
    client,
    get text() { return view.state.doc.toString(); },
    // Replaces the text, as one step of the history of the editor.
    /** @param {string} now */
    setText(now) {
      const before = view.state.doc.toString();
      if (now === before) return;
      let [from, end] = [0, 0];
      const most = Math.min(now.length, before.length);
      while (from < most && now[from] === before[from]) from += 1;
      while (end < most - from && now[now.length - 1 - end] === before[before.length - 1 - end]) end += 1;
      view.dispatch({ changes: { from, to: before.length - end, insert: now.slice(from, now.length - end) }, annotations: own });
    },
    // Shows another graph.
    /** @param {string} now @param {string} at */
    open(now, at) {
      address = at;
      view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: now }, selection: { anchor: 0 }, scrollIntoView: true, annotations: own, effects: server.reconfigure([]) });
      view.dispatch({ effects: server.reconfigure(client.plugin(at, 'shibo')) });
    },
    // Begins again with a new language server.
    connect() {
      view.dispatch({ effects: server.reconfigure([]) });
      client.disconnect();
      client.connect(transport);
      view.dispatch({ effects: server.reconfigure(client.plugin(address, 'shibo')) });
    },
    // Shows a place: line and column from 1.
    /** @param {number} line @param {number} column */
    show(line, column) {
      const found = view.state.doc.line(Math.min(Math.max(1, line), view.state.doc.lines));
      view.dispatch({ selection: { anchor: Math.min(found.from + column - 1, found.to) }, effects: EditorView.scrollIntoView(found.from, { y: 'center' }) });
      view.focus();
    },
  };
}
