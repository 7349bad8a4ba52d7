// @ts-check
// Documentation as HTML: known elements without attributes, and texts. Everything else is a stranger's, and is left out.
const KNOWN = new Set(['P', 'BR', 'HR', 'PRE', 'CODE', 'EM', 'STRONG', 'DEL', 'UL', 'OL', 'LI', 'TABLE', 'THEAD', 'TBODY', 'TR', 'TH', 'TD', 'BLOCKQUOTE', 'H1', 'H2', 'H3', 'H4', 'SPAN']);
// Their texts are no documentation.
const DROPPED = new Set(['SCRIPT', 'STYLE', 'TEMPLATE', 'IFRAME', 'OBJECT', 'SVG', 'MATH', 'NOSCRIPT', 'TEXTAREA', 'TITLE', 'HEAD']);

/** @param {Node} from @param {Node} to @param {Document} document */
function copy(from, to, document) {
  for (const node of from.childNodes) {
    if (node.nodeType === 3) { to.appendChild(document.createTextNode(node.nodeValue ?? '')); continue; }
    const name = node.nodeName.toUpperCase();
    if (node.nodeType !== 1 || DROPPED.has(name)) continue;
    if (!KNOWN.has(name)) { copy(node, to, document); continue; }
    const made = document.createElement(name);
    to.appendChild(made);
    copy(node, made, document);
  }
}

/** @param {string} html */
export function purified(html) {
  // Without attributes there is nothing to load or to run; a document of its own does neither.
  const bare = html.replace(/<(\/?[a-zA-Z][\w-]*)[^>]*>/g, '<$1>');
  const from = new DOMParser().parseFromString(bare, 'text/html');
  const made = document.implementation.createHTMLDocument('');
  copy(from.body, made.body, made);
  return made.body.innerHTML;
}
