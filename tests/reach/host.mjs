// Tests the messages of docs/protocol.md in WebAssembly. tests/cli/bridge.rs has the same session over pipes.
import assert from "node:assert/strict";
import { ask } from "../../hosts/npm/index.js";

const text = `(version: 1, canvas: (size_mm: (8, 4), resolution: (32, 16), seed: 1),
  params: { "gain": Number(default: 0.5, range: (0, 2)), "tint": Color(default: "#804020") },
  nodes: { "noise": Perlin(), "more": "= noise * $gain", "m": Material(base_color: "$tint", height: "more") },
  outputs: { "m": "m", "noise": "noise" })`;
const wood = `(version: 1, canvas: (size_mm: 40, resolution: 32, seed: 1),
  nodes: {
    "curve": TrunkNodes(height: (-600, 600), count: 7, wander: 9), "tree": FitSkeleton(curve: "curve"),
    "time": TrunkTime(tree: "tree"), "pattern": ColorPattern(), "wood": RingColor(time: "time", pattern: "pattern"),
    "color": CutPlane(solid: "wood"), "m": Material(base_color: "color"),
  },
  outputs: { "m": "m" })`;
const quad = "v 0 20 0\nv 40 20 0\nv 40 20 40\nv 0 20 40\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";

const last = async (request) => (await ask(request)).at(-1).json;

async function ok(request) {
  const json = await last(request);
  assert.ok(json.ok, JSON.stringify(json));
  return json.ok;
}

async function refused(request) {
  const json = await last(request);
  assert.ok(json.error, JSON.stringify(json));
  return json.error.code;
}

// A slot gives only the pictures that changed.
const { graph } = await ok({ op: "open", text });
const events = async (gain) => {
  const request = { op: "render", graph, slot: "m", sizes: [8, 16], set: { gain }, rows: "bottom", components: 4 };
  return (await ask(request)).slice(0, -1).map(({ json, bytes }) => [json.event, json.channel, json.width, bytes.length]);
};
const [color, height, noise] = [8, 16].map((width) => [
  ["picture", "base_color", width, 0],
  ["picture", "height", width, (width * width) / 2 * 16],
  ["picture", null, width, (width * width) / 2 * 16],
]).reduce((small, large) => small.map((one, at) => [one, large[at]]));
const same = ([, channel, width]) => ["same", channel, width, 0];
assert.deepEqual(await events(0.5), [color[0], height[0], noise[0], color[1], height[1], noise[1]]);
assert.deepEqual(await events(1), [same(color[0]), height[0], same(noise[0]), same(color[1]), height[1], same(noise[1])]);
assert.deepEqual(await events(1), [color[0], height[0], noise[0], color[1], height[1], noise[1]].map(same));

// Forms of samples.
const samples = async (as) => (await ask({ op: "render", graph, output: "noise", as }))[0].bytes;
const floats = new Float32Array((await samples("f32")).buffer);
assert.deepEqual([...(await samples("u8"))], [...floats].map((value) => Math.round(255 * value)));
assert.equal(Buffer.from((await samples("png")).slice(1, 4)).toString(), "PNG");
assert.deepEqual([...(await samples("exr")).slice(0, 4)], [0x76, 0x2f, 0x31, 0x01]);

// A mesh gives the picture of a graph that cuts the solid along it.
const flat = (await ok({ op: "open", text: wood })).graph;
const { mesh, ...facts } = await ok({ op: "mesh", file: "quad.obj", content: btoa(quad) });
assert.deepEqual(facts, { triangles: 2, uv: true, overlaps: 0, size_mm: 40, density_mm: [40, 40] });
const place = { move: [1, 40, 0], turn: [0, 10, 0] };
const [worn] = await ask({ op: "render", graph: flat, on: { mesh, by: "Part", place } });
const cut = `"mesh": LoadMesh(path: "quad.obj", unit: Mm, up: Z), "atlas": MeshAtlas(mesh: "mesh"),
  "placed": PlaceInTree(solid: "wood", position: (1, 40, 0), turn: (0, 10, 0)),
  "color": BakeSolid(atlas: "atlas", solid: "placed", by: Part)`;
