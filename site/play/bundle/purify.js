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
  // A document of its own loads nothing and runs nothing.
  const from = new DOMParser().parseFromString(html, 'text/html');
  const made = document.implementation.createHTMLDocument('');
  copy(from.body, made.body, made);
  return made.body.innerHTML;
}
