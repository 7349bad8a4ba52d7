// @ts-check
// The page: keeps the server's state and the selected target.
import { Connection } from './connection.js';
import { controls } from './controls.js';
import { $, element, notice, press, rove, say } from './dom.js';
import { drops } from './drop.js';
import { complain } from './errors.js';
import { legend, probe, probeMesh, status, tiling, working } from './facts.js';
import { Lit } from './lit.js';
import { Looks } from './looks.js';
import { addressed, again, ask, bitmap, exact, jump, latest, news, send } from './net.js';
import { Graph } from './nodes.js';
import { Outputs } from './outputs.js';
import { Overlay } from './overlay.js';
import { Parameters } from './params.js';
import { Picture } from './picture.js';
import { Tabs } from './tabs.js';
import { CHANNELS } from './textures.js';
import { sent } from './values.js';
import { Wire } from './wire.js';

const root = document.documentElement;
/** @type {(panel: string) => HTMLElement} */
const body = (panel) => /** @type {HTMLElement} */ ($(panel).querySelector('.body'));
// Longest side of exact values, in pixels.
const EXACT = 2048;
// Time to wait for a picture before newer values are sent, in ms.
const SEEN = 500;
/** @type {(value?: unknown) => void} */
let arrived = () => {};

// State shared by the modules: the server's state; the view; the selected target (an output, `OUTPUT.CHANNEL` or
// `@NODE`); the server's description of the target and of its picture.
// The first messages set the fields that are null here; the views are set below.
export const page = /** @type {Page} */ (/** @type {unknown} */ ({ state: null, view: 'picture', target: null, about: null, shown: null, waiting: false }));

for (const group of document.querySelectorAll('[data-rove]')) rove(group);
// The next values are sent only after the picture of the previous ones is announced: newer values would cancel its
// computation.
/** @type {Promise<unknown>} */
let sending = Promise.resolve();
const sendLatest = latest(async (/** @type {Values} */ values) => {
  const seen = new Promise((done) => { arrived = done; setTimeout(done, SEEN); });
  sending = send(sent(values));
  await sending;
  await seen;
});
// Values still on their way must not follow those that a change of the file sets: they would come back as set by hand,
// and the next save would write them.
function settle() {
  sendLatest.forget();
  return sending.catch(() => {});
}
page.picture = new Picture($('picture'), {
  onview: (scale) => { say($('zoom'), scale === null ? '' : `${(scale * 100).toFixed(scale < 0.1 ? 1 : 0)} %`); page.controls?.placeWipe(); page.overlay?.draw(); },
  oncursor: (pixel) => probe(page, pixel),
  online: async (ends) => { await page.tabs.show('measure'); measure?.cut(ends); },
});
page.overlay = new Overlay(page);
page.wire = new Wire($('wire'), page.picture);
page.lit = new Lit($('lit'), $('light'));
page.graph = new Graph($('graph'), { onselect: (name) => look(`@${name}`), onjump: jump, onlevel: (path) => crumbs(path), values: () => page.parameters.values });
const outputs = new Outputs(page, { choose, outputOf, channelsOf });
const chips = () => outputs.show();
page.parameters = new Parameters($('parameters'), {
  onchange: (values, label, group) => { page.looks.record(values, label, group); page.controls.live(); sendLatest(values); saveable(); },
  onsave: write,
});
// The server has dropped the refused value; a value that returns must be sent.
page.parameters.onrefuse = (/** @type {Values} */ values, /** @type {boolean} */ returns) => { page.looks.correct(values); if (returns) sendLatest(values); saveable(); };
page.looks = new Looks(body('looks'), {
  apply: (values, tell) => { page.controls.live(); page.parameters.take(values); if (tell) sendLatest(values); saveable(); },
  compare: compareLooks,
  settle,
});
const connection = new Connection(page, (values) => sendLatest(values));
// Parts of the panel, each loaded when its tab is first shown: the first page stays small.
/** @type {import('./measure.js').Measure | undefined} */
let measure;
/** @type {import('./sheet.js').Sheet | undefined} */
let sheet;
/** @type {import('./export.js').Exporter | undefined} */
let exporter;
/** @type {import('./photo.js').Photo | undefined} */
let photo;
/** @type {Record<string, () => Promise<void>>} */
const parts = {
  async look() {
    const { Photo } = await import('./photo.js');
    photo = new Photo(body('photo'), page, write);
    const { Slots } = await import('./slots.js');
    page.slots = new Slots(body('slots'), page);
  },
  async measure() {
    const { Measure } = await import('./measure.js');
    measure = new Measure(body('measure'), {
      ontone: (tone) => { page.picture.tone = tone; sharpen(); page.picture.draw(); legend(page); },
      source: () => page.picture.now,
      facts: () => page.state.scene.canvas,
      online: (ends) => { page.picture.line = ends; page.picture.draw(); measure?.cut(ends); },
    });
  },
  async history() {
    const { Sheet } = await import('./sheet.js');
    sheet = new Sheet(body('sheet'), page);
  },
  async export() {
    const { Exporter } = await import('./export.js');
    exporter = new Exporter(body('export'), page);
  },
};
page.tabs = new Tabs({
  load: (name) => parts[name]?.(),
  onshow: (name) => {
    if (name === 'measure') { sharpen(); measure?.show(); }
    if (name === 'look') page.slots?.draw();
    if (name === 'history') { page.looks.draw(); if (page.state?.scene) sheet?.show(); }
  },
});
drops(page.lit, () => page.controls.setView('lit'), async (file) => { await page.tabs.show('look'); await photo?.take(file); });

