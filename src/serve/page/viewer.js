// @ts-check
// Standalone viewer of a shared material: no server, no other file.
import { camera } from './camera.js';
import { Behind, illuminate, lightOf } from './environment.js';
import { FRAGMENT, VERTEX, linked } from './shaders.js';
import { SHAPES } from './shapes.js';
import { SLOTS, bind, texture } from './textures.js';

// Time budget of a picture in ms, while something moves and at rest.
const [MOVING, RESTING] = [40, 700];

// Decodes embedded bytes: see share.js.
/** @type {(text: string) => Promise<ArrayBuffer>} */
const bytes = (text) => new Response(new Blob([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))]).stream().pipeThrough(new DecompressionStream('deflate'))).arrayBuffer();

// Decodes an embedded mesh.
/** @param {NonNullable<Shared['mesh']>} mesh @returns {Promise<Omit<Shape, 'view'>>} */
async function carried({ data, index, perMm, span }) {
  const made = { data: new Float32Array(await bytes(data)), index: new Uint32Array(await bytes(index)) };
  return { make: () => made, perMm: perMm ?? undefined, span: span ?? undefined };
}

// Decodes the samples of an embedded picture.
/** @param {Shared['maps'][string]} picture @returns {Promise<Samples>} */
async function decoded({ image: src, range, scale }) {
  const image = Object.assign(new Image(), { src });
  await image.decode();
  const { width, height } = image;
  const sheet = /** @type {OffscreenCanvasRenderingContext2D} */ (new OffscreenCanvas(width, height).getContext('2d'));
  sheet.drawImage(image, 0, 0);
  const { data } = sheet.getImageData(0, 0, width, height);
  if (!range) return { width, height, form: 'rgba8', scale, data: data.buffer };
  // Sixteen bits in two channels.
  const [lo, hi] = range;
  const values = Float32Array.from({ length: width * height }, (_, k) => lo + ((hi - lo) * (data[4 * k] * 256 + data[4 * k + 1])) / 65535);
  return { width, height, form: 'r32f', data: values.buffer };
}

