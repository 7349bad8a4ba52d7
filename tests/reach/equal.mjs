// Compares the pictures of the module with those of the command: node equal.mjs SHIBO SIZE GRAPH… (or `all`).
import { spawn } from "node:child_process";
import { readFile } from "node:fs/promises";
import { createInterface } from "node:readline";
import { ask } from "../../hosts/npm/index.js";

const [shibo, size, ...named] = process.argv.slice(2);

/** The command, as a program that answers lines. */
const child = spawn(shibo, ["bridge", "--no-cache", "--threads", "1"], { stdio: ["pipe", "pipe", "inherit"] });
const lines = createInterface({ input: child.stdout })[Symbol.asyncIterator]();
let count = 0;

async function native(request) {
  child.stdin.write(`${JSON.stringify({ ...request, id: ++count })}\n`);
  const messages = [];
  for (;;) {
    const { value, done } = await lines.next();
    if (done) throw new Error(`${shibo} bridge has ended`);
    const json = JSON.parse(value);
    messages.push({ json, bytes: json.file ? await readFile(json.file) : Buffer.alloc(0) });
    if (json.ok || json.error) return messages;
  }
}

async function rendered(transport, graph) {
  const start = performance.now();
  const [{ json: opened }] = await transport({ op: "open", graph: `shibo:${graph}` });
  if (!opened.ok) throw new Error(`${graph}: ${JSON.stringify(opened.error)}`);
  const messages = await transport({ op: "render", graph: opened.ok.graph, sizes: [Number(size)] });
  const end = messages.at(-1).json;
  if (!end.ok) throw new Error(`${graph}: ${JSON.stringify(end.error)}`);
  await transport({ op: "close", graph: opened.ok.graph });
  return { pictures: messages.slice(0, -1), ms: performance.now() - start };
}

/** The parts of an event that must be equal: all but the place of the samples. */
function facts({ json: { id, file, ...rest } }) {
  return JSON.stringify(rest, Object.keys(rest).sort());
}

const [{ json: hello }] = await native({ op: "hello" });
const all = hello.ok.graphs.filter((graph) => !graph.part).map((graph) => graph.name);
const graphs = named[0] === "all" ? all : named;
let [pictures, different, times] = [0, 0, [0, 0]];
for (const graph of graphs) {
  const one = await rendered(native, graph);
  const other = await rendered(ask, graph);
  let equal = one.pictures.length === other.pictures.length;
  for (const [index, picture] of one.pictures.entries()) {
    const twin = other.pictures[index];
    pictures++;
    if (!twin || facts(picture) !== facts(twin) || Buffer.compare(picture.bytes, twin.bytes) !== 0) {
      different++;
      equal = false;
      console.log(`${graph}: ${picture.json.output} ${picture.json.channel ?? ""} differs`);
    }
  }
  times[0] += one.ms;
  times[1] += other.ms;
  const told = `${(one.ms / 1000).toFixed(2)} s native, ${(other.ms / 1000).toFixed(2)} s wasm`;
  console.log(`${graph}: ${one.pictures.length} pictures, ${equal ? "equal" : "DIFFERENT"}, ${told}`);
}
child.stdin.end();
const factor = (times[1] / times[0]).toFixed(1);
console.log(`${graphs.length} graphs at ${size}, ${pictures} pictures, ${different} different; wasm takes ${factor} times as long`);
process.exit(different ? 1 : 0);