function saveable() {
  const { count, byHand } = page.parameters;
  $('save').disabled = !count;
  say($('save'), count ? `Save ${count} change${count > 1 ? 's' : ''}` : 'Saved');
  $('save').title = `Write the values set by hand into the file (Ctrl+S)${count ? `: ${byHand}` : ''}`;
}

// ---- messages of the server

const heard = {
  /** @param {State} now */
  state(now) {
    // Another graph is shown now. After a loss of the connection, unsaved values of the old one stay in the banner.
    if (page.state && page.state.file !== now.file) {
      if (root.dataset.online !== 'yes' && page.parameters.count) return;
      if (again()) return;
    }
    page.state = now;
    root.dataset.online = 'yes';
    connection.find(now.values);
    say($('file'), now.file);
    $('unsaved').hidden = !now.unsaved;
    if (document.title !== `${now.file} · Shibo`) document.title = `${now.file} · Shibo`;
    page.looks.seen(now);
    follow();
    heard.errors(now);
    heard.busy(now);
    if (now.progress) heard.progress(now.progress);
    if (now.done) heard.done(now.done);
  },
  /** @param {Shown & { generation: number }} now */
  shown(now) {
    const { state } = page;
    if (!state?.scene || now.generation !== state.scene.generation) return;
    state.scene.pictures[now.target] = now;
    chips();
    if (now.target === page.target) present(now);
    if (now.final && page.lit.wants(now.target)) relight();
  },
  /** @param {Pick<State, 'errors'>} now */
  errors({ errors }) { if (page.state) { page.state.errors = errors; complain(page.state); status(page); } },
  /** @param {Pick<State, 'warnings'>} now */
  warnings({ warnings }) { if (page.state) { page.state.warnings = warnings; complain(page.state); status(page); } },
  /** @param {Pick<State, 'busy'>} now */
  busy({ busy }) {
    if (page.state) { page.state.busy = busy; page.state.progress = null; }
    if (page.graph.patient !== busy) { page.graph.patient = busy; if (!$('drawer').hidden) page.graph.draw(); }
    // Shows progress only after a delay, so that short evaluations do not flicker.
    clearTimeout(patience);
    patience = busy && !page.waiting ? setTimeout(() => wait(true), 200) : undefined;
    if (!busy) wait(false);
  },
  /** @param {Progress | null} p */
  progress(p) {
    if (!p) return;
    if (patience) { clearTimeout(patience); patience = undefined; wait(true); }
    if (page.state) { page.state.progress = p; working(p); status(page); }
  },
  /** @param {Done} done */
  done(done) {
    const { state, target } = page;
    if (!state) return;
    state.done = done;
    root.dataset.done = String(done.generation);
    status(page);
    if (done.generation !== state.scene?.generation) return;
    page.looks.pictures(state.scene.pictures);
    page.looks.draw();
    if (!$('drawer').hidden) page.graph.loadStats(done.generation);
    if (target?.startsWith('@')) refresh(2048);
    relight();
    sheet?.stale();
  },
  /** @param {ExportNews} now */
  export(now) { exporter?.heard(now); },
  /** @param {{ edit: FieldEdit, why: string }} now */
  refused({ edit, why }) { page.parameters.refuse(edit, why); },
  /** @param {FitNews} now */
  fit(now) { photo?.heard(now); },
  // The editor shows a target.
  /** @param {{ target: string }} now */
  look({ target: wanted }) { if (page.state?.scene) look(wanted); },
  offline() {
    root.dataset.online = 'no';
    clearTimeout(patience);
    wait(false);
    connection.lose();
    status(page);
  },
};

