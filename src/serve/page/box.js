// @ts-check
// Draws one box of the graph: thumbnail, names and cost.
import { H, W } from './nodes.js';

const THUMB = 62;
/** @type {(s: number) => string} */
const time = (s) => { const ms = s * 1000; return ms >= 999.5 ? `${(ms / 1000).toFixed(1)} s` : `${ms < 9.95 ? ms.toFixed(1) : ms.toFixed(0)} ms`; };

/**
 * @param {import('./nodes.js').Graph} graph
 * @param {Box} node
 * @param {number} i
 * @param {Record<string, string>} colors
 * @param {boolean} marked
 */
export function paintBox(graph, node, i, colors, marked) {
  const { context: c, scale } = graph;
  const sum = graph.sums[i];
  const [x, y] = [node.x, node.y];
  c.globalAlpha = sum?.state === 'unused' || node.outside ? 0.6 : 1;
  c.strokeStyle = marked ? colors.accent : node.broken ? colors.bad : i === graph.hover ? colors.dim : colors.line;
  c.lineWidth = marked ? 3 : node.broken ? 2 : 1;
  c.fillStyle = colors.raised;
  /** @param {number} dx @param {number} dy */
  const outline = (dx, dy) => { c.beginPath(); c.roundRect(x + dx, y + dy, W, H, 9); };
  // A sub-graph is drawn as a stack.
  if (node.use) { outline(6, -6); c.fill(); c.stroke(); outline(3, -3); c.fill(); c.stroke(); }
  outline(0, 0);
  c.fill();
  if (graph.heat && sum) {
    const share = Math.sqrt(sum.seconds / Math.max(graph.dearest, 1e-9));
    c.save();
    c.globalAlpha *= 0.75 * share;
    c.fillStyle = '#e0402a';
    c.fill();
    c.restore();
  }
  c.stroke();
  if (scale < 0.05) return;
  // When zoomed out, only the thumbnail is drawn.
  const high = scale < 0.3 ? H - 12 : THUMB;
  thumbnail(graph, node, colors, high);
  if (scale < 0.3) return;
  // On the red of the costs only the colour of texts can be read.
  c.fillStyle = node.shown && !graph.heat ? colors.accent : colors.text;
  c.font = '600 13px system-ui, sans-serif';
  c.fillText(node.outside ? `↗ ${node.label}` : node.label, x + 9, y + 85, W - 18);
  c.fillStyle = graph.heat ? colors.text : colors.dim;
  c.font = '12px system-ui, sans-serif';
  c.fillText(node.kind, x + 9, y + 102, W - 76);
  if (!sum) return;
  c.fillStyle = colors[sum.state];
  c.beginPath();
  c.arc(x + W - 12, y + 98, 3.5, 0, 7);
  c.fill();
  if (sum.seconds > 0 && (sum.state === 'computed' || graph.heat)) {
    c.fillStyle = colors.text;
    c.textAlign = 'right';
    c.fillText(time(sum.seconds), x + W - 20, y + 102);
    c.textAlign = 'left';
  }
}

/** @param {import('./nodes.js').Graph} graph @param {Box} node @param {Record<string, string>} colors @param {number} high */
function thumbnail(graph, node, colors, high) {
  const c = graph.context;
  const thumb = graph.thumbs.get(node.name);
  const [x, y, wide] = [node.x + 6, node.y + 6, W - 12];
  c.save();
  c.beginPath();
  c.roundRect(x, y, wide, high, 5);
  c.clip();
  c.fillStyle = colors.stage;
  c.fillRect(x, y, wide, high);
  if (thumb?.image) {
    const { image } = thumb;
    const share = Math.min(1, (high / wide) * (image.width / image.height));
    c.drawImage(image, 0, image.height * (0.5 - share / 2), image.width, image.height * share, x, y, wide, high);
  } else if (thumb) {
    sketch(graph, node, colors, high);
  }
  c.restore();
  if (node.broken) {
    c.fillStyle = colors.bad;
    c.font = '600 12px system-ui, sans-serif';
    c.fillText('does not tile', x + 5, y + 15);
  }
}

// Objects have no picture; some of their points and lines are drawn instead.
/** @param {import('./nodes.js').Graph} graph @param {Box} node @param {Record<string, string>} colors @param {number} high */
function sketch(graph, node, colors, high) {
  const c = graph.context;
  const { object } = /** @type {import('./nodes.js').Thumb} */ (graph.thumbs.get(node.name));
  if (!object) {
    c.fillStyle = colors.dim;
    c.font = '12px system-ui, sans-serif';
    c.textAlign = 'center';
    c.fillText(node.ports[0]?.type ?? '', node.x + W / 2, node.y + 42);
    c.textAlign = 'left';
    return;
  }
  const [width] = object.size_mm;
  // Objects that cover the canvas are drawn in part, all others whole.
  const part = Math.min(1, Math.sqrt(500 / Math.max(1, object.count)));
  const k = object.own ? Math.min((W - 12) / width, high / object.size_mm[1]) : (W - 12) / (width * part);
  const left = object.own ? (W - 12 - width * k) / 2 : 0;
  /** @type {(x: number, y: number) => Vec2} */
  const at = (x, y) => [node.x + 6 + left + x * k, node.y + 6 + y * k];
  c.strokeStyle = c.fillStyle = node.color ?? colors.accent;
  c.lineWidth = 1;
  c.beginPath();
  for (const [x0, y0, x1, y1] of object.lines ?? []) {
    if (Math.min(x0, x1) * k > W || Math.min(y0, y1) * k > high) continue;
    c.moveTo(...at(x0, y0));
    c.lineTo(...at(x1, y1));
  }
  c.stroke();
  for (const [x, y] of object.points ?? []) if (x * k < W && y * k < high) c.fillRect(.../** @type {Vec2} */ (at(x, y).map((v) => v - 1)), 2, 2);
}
