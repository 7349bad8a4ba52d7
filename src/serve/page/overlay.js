// @ts-check
// Read-outs over the picture: a scale bar in mm, a colour bar with the value under the cursor, and rulers along the edges.
import { $, element, say, short } from './dom.js';
import { heat } from './tone.js';

// Wanted length of the scale bar, and distance of two ticks of a ruler, in pixels of the window.
const BAR = 110;
const TICK = 70;

// The largest number of the series 1, 2, 5, 10 … that is not greater.
/** @param {number} v */
export function nice(v) {
  const ten = 10 ** Math.floor(Math.log10(v));
  return +(/** @type {number} */ ([5, 2, 1].find((n) => n * ten <= v * (1 + 1e-9))) * ten).toPrecision(1);
}

/** @type {(mm: number) => string} */
const length = (mm) => (mm >= 1000 ? `${short(mm / 1000)} m` : mm < 0.1 ? `${short(mm * 1000)} µm` : `${short(mm)} mm`);

export class Overlay {
  /** @param {Page} page */
  constructor(page) {
    this.page = page;
    this.rulers = false;
    this.text = element('span');
    this.bar = element('i');
    this.high = element('span');
    this.low = element('span');
    this.mark = element('i', { hidden: true });
    $('scale').append(this.bar, this.text);
    $('ramp').append(this.high, this.low, this.mark);
    this.shown = '';
  }

  // Length of one mm in pixels of the window; null if the picture has no place on the canvas.
  get perMm() {
    const { picture, state, shown } = this.page;
    if (!state?.scene || shown?.own || picture.object?.own || !(picture.bitmap || picture.object)) return null;
    return (picture.scale * picture.size[0]) / state.scene.canvas.size_mm[0] / picture.ratio;
  }

  // Shows everything for the present view.
  draw() {
    const { page } = this;
    const k = page.view === 'picture' ? this.perMm : null;
    $('scale').hidden = !k;
    if (k) {
      const mm = nice(BAR / k);
      this.bar.style.width = `${mm * k}px`;
      say(this.text, length(mm));
      this.place();
    }
    this.ramp();
    this.ruler(k);
  }

  // The scale bar stands above the tools if these reach it, and above the edge of the picture in narrow windows.
  place() {
    const [tools, stage, canvas] = [$('picture-tools'), $('stage'), $('picture')];
    const floats = tools.offsetWidth && getComputedStyle(tools).position === 'absolute';
    const below = stage.clientHeight - canvas.offsetTop - canvas.clientHeight;
    const covered = floats && tools.offsetLeft - tools.offsetWidth / 2 < 150;
    const bottom = `${below + (covered ? tools.offsetHeight + 24 : 16)}px`;
    if ($('scale').style.bottom !== bottom) $('scale').style.bottom = bottom;
  }

  // The colour bar of values that are shown as grey or in false colour.
  ramp() {
    const { picture, shown, view } = this.page;
    const range = picture.sharedRange ?? shown?.range;
    const on = view === 'picture' && picture.bitmap && range && shown?.type === 'Gray' && picture.comparison.mode !== 'difference';
    // In a flat stage the bar has no room.
    const { canvas } = picture;
    const high = Math.min(220, canvas.clientHeight * 0.4);
    $('ramp').hidden = !on || high < 70;
    if ($('ramp').hidden || !range) return;
    $('ramp').style.height = `${Math.round(high)}px`;
    $('ramp').style.top = `${Math.round(canvas.offsetTop + (canvas.clientHeight - high) / 2)}px`;
    const unit = shown?.unit ? ` ${shown.unit}` : '';
    const now = [...range, unit, picture.tone.heat].join();
    if (now === this.shown) return;
    this.shown = now;
    this.range = range;
    say(this.low, `${short(range[0])}${unit}`);
    say(this.high, `${short(range[1])}${unit}`);
    const stops = picture.tone.heat ? Array.from({ length: 17 }, (_, i) => `rgb(${heat(i / 16).join()})`) : ['#000', '#fff'];
    $('ramp').style.background = `linear-gradient(0deg, ${stops.join()})`;
  }

  // Marks the value under the cursor on the colour bar.
  /** @param {number | null} value */
  at(value) {
    this.mark.hidden = value === null || !this.range || $('ramp').hidden;
    if (this.mark.hidden || !this.range || value === null) return;
    const share = (value - this.range[0]) / Math.max(this.range[1] - this.range[0], 1e-30);
    this.mark.style.bottom = `${100 * Math.min(Math.max(share, 0), 1)}%`;
  }

  // Rulers in mm along the upper and the left edge.
  /** @param {number | null} k */
  ruler(k) {
    const box = $('rulers');
    box.toggleAttribute('hidden', !this.rulers || !k);
    if (!this.rulers || !k) return;
    const { picture } = this.page;
    const { clientWidth: w, clientHeight: h } = picture.canvas;
    const step = nice(TICK / k);
    const style = getComputedStyle(document.documentElement);
    const c = /** @type {CanvasRenderingContext2D} */ (box.getContext('2d'));
    [box.width, box.height] = [w * picture.ratio, h * picture.ratio];
    c.scale(picture.ratio, picture.ratio);
    c.fillStyle = style.getPropertyValue('--bar');
    c.fillRect(0, 0, w, 18);
    c.fillRect(0, 0, 34, h);
    c.fillStyle = c.strokeStyle = style.getPropertyValue('--dim');
    c.font = '11px system-ui, sans-serif';
    c.beginPath();
    // Position of the canvas's corner in the window.
    const origin = [w / 2 - (picture.center[0] * picture.scale) / picture.ratio, h / 2 - (picture.center[1] * picture.scale) / picture.ratio];
    for (let i = Math.ceil((34 - origin[0]) / k / step); i * step * k + origin[0] < w; i += 1) {
      const x = Math.round(i * step * k + origin[0]) + 0.5;
      c.moveTo(x, 13);
      c.lineTo(x, 18);
      c.fillText(short(i * step), x + 3, 12);
    }
    for (let i = Math.ceil((18 - origin[1]) / k / step); i * step * k + origin[1] < h; i += 1) {
      const y = Math.round(i * step * k + origin[1]) + 0.5;
      c.moveTo(28, y);
      c.lineTo(34, y);
      c.fillText(short(i * step), 3, y + 11, 28);
    }
    c.stroke();
    c.fillText('mm', 6, 12);
  }

  /** @param {boolean} on */
  setRulers(on) {
    this.rulers = on;
    $('toggle-rulers').ariaPressed = String(on);
    $('stage').toggleAttribute('data-rulers', on);
    this.draw();
  }
}
