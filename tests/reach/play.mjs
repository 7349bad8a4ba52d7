// Tests the playground in a headless Chromium: node play.mjs FOLDER AXE [GRAPH…]. FOLDER has the built site, AXE the source of axe-core.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { deflateRawSync } from "node:zlib";
import { Browser, serve } from "./browser.mjs";
import { digest, golden } from "./digest.mjs";
import { values } from "./values.mjs";
import { views } from "./views.mjs";

const [folder, axe, ...named] = process.argv.slice(2);
const graphs = named.length ? named : ["starter", "calf", "walnut"];
/** A folder for pictures of the page, for people. */
const album = process.env.SHIBO_ALBUM;
const text = `(version: 1, canvas: (size_mm: (8, 4), resolution: (512, 256)),
  params: { "gain": Number(default: 0.5, range: (0, 2), doc: "<img src=x onerror=alert(1)>") },
  nodes: { "noise": Perlin(), "more": "= noise * $gain", "m": Material(base_color: "#804020", height: "more") },
  outputs: { "noise": "noise", "m": "m" })`;
const packed = (of) => `g=${deflateRawSync(of).toString("base64url")}`;

const server = await serve(folder);
const browser = new Browser();
const url = (fragment = "") => `${server.url}play/#${fragment}`;
const downloads = mkdtempSync(join(tmpdir(), "shibo-downloads-"));
const figure = (name, value) => console.log(`     ${name}: ${value}`);
async function keep(page, name) {
  if (!album) return;
  mkdirSync(album, { recursive: true });
  writeFileSync(`${album}/${name}.png`, await page.picture());
}
const ROOT = "document.documentElement.dataset";
const loaded = (page) => page.wait("window.shibo && shibo.shown > 0 && document.getElementById('text').shadowRoot?.querySelector('.cm-content')");
const EDITOR = "document.getElementById('text').shadowRoot";

/** The picture shown, with plain numbers. */
async function picture(page) {
  const { data, ...facts } = await page.eval("shibo.sharp().then(() => { const p = shibo.picture(); return { ...p, data: [...p.data] }; })");
  return { ...facts, data: Float32Array.from(data) };
}

