// Decides which RON files are graphs. Other programs, such as Bevy, have RON files too, and those are left alone. Free of the
// editor's own types, so that tests read it.

/** The language of graphs. */
export const LANGUAGE = 'shibo';
/** The languages that a `.ron` file has before it is recognised: plain text, or RON if another extension knows that. */
const UNDECIDED = ['plaintext', 'ron'];
/** The fields at the top of a graph file. */
const FIELDS = ['version', 'canvas', 'imports', 'params', 'presets', 'inputs', 'nodes', 'outputs'];
/** The fields that make a file a graph, and how their values begin. */
const OPENERS: Record<string, string> = { nodes: '{', canvas: '(' };
/** Characters that are read at most, so that a huge scene of a game does not delay the editor. */
const MOST = 1 << 20;

/** Returns true if a document may be a graph that the editor does not know as one. */
export function isUndecided(fileName: string, languageId: string): boolean {
  return fileName.toLowerCase().endsWith('.ron') && UNDECIDED.includes(languageId);
}

/**
 * Returns true if a text is a graph: a struct without a name that has `nodes: {` or `canvas: (`, and in which most fields up to
 * there are fields of a graph. The file may be broken after that, since it is being written.
 */
export function isGraph(text: string): boolean {
  let known = 0;
  let unknown = 0;
  for (const { name, opener } of fields(text.slice(0, MOST))) {
    if (FIELDS.includes(name)) known += 1; else unknown += 1;
    if (OPENERS[name] === opener && known > unknown) return true;
  }
  return false;
}

// Comments, texts, raw texts and characters: places where brackets and commas have no meaning.
const SKIPPED = /\/\/[^\n]*|r(#*)"[\s\S]*?"\1|"(?:[^"\\]|\\[\s\S])*"|'(?:[^'\\]|\\.)'/y;

/** The fields at the top level of a struct without a name, each with the first character of its value. */
function* fields(text: string): Generator<{ name: string; opener: string }> {
  let at = blank(text, 0);
  // The attributes of a file, such as #![enable(implicit_some)].
  while (text.startsWith('#!', at)) {
    const end = text.indexOf(']', at);
    if (end < 0) return;
    at = blank(text, end + 1);
  }
  if (text[at] !== '(') return;
  at += 1;
  for (;;) {
    at = blank(text, at);
    const name = /[\p{L}_][\p{L}\p{N}_]*/uy;
    name.lastIndex = at;
    const found = name.exec(text);
    if (!found) return;
    at = blank(text, name.lastIndex);
    if (text[at] !== ':') return;
    at = blank(text, at + 1);
    if (at < text.length) yield { name: found[0], opener: text[at] ?? '' };
    at = afterValue(text, at);
    if (text[at] !== ',') return;
    at += 1;
  }
}

/** The place after blanks and comments. */
function blank(text: string, from: number): number {
  let at = from;
  for (;;) {
    const before = at;
    while (at < text.length && /[\s\uFEFF]/.test(text[at] ?? '')) at += 1;
    if (text.startsWith('//', at)) at = end(text, text.indexOf('\n', at));
    else if (text.startsWith('/*', at)) at = afterBlock(text, at);
    if (at === before) return at;
  }
}

/** The place after a block comment, which may contain others. */
function afterBlock(text: string, from: number): number {
  let depth = 0;
  const mark = /\/\*|\*\//g;
  mark.lastIndex = from;
  for (let found = mark.exec(text); found; found = mark.exec(text)) {
    depth += found[0] === '/*' ? 1 : -1;
    if (depth === 0) return mark.lastIndex;
  }
  return text.length;
}

/** The place of the comma or bracket that ends a value. */
function afterValue(text: string, from: number): number {
  let depth = 0;
  let at = from;
  while (at < text.length) {
    const c = text[at] ?? '';
    SKIPPED.lastIndex = at;
    if (text.startsWith('/*', at)) { at = afterBlock(text, at); continue; }
    // The `r` of a raw text begins a word.
    if (`/"'r`.includes(c) && !(c === 'r' && /[\p{L}\p{N}_]/u.test(text[at - 1] ?? '')) && SKIPPED.test(text)) { at = SKIPPED.lastIndex; continue; }
    if ('([{'.includes(c)) depth += 1;
    else if (')]}'.includes(c)) { if (depth === 0) return at; depth -= 1; }
    else if (c === ',' && depth === 0) return at;
    at += 1;
  }
  return at;
}

const end = (text: string, at: number): number => (at < 0 ? text.length : at);
