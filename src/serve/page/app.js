// The page: keeps what the server tells, and what is being looked at.
import { Graph } from './nodes.js';
import { CHANNELS, Lit } from './lit.js';
import { ask, bitmap, jump, latest, news, send } from './net.js';
import { Parameters } from './params.js';
import { Picture } from './picture.js';

const $ = (id) => document.getElementById(id);
const root = document.documentElement;
const PLANES = ['all', 'r', 'g', 'b'];
const store = (key, value) => { try { localStorage.setItem(`shibo-${key}`, value); } catch { /* private mode */ } };
const stored = (key) => { try { return localStorage.getItem(`shibo-${key}`); } catch { return null; } };

let state = null;
let view = 'picture';
// What is looked at: an output or `OUTPUT.CHANNEL`, or `@NODE`; and what is known of it.
let target = null;
let about = null;
let shown = null;

const picture = new Picture($('picture'), {
  onview: (scale) => { $('zoom').textContent = scale === null ? '' : `${(scale * 100).toFixed(scale < 0.1 ? 1 : 0)} %`; placeWipe(); },
  oncursor: (pixel) => probe(pixel),
});
const lit = new Lit($('lit'), $('light'));
const graph = new Graph($('graph'), (name) => { look(`@${name}`); jump(name); });
const parameters = new Parameters($('parameters'), latest(async (values) => { await send(values); }));

// ---- what the server tells

const heard = {
  state(now) {
    state = now;
    root.dataset.online = 'yes';
    $('file').textContent = now.file;
    document.title = `${now.file} · Shibo`;
    follow();
    heard.errors(now);
    heard.busy(now);
    if (now.progress) heard.progress(now.progress);
    if (now.done) heard.done(now.done);
  },
  shown(now) {
    if (!state?.scene || now.generation !== state.scene.generation) return;
    state.scene.pictures[now.target] = now;
    chips();
    if (now.target === target) show(now);
    if (now.final && lit.wants(now.target)) relight();
  },
  errors({ errors }) { if (state) { state.errors = errors; complain(); } },
  warnings({ warnings }) { if (state) { state.warnings = warnings; complain(); } },
  busy({ busy }) {
    if (state) { state.busy = busy; state.progress = null; }
    if (graph.patient !== busy) { graph.patient = busy; graph.draw(); }
    // What is over in the blink of an eye is not talked of.
    clearTimeout(patience);
    patience = busy && !waiting ? setTimeout(() => wait(true), 200) : null;
    if (!busy) wait(false);
  },
  progress(p) {
    if (!p) return;
    if (patience) { clearTimeout(patience); patience = null; wait(true); }
    $('progress').classList.remove('unknown');
    $('progress').firstElementChild.style.width = `${(100 * p.done) / Math.max(1, p.total)}%`;
    if (state) { state.progress = p; status(); }
  },
  done(done) {
    if (!state) return;
    state.done = done;
    root.dataset.done = done.generation;
    status();
    if (done.generation === state.scene?.generation) {
      if (!$('drawer').hidden) graph.loadStats(done.generation);
      if (target?.startsWith('@')) refresh(2048);
      relight();
    }
  },
  // The editor shows something.
  look({ target: wanted }) { if (state?.scene) look(wanted); },
  offline() { root.dataset.online = 'no'; status(); },
};

// Shows that something takes longer.
let waiting = false;
let patience = null;
function wait(on) {
  waiting = on;
  $('progress').classList.toggle('on', on);
  $('progress').classList.toggle('unknown', on);
  status();
}

news((kind, data) => heard[kind]?.(data));

// Another graph: what was looked at is looked at again, if it is still there.
function follow() {
  const { scene } = state;
  $('empty').hidden = !!scene;
  if (!scene) {
    $('empty').textContent = state.errors.length ? 'The page fills as soon as the file is sound.' : 'Evaluating …';
    return;
  }
  parameters.update(scene, state.values);
  const { canvas } = scene;
  $('canvas-facts').textContent = `${canvas.size_mm.join(' × ')} mm · ${canvas.resolution.join(' × ')} px`;
  const names = scene.outputs.map((o) => o.name);
  const known = target && (target.startsWith('@') || names.some((n) => target === n || target.startsWith(`${n}.`)));
  chips();
  const wanted = decodeURIComponent(window.location.hash.slice(1));
  if (!known && wanted) look(wanted); else if (!known) choose(firstOutput(scene)); else if (target.startsWith('@')) refresh(512); else showKnown();
  if (!$('drawer').hidden) graph.load(scene.generation);
  relight();
}

