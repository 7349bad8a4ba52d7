// Two pictures compared: by a line between them, side by side, or by their difference.
export class Comparison {
  constructor() {
    this.before = null;
    // What the second one is, unless it is what is shown.
    this.after = null;
    this.mode = 'wipe';
    this.wipe = 0.5;
  }

  // `layer` paints one of both into an area: from, to, and how far it is moved sideways.
  paint(picture, layer) {
    const { canvas, context: c } = picture;
    const { width } = canvas;
    if (this.mode === 'side') {
      const half = Math.round(width / 2);
      layer([0, half, -Math.round(width / 4)], 0);
      layer([half, width, Math.round(width / 4)], 1);
      c.fillStyle = '#8888';
      c.fillRect(half - 1, 0, 2, canvas.height);
    } else if (this.mode === 'difference') {
      layer([0, width], 0);
      c.globalCompositeOperation = 'difference';
      layer([0, width], 1);
      // Where there is nothing at all, the difference leaves the ground as it is.
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