// Shows that an evaluation takes longer.
/** @type {number | undefined} */
let patience;
/** @param {boolean} on */
function wait(on) {
  page.waiting = on;
  $('progress').classList.toggle('on', on);
  $('progress').classList.toggle('unknown', on);
  $('working').hidden = !on;
  if (on) say($('working'), 'evaluating …');
  status(page);
}

// Handles a new graph; keeps the selected target if it still exists.
function follow() {
  const { scene, errors, values } = page.state;
  $('empty').hidden = !!scene;
  if (!scene) {
    $('empty').textContent = errors.length ? 'The page fills as soon as the file is sound.' : 'Evaluating …';
    return;
  }
  page.lit.staging.open(page.state.file);
  page.wire.follow(scene);
  page.parameters.update(scene, values);
  saveable();
  const { canvas } = scene;
  say($('canvas-facts'), `${canvas.size_mm.join(' × ')} mm · ${canvas.resolution.join(' × ')} px`);
  tiling(page, look);
  const names = scene.outputs.map((o) => o.name);
  const { target } = page;
  const known = target && (target.startsWith('@') || names.some((n) => target === n || target.startsWith(`${n}.`)));
  chips();
  const wanted = addressed();
  if (!known && wanted) look(wanted); else if (!known) choose(firstOutput(scene)); else if (target.startsWith('@')) refresh(512); else showKnown();
  if (!$('drawer').hidden) page.graph.load(scene.generation);
  relight();
}

// The first picture: a finished look if there is one, else the first output.
/** @param {Scene} scene */
function firstOutput(scene) {
  const found = scene.outputs.find((o) => o.type === 'Rgb' && /lit|preview/.test(o.name));
  return (found ?? scene.outputs[0])?.name ?? null;
}

function showKnown() {
  const known = page.state.scene.pictures[page.target];
  if (known) present({ ...known, generation: page.state.scene.generation });
}

// ---- the selected target

/** @param {string} name @returns {{ name: string, type: string } | undefined} */
export function outputOf(name) { return page.state?.scene?.outputs.find((o) => name === o.name || name?.startsWith(`${o.name}.`)); }
/** @param {string} output @returns {string[]} */
function channelsOf(output) { return CHANNELS.filter((c) => page.state.scene.pictures[`${output}.${c}`]); }

// Selects an output, or for a material one of its channels.
/** @param {string | null} name */
export function choose(name) {
  if (!name) return;
  const output = outputOf(name);
  if (output?.type === 'Material' && name === output.name) {
    const channels = channelsOf(name);
    const last = page.target?.split('.').at(-1);
    look(`${name}.${last && channels.includes(last) ? last : channels[0] ?? 'base_color'}`);
  } else {
    look(name);
  }
}

/** @param {string} name */
export function look(name) {
  page.target = name;
  root.dataset.target = name;
  page.about = null;
  chips();
  page.graph.select(name.startsWith('@') ? name.slice(1).split(':')[0] : null, false);
  if (name.startsWith('@')) page.tabs.show('parameters'); else { $('inspector').hidden = true; showKnown(); }
  refresh(512);
  relight();
}

export function back() {
  $('inspector').hidden = true;
  if (page.state?.scene) choose(firstOutput(page.state.scene));
}