// A picture to begin with: a finished look if there is one, else the first output.
function firstOutput(scene) {
  const lit = scene.outputs.find((o) => o.type === 'Rgb' && /lit|preview/.test(o.name));
  return (lit ?? scene.outputs[0])?.name ?? null;
}

function showKnown() {
  const known = state.scene.pictures[target];
  if (known) show(known);
}

// ---- what is looked at

const outputOf = (name) => state?.scene?.outputs.find((o) => name === o.name || name?.startsWith(`${o.name}.`));
const channelsOf = (output) => CHANNELS.filter((c) => state.scene.pictures[`${output}.${c}`]);

// Looks at an output; of a material at one of its channels.
function choose(name) {
  if (!name) return;
  const output = outputOf(name);
  if (output?.type === 'Material' && name === output.name) {
    const channels = channelsOf(name);
    const last = target?.split('.').at(-1);
    look(`${name}.${channels.includes(last) ? last : channels[0] ?? 'base_color'}`);
  } else {
    look(name);
  }
}

function look(name) {
  target = name;
  root.dataset.target = name;
  about = null;
  chips();
  graph.select(name.startsWith('@') ? name.slice(1).split(':')[0] : null, false);
  if (!name.startsWith('@')) { $('inspector').hidden = true; showKnown(); }
  refresh(512);
  relight();
}

// Asks for the picture of what is looked at, coarse and then sharp.
const refresh = latest(async (longest) => {
  const wanted = target;
  const { generation, canvas } = state.scene;
  const found = await ask('look', { g: generation, t: wanted, s: longest });
  if (!found || wanted !== target || generation !== state.scene.generation) return;
  about = found;
  if (wanted.startsWith('@')) inspect();
  if (found.shown) {
    await show({ ...found.shown, generation });
    if (!found.shown.final && longest < 2048 && !state.busy) refresh(2048);
  } else if (found.object) {
    const object = await ask('object', { g: generation, t: wanted });
    if (wanted !== target) return;
    shown = { type: found.object };
    if (object) picture.showObject(object, object.own ? object.size_mm.map((v) => (1000 * v) / Math.max(...object.size_mm)) : canvas.resolution);
    root.dataset.shown = `${wanted} ${found.object}`;
    legend(object);
  }
});

let turn = 0;
let best = null;
async function show(now) {
  // A sharp picture is not replaced by a coarse one of the same thing, not even by one that was asked for earlier.
  const { generation } = state.scene;
  const same = best?.target === now.target && best.generation === generation;
  if (same && best.final && !now.final) return;
  best = { target: now.target, generation, final: now.final };
  turn += 1;
  const mine = turn;
  if (shown?.picture === now.picture && picture.bitmap && !picture.object) {
    shown = now;
    picture.source = now.own ? null : { g: generation, t: now.target };
    mark(now);
    return;
  }
  const image = await bitmap(now.picture).catch(() => null);
  if (!image || mine !== turn || now.target !== target) { image?.close(); return; }
  shown = now;
  // What lies nowhere on the canvas has pixels of its own, and no finer ones.
  picture.show(image, now.own ? now.size : state.scene.canvas.resolution, now.own ? null : { g: state.scene.generation, t: now.target });
  mark(now);
  legend();
}

function mark(now) {
  root.dataset.shown = now.target;
  root.dataset.generation = state.scene.generation;
  root.dataset.sha = state.scene.sha256;
  root.dataset.final = now.final;
  root.dataset.picture = now.picture;
  $('empty').hidden = true;
}

function chips() {
  const { scene } = state ?? {};
  if (!scene) return;
  const button = (name, text, on) => {
    const made = document.createElement('button');
    Object.assign(made, { textContent: text.replaceAll('_', ' '), className: on ? 'on' : '' });
    made.dataset.target = name;
    made.onclick = () => choose(name);
    return made;
  };
  const node = target?.startsWith('@');
  const current = node ? null : outputOf(target);
  const outputs = scene.outputs.map((o) => button(o.name, o.name, o === current));
  if (node) outputs.push(button(target, target.slice(1), true));
  replace($('outputs'), outputs);
  const channels = current?.type === 'Material' ? channelsOf(current.name) : node && about?.channels ? about.channels : [];
  const base = node ? target.replace(/\.[a-z_]+$/, '') : current?.name;
  const now = about?.channel ?? target?.slice((base?.length ?? 0) + 1);
  replace($('channels'), channels.map((c) => button(`${base}.${c}`, c, c === now)));
}

