// Tests the functions of the npm package.
import assert from "node:assert/strict";
//   node package.mjs [PACKAGE]    the name of an installed package; by default the sources
const { ShiboError, ask, check, graphs, params, render, renderAll, write } = await import(
  process.argv[2] ?? "../../hosts/npm/index.js"
);

const text = `(version: 1, canvas: (size_mm: (8, 4), resolution: (16, 8)),
  params: { "gain": Number(default: 0.5, range: (0, 2)), "tint": Color(default: "#804020") },
  nodes: { "noise": Perlin(), "more": "= noise * $gain", "m": Material(base_color: "$tint", height: "more") },
  outputs: { "m": "m", "noise": "noise" })`;

const shipped = await graphs();
assert.ok(shipped.length > 30 && shipped.some((graph) => graph.name === "walnut" && !graph.part));

const [gain, tint] = await params(text);
assert.deepEqual([gain.name, gain.default, gain.range], ["gain", 0.5, [0, 2]]);
assert.equal(tint.type, "Color");

const all = await renderAll(text);
assert.deepEqual(Object.keys(all).sort(), ["m.base_color", "m.height", "noise"]);
assert.deepEqual([all.noise.width, all.noise.height, all.noise.channels], [16, 8, 1]);
assert.equal(all["m.base_color"].data.length, 16 * 8 * 3);
assert.ok(all["m.base_color"].data.every((value, index) => value === all["m.base_color"].data[index % 3]));
assert.ok(all["m.height"].data.every((value, index) => value === Math.fround(all.noise.data[index] * 0.5)));

// Requests that are made at the same time do not mix.
const [height, large] = await Promise.all([
  render(text, { output: "m.height", set: { gain: 1 } }),
  render(text, { output: "noise", resolution: 32 }),
]);
assert.deepEqual(height.data, all.noise.data);
assert.deepEqual([large.width, large.height], [32, 16]);

// Files come from the caller alone.
const reads = text.replace("Perlin()", 'Image(path: "a.png")');
const png =
  "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg==";
const white = await render(reads, { output: "noise", files: { "a.png": Buffer.from(png, "base64") } });
assert.ok(white.data.every((value) => value === 1));
await assert.rejects(render(reads, { output: "noise" }), (error) => {
  assert.ok(error instanceof ShiboError && error.code === "graph");
  assert.equal(error.diagnostics[0].line, 3);
  return true;
});
assert.deepEqual(await check(text), []);
const found = await check(text.replace("Perlin", "Perlim"));
assert.deepEqual([found[0].level, found[0].line], ["error", 3]);
assert.ok(found[0].fixes.length > 0, JSON.stringify(found[0]));

await assert.rejects(render(text, { output: "m" }), { name: "ShiboError", code: "no-output" });
await assert.rejects(render(text, { output: "none" }), { code: "no-output" });
await assert.rejects(render(text, { output: "noise", signal: AbortSignal.abort() }), { name: "AbortError" });
// A render that is aborted between two pictures stops, and the next one is whole.
const controller = new AbortController();
const stopped = renderAll("shibo:calf", { resolution: 128, signal: controller.signal });
const after = render(text, { output: "noise" });
setTimeout(() => controller.abort(), 1);
await assert.rejects(stopped, { name: "AbortError" });
assert.deepEqual((await after).data, all.noise.data);

// Files as the command writes them.
const names = (await write(text, { resolution: 8 })).map((file) => file.name);
assert.deepEqual(names.sort(), ["m_base_color.png", "m_height.exr", "noise.png"]);
const [glb] = await write(text, { target: "gltf" });
assert.equal(glb.name, "m.glb");
assert.equal(new TextDecoder().decode(glb.bytes.slice(0, 4)), "glTF");
await assert.rejects(write(text, { target: "none" }), { code: "usage" });

const [unknown] = await ask({ op: "fly" });
assert.equal(unknown.json.error.code, "unknown-op");
console.log("the npm package passes its tests");