// `shared` is the data written by share.js.
/** @param {HTMLCanvasElement} canvas @param {Shared} shared */
export async function view(canvas, shared) {
  const gl = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true });
  if (!gl) { document.body.append('This browser has no WebGL 2.'); return; }
  const half = gl.getExtension('EXT_color_buffer_half_float') || gl.getExtension('EXT_color_buffer_float');
  const program = linked(gl, VERTEX, FRAGMENT);
  gl.useProgram(program);
  gl.enable(gl.DEPTH_TEST);
  /** @type {Record<string, WebGLUniformLocation | null>} */
  const places = {};
  /** @type {Uniforms} */
  const at = (name) => (places[name] ??= gl.getUniformLocation(program, name));
  const found = Object.fromEntries(await Promise.all(Object.entries(shared.maps).map(async ([channel, map]) => [channel, await decoded(map)])));
  const slots = Object.keys(SLOTS).filter((slot) => SLOTS[slot].some((channel) => found[channel]));
  const maps = Object.fromEntries(slots.map((slot) => [slot, texture({ gl, mipHalf: half }, slot, found)]));
  /** @type {Omit<Shape, 'view'>} */
  const shape = shared.mesh ? await carried(shared.mesh) : SHAPES[shared.shape];
  const around = shared.light ? lightOf(gl, await bytes(shared.light)) : null;
  const behind = new Behind();
  // A mesh of the graph shows its textures once, without repeats; so does a shape cut from a solid.
  const perMm = shape.perMm ?? (shape.solid ? 2 / Math.max(...shared.mm) : null);
  const repeat = perMm ? 1 : shared.values.repeat;
  const moved = shared.relief === 'displacement' && !!shared.maps.height;
  const { data, index } = shape.make(moved ? 1 : 0.35);
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
  for (const [i, [n, from]] of [[3, 0], [3, 3], [3, 6], [2, 9]].entries()) {
    gl.enableVertexAttribArray(i);
    gl.vertexAttribPointer(i, n, gl.FLOAT, false, 44, from * 4);
  }
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, index, gl.STATIC_DRAW);

  const v = shared.values;
  const eye = { turn: shared.turn, tilt: shared.tilt, distance: shared.distance };
  let { light } = v;
  // Without a graphics card it is drawn coarsely while it moves, and finely at rest. The first picture is not measured.
  /** @type {number | null} */
  let cost = null;
  let drawn = 0;
  /** @type {number | undefined} */
  let resting;
  /** @param {number} budget */
  const paint = (budget) => {
    const full = Math.min(devicePixelRatio || 1, 2);
    const pixels = canvas.clientWidth * canvas.clientHeight * full * full;
    const share = cost === null ? 0.2 : Math.min(1, Math.max(0.15, Math.sqrt(budget / (cost * pixels))));
    const ratio = full * share;
    const began = performance.now();
    [canvas.width, canvas.height] = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.max(1, Math.round(n * ratio)));
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...shared.back, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const flat = Math.cos(eye.tilt);
    const from = /** @type {Vec3} */ ([Math.sin(eye.turn) * flat, Math.sin(eye.tilt), Math.cos(eye.turn) * flat].map((c) => c * eye.distance));
    /** @type {Lighting} */
    const lighting = { light: around, level: shared.level, turn: light, key: [v.lightHeight, v.lightSize], exposure: v.exposure };
    if (shared.behind) behind.paint(gl, from, canvas.width / canvas.height, lighting);
    gl.useProgram(program);
    gl.bindVertexArray(array);
    illuminate(gl, at, lighting);
    gl.uniformMatrix4fv(at('uView'), false, camera(from, canvas.width / canvas.height));
    gl.uniform4f(at('uEye'), ...from, 1);
    gl.uniform2f(at('uRepeat'), repeat, perMm ? 1 : (repeat * shared.mm[0]) / shared.mm[1]);
    gl.uniform1f(at('uDisplace'), moved ? (perMm || (shape.span ?? 0) / repeat / shared.mm[0]) * v.relief : 0);
    gl.uniform2fv(at('uHeights'), shared.maps.height?.range ?? [0, 0]);
    gl.uniform1f(at('uUvPerMm'), 1 / shared.mm[0]);
    gl.uniform2f(at('uAspect'), 1, shared.mm[0] / shared.mm[1]);
    gl.uniform1f(at('uRelief'), v.relief);
    gl.uniform1i(at('uParallax'), shared.relief === 'parallax' ? 1 : 0);
    gl.uniform1f(at('uFine'), 0.7);
    gl.uniform1f(at('uWorldPerMm'), perMm ?? 0);
    bind(gl, at, maps);
    gl.uniform4f(at('uConstants'), v.roughness, v.metallic, v.anisotropy, v.coat);
    gl.drawElements(gl.TRIANGLES, index.length, gl.UNSIGNED_INT, 0);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    drawn += 1;
    if (drawn > 1) cost = (performance.now() - began) / (canvas.width * canvas.height);
    canvas.dataset.drawn = String(drawn);
    clearTimeout(resting);
    if (budget < RESTING) resting = setTimeout(() => draw(drawn > 1 ? RESTING : MOVING), drawn > 1 ? 220 : 0);
  };
  let queued = false;
  const draw = (budget = MOVING) => { if (!queued) { queued = true; requestAnimationFrame(() => { queued = false; paint(budget); }); } };
  /** @param {number} dx @param {number} dy */
  const turn = (dx, dy) => { eye.turn -= dx; eye.tilt = Math.min(1.5, Math.max(-1.5, eye.tilt + dy)); draw(); };
  /** @param {number} by */
  const zoom = (by) => { eye.distance = Math.min(12, Math.max(1.25, eye.distance * by)); draw(); };
  canvas.onpointerdown = (e) => canvas.setPointerCapture(e.pointerId);
  canvas.onpointermove = (e) => {
    if (!canvas.hasPointerCapture(e.pointerId)) return;
    if (e.shiftKey) { light += e.movementX * 0.5; draw(); } else turn(e.movementX * 0.008, e.movementY * 0.008);
  };
  canvas.addEventListener('wheel', (e) => { e.preventDefault(); zoom(Math.exp(e.deltaY * 0.0012)); }, { passive: false });
  canvas.onkeydown = (e) => {
    const by = /** @type {Record<string, Vec2>} */ ({ ArrowLeft: [0.12, 0], ArrowRight: [-0.12, 0], ArrowUp: [0, 0.12], ArrowDown: [0, -0.12] })[e.key];
    if (by) turn(...by); else if (e.key === '+') zoom(0.85); else if (e.key === '-') zoom(1.18);
  };
  new ResizeObserver(() => draw()).observe(canvas);
  draw();
}