// Buttons are replaced only where they are others: a click must not fall between two of them.
function replace(parent, children) {
  const same = parent.children.length === children.length && children.every((c, i) => c.dataset.target === parent.children[i].dataset.target);
  if (!same) { parent.replaceChildren(...children); return; }
  children.forEach((c, i) => { parent.children[i].className = c.className; });
}

// ---- facts

function legend(object) {
  let text = '';
  if (object?.note) text = object.note;
  else if (object) text = `${object.count.toLocaleString()} ${object.unit}`;
  else if (shown?.own) text = `${shown.size.join(' × ')} px of its own`;
  else if (shown?.range && (shown.range[0] !== 0 || shown.range[1] !== 1)) {
    const [lo, hi] = shown.range.map((v) => +v.toPrecision(3));
    text = `black ${lo}${shown.unit ? ` ${shown.unit}` : ''} · white ${hi}${shown.unit ? ` ${shown.unit}` : ''}`;
  }
  $('legend').textContent = text;
}

const probe = latest(async (pixel) => {
  if (!pixel || !state?.scene || picture.object?.own) { $('cursor').textContent = ''; return; }
  const [x, y] = pixel;
  if (shown?.own) { $('cursor').textContent = `${x}, ${y} px`; return; }
  const found = shown?.picture ? await ask('probe', { g: state.scene.generation, t: target, x, y }) : null;
  const size = state.scene.canvas;
  const mm = found?.mm ?? [0, 1].map((i) => ((pixel[i] + 0.5) * size.size_mm[i]) / size.resolution[i]);
  let text = `x ${mm[0].toFixed(3)}  y ${mm[1].toFixed(3)} mm   ·   ${x}, ${y} px`;
  if (found) {
    const n = (v) => (Number.isInteger(v) ? String(v) : (+v).toFixed(Math.abs(v) < 10 ? 4 : 2));
    let values = found.values.map(n).join('  ');
    if (found.type === 'Normal') values = found.values.map((v) => n(2 * v - 1)).join('  ');
    text += `   ·   ${values}${found.unit ? ` ${found.unit}` : ''}`;
    if (found.srgb) text += `   ·   #${found.srgb.map((v) => v.toString(16).padStart(2, '0')).join('')}`;
  }
  $('cursor').textContent = text;
});

function status() {
  const s = $('status');
  s.className = '';
  if (root.dataset.online === 'no') { s.textContent = 'not connected: is `shibo watch` running?'; s.className = 'bad'; return; }
  if (!state) return;
  if (state.errors.length) { s.textContent = `${state.errors.length} error${state.errors.length > 1 ? 's' : ''}: the last good picture stays`; s.className = 'bad'; return; }
  if (waiting) { s.textContent = state.progress ? `${state.progress.node} …` : 'evaluating …'; s.className = 'busy'; return; }
  const ms = (v) => (v >= 999.5 ? `${(v / 1000).toFixed(1)} s` : `${v.toFixed(0)} ms`);
  const { done } = state;
  if (done) s.textContent = `${done.ran} of ${state.scene?.nodes ?? '?'} nodes ran · shown in ${ms(done.first_ms)} · sharp in ${ms(done.all_ms)}`;
}

const el = (tag, className, text) => Object.assign(document.createElement(tag), { className, textContent: text ?? '' });

function complain() {
  const box = $('errors');
  const list = [...state.errors.map((e) => [e, 'error']), ...(state.errors.length ? [] : state.warnings.filter((w) => !w.dismissed).map((w) => [w, 'error warning']))];
  box.hidden = !list.length;
  root.dataset.errors = state.errors.length;
  status();
  if (!list.length) return;
  const title = el('h2', '', state.errors.length ? `${state.errors.length} error${state.errors.length > 1 ? 's' : ''}` : 'Worth knowing');
  if (state.errors.length && state.scene) title.append(el('span', '', 'what you see is the last good result'));
  title.append(el('div', 'spring'));
  const close = el('button', '', '✕');
  close.ariaLabel = 'Close';
  close.onclick = () => { box.hidden = true; state.warnings.forEach((w) => { w.dismissed = true; }); };
  title.append(close);
  box.replaceChildren(title, ...list.map(([e, className]) => complaint(e, className)));
}

