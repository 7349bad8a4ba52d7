// @ts-check
// The playground: opens links, shows the text beside the picture, and keeps both in this tab. Everything else is the page of
// `shibo watch`.
import { page } from './app.js';
import { hello, onserver, pool } from './begin.js';
import { $, element, notice, press, say } from './dom.js';
import { editor as build } from './editor.js';
import { filesDialog, isPhoto, isPicture, take } from './files.js';
import { Language } from './language.js';
import { Library } from './library.js';
import { MOST_TEXT, fragment, read } from './links.js';
import { ron } from './news.js';
import { openAddress } from './opening.js';
import { model } from './session.js';

const root = document.documentElement;
const FIRST = 'shibo:starter';
const STORE = 'shibo-graph';
// A text is opened once it rests for this time, in ms.
const REST = 120;
const SIZES = [128, 256, 512, 1024, 2048, 4096];
/** @type {(id: string) => any} */
const own = (id) => document.getElementById(id);

/** @type {ReturnType<typeof build> | null} */
let editor = null;
/** @type {Record<string, string>} texts of shipped graphs, as they were opened */
const shipped = {};
/** @type {Record<string, string>} */
const paths = {};
let shown = 0;
const language = new Language(pool.editor, () => model.files);
let began = performance.now();

// ---- the graph

/** @param {string} name */
async function textOf(name) {
  if (shipped[name] === undefined) {
    const found = await model.pool.editor.ask({ op: 'text', graph: name }).done;
    [shipped[name], paths[name]] = [found.text, found.path];
  }
  return shipped[name];
}

const address = () => location.hash;
// The address of the text for the language server.
const uri = () => paths[model.name] ?? `untitled:${model.name}`;

/** @param {{ name: string, text: string, values: import('./work.js').Chosen}} graph */
function show({ name, text, values }) {
  model.news.known = {};
  model.name = name;
  editor?.open(text, uri());
  model.setText(text, { name, values });
}

// Opens the graph that the fragment names, or the first one.
const openLink = () => openAddress({
  address,
  async read(hash) {
    const linked = await read(hash);
    const graph = linked?.graph ?? (linked?.of && `shibo:${linked.of}`) ?? (linked ? 'graph.ron' : FIRST);
    const text = linked?.text ?? await textOf(graph);
    if (linked?.text && graph !== 'graph.ron') await textOf(graph);
    return { name: graph, text, values: { preset: linked?.preset ?? null, set: linked?.set ?? [] } };
  },
  show,
  async refuse(error) {
    notice(`The link was not opened: ${error.message}`, true);
    if (model.text) return;
    const text = await textOf(FIRST);
    if (!model.text) show({ name: FIRST, text, values: { preset: null, set: [] } });
  },
});

// Edits of this tab, if its address is the one of before.
const restore = () => openAddress({
  address,
  async read(hash) {
    const kept = JSON.parse(sessionStorage.getItem(STORE) ?? 'null');
    if (!kept || kept.hash !== hash || typeof kept.text !== 'string' || kept.text.length > MOST_TEXT) return null;
    if (kept.name.startsWith('shibo:')) await textOf(kept.name);
    return kept;
  },
  show(kept) {
    const { size } = /** @type {{ size?: number }} */ (kept);
    if (size && SIZES.includes(size)) model.size = size;
    show(kept);
  },
  refuse() { /* the address is opened instead */ },
});

/** @type {number | undefined} */
let keeping;
function keep() {
  clearTimeout(keeping);
  keeping = setTimeout(() => {
    const { name, text, values, size } = model.latest;
    try { sessionStorage.setItem(STORE, JSON.stringify({ hash: location.hash, name, text, values, size })); } catch { /* it is full */ }
  }, 200);
}

async function link() {
  const { name, text: written, values: { edits, ...values } } = model.latest;
  // Values of nodes are in the text of the link.
  const text = edits?.length && model.opened?.text === written ? (await pool.editor.ask({ op: 'try', graph: model.opened.graph, edits }).done).text : written;
  const isShipped = shipped[name] === text;
  const of = name.startsWith('shibo:') && !isShipped ? name.slice(6) : undefined;
  return new URL(await fragment({ graph: isShipped ? name : undefined, of, text, ...values }), location.href.split('#')[0]).href;
}

