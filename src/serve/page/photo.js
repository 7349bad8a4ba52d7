// @ts-check
// A photograph beside the picture: shown at the same mm, compared in words, and fitted. See serve/photo.rs.
import { element, notice, say, short } from './dom.js';
import { ask, latest, post, sendPhoto } from './net.js';

// Longest side of the photograph on the page, in pixels.
const MOST = 2048;

export class Photo {
  /** @param {HTMLElement} root @param {Page} page @param {(change: unknown, after: Values, label: string) => Promise<boolean>} onsave */
  constructor(root, page, onsave) {
    this.root = root;
    this.page = page;
    /** @type {ImageBitmap | null} */
    this.image = null;
    this.file = '';
    /** @type {number | null} */
    this.fit = null;
    // News that came before the answer with the number of the fit.
    /** @type {FitNews[] | null} */
    this.early = null;
    this.input = element('input', { type: 'file', id: 'photo-file', accept: '.png,.jpg,.jpeg,.tif,.tiff', hidden: true, ariaLabel: 'Choose a photograph' });
    this.input.onchange = () => { if (this.input.files?.[0]) this.take(this.input.files[0]); this.input.value = ''; };
    const choose = element('button', { id: 'photo-choose', textContent: 'Choose …', title: 'Choose a photograph of the material, or drop one on the page' });
    choose.onclick = () => this.input.click();
    this.away = element('button', { id: 'photo-away', textContent: 'Put away', hidden: true });
    this.away.onclick = () => this.drop();
    this.about = element('p', { className: 'doc', textContent: 'A photograph is compared with the picture in words, and Fit finds the values with which the graph looks like it. It stays on this machine.' });
    this.width = element('input', { type: 'number', id: 'photo-width', min: 0.01, step: 'any', placeholder: 'unknown' });
    this.width.onchange = () => { this.place(); this.compare(); };
    this.begin = element('button', { id: 'photo-fit', textContent: 'Fit' });
    this.begin.onclick = () => this.start();
    this.end = element('button', { id: 'photo-stop', textContent: 'Stop', title: 'Keep the best values so far', hidden: true });
    this.end.onclick = () => post('photo/stop', {});
    this.name = element('input', { type: 'text', id: 'photo-name', ariaLabel: 'Name of the preset', spellcheck: false });
    this.keep = element('button', { id: 'photo-keep', textContent: 'Keep as preset' });
    this.keep.onclick = () => this.save(onsave);
    this.kept = element('div', { className: 'row', hidden: true }, this.name, this.keep);
    this.bar = element('progress', { max: 1, hidden: true, ariaLabel: 'Progress of the fit' });
    this.note = element('p', { className: 'doc', role: 'status' });
    this.words = element('ul', { id: 'photo-words' });
    this.found = element('ul', { id: 'photo-found' });
    const size = element('div', { className: 'fields' }, element('label', { htmlFor: 'photo-width', textContent: 'Width of the photograph, mm' }), this.width);
    this.inside = element('div', { hidden: true }, size, element('h3', { textContent: 'The picture is' }), this.words, element('div', { className: 'row' }, this.begin, this.end), this.bar, this.note, this.found, this.kept);
    root.replaceChildren(this.about, element('div', { className: 'row' }, choose, this.input, this.away), this.inside);
  }

  // Takes a photograph and shows it beside the picture.
  /** @param {File} file */
  async take(file) {
    this.page.tabs.show('look');
    try {
      const { name, size } = await sendPhoto(file);
      // TIFF files are not shown by browsers, but can be fitted.
      this.image = await createImageBitmap(file).catch(() => null);
      this.file = name;
      say(this.about, `${name}, ${size.join(' × ')} px`);
    } catch (error) {
      notice(`${file.name} cannot be compared: ${/** @type {Error} */ (error).message}`, true);
      return;
    }
    this.inside.hidden = this.away.hidden = false;
    this.finish('');
    this.found.replaceChildren();
    this.kept.hidden = true;
    this.place();
    this.compare();
  }

  async drop() {
    await sendPhoto(null).catch(() => null);
    this.image = null;
    this.file = '';
    this.inside.hidden = this.away.hidden = true;
    say(this.about, 'Choose a photograph, or drop one on the page.');
    this.page.parameters.mark(new Map());
    const { comparison } = this.page.picture;
    if (comparison.before?.label === 'photograph') comparison.before = null;
    this.page.controls.compared();
  }

  get mm() { return this.width.valueAsNumber > 0 ? this.width.valueAsNumber : null; }

