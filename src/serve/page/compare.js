// @ts-check
// Comparison of two pictures: with a dividing line, side by side, as a difference, or one after the other.
// Time that flicker shows one picture, in ms.
const FLICKER = 600;

export class Comparison {
  constructor() {
    /** @type {Source | null} */
    this.before = null;
    // The second picture; null for the one shown.
    /** @type {Source | null} */
    this.after = null;
    this.mode = 'wipe';
    this.wipe = 0.5;
    // The side that flicker shows: 0 for the first picture.
    this.side = 0;
    /** @type {number | undefined} */
    this.clock = undefined;
  }

  get flickers() { return this.mode === 'flicker' && !!this.before; }

  // Shows the two pictures one after the other, `draw` after each change. Users who want no motion change them by hand.
  /** @param {() => void} draw */
  run(draw) {
    clearInterval(this.clock);
    if (!this.flickers || matchMedia('(prefers-reduced-motion: reduce)').matches) return;
    this.clock = setInterval(() => { if (this.flickers) this.flip(draw); else clearInterval(this.clock); }, FLICKER);
  }

  /** @param {() => void} draw */
  flip(draw) { this.side = 1 - this.side; draw(); }

  // `layer` paints one of the two pictures into an area, given its left and right edge and its shift.
  /** @param {import('./picture.js').Picture} picture @param {(area: [number, number, number?], side: number) => void} layer */
  paint(picture, layer) {
    const { canvas, context: c } = picture;
    const { width } = canvas;
    if (this.mode === 'side') {
      const half = Math.round(width / 2);
      layer([0, half, -Math.round(width / 4)], 0);
      layer([half, width, Math.round(width / 4)], 1);
      c.fillStyle = '#8888';
      c.fillRect(half - 1, 0, 2, canvas.height);
    } else if (this.mode === 'flicker') {
      layer([0, width], this.side);
    } else if (this.mode === 'difference') {
      layer([0, width], 0);
      c.globalCompositeOperation = 'difference';
      layer([0, width], 1);
      // Where neither picture covers the canvas, the difference leaves the background unchanged.
      c.globalCompositeOperation = 'source-over';
      c.filter = 'brightness(4)';
      c.drawImage(canvas, 0, 0);
      c.filter = 'none';
    } else {
      const split = Math.round(width * this.wipe);
      layer([0, split], 0);
      layer([split, width], 1);
    }
  }
}
