// @ts-check
// Buttons and keys.
import { $, element, keep, notice, press, setting } from './dom.js';
import { legend } from './facts.js';

const root = document.documentElement;
/** @type {(list: string[], now: string, by: number) => string} */
const step = (list, now, by) => list[(list.indexOf(now) + by + list.length) % list.length];

/**
 * @param {Page} page
 * @param {{
 *   look: (name: string) => void,
 *   choose: (name: string | null) => void,
 *   back: () => void,
 *   outputOf: (name: string) => { name: string, type: string } | undefined,
 *   relight: () => void,
 * }} of
 */
export function controls(page, { look, choose, back, outputOf, relight }) {
  const { picture, lit, graph } = page;
  const { comparison } = picture;

  /** @param {string} name */
  function setView(name) {
    page.view = name;
    root.dataset.view = $('stage').dataset.view = name;
    press($('views'), (b) => b.dataset.view === name);
    $('picture').hidden = $('picture-tools').hidden = name !== 'picture';
    $('lit').hidden = $('lit-tools').hidden = $('light').hidden = name !== 'lit';
    if (name === 'lit') { lit.start(); relight(); lit.resize(); } else { picture.resize(); picture.draw(); }
    page.overlay.draw();
    placeWipe();
  }

  // Places the dividing line: the lit view compares with the pinned material, the picture view also with another look.
  function placeWipe() {
    const pinned = page.view === 'lit' ? lit.pinned : comparison.before;
    const mode = page.view === 'lit' ? 'wipe' : comparison.mode;
    const share = page.view === 'lit' ? lit.wipe : comparison.wipe;
    $('wipe').hidden = !pinned || mode !== 'wipe';
    $('wipe').style.left = `${share * 100}%`;
    $('wipe').ariaValueNow = String(Math.round(share * 100));
    $('tag-a').hidden = $('tag-b').hidden = !pinned || mode === 'difference';
    if (pinned && mode === 'flicker') { $('tag-a').hidden = comparison.side === 1; $('tag-b').hidden = comparison.side === 0; }
    $('tag-a').textContent = (page.view === 'picture' && comparison.before?.label) || 'pinned';
    $('tag-b').textContent = (page.view === 'picture' && comparison.after?.label) || 'now';
  }

  /** @param {number} share */
  function setWipe(share) {
    const to = Math.min(1, Math.max(0, share));
    if (page.view === 'lit') { lit.wipe = to; lit.draw(); } else { comparison.wipe = to; picture.draw(); }
    placeWipe();
  }

  function compared() {
    $('compares').hidden = !comparison.before;
    $('pin').ariaPressed = String(!!comparison.before);
    press($('compares'), (b) => b.dataset.compare === comparison.mode);
    placeWipe();
    if (picture.fitted) picture.fit(); else picture.draw();
    legend(page);
    comparison.run(flicked);
  }

  function flicked() { placeWipe(); picture.draw(); }

  // Changes from one picture to the other by hand.
  function flip() {
    if (!comparison.before) return;
    if (comparison.mode !== 'flicker') { comparison.mode = 'flicker'; compared(); }
    clearInterval(comparison.clock);
    comparison.flip(flicked);
  }

  // A change of values while two looks are compared: the right side shows the picture of now again.
  function live() {
    if (!comparison.after) return;
    comparison.after = null;
    page.looks.marked = page.looks.marked.filter((step) => step.label && comparison.before?.label === `${step.number}. ${step.label}`);
    page.looks.draw();
    compared();
  }

  function pin() {
    if (page.view === 'lit') {
      $('pin-lit').ariaPressed = String(lit.pin());
      placeWipe();
      return;
    }
    const on = !comparison.before && !!picture.now;
    comparison.before = on ? { .../** @type {Source} */ (picture.now), label: '' } : null;
    comparison.after = null;
    if (!on) { page.looks.marked = []; page.looks.draw(); }
    compared();
    page.sharpen();
  }

  /** @param {string} plane */
  function setPlane(plane) {
    picture.plane = plane;
    press($('planes'), (b) => b.dataset.plane === plane);
    picture.draw();
  }

  /** @param {boolean} on */
  function setRepeat(on) { picture.repeat = on; $('repeat').ariaPressed = String(on); picture.fit(); }
  /** @param {boolean} on */
  function setSeam(on) { picture.seam = on; $('seam').ariaPressed = String(on); picture.draw(); }

  /** @param {boolean} on */
  function setDrawer(on) {
    $('drawer').hidden = !on;
    $('toggle-graph').ariaPressed = String(on);
    if (on && page.state?.scene) { graph.resize(); graph.load(page.state.scene.generation).then(names); }
  }

  function names() {
    $('names').replaceChildren(...graph.names.slice(0, 2000).map((n) => element('option', { value: n })));
  }

  // Height of the drawer, as a share of the window.
  /** @param {number} share */
  function setHeight(share) {
    const to = Math.min(1, Math.max(0.15, share));
    const full = to > 0.92;
    $('drawer').classList.toggle('full', full);
    $('graph-full').ariaPressed = String(full);
    if (!full) $('drawer').style.height = `${Math.round(to * 100)}vh`;
    $('drawer-size').ariaValueNow = String(Math.round(to * 100));
    keep('drawer', full ? 1 : to);
    graph.resize();
  }

  /** @param {boolean} on */
  function setPanel(on) { $('panel').hidden = !on; $('toggle-panel').ariaPressed = String(on); keep('panel', on); }

  /** @param {string} theme */
  function setTheme(theme) {
    root.dataset.theme = theme;
    picture.draw();
    graph.draw();
    lit.draw();
  }

  /** @param {number} by */
  function nextOutput(by) {
    const list = page.state?.scene?.outputs.map((o) => o.name) ?? [];
    if (list.length) choose(step(list, outputOf(page.target)?.name ?? list[0], by));
  }

  /** @param {number} by */
  function nextChannel(by) {
    const list = [...$('channels').children].map((b) => /** @type {string} */ (/** @type {HTMLElement} */ (b).dataset.target));
    if (list.length) look(step(list, page.target, by));
  }

  function toggleTheme() {
    const theme = root.dataset.theme === 'light' ? 'dark' : 'light';
    setTheme(theme);
    keep('theme', theme);
  }

  /** @param {number} by */
  const zoom = (by) => (page.view === 'lit' ? lit.zoom(by) : picture.zoom(by));
  // Keys of the picture view do nothing in the lit view.
  /** @type {(work: () => void) => () => void} */
  const inPicture = (work) => () => { if (page.view === 'picture') work(); };
  /** @type {(work: () => void) => () => void} */
  const inLit = (work) => () => { if (page.view === 'lit') work(); };
  /** @type {Record<string, () => void>} */
  const actions = {
    1: () => setView('picture'), 2: () => setView('lit'), g: () => setDrawer($('drawer').hidden), p: () => setPanel($('panel').hidden),
    ',': () => nextOutput(-1), '.': () => nextOutput(1), '[': () => nextChannel(-1), ']': () => nextChannel(1),
    '+': () => zoom(1.5), '=': () => zoom(1.5), '-': () => zoom(1 / 1.5),
    0: () => (page.view === 'lit' ? lit.reset() : picture.fit()), 9: inPicture(() => picture.zoomTo(1)),
    t: inPicture(() => setRepeat(!picture.repeat)), h: inPicture(() => setSeam(!picture.seam)),
    c: inPicture(() => setPlane('all')), r: inPicture(() => setPlane('r')), b: inPicture(() => setPlane('b')), a: pin,
    x: inPicture(flip), m: inPicture(() => page.overlay.setRulers(!page.overlay.rulers)),
    s: inLit(() => { if (lit.strokes.mesh) { lit.strokes.toggle(); if (lit.strokes.drawing) page.tabs.show('look'); } else { lit.nextShape(); } }), n: inLit(() => lit.nextShape()),
    f: () => { if (!$('drawer').hidden) graph.fit(); },
    d: toggleTheme, '?': () => $('keys').showModal(),
    '/': () => { setDrawer(true); $('find').focus(); $('find').select(); },
    Escape: () => { if (document.activeElement === $('find')) $('find').blur(); else if (page.target?.startsWith('@')) back(); },
  };
  /** @type {Record<string, (e: KeyboardEvent) => void>} */
  const withControl = {
    z: (e) => (e.shiftKey ? page.looks.redo() : page.looks.undo()),
    y: () => page.looks.redo(),
    s: () => page.parameters.save(),
    o: () => $('open').click(),
  };

  addEventListener('keydown', (e) => {
    if ($('keys').open || $('graphs').open || e.altKey) return;
    const target = /** @type {HTMLElement} */ (e.target);
    const typing = target.matches?.('input:not([type=range]):not([type=checkbox]):not([type=color]), select, textarea');
    const key = e.key.length === 1 ? e.key.toLowerCase() : e.key;
    if (e.ctrlKey || e.metaKey) {
      // While the user types in a text field, the browser's own undo applies.
      const text = target.matches?.('input[type=text]:not(.number-box), input[type=search], textarea, .number-box[data-typed]');
      if (withControl[key] && !(text && key !== 's')) { e.preventDefault(); withControl[key](e); }
      return;
    }
    if (typing && e.key !== 'Escape') return;
    if (target.matches?.('input[type=range]') && /^[0-9+-]$/.test(e.key)) return;
    // With Shift, digits are slots, whatever they type on the keyboard.
    const slot = e.shiftKey && /^Digit[1-9]$/.test(e.code) ? Number(e.code.slice(5)) : 0;
    if (slot) { e.preventDefault(); page.tabs.show('look').then(() => page.slots?.use(slot)); return; }
    const action = actions[key];
    if (action) { e.preventDefault(); action(); }
  });

  /** @type {(group: HTMLElement, name: string, work: (value: string) => void) => void} */
  const choices = (group, name, work) => { for (const b of /** @type {Iterable<HTMLElement>} */ (group.children)) b.onclick = () => work(b.dataset[name] ?? ''); };
  choices($('views'), 'view', setView);
  choices($('planes'), 'plane', setPlane);
  choices($('compares'), 'compare', (mode) => { comparison.mode = mode; compared(); });
  $('repeat').onclick = () => setRepeat(!picture.repeat);
  $('toggle-rulers').onclick = () => page.overlay.setRulers(!page.overlay.rulers);
  $('seam').onclick = () => setSeam(!picture.seam);
  $('zoom-in').onclick = () => picture.zoom(1.5);
  $('zoom-out').onclick = () => picture.zoom(1 / 1.5);
  $('zoom-fit').onclick = () => picture.fit();
  $('zoom-one').onclick = () => picture.zoomTo(1);
  $('pin').onclick = $('pin-lit').onclick = pin;
  $('save').onclick = () => page.parameters.save();
  $('toggle-graph').onclick = $('graph-close').onclick = actions.g;
  $('toggle-panel').onclick = actions.p;
  $('graph-fit').onclick = () => graph.fit();
  $('graph-full').onclick = () => setHeight($('drawer').classList.contains('full') ? 0.4 : 1);
  $('graph-heat').onclick = () => { graph.heat = !graph.heat; $('graph-heat').ariaPressed = String(graph.heat); graph.draw(); };
  $('theme').onclick = toggleTheme;
  $('help').onclick = actions['?'];
  $('find').onchange = () => {
    const text = $('find').value.trim().toLowerCase();
    const found = graph.names.find((n) => n.toLowerCase() === text) ?? graph.names.find((n) => n.toLowerCase().includes(text));
    if (!text) return;
    if (!found) { notice(`There is no node ${$('find').value}`, true); return; }
    look(`@${found}`);
    graph.select(found, true);
    $('find').blur();
  };

  // Draggable elements: the line between two pictures, and the edge of the drawer.
  /** @param {HTMLElement} handle @param {(e: PointerEvent) => void} move */
  const drags = (handle, move) => {
    handle.onpointerdown = (e) => { handle.setPointerCapture(e.pointerId); e.preventDefault(); };
    handle.onpointermove = (e) => { if (handle.hasPointerCapture(e.pointerId)) move(e); };
  };
  drags($('wipe'), (e) => { const box = $('stage').getBoundingClientRect(); setWipe((e.clientX - box.left) / box.width); });
  drags($('drawer-size'), (e) => setHeight((innerHeight - e.clientY - 28) / innerHeight));
  /** @param {HTMLElement} handle @param {(by: number) => void} move */
  const arrows = (handle, move) => handle.addEventListener('keydown', (e) => {
    const by = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[e.key];
    if (by) { e.preventDefault(); e.stopPropagation(); move(by); }
  });
  arrows($('wipe'), (by) => setWipe((page.view === 'lit' ? lit.wipe : comparison.wipe) + by * 0.02));
  arrows($('drawer-size'), (by) => setHeight(Number($('drawer-size').ariaValueNow) / 100 + by * 0.05));

  setTheme(setting('theme') ?? (matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark'));
  setPanel(setting('panel') ?? true);
  setHeight(setting('drawer') ?? 0.4);
  setPlane('all');
  compared();
  queueMicrotask(() => setView('picture'));
  return { placeWipe, compared, live, setView, setSeam, setDrawer, names };
}