// Requests the picture of the selected target, first coarse and then sharp.
const refresh = latest(async (/** @type {number} */ longest) => {
  const wanted = page.target;
  const { generation, canvas } = page.state.scene;
  /** @type {About | null | undefined} */
  const found = await ask('look', { g: generation, t: wanted, s: longest });
  if (wanted !== page.target || generation !== page.state.scene.generation) return;
  // The node was deleted from the file.
  if (found === null && wanted.startsWith('@')) back();
  if (!found) return;
  page.about = found;
  if (wanted.startsWith('@')) details();
  if (found.shown) {
    await show({ ...found.shown, generation });
    if (!found.shown.final && longest < 2048 && !page.state.busy) refresh(2048);
  } else if (found.object) {
    /** @type {Sketch | null} */
    const object = await ask('object', { g: generation, t: wanted });
    if (wanted !== page.target) return;
    page.shown = { type: found.object };
    if (object) page.picture.showObject(object, object.own ? /** @type {Vec2} */ (object.size_mm.map((v) => (1000 * v) / Math.max(...object.size_mm))) : canvas.resolution);
    root.dataset.shown = `${wanted} ${found.object}`;
    legend(page, object);
  }
});

async function details() {
  const { inspect } = await import('./inspector.js');
  const { target, graph, about } = page;
  if (!about || !target.startsWith('@')) return;
  const node = graph.box(about.node);
  inspect(about, {
    node, target, parameters: page.parameters, stat: graph.stats[graph.index(about.node)], onport: look, onclose: back, onjump: () => jump(about.node),
    onchange: (change, label) => write(change, page.parameters.values, label),
  });
  chips();
}

// Shows the newest announced picture, one at a time. The next values are sent as soon as a picture is announced, so
// that the server computes the next one while this one is drawn.
const present = latest(async (/** @type {Shown} */ now) => {
  if (page.state.scene?.generation === now.generation && root.dataset.generation !== String(now.generation)) arrived();
  await show(now);
});

let turn = 0;
/** @type {{ target: string, generation: number, final: boolean } | null} */
let best = null;
/** @param {Shown} now */
async function show(now) {
  // A coarse picture never replaces a sharp one of the same target, even if it arrives later.
  const { generation, sha256, canvas } = page.state.scene;
  if (best && best.target === now.target && best.generation === generation && best.final && !now.final) return;
  best = { target: now.target, generation, final: now.final };
  turn += 1;
  const mine = turn;
  const tiles = now.own ? null : { g: generation, t: now.target };
  if (page.shown?.picture === now.picture && page.picture.bitmap) {
    page.shown = now;
    page.picture.source = tiles;
    page.looks.shown(now, page.picture.bitmap);
    mark(now, generation, sha256);
    return;
  }
  const image = await bitmap(now.picture).catch(() => null);
  if (!image || mine !== turn || now.target !== page.target) { image?.close(); return; }
  page.shown = now;
  // A picture without a position on the canvas has its own size, and there is no finer one.
  page.picture.show({ image, range: now.range, type: now.type, unit: now.unit, own: now.own }, now.own ? now.size : canvas.resolution, tiles);
  page.looks.shown(now, image);
  mark(now, generation, sha256);
  legend(page);
  sharpen();
  measure?.show();
}

/** @param {Shown} now @param {number} generation @param {string} sha256 */
function mark(now, generation, sha256) {
  if (now.final) photo?.compare();
  Object.assign(root.dataset, { shown: now.target, generation, sha: sha256, final: now.final, picture: now.picture });
  $('empty').hidden = true;
}

// Fetches exact values while a measuring tool is in use.
const sharpen = latest(async () => {
  const { now } = page.picture;
  const { state, shown } = page;
  if (!now || now.own || now.samples || !shown?.final || !(measure?.open || page.picture.comparison.before)) return;
  now.samples = await exact({ g: state.scene.generation, t: String(shown.target), s: EXACT });
  if (now === page.picture.now) { page.picture.draw(); measure?.show(); legend(page); }
});
page.sharpen = sharpen;

// ---- the file

