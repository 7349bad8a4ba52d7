// Builds the playground into a folder: node build.mjs FOLDER [NAMES], with shibo.wasm already built. NAMES is a file with the graphs
// that have a picture in ../gallery, one a line.
import { build } from 'esbuild';
import { copyFile, mkdir, readFile, readdir, writeFile } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const top = join(here, '../..');
const page = join(top, 'src/serve/page');
const npm = join(top, 'hosts/npm');
const [out = join(top, 'target/dist/site/play'), names] = process.argv.slice(2);

// What the page may do: nothing leaves its folder. A policy in the page holds on every host.
const POLICY = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; connect-src 'self'; img-src 'self' blob: data:; style-src 'self'; base-uri 'none'; form-action 'none'";

// Changes of the page of `shibo watch`: the texts must be there, so that a change of the page is noticed here.
const CHANGES = [
  ['<meta charset="utf-8">', `<meta charset="utf-8">\n  <meta http-equiv="Content-Security-Policy" content="${POLICY}">\n  <meta name="description" content="Procedural textures in the browser: edit a graph, see it, and take the maps with you.">`],
  ['<script type="module" src="app.js"></script>', '<link rel="stylesheet" href="play.css">\n  <link rel="preload" href="shibo.wasm" as="fetch" crossorigin>\n  <script type="module" src="begin.js"></script>\n  PRELOADS\n  <script type="module" src="play.js"></script>'],
  ['<div id="outputs"', `<div class="row" id="play-tools">
      <button id="library-open" title="The shipped graphs">Library</button>
      <button id="link" title="Copy a link with the text and the values">Link</button>
      <button id="files-open" title="Pictures and meshes that the graph reads">Files</button>
      <button id="text-save" title="Save the text as a file">Save text</button>
      <label class="size" for="size">Size <select id="size"></select></label>
    </div>
    <div class="segments" id="sides" role="group" aria-label="Side" data-rove><button data-side="text">Text</button><button data-side="view" aria-pressed="true">View</button></div>
    <div id="outputs"`],
  ['<main>', '<main>\n    <section id="text" aria-label="Text"></section>'],
  ['<div id="empty" hidden></div>', `<div id="empty" hidden></div>
      <div id="long" role="alert" hidden>This graph takes long. Go on? <button id="long-on">Go on</button> <button id="long-stop">Stop</button></div>`],
  ['<span id="status" role="status"></span>', '<span id="made"></span>\n    <span id="status" role="status"></span>'],
  ['<dialog id="keys"', `<dialog id="library" class="wide"></dialog>
  <dialog id="files"></dialog>
  <dialog id="link-box" aria-labelledby="link-title"><h2 id="link-title">Link</h2><input id="link-text" readonly aria-label="The link"><div class="row"><button id="link-close">Close</button></div></dialog>
  <dialog id="keys"`],
  ['<dt>Ctrl+S</dt><dd>save to file</dd>', '<dt>Ctrl+S</dt><dd>write the values set by hand into the text</dd>\n      <dt>Ctrl+Space</dt><dd>in the text: offers; F8: next error</dd>'],
];

const once = (text, [from, to]) => {
  if (text.split(from).length !== 2) throw new Error(`index.html of the page must have once: ${from}`);
  return text.replace(from, () => to);
};

await mkdir(out, { recursive: true });

// The modules of the page come from the same files. Those of the playground replace some, and none by accident.
const replaced = ['net.js', 'settings.js'];
const unused = ['stream.js', 'moved.html'];
const own = await readdir(join(here, 'src'));
const common = (await readdir(page)).filter((name) => /\.(js|css|svg)$/.test(name) && !unused.includes(name));
for (const name of replaced) if (!common.includes(name)) throw new Error(`the page has no ${name}`);
for (const name of own) if (common.includes(name) && !replaced.includes(name)) throw new Error(`${name} is a module of the page, too`);
for (const name of common.filter((name) => !own.includes(name))) await copyFile(join(page, name), join(out, name));
for (const name of own) await copyFile(join(here, 'src', name), join(out, name));
for (const name of ['engine.js', 'shibo.wasm']) await copyFile(join(npm, name), join(out, name));
const pictures = names ? (await readFile(names, 'utf8')).split('\n').filter(Boolean) : [];
await writeFile(join(out, 'pictures.js'), `// Graphs with a picture in the gallery.\nexport const PICTURES = ${JSON.stringify(pictures)};\n`);
await build({ entryPoints: [join(here, 'bundle/editor.js')], outfile: join(out, 'editor.js'), bundle: true, format: 'esm', minify: true, target: 'es2022', legalComments: 'none', logLevel: 'error' });

// Modules that the page needs at once load together.
const later = ['bodies.js', 'photo.js', 'worker.js', 'answers.js', 'paint.js', 'engine.js', 'begin.js', 'play.js', 'settings.js'];
const modules = [...new Set([...common, ...own, 'editor.js', 'pictures.js'])].filter((name) => name.endsWith('.js') && !later.includes(name)).sort();
const preloads = ['settings.js', ...modules].map((name) => `<link rel="modulepreload" href="${name}">`).join('\n  ');
const html = CHANGES.reduce(once, await readFile(join(page, 'index.html'), 'utf8'));
await writeFile(join(out, 'index.html'), once(html, ['PRELOADS', preloads]));

// The licences of the bundled modules.
const lock = JSON.parse(await readFile(join(here, 'package-lock.json'), 'utf8'));
const bundled = Object.entries(lock.packages).filter(([path]) => path && !/esbuild|typescript|vscode/.test(path));
const licences = await Promise.all(bundled.map(async ([path, { version }]) => {
  const folder = join(here, path);
  const file = (await readdir(folder)).find((name) => /^licen[cs]e/i.test(name));
  return `${path.replace(/^node_modules\//, '')} ${version}\n\n${file ? await readFile(join(folder, file), 'utf8') : 'MIT'}`;
}));
await writeFile(join(out, 'licences.txt'), `editor.js contains these modules.\n\n${licences.join('\n\n')}`);