const tests = {
  async "a link gives the pictures of the command"(page) {
    const wanted = await golden();
    let count = 0;
    for (const name of graphs) {
      const shown = await page.eval("shibo.shown");
      await page.eval(`location.hash = "shibo:${name}"`);
      await page.wait(`document.title.startsWith("${name}.ron") && shibo.text.length > 0`);
      // The page shows the new graph by itself, also if an output has the same name.
      if (name !== graphs[0]) await page.wait(`shibo.shown > ${shown}`);
      await page.eval("shibo.setSize(64)");
      for (const [target, bits] of wanted.get(name)) {
        const [output, channel] = target.split(".");
        const clicked = await page.eval(`(async () => {
          await shibo.sharp();
          document.querySelector('#outputs [data-target="${output}"]').click();
          const channel = document.querySelector('#channels [data-target="${target}"]');
          ${channel ? "channel.click();" : ""}
          await shibo.sharp();
          return shibo.picture()?.name;
        })()`);
        if (clicked !== target) {
          // Points, meshes and other objects have no pixels.
          assert.equal(await page.eval(`shibo.picture()`), null, `${name}: ${target} gives ${clicked}`);
          continue;
        }
        assert.equal(digest(await picture(page)), bits, `${name}: ${target}`);
        count += 1;
      }
    }
    figure("pictures with the digests of the command", count);
    assert.ok(count >= 3 * graphs.length);
  },

  async "a text in a link is shown, and typing changes the picture"(page) {
    await page.eval(`location.hash = "${packed(text)}&p=gain:0.25"`);
    await page.wait(`shibo.text.includes('"more"') && document.querySelector('[data-param="gain"] input')`);
    await page.eval("shibo.setSize(64)");
    await page.eval("(async () => { await shibo.sharp(); document.querySelector('#outputs [data-target=\"m\"]').click(); await shibo.sharp(); document.querySelector('#channels [data-target=\"m.height\"]').click(); })()");
    const before = await picture(page);
    assert.equal(before.name, "m.height");
    assert.deepEqual([before.width, before.height], [64, 32]);
    await page.eval(`${EDITOR}.querySelector('.cm-content').focus()`);
    await page.key("End", { keyCode: 35, modifiers: 2 });
    await page.eval("shibo.setText(shibo.text.replace('noise * $gain', 'noise * $gain * 2'))");
    const doubled = await picture(page);
    assert.deepEqual([...doubled.data], [...before.data].map((value) => 2 * value));
    // Real keys.
    const shown = await page.eval("shibo.shown");
    await page.type(" // the end");
    await page.wait("shibo.text.endsWith('// the end')");
    assert.deepEqual([...(await picture(page)).data], [...doubled.data]);
    await page.eval("shibo.setText(shibo.text.replace('$gain * 2', '$gain * 3'))");
    await page.wait(`shibo.shown > ${shown}`);
    const name = await page.eval(`document.querySelector('.param[data-param="gain"] .doc').textContent`);
    assert.equal(name, "<img src=x onerror=alert(1)>");
  },

  async "an error is shown with its line, and the last picture stays"(page) {
    const before = await picture(page);
    await page.eval("shibo.setText(shibo.text.replace('Perlin()', 'Perlim()'))");
    await page.wait(`${ROOT}.errors === "1"`);
    const shown = await page.eval("document.querySelector('#errors .error').textContent");
    assert.match(shown, /Perlim/);
    assert.match(shown, /graph\.ron:3:/);
    assert.equal((await page.eval("shibo.diagnostics()"))[0].line, 3);
    assert.deepEqual([...(await picture(page)).data], [...before.data]);
    await page.wait(`${EDITOR}.querySelector('.cm-lint-marker-error')`);
    await keep(page, "error");
    await page.eval("document.querySelector('#errors .error p').click()");
    await page.wait(`${EDITOR}.querySelector('.cm-activeLine').textContent.includes('Perlim')`);
    await page.eval("shibo.setText(shibo.text.replace('Perlim()', 'Perlin()'))");
    await page.wait(`${ROOT}.errors === "0" && !${EDITOR}.querySelector('.cm-lint-marker-error')`);
  },

  async "the editor explains and completes"(page) {
    const place = (word) => page.eval(`(() => {
      const walker = document.createTreeWalker(${EDITOR}.querySelector('.cm-content'), NodeFilter.SHOW_TEXT);
      for (let node = walker.nextNode(); node; node = walker.nextNode()) {
        const from = node.data.indexOf('${word}');
        if (from < 0) continue;
        const range = document.createRange();
        range.setStart(node, from + 1);
        range.setEnd(node, from + 4);
        const box = range.getBoundingClientRect();
        return [box.x + box.width / 2, box.y + box.height / 2];
      }
    })()`);
    const at = await place("Perlin");
    await page.move(...at);
    const hover = await page.wait(`${EDITOR}.querySelector('.cm-lsp-hover-tooltip')?.textContent`);
    assert.match(hover, /Perlin/);
    await keep(page, "hover");
    await page.move(1, 1);
    await page.wait(`!${EDITOR}.querySelector('.cm-lsp-hover-tooltip')`);
    // The description of a stranger's parameter is no HTML.
    await page.move(...await place("gain"));
    const described = await page.wait(`${EDITOR}.querySelector('.cm-lsp-hover-tooltip')?.innerHTML`);
    assert.ok(!/<img|onerror=[^&]*>/.test(described.replaceAll("&lt;img", "")), described);
    await page.move(1, 1);
    await page.click(...at);
    await page.key(" ", { code: "Space", modifiers: 2, keyCode: 32 });
    await page.wait(`${EDITOR}.querySelector('.cm-tooltip-autocomplete li')`);
    await keep(page, "completion");
    await page.key("Escape", { keyCode: 27 });
  },

  async "editor answers come while a picture is made"(page) {
    await page.eval(`location.hash = "shibo:calf"`);
    await page.wait(`document.title.startsWith("calf.ron")`);
    await page.eval("shibo.sharp()");
    await page.eval("shibo.setSize(1024); shibo.set('pitch', 1.9); 0");
    const times = await page.eval(`(async () => {
      const times = [];
      let text = shibo.text;
      const line = text.split("\\n").findIndex((one) => one.includes("PoissonPoints("));
      for (let i = 0; i < 60; i += 1) {
        const began = performance.now();
        const position = { line, character: 20 + (i % 7) };
        await shibo.lsp(i % 2 ? "textDocument/hover" : "textDocument/completion", { position });
        times.push(performance.now() - began);
        await new Promise((done) => setTimeout(done, 30));
      }
      return times.sort((a, b) => a - b);
    })()`);
    figure("answers of the editor while a picture is made", `median ${times[30].toFixed(1)} ms, p95 ${times[57].toFixed(1)} ms`);
    assert.ok(times[57] < 500, `${times}`);
  },

  async "a dragged number is followed by pictures"(page) {
    await page.eval(`location.hash = "shibo:starter"`);
    await page.wait(`document.title.startsWith("starter.ron") && document.querySelector("#parameters .param .field input")`);
    await page.eval("shibo.setSize(256)");
    await page.eval("shibo.sharp()");
    const names = await page.eval("[...document.querySelectorAll('#parameters .param:has(.field)')].map((one) => one.dataset.param)");
    const rates = [];
    for (const id of names) {
      await page.eval("shibo.sharp()");
      const rate = await page.eval(`(async () => {
        const number = document.querySelector('.param[data-param="${id}"] .field input');
        const { left, width } = number.getBoundingClientRect();
        const tell = (kind, x) => number.dispatchEvent(new PointerEvent(kind, { bubbles: true, clientX: x, button: 0, buttons: 1 }));
        const before = shibo.shown;
        const began = performance.now();
        let at = 0;
        tell("pointerdown", left);
        while (performance.now() - began < 2000) {
          at += 1;
          tell("pointermove", left + 0.4 * width * Math.sin(at / 40));
          await new Promise((done) => setTimeout(done, 12));
        }
        const count = shibo.shown - before;
        const size = shibo.picture().width;
        tell("pointerup", left);
        return [count / (performance.now() - began) * 1000, size];
      })()`);
      rates.push([id, ...rate]);
    }
    figure("pictures per second while a number is dragged", rates.map(([id, rate, size]) => `${id} ${rate.toFixed(1)} at ${size}²`).join(", "));
    assert.ok(Math.max(...rates.map(([, rate]) => rate)) > 2);
  },

  async "maps are downloaded"(page) {
    await page.eval(`location.hash = "${packed(text)}"`);
    await page.wait(`shibo.text.includes('"more"') && document.title.startsWith("graph.ron")`);
    await page.eval("shibo.sharp()");
    // The code of the tab is loaded when it is first shown, and then asks for the formats.
    await page.eval("document.getElementById('tab-export').click()");
    await page.wait(`document.querySelector('#export-what [value="gltf"]')`);
    assert.deepEqual(await page.eval("[...document.getElementById('export-format').options].map((one) => one.value)"), ["", "png", "exr"]);
    for (const [what, format, name, start] of [["map", "png", "noise.png", "\x89PNG"], ["maps", "", "graph.zip", "PK"], ["map", "exr", "noise.exr", "v/1\x01"], ["gltf", "", "m.glb", "glTF"]]) {
      await page.eval(`(() => {
        document.getElementById("export-what").value = "${what}";
        document.getElementById("export-format").value = "${format}";
        document.getElementById("export-size").value = "256";
        document.getElementById("export-begin").click();
      })()`);
      const file = join(downloads, name);
      const end = Date.now() + 20_000;
      while (!existsSync(file) && Date.now() < end) await new Promise((done) => setTimeout(done, 50));
      const note = await page.eval('document.getElementById("export-note").textContent');
      assert.ok(existsSync(file), `${what} ${format}: ${note}; ${readdirSync(downloads)}`);
      assert.equal(readFileSync(file).subarray(0, start.length).toString("latin1"), start);
      assert.match(note, /MiB/);
    }
    const names = execFileSync("unzip", ["-Z1", join(downloads, "graph.zip")], { encoding: "utf8" }).trim().split("\n").sort();
    assert.deepEqual(names, ["m_base_color.png", "m_height.exr", "noise.png"]);
  },

  async "values are written into the text, and undone"(page) {
    await page.eval("shibo.set('gain', 1.5)");
    await page.eval("shibo.sharp()");
    await page.wait("!document.getElementById('save').disabled");
    await page.eval("document.getElementById('save').click()");
    await page.wait("shibo.text.includes('default: 1.5')");
    await page.wait(`${EDITOR}.querySelector('.cm-content').textContent.includes('default: 1.5')`);
    await page.eval("shibo.sharp()");
    await page.wait("!document.getElementById('undo').disabled");
    await page.eval("document.getElementById('undo').click()");
    await page.wait("shibo.text.includes('default: 0.5')");
  },

  async "a link opens the same graph with the same values, and edits survive a reload"(page) {
    await page.eval("shibo.set('gain', 0.75)");
    const link = await page.eval("shibo.link()");
    assert.match(link, /#g=[\w-]+&p=gain%3A0\.75$/);
    const other = await browser.open(link);
    await loaded(other);
    assert.equal(await other.eval("shibo.text"), await page.eval("shibo.text"));
    assert.equal(await other.eval("document.querySelector('.param[data-param=\"gain\"] .number-box').value"), "0.75");
    await other.eval("shibo.setText(shibo.text + '// mine')");
    await other.eval("shibo.sharp()");
    await new Promise((done) => setTimeout(done, 400));
    await other.call("Page.reload");
    await other.wait("window.shibo && shibo.text.endsWith('// mine')");
    assert.deepEqual(other.complaints, []);
  },

  async "damaged and hostile links are refused"(page) {
    const before = await page.eval("shibo.text");
    const bomb = packed(Buffer.alloc(40 << 20, 32));
    assert.ok(bomb.length < 65536);
    for (const [fragment, why] of [[`g=${"A".repeat(70_000)}`, /64 KiB/], [bomb, /1 MiB/], ["g=!!!", /damaged/], ["g=AAAA", /damaged/], ["%E0%A4%A", /damaged/], ["javascript:alert(1)", /names no graph/], ["shibo:../x", /names no graph/], ["shibo:no_such_graph", /no shipped graph/]]) {
      await page.eval("document.getElementById('notice').textContent = ''");
      await page.eval(`location.hash = ${JSON.stringify(fragment)}`);
      const said = await page.wait("document.getElementById('notice').textContent");
      assert.match(said, why, fragment.slice(0, 40));
      assert.equal(await page.eval("shibo.text"), before);
    }
    // A very large canvas is made small until the user asks for more.
    await page.eval(`location.hash = "${packed(text.replace("(512, 256)", "(60000, 30000)"))}"`);
    await page.wait("shibo.text.includes('60000')");
    await page.eval("shibo.setSize(256)");
    assert.equal((await picture(page)).width, 256);
    assert.ok(await page.eval("Math.max(...document.getElementById('zoom').textContent ? [256] : [256]) <= 2048"));
  },

  async "a dropped picture becomes a file of the graph"(page) {
    const png = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP4DwABAQEAsTj2FAAAAABJRU5ErkJggg==";
    await page.eval(`shibo.setText(${JSON.stringify(text.replace("Perlin()", 'Image(path: "a.png")'))})`);
    await page.wait(`${ROOT}.errors === "1"`);
    const drop = () => page.eval(`(async () => {
      const bytes = Uint8Array.from(atob("${png}"), (c) => c.charCodeAt(0));
      const data = new DataTransfer();
      data.items.add(new File([bytes], "a.png", { type: "image/png" }));
      document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
    })()`);
    await drop();
    await page.wait(`${ROOT}.errors === "0"`);
    await page.eval("document.querySelector('#outputs [data-target=\"noise\"]').click()");
    const white = await picture(page);
    assert.ok(white.data.every((value) => value > 0.9999), `${white.name} ${white.width} ${white.data.slice(0, 9)}`);
    await page.wait(`!${EDITOR}.querySelector('.cm-lint-marker-error')`);
    // Without the file there is an error again, also in the editor; with it, none.
    await page.eval("document.getElementById('files-open').click()");
    await page.eval(`document.querySelector('#files [aria-label="Remove a.png"]').click()`);
    await page.wait(`${ROOT}.errors === "1" && ${EDITOR}.querySelector('.cm-lint-marker-error')`);
    await drop();
    await page.wait(`${ROOT}.errors === "0" && !${EDITOR}.querySelector('.cm-lint-marker-error')`);
    await page.eval("document.getElementById('files').close()");
    // A shipped graph whose text names the file becomes a text of its own, and still finds its imports.
    await page.eval('location.hash = "shibo:calf"');
    await page.wait("document.title.startsWith('calf.ron')");
    await page.eval("shibo.setSize(64); shibo.sharp()");
    const before = await picture(page);
    await page.eval(`shibo.setText(shibo.text.replace("nodes: {", 'nodes: {\\n    "mine": Image(path: "a.png"),'))`);
    await page.wait(`document.title.startsWith("graph.ron") && ${ROOT}.errors === "0"`);
    assert.deepEqual([...(await picture(page)).data], [...before.data]);
  },

  async "a slow graph is asked about, and a newer one takes over"(page) {
    await page.eval(`location.hash = "shibo:calf&p=pitch:1.3"`);
    await page.wait(`document.title.startsWith("calf.ron")`);
    await page.eval("shibo.setSize(4096); 0");
    await page.wait("!document.getElementById('long').hidden");
    await keep(page, "long");
    await page.eval("document.getElementById('long-stop').click()");
    await page.eval("shibo.sharp()");
    await page.wait("document.getElementById('long').hidden");
    // The next change begins again.
    await page.eval("shibo.set('pitch', 1.2); 0");
    await new Promise((done) => setTimeout(done, 1500));
    const began = Date.now();
    await page.eval(`location.hash = "${packed(text)}"`);
    await page.eval("shibo.setSize(64); 0");
    await page.wait("document.title.startsWith('graph.ron') && shibo.picture()?.width === 64");
    figure("a picture of another graph while a slow one is made", `${Date.now() - began} ms`);
    await page.eval("shibo.setSize(256)");
  },

  async "the keyboard and axe find no problems"(page) {
    await page.eval("document.activeElement?.blur(); document.getElementById('picture').focus()");
    await page.key("2", { code: "Digit2" });
    await page.wait(`${ROOT}.view === "lit" && +document.getElementById("lit").dataset.drawn > 0`);
    await page.eval("shibo.sharp()");
    await keep(page, "light");
    await page.key("?", { code: "Slash", modifiers: 0 });
    await page.wait("document.getElementById('keys').open");
    await page.key("Escape", { keyCode: 27 });
    await page.wait("!document.getElementById('keys').open");
    // Keys in the text do nothing else.
    await page.eval(`${EDITOR}.querySelector('.cm-content').focus()`);
    await page.key("1", { code: "Digit1" });
    await page.wait("shibo.text.includes('1')");
    assert.equal(await page.eval(`${ROOT}.view`), "lit");
    await page.eval("document.getElementById('picture').blur()");
    await page.eval("document.activeElement.blur(); for (const d of document.querySelectorAll('details')) d.open = true");
    await page.eval(readFileSync(axe, "utf8"));
    for (const [width, height] of [[1280, 800], [390, 844]]) {
      await page.size(width, height);
      for (const theme of ["dark", "light"]) {
        await page.eval(`${ROOT}.theme === "${theme}" || document.getElementById("theme").click()`);
        for (const side of width < 760 ? ["text", "view"] : ["view"]) {
          await page.eval(`document.querySelector('#sides [data-side="${side}"]').click()`);
          const found = await page.eval("axe.run(document).then((r) => r.violations.map((v) => `${v.id}: ${v.nodes.map((n) => `${n.target} ${n.failureSummary}`).join('; ')}`))");
          assert.deepEqual(found, [], `${width} ${theme} ${side}`);
          await keep(page, `axe_${width}_${theme}_${side}`);
        }
      }
    }
    await page.size(1280, 800);
    await page.eval("document.getElementById('library-open').click()");
    await page.wait("document.querySelectorAll('.card').length > 30");
    assert.deepEqual(await page.eval("axe.run(document).then((r) => r.violations.map((v) => `${v.id}: ${v.nodes[0].target}`))"), []);
    await new Promise((done) => setTimeout(done, 500));
    await keep(page, "library");
    await page.eval("document.getElementById('library').close()");
  },
};

let failed = 0;
try {
  const began = Date.now();
  const page = await browser.open(url("shibo:starter"));
  await page.wait("window.shibo?.shown > 0");
  figure("first picture of shibo:starter after navigation", `${Date.now() - began} ms`);
  await loaded(page);
  await page.eval("shibo.sharp()");
  await keep(page, "start");
  await browser.call("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: downloads, browserContextId: page.context });
  const all = { ...tests, ...views({ packed, keep, axe: readFileSync(axe, "utf8") }), ...values({ packed, keep }) };
  // SHIBO_ONLY is a regular expression for the names of the tests to run.
  const only = new RegExp(process.env.SHIBO_ONLY ?? "");
  for (const [name, test] of Object.entries(all).filter(([name]) => only.test(name))) {
    const before = Date.now();
    try {
      await test(page);
      console.log(`ok   ${name} (${Date.now() - before} ms)`);
    } catch (error) {
      failed += 1;
      console.log(`FAIL ${name}: ${error.stack ?? error}`);
      await keep(page, `failed_${failed}`);
    }
  }
  const foreign = page.requests.filter((address) => !address.startsWith(server.url) && !/^(blob:http:\/\/127|data:)/.test(address));
  assert.deepEqual(foreign, []);
  const complaints = page.complaints.filter((one) => !/blob:.*connect-src|connect-src.*blob:/.test(one));
  assert.deepEqual(complaints, []);
  console.log("ok   no foreign request, and no complaint of the browser");
} catch (error) {
  failed += 1;
  console.log(`FAIL ${error.stack ?? error}`);
} finally {
  await browser.close();
  server.close();
  rmSync(downloads, { recursive: true });
}
process.exit(failed ? 1 : 0);
