// Makes static pages of docs/*.md and a first page: node pages.mjs FOLDER. Links are relative, so the folder works anywhere. Whole graphs
// and pictures of shipped graphs get a link into the playground.
import { copyFile, mkdir, readFile, readdir, writeFile } from 'node:fs/promises';
import { dirname, join, posix, relative } from 'node:path';
import { fileURLToPath } from 'node:url';
import { deflateRawSync } from 'node:zlib';
import { Marked } from './play/node_modules/marked/lib/marked.esm.js';

const here = dirname(fileURLToPath(import.meta.url));
const top = join(here, '..');
const [out = join(top, 'target/dist/site')] = process.argv.slice(2);
// The longest text in a link: see src/links.js of the playground.
const MOST_FRAGMENT = 65536;
const POLICY = "default-src 'none'; img-src 'self' data:; style-src 'self'; base-uri 'none'; form-action 'none'";
// The order of the navigation; other pages follow by name.
const FIRST = ['graph-file', 'nodes', 'gallery', 'watch', 'editor', 'composing', 'materials'];

/** @type {(folder: string) => Promise<string[]>} */
async function files(folder) {
  const all = await readdir(folder, { withFileTypes: true });
  const lists = await Promise.all(all.map((one) => (one.isDirectory() ? files(join(folder, one.name)) : [join(folder, one.name)])));
  return lists.flat().sort();
}

const escaped = (text) => text.replaceAll('&', '&amp;').replaceAll('<', '&lt;').replaceAll('>', '&gt;').replaceAll('"', '&quot;');
// Anchors as GitHub makes them, which the links in docs/ use.
const slug = (text) => text.toLowerCase().replace(/<[^>]*>/g, '').replace(/&[a-z]+;/g, '').replace(/[^\p{L}\p{N}\s_-]/gu, '').trim().replace(/\s/g, '-');

const all = (await files(join(top, 'docs'))).map((path) => relative(top, path));
const graphs = new Set((await readdir(join(top, 'graphs'))).filter((name) => name.endsWith('.ron')).map((name) => name.slice(0, -4)));
const pages = all.filter((path) => path.endsWith('.md'));
const known = new Set(all);
const title = (text) => /^# (.+)$/m.exec(text)?.[1].replaceAll('`', '') ?? 'Shibo';
const texts = new Map(await Promise.all(pages.map(async (path) => [path, await readFile(join(top, path), 'utf8')])));
const menu = pages.filter((path) => path.split('/').length === 2)
  .map((path) => ({ path, name: path.slice(5, -3), title: title(texts.get(path)) }))
  .sort((a, b) => (FIRST.indexOf(a.name) + 1 || 99) - (FIRST.indexOf(b.name) + 1 || 99) || (a.name < b.name ? -1 : 1));

// A link of a page, from where it stands; null for a target outside the site.
/** @param {string} from @param {string} href */
function resolved(from, href) {
  if (/^[a-z]+:/.test(href) || href.startsWith('#')) return href;
  const [path, anchor] = href.split('#');
  const target = posix.normalize(posix.join(posix.dirname(from), path));
  const graph = /^graphs\/(\w+)\.ron$/.exec(target)?.[1];
  const up = posix.relative(posix.dirname(from), '.') || '.';
  if (graph && graphs.has(graph)) return `${up}/play/#shibo:${graph}`;
  if (!known.has(target)) return null;
  return `${path.replace(/\.md$/, '.html')}${anchor ? `#${anchor}` : ''}`;
}