function complaint(e, className) {
  const made = el('div', className);
  made.append(el('p', '', e.message), el('div', 'where', `${e.file}:${e.line}:${e.column}   ${e.code}`));
  const pre = el('pre', '');
  for (const { n, text } of e.lines) {
    const at = n === e.line;
    const line = el('div', at ? 'at' : 'other');
    line.append(el('b', '', String(n)));
    if (at) {
      const chars = [...text];
      const end = e.end_line === e.line ? Math.max(e.end_column, e.column + 1) : chars.length + 1;
      line.append(chars.slice(0, e.column - 1).join(''), el('mark', '', chars.slice(e.column - 1, end - 1).join('') || ' '), chars.slice(end - 1).join(''));
    } else {
      line.append(text);
    }
    pre.append(line);
  }
  made.append(pre);
  if (e.help) made.append(el('div', 'help', e.help));
  for (const r of e.related) made.append(el('div', 'where', `${r.file}:${r.line}:${r.column}   ${r.message}`));
  return made;
}

function inspect() {
  const box = $('inspector');
  box.hidden = false;
  const head = el('h2', '', 'Node');
  const close = el('button', '', '✕');
  close.ariaLabel = 'Back to the outputs';
  close.onclick = back;
  head.append(el('div', 'spring'), close);
  const name = el('div', 'name', about.node);
  const parts = [head, name, el('div', 'kind', about.kind)];
  const node = graph.nodes[graph.byName?.get(about.node)];
  if (node?.ports.length > 1) {
    const ports = el('div', 'ports');
    node.ports.forEach((p, i) => {
      const full = i ? `@${about.node}:${p.name}` : `@${about.node}`;
      const b = el('button', target === full ? 'on' : '', p.name);
      b.onclick = () => look(full);
      ports.append(b);
    });
    parts.push(ports);
  }
  const stat = graph.stats[graph.byName?.get(about.node)];
  const facts = [about.doc, stat && `${stat.state}${stat.state === 'computed' ? ` in ${(stat.seconds * 1000).toFixed(1)} ms` : ''}`, node && `line ${node.line}`];
  parts.push(el('div', 'facts', facts.filter(Boolean).join(' · ')), el('pre', '', about.text));
  box.replaceChildren(...parts);
  chips();
}

function back() {
  $('inspector').hidden = true;
  if (state?.scene) choose(firstOutput(state.scene));
}

// ---- the lit view

// The material that is lit: the one looked at, the graph's first, or what is looked at by itself.
function relight() {
  if (view !== 'lit' || !state?.scene) return;
  const { scene } = state;
  lit.setMesh(scene);
  const current = outputOf(target);
  const material = current?.type === 'Material' ? current : target?.startsWith('@') ? null : scene.outputs.find((o) => o.type === 'Material');
  const size = state.busy ? 512 : lit.resolution;
  if (material) {
    const maps = Object.fromEntries(channelsOf(material.name).map((c) => [c, { t: `${material.name}.${c}`, id: scene.pictures[`${material.name}.${c}`]?.picture }]));
    lit.load(scene, maps, size);
  } else if (about?.channels && target?.startsWith('@')) {
    const base = target.replace(/\.[a-z_]+$/, '');
    lit.load(scene, Object.fromEntries(about.channels.map((c) => [c, { t: `${base}.${c}`, id: `${scene.generation}` }])), size);
  } else if (shown?.type && shown.picture && !shown.own) {
    const channel = { Gray: 'height', Normal: 'normal' }[shown.type] ?? 'base_color';
    lit.load(scene, { [channel]: { t: target, id: shown.picture } }, size);
  }
}

// ---- controls

function setView(name) {
  view = name;
  root.dataset.view = $('stage').dataset.view = name;
  for (const b of $('views').children) b.classList.toggle('on', b.dataset.view === name);
  $('picture').hidden = $('picture-tools').hidden = name !== 'picture';
  $('lit').hidden = $('lit-tools').hidden = $('light').hidden = name !== 'lit';
  if (name === 'lit') { lit.start(); relight(); lit.resize(); } else { picture.resize(); picture.draw(); }
  placeWipe();
}

function placeWipe() {
  const current = view === 'lit' ? lit : picture;
  $('wipe').hidden = !current.pinned;
  $('wipe').style.left = `${current.wipe * 100}%`;
}

function setPlane(plane) {
  picture.plane = plane;
  for (const b of $('planes').children) b.classList.toggle('on', b.dataset.plane === plane);
  picture.draw();
}

function pin() {
  const current = view === 'lit' ? lit : picture;
  const on = current.pin();
  $(view === 'lit' ? 'pin-lit' : 'pin').ariaPressed = on;
  placeWipe();
}

function setRepeat(on) { picture.repeat = on; $('repeat').ariaPressed = on; picture.fit(); }

function setDrawer(on) {
  $('drawer').hidden = !on;
  $('toggle-graph').ariaPressed = on;
  if (on && state?.scene) { graph.resize(); graph.load(state.scene.generation).then(names); }
}

