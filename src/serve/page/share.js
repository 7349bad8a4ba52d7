// What is lit as one HTML file, which opens without Shibo.
import { worn } from './net.js';
import { CHANNELS } from './textures.js';

const MODULES = ['camera.js', 'shaders.js', 'textures.js', 'environment.js', 'shapes.js', 'viewer.js'];

// A texture as a picture in the text: colours as they are, single channels with sixteen bits in two.
async function picture({ width, height, form, data, scale }) {
  const canvas = new OffscreenCanvas(width, height);
  const c = canvas.getContext('2d');
  const out = c.createImageData(width, height);
  let range = null;
  if (form === 'rgba8') {
    out.data.set(new Uint8Array(data));
    for (let i = 3; i < out.data.length; i += 4) out.data[i] = 255;
  } else {
    const values = halves(new Uint16Array(data));
    const [lo, hi] = values.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
    range = [lo, hi];
    values.forEach((v, i) => {
      const code = hi > lo ? Math.round(((v - lo) / (hi - lo)) * 65535) : 0;
      out.data.set([code >> 8, code & 255, 0, 255], 4 * i);
    });
  }
  c.putImageData(out, 0, 0);
  const blob = await canvas.convertToBlob({ type: 'image/png' });
  const image = await new Promise((done) => { const reader = new FileReader(); reader.onload = () => done(reader.result); reader.readAsDataURL(blob); });
  return range ? { image, range } : { image, scale };
}

const halves = (list) => Float32Array.from(list, (h) => {
  const [e, m] = [(h >> 10) & 31, h & 1023];
  return (e ? (1 + m / 1024) * 2 ** (e - 15) : m * 2 ** -24) * (h & 0x8000 ? -1 : 1);
});

// The ground behind the shape.
function backdrop(chosen) {
  if (chosen && chosen < 4) return [[0, 0, 0], [0.467, 0.467, 0.467], [1, 1, 1]][chosen - 1];
  const hex = getComputedStyle(document.documentElement).getPropertyValue('--glow').trim();
  return [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);
}

// Bytes, compressed, as text.
async function packed(list) {
  const stream = new Blob([list]).stream().pipeThrough(new CompressionStream('deflate'));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  let text = '';
  for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
  return btoa(text);
}

// The mesh of the graph, or one of the user's own; the other shapes are made anew.
async function mesh({ shape, shapes }) {
  if (shape !== 'mesh' && shape !== 'own') return null;
  const { data, index } = shapes[shape].make();
  const { perMm = null, span = null } = shapes[shape];
  return { data: await packed(data), index: await packed(index), perMm, span };
}

// The text of the file.
export async function html(lit, title) {
  const { scene, maps, size } = lit.asked;
  const found = {};
  for (const [channel, map] of Object.entries(maps)) {
    const data = CHANNELS.includes(channel) && await worn(scene, map, size);
    if (data) found[channel] = await picture(data);
  }
  const back = backdrop(lit.staging.backdrop);
  const shared = {
    maps: found, mm: scene.canvas.size_mm, shape: lit.shape, mesh: await mesh(lit), relief: lit.relief, values: lit.values,
    turn: lit.turn, tilt: lit.tilt, distance: lit.distance, scene: lit.staging.scene, back,
    behind: lit.staging.showsEnvironment, own: lit.staging.isOwn ? await packed(lit.own.bytes) : null,
  };
  const texts = await Promise.all(MODULES.map(async (name) => (await fetch(name)).text()));
  const script = texts.join('\n').replace(/^import .*$/gm, '').replace(/^export /gm, '');
  const escaped = (text) => text.replaceAll('&', '&amp;').replaceAll('<', '&lt;');
  const json = JSON.stringify(shared).replaceAll('<', '\\u003c');
  return `<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1"><title>${escaped(title)}</title>
<style>html, body { margin: 0; height: 100%; background: rgb(${back.map((v) => v * 255).join(' ')}); } canvas { width: 100%; height: 100%; display: block; touch-action: none; }</style></head>
<body><canvas tabindex="0" role="application" aria-label="${escaped(title)} in light. Arrows turn it, plus and minus zoom."></canvas>
<script type="module">
${script}
view(document.querySelector('canvas'), ${json});
</script></body></html>
`;
}