// ---- the parts around the page

function sizes() {
  const select = own('size');
  const all = [...new Set([...SIZES, model.size])].sort((a, b) => a - b);
  select.replaceChildren(...all.map((n) => element('option', { value: n, textContent: `${n} px`, selected: n === model.size })));
  select.onchange = () => { model.setSize(+select.value); keep(); };
}

const library = new Library(own('library'), (name) => {
  const hash = `#shibo:${name}`;
  if (location.hash === hash) openLink(); else location.hash = hash;
});
// The text of a shipped graph becomes one of its own as soon as it names a file of the user: its imports name the shipped graphs then.
function detach() {
  if (!model.name.startsWith('shibo:') || !Object.keys(model.files).some((name) => model.text.includes(`"${name}"`))) return;
  const text = model.text.replace(/"(?:\w+\/)*(\w+)\.ron"/g, (all, name) => (library.names.has(name) ? `"shibo:${name}"` : all));
  model.name = 'graph.ron';
  model.text = text;
  // The change that led here may come from the editor.
  queueMicrotask(() => editor?.open(text, uri()));
}
const files = filesDialog(own('files'));

own('library-open').onclick = () => library.open();
own('files-open').onclick = () => files.open();
own('link').onclick = async () => {
  try {
    const address = await link();
    await navigator.clipboard.writeText(address).then(
      () => notice(`The link is copied: ${address.length.toLocaleString('en')} characters`),
      () => { own('link-text').value = address; own('link-box').showModal(); own('link-text').select(); },
    );
    if (Object.keys(model.files).length) notice('The link is copied. It has the text and the values, not the files of the graph', true);
  } catch (error) {
    notice(/** @type {Error} */ (error).message, true);
  }
};
own('link-close').onclick = () => own('link-box').close();
own('text-save').onclick = () => {
  const { name, text } = model;
  const made = element('a', { href: URL.createObjectURL(new Blob([text], { type: 'text/plain' })), download: name.startsWith('shibo:') ? `${name.slice(6)}.ron` : name });
  made.click();
  setTimeout(() => URL.revokeObjectURL(made.href), 60_000);
};

// A step that takes long.
model.onlong = (long) => { own('long').hidden = !long; };
own('long-on').onclick = () => { own('long').hidden = true; };
own('long-stop').onclick = () => { model.pause(); notice('Stopped. A change of the text or of a value begins again'); };

// A narrow window shows the text or the picture.
for (const b of own('sides').children) b.onclick = () => { root.dataset.side = b.dataset.side; press(own('sides'), (one) => one === b); dispatchEvent(new Event('resize')); };

model.inLight = () => root.dataset.view === 'lit';
model.ontext = (text, isOther) => { if (isOther) editor?.open(text, uri()); else editor?.setText(text); };
model.onchange = () => { began = performance.now(); detach(); language.follow(); keep(); };
// The editor's engine was started again: the language server has neither the text nor the files.
model.onrestart = (isAgain, message) => {
  language.restarted();
  // Otherwise an error of the text says it.
  if (!isAgain) return;
  editor?.connect();
  notice(message, true);
};
model.onresume = () => editor?.connect();
// The graph shows the work for each node.
model.onrest = () => { if (!$('drawer').hidden && page.graph.generation === model.generation) page.graph.loadStats(model.generation); };
model.onjump = ({ node, file, line, column }) => {
  if (line) editor?.show(line, column ?? 1); else notice(`${node} stands in another file: ${file}`);
};

// A picture that is dropped on the view or the panel is a photograph: see drop.js. Other files, and pictures that the text names, are
// for the graph; panoramas and meshes are for the 3D view, too.
addEventListener('drop', async (event) => {
  const dropped = [...(event.dataTransfer?.files ?? [])];
  if (!dropped.length) return;
  event.preventDefault();
  const onView = event.target instanceof Element && event.target.closest('#stage, #panel');
  if (onView && dropped.length === 1 && isPhoto(dropped[0]) && !model.text.includes(`"${dropped[0].name}"`)) return;
  if (dropped.every(isPicture)) event.stopImmediatePropagation();
  await take(dropped, files.build);
}, true);