function names() {
  $('names').replaceChildren(...graph.nodes.slice(0, 2000).map((n) => Object.assign(document.createElement('option'), { value: n.name })));
}

function setPanel(on) { $('panel').hidden = !on; $('toggle-panel').ariaPressed = on; store('panel', on ? 'on' : 'off'); }

function setTheme(theme) {
  root.dataset.theme = theme;
  store('theme', theme);
  picture.draw();
  graph.draw();
  lit.draw();
}

function step(list, now, by) { return list[(list.indexOf(now) + by + list.length) % list.length]; }

function nextOutput(by) {
  const names = state?.scene?.outputs.map((o) => o.name) ?? [];
  if (names.length) choose(step(names, outputOf(target)?.name ?? names[0], by));
}

function nextChannel(by) {
  const list = [...$('channels').children].map((b) => b.dataset.target);
  if (list.length) look(step(list, target, by));
}

const toggleTheme = () => setTheme(root.dataset.theme === 'light' ? 'dark' : 'light');
const actions = {
  1: () => setView('picture'), 2: () => setView('lit'), g: () => setDrawer($('drawer').hidden), p: () => setPanel($('panel').hidden),
  '[': () => nextChannel(-1), ']': () => nextChannel(1), '+': () => picture.zoom(1.5), '=': () => picture.zoom(1.5), '-': () => picture.zoom(1 / 1.5),
  0: () => (view === 'lit' ? lit.reset() : picture.fit()), 9: () => picture.zoomTo(1), t: () => setRepeat(!picture.repeat),
  c: () => setPlane('all'), r: () => setPlane('r'), b: () => setPlane('b'), a: pin, s: () => (lit.strokes.mesh && view === 'lit' ? lit.strokes.toggle() : lit.nextShape()), n: () => lit.nextShape(), f: () => graph.fit(),
  d: toggleTheme, '?': () => $('keys').showModal(),
  '/': () => { setDrawer(true); $('find').focus(); $('find').select(); },
  Escape: () => { if (document.activeElement === $('find')) $('find').blur(); else if (target?.startsWith('@')) back(); },
};

addEventListener('keydown', (e) => {
  if (e.ctrlKey || e.metaKey || e.altKey || $('keys').open) return;
  const typing = e.target.matches('input:not([type=range]):not([type=checkbox]), select, textarea');
  if (e.key === 'Tab' && !typing && (document.activeElement === document.body || document.activeElement?.matches('canvas'))) {
    e.preventDefault();
    nextOutput(e.shiftKey ? -1 : 1);
    return;
  }
  if (typing && e.key !== 'Escape') return;
  const action = actions[e.key.length === 1 ? e.key.toLowerCase() : e.key];
  if (action) { e.preventDefault(); action(); }
});

for (const b of $('views').children) b.onclick = () => setView(b.dataset.view);
for (const b of $('planes').children) b.onclick = () => setPlane(b.dataset.plane);
$('repeat').onclick = () => setRepeat(!picture.repeat);
$('zoom-in').onclick = actions['+'];
$('zoom-out').onclick = actions['-'];
$('zoom-fit').onclick = () => picture.fit();
$('zoom-one').onclick = () => picture.zoomTo(1);
$('pin').onclick = $('pin-lit').onclick = pin;
$('toggle-graph').onclick = $('graph-close').onclick = actions.g;
$('toggle-panel').onclick = actions.p;
$('graph-fit').onclick = () => graph.fit();
$('theme').onclick = toggleTheme;
$('help').onclick = actions['?'];
$('find').onchange = () => {
  const text = $('find').value.trim().toLowerCase();
  const found = graph.nodes.find((n) => n.name.toLowerCase() === text) ?? graph.nodes.find((n) => n.name.toLowerCase().includes(text));
  if (text && found) { look(`@${found.name}`); graph.select(found.name, true); $('find').blur(); }
};
$('wipe').onpointerdown = (e) => { $('wipe').setPointerCapture(e.pointerId); e.preventDefault(); };
$('wipe').onpointermove = (e) => {
  if (!$('wipe').hasPointerCapture(e.pointerId)) return;
  const box = $('stage').getBoundingClientRect();
  const current = view === 'lit' ? lit : picture;
  current.wipe = Math.min(1, Math.max(0, (e.clientX - box.left) / box.width));
  placeWipe();
  current.draw();
};

setTheme(stored('theme') ?? (matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark'));
setPanel(stored('panel') !== 'off');
setPlane(PLANES[0]);
setView('picture');