// Changes the file; `after` are the parameter values to set afterwards. Returns whether the file was changed.
/** @param {unknown} change @param {Values} after @param {string} label */
async function write(change, after, label) {
  let written = false;
  // While an editor follows the graph, the change is made in its text.
  if (page.state.unsaved != null) label = label.replace('Saved to file', 'Put into the editor');
  try {
    page.parameters.take(after);
    await page.looks.save(change, after, label);
    notice(label);
    written = true;
  } catch (error) {
    page.parameters.take(/** @type {Look} */ (page.looks.at).values);
    notice(/** @type {Error} */ (error).message, true);
  }
  saveable();
  return written;
}

// ---- comparison of two looks

/** @param {Look[] | null} steps */
async function compareLooks(steps) {
  const { comparison } = page.picture;
  Object.assign(comparison, { before: null, after: null });
  if (steps) {
    const sides = await Promise.all(steps.map(async (step) => {
      const now = step.pictures[page.target];
      const image = now && await bitmap(now.picture).catch(() => null);
      return image && { image, range: now.range, type: now.type, unit: now.unit, label: `${step.number}. ${step.label}` };
    }));
    if (sides.every(Boolean)) [comparison.before, comparison.after] = sides;
    else notice(`${page.target} is not kept for both looks; go to each once`, true);
  }
  page.controls.compared();
}

// Breadcrumbs of the drawn level of the graph.
/** @param {string} path */
function crumbs(path) {
  const parts = path ? path.split('/') : [];
  /** @param {string} text @param {string} to */
  const button = (text, to) => {
    const made = element('button', { textContent: text, ariaPressed: String(to === path) });
    made.onclick = () => page.graph.enter(to);
    return made;
  };
  $('crumbs').replaceChildren(button('Graph', ''), ...parts.map((part, i) => button(`› ${part}`, parts.slice(0, i + 1).join('/'))));
}

// ---- the lit view

// Bodies of outputs, if the graph ever had one.
/** @type {Promise<import('./bodies.js').Bodies> | undefined} */
let bodies;

// The material to light: the selected one, else the graph's first, else the selected target by itself.
export function relight() {
  const { state, target, about, shown, lit } = page;
  if (page.view !== 'lit' || !state?.scene) return;
  const { scene } = state;
  lit.setMesh(scene);
  lit.setSolid(scene.solid);
  if (scene.bodies.length) bodies ??= import('./bodies.js').then(({ Bodies }) => new Bodies(lit));
  bodies?.then((found) => { if (page.state.scene === scene) found.follow(scene); });
  const { solid } = lit.shapes[lit.shape];
  const current = outputOf(target);
  const material = current?.type === 'Material' ? current : target?.startsWith('@') ? null : scene.outputs.find((o) => o.type === 'Material');
  const size = state.busy ? 512 : lit.resolution;
  if (material) {
    const maps = Object.fromEntries(channelsOf(material.name).map((c) => [c, { t: `${material.name}.${c}`, id: `${scene.pictures[`${material.name}.${c}`]?.picture} ${solid}`, solid }]));
    lit.load(scene, maps, size);
  } else if (about?.channels && target?.startsWith('@')) {
    const base = target.replace(/\.[a-z_]+$/, '');
    lit.load(scene, Object.fromEntries(about.channels.map((c) => [c, { t: `${base}.${c}`, id: `${scene.generation} ${solid}`, solid }])), size);
  } else if (solid) {
    lit.load(scene, { base_color: { t: target, id: `${scene.generation} ${solid}`, solid } }, size);
  } else if (shown?.type && shown.picture && !shown.own) {
    const channel = /** @type {Record<string, string>} */ ({ Gray: 'height', Normal: 'normal' })[shown.type] ?? 'base_color';
    lit.load(scene, { [channel]: { t: target, id: shown.picture } }, size);
  }
}

$('open').onclick = () => import('./graphs.js').then(({ chooseGraph }) => chooseGraph(page));
page.lit.onshape = relight;
page.lit.onhover = (/** @type {Hover | null} */ found) => probeMesh(page, found);
page.controls = controls(page, { look, choose, back, outputOf, relight });
crumbs('');
page.tabs.start();
press($('views'), (b) => b.dataset.view === 'picture');
news((kind, data) => /** @type {Record<string, (data: any) => void>} */ (heard)[kind]?.(data));