/** @param {string} text */
const isGraph = (text) => /^\s*(?:\/\/[^\n]*\n\s*|\/\*[\s\S]*?\*\/\s*)*\(/.test(text) && /\bcanvas\s*:/.test(text) && /\boutputs\s*:/.test(text);

/** @param {string} from */
function markdown(from) {
  const up = posix.relative(posix.dirname(from), '.') || '.';
  const seen = new Map();
  const open = (fragment) => `<a class="open" href="${up}/play/#${fragment}">Open</a>`;
  return new Marked({
    renderer: {
      heading({ tokens, depth }) {
        const inner = this.parser.parseInline(tokens);
        const plain = slug(inner);
        const count = seen.get(plain) ?? 0;
        seen.set(plain, count + 1);
        return `<h${depth} id="${plain}${count ? `-${count}` : ''}">${inner}</h${depth}>\n`;
      },
      link({ href, tokens }) {
        const to = resolved(from, href);
        const inner = this.parser.parseInline(tokens);
        return to === null ? inner : `<a href="${escaped(to)}">${inner}</a>`;
      },
      image({ href, text }) {
        const to = resolved(from, href);
        if (to === null) return escaped(text);
        const graph = /(?:^|\/)gallery\/(\w+)\.png$/.exec(href)?.[1];
        return `<span class="picture"><img src="${escaped(to)}" alt="${escaped(text)}" loading="lazy">${graph && graphs.has(graph) ? open(`shibo:${graph}`) : ''}</span>`;
      },
      code({ text, lang }) {
        const packed = lang === 'ron' && isGraph(text) ? `g=${deflateRawSync(text, { level: 9 }).toString('base64url')}` : '';
        const link = packed && packed.length <= MOST_FRAGMENT ? open(packed) : '';
        return `<div class="code">${link}<pre tabindex="0"><code>${escaped(text)}</code></pre></div>\n`;
      },
      // Raw HTML is no part of these texts.
      html({ text }) { return escaped(text); },
    },
  });
}

/** @param {{ up: string, name: string, title: string, body: string }} of */
const page = ({ up, name, title: heading, body }) => `<!doctype html>
<html lang="en">
<head>
  <meta charset="utf-8">
  <meta http-equiv="Content-Security-Policy" content="${POLICY}">
  <meta name="viewport" content="width=device-width, initial-scale=1">
  <meta name="color-scheme" content="dark light">
  <title>${escaped(heading)}${name ? ' · Shibo' : ''}</title>
  <link rel="icon" href="${up}/play/icon.svg" type="image/svg+xml">
  <link rel="stylesheet" href="${up}/site.css">
</head>
<body>
  <header><a class="brand" href="${up}/index.html">Shibo</a><a href="${up}/play/index.html">Playground</a><a href="${up}/docs/gallery.html">Gallery</a></header>
  <div class="columns">
    <nav aria-label="Documentation"><ul>${menu.map((one) => `<li><a href="${up}/docs/${one.name}.html"${one.name === name ? ' aria-current="page"' : ''}>${escaped(one.title)}</a></li>`).join('')}</ul></nav>
    <main>${body}</main>
  </div>
</body>
</html>
`;

for (const path of all.filter((one) => !one.endsWith('.md'))) {
  await mkdir(join(out, dirname(path)), { recursive: true });
  await copyFile(join(top, path), join(out, path));
}
for (const path of pages) {
  const up = posix.relative(posix.dirname(path), '.') || '.';
  const text = texts.get(path);
  await mkdir(join(out, dirname(path)), { recursive: true });
  await writeFile(join(out, path.replace(/\.md$/, '.html')), page({ up, name: path.slice(5, -3), title: title(text), body: markdown(path).parse(text) }));
}
const shown = ['oak', 'calf', 'walnut', 'terrazzo', 'agate', 'denim', 'glazed_tile', 'moss', 'damascus', 'goat', 'linen', 'bark'].filter((name) => graphs.has(name) && known.has(`docs/gallery/${name}.png`));
const cards = shown.map((name) => `<a class="card" href="play/#shibo:${name}"><img src="docs/gallery/${name}.png" alt="" width="200" height="200" loading="lazy">${name.replaceAll('_', ' ')}</a>`).join('\n');
await writeFile(join(out, 'index.html'), page({
  up: '.', name: '', title: 'Shibo',
  body: `<h1>Shibo</h1>
<p>Procedural textures from node graphs. A graph is a text with sizes in millimetres; each of these pictures is one. Open it, change it, and take the maps or a glTF file with you: everything runs in this tab.</p>
<p><a class="start" href="play/index.html">Open the playground</a></p>
<div class="cards">${cards}</div>
<p>All graphs are in the <a href="docs/gallery.html">gallery</a>; <a href="docs/graph-file.html">the format of graph files</a> and <a href="docs/nodes.html">the manual of nodes</a> explain the texts.</p>`,
}));
await copyFile(join(here, 'site.css'), join(out, 'site.css'));
const pictures = [...graphs].filter((name) => known.has(`docs/gallery/${name}.png`)).sort();
await writeFile(join(out, '.pictures'), `${pictures.join('\n')}\n`);