  // Shows the photograph on the left, at the mm per pixel of the picture, in its middle.
  async place() {
    const { scene } = this.page.state;
    if (!this.image || !scene) return;
    const [wide, high] = scene.canvas.size_mm;
    const k = MOST / Math.max(wide, high);
    const canvas = new OffscreenCanvas(Math.max(1, Math.round(wide * k)), Math.max(1, Math.round(high * k)));
    const width = (this.mm ?? wide) * k;
    const height = (width * this.image.height) / this.image.width;
    const c = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext('2d'));
    c.imageSmoothingQuality = 'high';
    c.drawImage(this.image, (canvas.width - width) / 2, (canvas.height - height) / 2, width, height);
    const { comparison } = this.page.picture;
    comparison.before = { image: canvas.transferToImageBitmap(), range: null, type: 'Rgb', unit: '', label: 'photograph' };
    comparison.after = null;
    comparison.mode = 'side';
    this.page.controls.setView('picture');
    this.page.controls.compared();
  }

  // Asks for the differences of the shown picture.
  compare = latest(async () => {
    const { state, target } = this.page;
    if (!this.file || !state?.scene || !target) return;
    /** @type {{ words: string[] } | null} */
    const found = await ask('photo/beside', { g: state.scene.generation, t: target, ...(this.mm ? { mm: this.mm } : {}) });
    const words = found?.words ?? ['no picture that can be compared: choose a colour or a number'];
    this.words.replaceChildren(...words.map((textContent) => element('li', { textContent })));
    this.words.dataset.generation = String(state.scene.generation);
  });

  async start() {
    const { state } = this.page;
    this.finish('Rendering …');
    this.begin.disabled = true;
    this.end.hidden = this.bar.hidden = false;
    this.bar.removeAttribute('value');
    this.kept.hidden = true;
    this.early = [];
    const answer = await post('photo/fit', { g: state.scene.generation, ...(this.mm ? { mm: this.mm } : {}) }).catch(() => null);
    if (answer?.status !== 200) {
      this.finish(answer ? (await answer.text()) || 'The graph has changed meanwhile; try again.' : 'Not connected.');
      return;
    }
    this.fit = (await answer.json()).id;
    const { early } = this;
    this.early = null;
    for (const news of early ?? []) this.heard(news);
  }

  /** @param {string} text */
  finish(text) {
    this.begin.disabled = false;
    this.end.hidden = this.bar.hidden = true;
    this.page.parameters.show();
    say(this.note, text);
  }

  // News of a fit.
  /** @param {FitNews} news */
  heard(news) {
    // Other pages hear the news, too.
    if (this.fit === null) { this.early?.push(news); return; }
    if (news.id !== this.fit) return;
    this.root.dataset.fit = news.state;
    if (news.state === 'running') {
      this.page.parameters.show(new Map(news.set));
      this.bar.value = news.done / Math.max(1, news.total);
      const distance = news.best === null ? '' : news.floor ? `: ${short(news.best / news.floor)} × the difference of two seeds` : `: distance ${short(news.best)}`;
      say(this.note, `${news.done} of ${news.total} renders${distance}`);
      return;
    }
    this.fit = null;
    if (news.state === 'failed') { this.finish(news.message); return; }
    if (news.state === 'cancelled') { this.finish('Ended: the graph has changed.'); return; }
    const { report, set } = news;
    this.finish(report.floor ? `${short(report.distance / report.floor)} × the difference of two seeds` : `distance ${short(report.distance)}`);
    const { parameters } = this.page;
    // The values come from the graph with its preset, so they replace both.
    parameters.take({ preset: parameters.preset, set: new Map([...parameters.set, ...set]) });
    parameters.tell(`Fitted to ${this.file}`);
    const errors = new Map(Object.entries(report.parameters).map(([name, one]) => [name, error(one)]));
    parameters.mark(errors);
    this.found.replaceChildren(...[...errors].map(([name, { text }]) => element('li', { textContent: `${name.replaceAll('_', ' ')}: ${text}` })));
    if (report.width_fitted && report.width_mm) {
      this.found.append(element('li', { textContent: `width: about ${short(report.width_mm)} mm, as none was given; lengths are right only relative to each other` }));
    }
    this.name.value = news.name;
    this.kept.hidden = false;
  }

  /** @param {(change: unknown, after: Values, label: string) => Promise<boolean>} onsave */
  async save(onsave) {
    const name = this.name.value.trim();
    if (!name) { this.name.focus(); notice('Give the preset a name', true); return; }
    if (await onsave({ fitted: { name } }, { ...this.page.parameters.values, preset: name, set: new Map() }, `Preset ${name} kept`)) this.kept.hidden = true;
  }
}

// The error of a value in words, and whether the photograph leaves it open.
/** @param {FoundValue} one */
function error({ value, error: by, determined, unit }) {
  if (typeof value === 'string') return { text: determined ? value : `${value}, weakly determined`, loose: !determined };
  const text = `${short(value)} ± ${short(by)}${unit ? ` ${unit}` : ''}`;
  return { text: determined ? text : `not determined: ${text}`, loose: !determined };
}