const baked = wood.replace('"color": CutPlane(solid: "wood")', cut);
const written = (await ok({ op: "open", text: baked, files: { "quad.obj": btoa(quad) } })).graph;
assert.deepEqual(worn.bytes, (await ask({ op: "render", graph: written }))[0].bytes);
assert.notDeepEqual(worn.bytes, (await ask({ op: "render", graph: flat }))[0].bytes);
const twice = await ok({ op: "mesh", file: "t.obj", content: btoa(`${quad}v 0 30 0\nv 40 30 0\nv 40 30 40\nf 5/1 6/2 7/3\n`) });
assert.ok(twice.overlaps > 0.1);
assert.equal(await refused({ op: "render", graph: flat, on: { mesh: twice.mesh } }), "graph");
assert.deepEqual(await ok({ op: "close", mesh }), {});
assert.equal(await refused({ op: "render", graph: flat, on: { mesh } }), "no-mesh");
assert.equal(await refused({ op: "mesh", file: "none.obj" }), "graph");

// Values are written into a text, and a preset is added to it.
const { sha256 } = await ok({ op: "open", text });
assert.equal(await refused({ op: "keep", graph, values: {}, sha256: "" }), "changed");
const kept = await ok({ op: "keep", graph, values: { gain: 1.25 }, sha256 });
assert.equal(kept.text, text.replace("default: 0.5", "default: 1.25"));
const added = await ok({ op: "keep", graph, values: { gain: 2 }, preset: "loud", add: true, sha256 });
assert.deepEqual((await ok({ op: "open", text: added.text })).presets, { loud: { gain: 2 } });

// The facts that a page shows.
const facts8 = await ok({ op: "open", text });
assert.deepEqual(facts8.params[0].source, { value: "0.5", default: "0.5", line: ['params: { "gain": Number(default: ', ', range: (0, 2)), "tint": Color(default: "#804020") },'] });
assert.deepEqual([facts8.nodes > 2, facts8.breaks], [true, []]);
const [studio] = await ask({ op: "light", environment: "Studio" });
assert.equal(new DataView(studio.bytes.buffer).getUint32(0, true), new Uint32Array(studio.bytes.slice(0, 4).buffer)[0]);
assert.ok(studio.bytes.length > 10_000);
assert.equal(await refused({ op: "light", content: btoa("no picture") }), "file");

// A shipped graph as a text: its paths are those of the library.
const oak = await ok({ op: "text", graph: "shibo:calf" });
assert.ok(oak.text.startsWith("(") || oak.text.includes("canvas"));
assert.equal(oak.path, "shibo:/calf.ron");
assert.equal((await ok({ op: "open", graph: "shibo:calf", text: oak.text })).sha256, (await ok({ op: "open", graph: "shibo:calf" })).sha256);
assert.equal(await refused({ op: "text", graph: "shibo:none" }), "usage");

// The language server.
const message = async (message, files) => ask({ op: "lsp", message: { jsonrpc: "2.0", ...message }, files });
const lsp = async (id, method, params) => (await message({ id, method, params }))[0].json.ok.messages[0].result;
assert.ok((await lsp(1, "initialize", { capabilities: {} })).capabilities.hoverProvider);
const textDocument = { uri: "untitled:graph.ron", languageId: "shibo", version: 1, text: text.replace("Perlin", "Perlim") };
const told = (await message({ method: "textDocument/didOpen", params: { textDocument } })).at(-1).json.message;
assert.deepEqual([told.params.uri, told.params.diagnostics[0].range.start.line], [textDocument.uri, 2]);
assert.match(told.params.diagnostics[0].message, /Perlim/);
const at = { textDocument: { uri: textDocument.uri }, position: { line: 2, character: 21 } };
const offered = await lsp(2, "textDocument/completion", at);
assert.ok(offered.items.some((item) => item.label === "Perlin"));
assert.match((await lsp(3, "textDocument/hover", { ...at, position: { line: 2, character: text.split("\n")[2].indexOf("$gain") + 2 } })).contents.value, /gain/);

// Other requests, and requests that only a process can answer.
assert.equal((await ok({ op: "sample", graph })).samples.noise.bits.length, 16);
assert.deepEqual(await ok({ op: "cancel", of: 1 }), {});
assert.deepEqual(await ok({ op: "free", files: ["x"] }), {});
assert.equal(await refused({ op: "write", graph, folder: "out" }), "usage");
assert.equal(await refused({ op: "lsp", message: {} }), "bad-request");
assert.equal(await refused({ op: "open", text: `(pad: "${"x".repeat(16 << 20)}")` }), "too-large");
assert.equal(await refused({ op: "render", graph: "g99" }), "no-graph");
assert.deepEqual(await ok({ op: "close", graph }), {});
console.log("the messages of the protocol pass their tests");