// Keys in the text are for the editor alone, except saving.
own('text').addEventListener('keydown', (/** @type {KeyboardEvent} */ event) => {
  if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === 's') return;
  event.stopPropagation();
});

// Counts the pictures that the page has shown.
new MutationObserver(() => {
  shown += 1;
  const best = model.best(model.focus);
  if (best) say(own('made'), `${best.json.width} × ${best.json.height} px in ${duration(performance.now() - began)}`);
}).observe(root, { attributeFilter: ['data-picture'] });
/** @param {number} ms */
const duration = (ms) => (ms >= 999.5 ? `${(ms / 1000).toFixed(1)} s` : `${ms.toFixed(0)} ms`);

// ---- for consoles and tests

// The page asks for one target after the other; the last one counts.
function follow() {
  const { target } = root.dataset;
  if (target && target !== model.focus && model.opened) model.look(target);
}

/** @type {any} */ (window).shibo = {
  get text() { return model.text; },
  /** @param {string} text */
  setText(text) { editor?.setText(text); model.setText(text); },
  /** @param {string} name @param {unknown} value */
  set(name, value) {
    const param = model.param(name);
    if (!param) throw new Error(`there is no parameter \`${name}\``);
    const text = typeof value === 'string' && /^["(]/.test(value) ? value : ron(value, param.type);
    const { values } = model.latest;
    const set = [...values.set.filter(([known]) => known !== name), /** @type {[string, string]} */ ([name, text])];
    model.setValues({ ...values, set });
    page.parameters.take({ ...values, set });
  },
  /** @param {number} size */
  setSize(size) {
    if (!Number.isInteger(size) || size < 1 || size > 8192) throw new Error('a size is a whole number from 1 to 8192');
    model.setSize(size);
    sizes();
  },
  sharp() {
    follow();
    return model.sharp();
  },
  picture() {
    follow();
    const found = model.best(model.focus) ?? model.pictures.get(model.focus);
    if (!found) return null;
    const { json, data, target } = found;
    return { name: target, width: json.width, height: json.height, channels: json.components, data, unit: json.unit || null, meaning: json.meaning, sizeMm: json.size_mm };
  },
  get shown() { return shown; },
  diagnostics: () => [...model.errors, ...(model.errors.length ? [] : model.opened?.warnings ?? [])],
  link,
  // Asks the language server about the text.
  /** @param {string} method @param {any} params */
  lsp: (method, params) => editor?.client.request(method, { textDocument: { uri: uri() }, ...params }),
};

// ---- the beginning

async function begin() {
  say($('empty'), 'Loading the engine …');
  $('empty').hidden = false;
  await pool.editor.ready;
  addEventListener('hashchange', openLink);
  const first = address();
  // Another address may have been opened meanwhile.
  if (!await restore() && address() === first) await openLink();
  sizes();
  editor = build(own('text').attachShadow({ mode: 'open' }), {
    text: model.text,
    uri: uri(),
    onchange: (text) => {
      if (text.length > MOST_TEXT) notice('The text has more than 1 MiB', true); else model.setText(text, { wait: REST });
    },
    send: (message) => language.send(message),
    onmessage: (listener) => onserver((json) => { if (json.event === 'lsp') listener(json.message); }),
  });
  library.follow((await hello).graphs);
  await model.sharp();
  pool.reserve();
}

// The errors on the stage lead to their lines.
$('errors').addEventListener('click', (event) => {
  const where = /** @type {HTMLElement} */ (event.target).closest('.error')?.querySelector('.where')?.textContent ?? '';
  const [, line, column] = /:(\d+):(\d+) /.exec(`${where} `) ?? [];
  if (line) editor?.show(+line, +column);
});
$('save').textContent = 'Write to text';
begin().catch((error) => {
  $('empty').hidden = false;
  say($('empty'), location.protocol === 'file:' ? 'A browser starts no workers from a file: serve this folder, for example with python3 -m http.server' : `The playground cannot start: ${error.message}`);
});
