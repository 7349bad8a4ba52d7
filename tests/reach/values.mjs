// Tests of the playground's page: values of nodes, and a photograph beside the picture. See play.mjs.
import assert from "node:assert/strict";
import { EDITOR, inside, module, show } from "./views.mjs";

const text = `(version: 1, canvas: (size_mm: 8, resolution: 256, seed: 2),
  params: { "size": Number(default: 1.5, range: (0.5, 4), doc: "Size"), "tint": Color(default: "#806040", doc: "Colour") },
  nodes: {
    "noise": Perlin(size: "$size"),
    "other": Perlin(size: 2.0),
    "more": "= noise * 0.5",
    "color": "= $tint * (1 + 0.8 * more) + 0.0 * other",
  },
  outputs: { "color": "color" })`;

const data = (page) => page.eval("shibo.sharp().then(() => [...shibo.picture().data])");

export const values = ({ packed, keep }) => ({
  async "a value of a node is tried, written as one step, and becomes a parameter"(page) {
    await show(page, packed(text), "graph.ron");
    const look = (name) => inside(page, `const { look } = ${module("app.js")}; look('@${name}');`);
    await look("more");
    await page.wait("document.querySelector('#inspector .kind') && document.querySelector('#inspector .formula input')");
    const before = await data(page);
    // Typed: the picture follows, the text does not.
    await page.eval("(() => { const box = document.querySelector('#inspector .formula input'); box.value = '0.25'; box.dispatchEvent(new Event('change')); })()");
    await page.wait("document.getElementById('save').textContent === 'Save 1 change'");
    await inside(page, `const { model } = ${module("session.js")}; for (let i = 0; i < 600 && !model.values.edits; i += 1) await new Promise((done) => setTimeout(done, 20));`);
    assert.deepEqual(await data(page), before.map((value) => value / 2));
    assert.ok(await page.eval("shibo.text.includes('noise * 0.5')"));
    // A value that the graph refuses is told, and the one before stays.
    await inside(page, `const { page } = ${module("app.js")}; page.parameters.edit({ node: 'other', field: 'size', value: '-1' }, null);`);
    await page.wait("/not taken/.test(document.getElementById('notice').textContent)");
    assert.deepEqual(await inside(page, `const { page } = ${module("app.js")}; return page.parameters.values.edits.map(({ node, value }) => node + ' ' + value);`), ["more 0.25"]);
    assert.deepEqual(await data(page), before.map((value) => value / 2));
    // A link has the tried text.
    const link = await page.eval("shibo.link()");
    const read = await inside(page, `const { read } = ${module("links.js")}; return (await read(new URL(${JSON.stringify(link)}).hash)).text;`);
    assert.ok(read.includes("noise * 0.25"), read);
    await keep(page, "node_value");
    // Written, with another value of a node, and undone in the editor by one step.
    await look("other");
    await page.wait("document.querySelector('#inspector [data-field=size] .number-box')");
    await page.eval("(() => { const box = document.querySelector('#inspector [data-field=size] .number-box'); box.value = '3'; box.dispatchEvent(new Event('change')); })()");
    await page.wait("document.getElementById('save').textContent === 'Save 2 changes'");
    await page.eval("document.getElementById('save').click()");
    await page.wait("shibo.text.includes('noise * 0.25') && shibo.text.includes('Perlin(size: 3.0)')");
    await page.wait(`${EDITOR}.querySelector('.cm-content').textContent.includes('noise * 0.25')`);
    await page.wait("document.getElementById('save').disabled");
    const undo = async () => {
      await page.eval(`${EDITOR}.querySelector('.cm-content').focus()`);
      await page.key("z", { code: "KeyZ", keyCode: 90, modifiers: 2 });
    };
    await undo();
    await page.wait("shibo.text.includes('noise * 0.5') && shibo.text.includes('Perlin(size: 2.0)')");
    // Each change of the page is a step of its own, however soon it comes.
    await page.eval("shibo.setText(shibo.text.replace('noise * 0.5', 'noise * 0.1')); shibo.setText(shibo.text.replace('noise * 0.1', 'noise * 0.9'))");
    await undo();
    await page.wait("shibo.text.includes('noise * 0.1')");
    await undo();
    await page.wait("shibo.text.includes('noise * 0.5')");
    await page.eval("shibo.sharp()");
    // A parameter of the value.
    await look("other");
    await page.wait("document.querySelector('#inspector [aria-label=\"Make a parameter of size\"]:not([disabled])')");
    await page.eval("document.querySelector('#inspector [aria-label=\"Make a parameter of size\"]').click()");
    await page.wait("/\"other\": Perlin\\(size: \"\\$\\w+\"\\)/.test(shibo.text)");
    await page.eval("shibo.sharp()");
    assert.deepEqual(await page.eval("shibo.diagnostics().filter((one) => one.level === 'error')"), []);
  },

  async "a photograph is compared, fitted, and kept as a preset"(page) {
    await show(page, packed(text), "graph.ron", 256);
    await page.eval("document.querySelector('#outputs [data-target=\"color\"]').click()");
    // The photograph: the graph with other values.
    const drop = (name, more = "") => inside(page, `
      ${more}
      const data = new DataTransfer();
      data.items.add(new File([window.photo], ${JSON.stringify(name)}));
      document.getElementById('picture').dispatchEvent(new DragEvent('drop', { dataTransfer: data, bubbles: true, cancelable: true }));`);
    await page.eval("shibo.set('size', 3)");
    await page.eval("shibo.sharp()");
    await inside(page, `
      const { model } = ${module("session.js")};
      const { pixels, json: { width, height } } = model.best('color');
      const canvas = new OffscreenCanvas(width, height);
      canvas.getContext('2d').putImageData(new ImageData(pixels.slice(), width, height), 0, 0);
      window.photo = await canvas.convertToBlob({ type: 'image/png' });
      shibo.set('size', 1.5);
      await shibo.sharp();`);
    // A file that only begins as a picture does is refused with its reason.
    await drop("broken.png", "const whole = window.photo; window.photo = whole.slice(0, 40); setTimeout(() => { window.photo = whole; });");
    await page.wait("/broken\\.png cannot be compared: ./.test(document.getElementById('notice').textContent)");
    await drop("felt.png");
    await page.wait("document.querySelectorAll('#photo-words li').length > 0 && document.querySelector('#photo-words').dataset.generation");
    const words = await page.eval("[...document.querySelectorAll('#photo-words li')].map((li) => li.textContent)");
    assert.ok(words.some((word) => /too fine by/.test(word)), `${words}`);
    assert.equal(await inside(page, `const { page } = ${module("app.js")}; return page.picture.comparison.before.label;`), "photograph");
    assert.ok(!(await inside(page, `const { model } = ${module("session.js")}; return Object.keys(model.files);`)).includes("felt.png"), "it is no file of the graph");
    await keep(page, "photograph");
    // Pictures are made while a fit is at work.
    await page.eval("document.getElementById('photo-width').value = '8'; document.getElementById('photo-width').onchange(); document.getElementById('photo-fit').click()");
    await page.wait("document.querySelector('#photo .body').dataset.fit === 'running' && document.querySelector('#photo progress').value > 0");
    assert.ok(await page.eval("document.getElementById('photo-fit').disabled"));
    await inside(page, `const { look } = ${module("app.js")}; look('@noise'); await shibo.sharp(); look('color');`);
    const began = Date.now();
    await page.wait("document.querySelector('#photo .body').dataset.fit === 'done'", 300_000);
    console.log(`     rest of a fit: ${((Date.now() - began) / 1000).toFixed(1)} s`);
    const size = +(await page.eval("document.querySelector('.param[data-param=\"size\"] .number-box').value"));
    // From 1.5 towards 3.
    assert.ok(size > 2 && size < 3.8, `${size}`);
    await page.eval("shibo.sharp()");
    await keep(page, "fitted");
    assert.equal(await page.eval("document.getElementById('photo-name').value"), "felt");
    await page.eval("document.getElementById('photo-keep').click()");
    await page.wait("/\\/\\/ fitted to felt\\.png, 8 mm wide[^\\n]*\\n *\"felt\": \\{/.test(shibo.text)");
    await page.wait("document.querySelector('.presets button[value=felt]')?.ariaPressed === 'true'");
    // A fit that is stopped keeps its best values; one whose graph changes has no result.
    await page.eval("shibo.sharp()");
    const fit = (state) => page.wait(`document.querySelector('#photo .body').dataset.fit === '${state}'`);
    await page.eval("document.getElementById('photo-fit').click()");
    await fit("running");
    await page.eval("document.getElementById('photo-stop').click()");
    await fit("done");
    await page.eval("shibo.sharp()");
    await page.eval("document.getElementById('photo-fit').click()");
    await fit("running");
    await page.eval("shibo.set('size', 0.75)");
    await fit("cancelled");
    await page.eval("document.getElementById('photo-away').click()");
    await page.wait("document.getElementById('photo-away').hidden");
    assert.equal(await inside(page, `const { photos } = ${module("session.js")}; return photos.hand;`), null);
  },
});
