// @ts-check
// Objects: points and lines in mm.
/** @param {import('./picture.js').Picture & { object: Sketch }} picture */
export function drawObject(picture) {
  const { canvas, context: c, scale, object } = picture;
  const style = getComputedStyle(document.documentElement);
  const mm = (picture.size[0] * scale) / object.size_mm[0];
  const x0 = canvas.width / 2 - picture.center[0] * scale;
  const y0 = canvas.height / 2 - picture.center[1] * scale;
  c.fillStyle = style.getPropertyValue('--back');
  c.fillRect(x0, y0, picture.size[0] * scale, picture.size[1] * scale);
  const width = Math.max(1, Math.min(3, mm * 0.05)) * Math.sqrt(picture.ratio);
  c.lineWidth = width;
  for (const [alive, color] of /** @type {[number, string][]} */ ([[0, '--bad'], [1, '--accent']])) {
    c.strokeStyle = style.getPropertyValue(color);
    c.beginPath();
    for (const line of object.lines ?? []) {
      if ((line[4] ?? 1) !== alive) continue;
      c.moveTo(x0 + line[0] * mm, y0 + line[1] * mm);
      c.lineTo(x0 + line[2] * mm, y0 + line[3] * mm);
    }
    c.stroke();
  }
  c.fillStyle = style.getPropertyValue('--accent');
  const dot = Math.max(1.5, Math.min(5, mm * 0.1));
  for (const [x, y] of object.points ?? []) c.fillRect(x0 + x * mm - dot / 2, y0 + y * mm - dot / 2, dot, dot);
}
