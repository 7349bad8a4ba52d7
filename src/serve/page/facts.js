// @ts-check
// Text below the picture.
import { $, notice, say } from './dom.js';
import { ask, latest } from './net.js';
import { difference, valueAt } from './tone.js';

// Shows whether the canvas tiles, and which nodes prevent that.
/** @param {Page} page @param {(name: string) => void} look */
export function tiling(page, look) {
  const { canvas, breaks } = page.state.scene;
  const [first] = breaks ?? [];
  const button = $('tiling');
  button.hidden = false;
  button.className = first ? 'bad' : '';
  say(button, first ? 'does not tile' : canvas.tile.every(Boolean) ? 'tiles' : canvas.tile.some(Boolean) ? 'tiles one way' : 'no tiling');
  button.title = first ? `${first.message}; ${first.help}` : 'As the canvas of the graph says';
  button.onclick = () => { if (first) { look(`@${first.node}`); notice(first.message); } else page.controls.setSeam(!page.picture.seam); };
}

/** @type {(v: number) => string} */
const n = (v) => (Number.isInteger(v) ? String(v) : (+v).toFixed(Math.abs(v) < 10 ? 4 : 2));

// Difference of two pictures; the result of the last comparison is cached.
/** @type {Partial<ReturnType<typeof difference>> & { before?: Source, now?: Source, exact?: string }} */
let compared = {};
/** @param {Source} before @param {Source} now @param {string | undefined} unit */
function numbers(before, now, unit) {
  const same = compared.before === before && compared.now === now && compared.exact === [!!before.samples, !!now.samples].join();
  if (!same) compared = { before, now, exact: [!!before.samples, !!now.samples].join(), ...difference(before, now) };
  const [mean, rms, most] = [compared.mean ?? 0, compared.rms ?? 0, compared.most ?? 0].map((v) => `${+v.toPrecision(3)}${unit ? ` ${unit}` : ''}`);
  return `mean difference ${mean} · RMS ${rms} · most ${most}`;
}

// Shows the black and white values, or the number of shapes of an object.
/** @param {Page} page @param {Sketch | null} [object] */
export function legend(page, object) {
  const { shown, picture } = page;
  let text = '';
  const range = picture.sharedRange ?? shown?.range;
  if (object?.note) text = object.note;
  else if (object) text = `${object.count.toLocaleString()} ${object.unit}`;
  else if (shown?.own) text = `${shown.size?.join(' × ')} px of its own`;
  else if (range && (range[0] !== 0 || range[1] !== 1)) {
    const [lo, hi] = range.map((v) => `${+v.toPrecision(3)}${shown?.unit ? ` ${shown.unit}` : ''}`);
    text = `black ${lo} · white ${hi}${picture.tone.range ? ' · locked' : picture.comparison.before && picture.sharedRange ? ' · shared' : ''}`;
  }
  const { before, after, mode } = picture.comparison;
  const now = after ?? picture.now;
  if (before && now && !object && mode === 'difference') text = [numbers(before, now, shown?.unit), text].filter(Boolean).join(' · ');
  say($('legend'), text);
}
// Shows the position under the cursor and the values there.
/** @type {(page: Page, pixel: Vec2 | null) => Promise<void>} */
export const probe = latest(async (page, pixel) => {
  const { state, shown, picture, target } = page;
  if (!pixel || !state?.scene || picture.object?.own) { $('cursor').textContent = ''; page.overlay.at(null); return; }
  const [x, y] = pixel;
  if (shown?.own) { $('cursor').textContent = `${x}, ${y} px`; return; }
  const found = shown?.picture ? await ask('probe', { g: state.scene.generation, t: target, x, y }) : null;
  page.overlay.at(found?.type === 'Gray' ? found.values[0] : null);
  const { canvas } = state.scene;
  const share = /** @type {Vec2} */ ([0, 1].map((i) => (pixel[i] + 0.5) / canvas.resolution[i]));
  const mm = found?.mm ?? share.map((s, i) => s * canvas.size_mm[i]);
  let text = `x ${mm[0].toFixed(3)}  y ${mm[1].toFixed(3)} mm   ·   ${x}, ${y} px`;
  if (found) {
    const values = found.type === 'Normal' ? found.values.map((/** @type {number} */ v) => 2 * v - 1) : found.values;
    text += `   ·   ${values.map(n).join('  ')}${found.unit ? ` ${found.unit}` : ''}`;
    if (found.srgb) text += `   ·   #${found.srgb.map((/** @type {number} */ v) => v.toString(16).padStart(2, '0')).join('')}`;
  }
  const { before, after } = picture.comparison;
  if (before) text += `   ·   left ${valueAt(before, share).map(n).join('  ')}`;
  if (after) text += `   right ${valueAt(after, share).map(n).join('  ')}`;
  $('cursor').textContent = text;
});

// Shows the point of the mesh under the cursor: position, triangle, part, chart, texel and values.
/** @type {(page: Page, found: Hover | null) => Promise<void>} */
export const probeMesh = latest(async (page, found) => {
  const { state, target } = page;
  if (!found || !state?.scene) { $('cursor').textContent = ''; return; }
  const { canvas, generation } = state.scene;
  const [x, y] = found.uv.map((v, i) => Math.min(canvas.resolution[i] - 1, Math.max(0, Math.floor(v * canvas.resolution[i]))));
  const parts = [`${found.mm.map((v) => v.toFixed(2)).join('  ')} mm`];
  if (found.triangle !== undefined) parts.push(`triangle ${found.triangle}`, `chart ${found.chart}`);
  if (found.part) parts.push(found.part);
  parts.push(`${x}, ${y} px`);
  const value = await ask('probe', { g: generation, t: target, x, y }).catch(() => null);
  if (value) parts.push(`${value.values.map(n).join('  ')}${value.unit ? ` ${value.unit}` : ''}`);
  $('cursor').textContent = parts.join('   ·   ');
});

// Shows on the stage the node that is computed, the share of all work, and the time so far.
/** @param {Progress} p */
export function working(p) {
  $('progress').classList.remove('unknown');
  const share = Math.min(99, Math.floor(100 * p.share));
  /** @type {HTMLElement} */ ($('progress').firstElementChild).style.width = `${share}%`;
  const part = p.part === null ? '' : ` ${Math.floor(100 * p.part)} %`;
  say($('working'), [`${p.node ?? 'pictures'}${part}`, `${share} % of all`, `${p.seconds.toFixed(p.seconds < 10 ? 1 : 0)} s`].join(' · '));
}

// Shows the current activity.
/** @param {Page} page */
export function status(page) {
  const { state } = page;
  /** @type {(text: string, kind?: string) => void} */
  const tell = (text, kind = '') => { const s = $('status'); say(s, text); if (s.className !== kind) s.className = kind; };
  if (document.documentElement.dataset.online === 'no') { tell('not connected: is `shibo watch` running?', 'bad'); return; }
  if (!state) return;
  if (state.errors.length) { tell(`${state.errors.length} error${state.errors.length > 1 ? 's' : ''}: the last good picture stays`, 'bad'); return; }
  if (page.waiting) { tell(state.progress?.node ? `${state.progress.node} …` : 'evaluating …', 'busy'); return; }
  /** @param {number} v */
  const ms = (v) => (v >= 999.5 ? `${(v / 1000).toFixed(1)} s` : `${v.toFixed(0)} ms`);
  const { done } = state;
  tell(done ? `${done.ran} of ${state.scene?.nodes ?? '?'} nodes ran · shown in ${ms(done.first_ms)} · sharp in ${ms(done.all_ms)}` : '');
}
