// Compares small pictures of the shipped graphs in WebAssembly with the digests that tests/shipped compares with those of the
// command: node digests.mjs GRAPH… (or `all`).
import { ask } from "../../hosts/npm/index.js";
import { golden } from "./digest.mjs";

const digests = await golden();
const named = process.argv.slice(2);
let [pictures, different] = [0, 0];
for (const name of named[0] === "all" ? digests.keys() : named) {
  const [{ json: opened }] = await ask({ op: "open", graph: `shibo:${name}` });
  if (!opened.ok) throw new Error(`${name}: ${JSON.stringify(opened.error)}`);
  let done;
  try {
    done = (await ask({ op: "sample", graph: opened.ok.graph })).at(-1).json;
  } catch (error) {
    done = { error };
  }
  if (!done.ok) {
    different++;
    console.log(`${name}: ${done.error.message}`);
    continue;
  }
  await ask({ op: "close", graph: opened.ok.graph });
  const wanted = digests.get(name);
  const found = Object.keys(done.ok.samples);
  if (!wanted || String([...wanted.keys()].sort()) !== String(found.sort())) throw new Error(`${name} has other outputs: ${found}`);
  for (const [output, bits] of wanted) {
    pictures++;
    if (done.ok.samples[output].bits === bits) continue;
    different++;
    console.log(`${name}: ${output} differs`);
  }
}
console.log(`${pictures} pictures at 64 pixels, ${different} differ from the digests of the command`);
process.exit(different ? 1 : 0);
