// Tests of the playground's page beside the pictures of outputs: nodes, variations, shapes, meshes and bodies. See play.mjs.
import assert from "node:assert/strict";

export const ROOT = "document.documentElement.dataset";
export const EDITOR = "document.getElementById('text').shadowRoot";
const text = `(version: 1, canvas: (size_mm: (8, 4), resolution: (512, 256), seed: 2),
  params: { "gain": Number(default: 0.5, range: (0, 2), doc: "How much"), "side": Number(default: 1, range: (0.5, 4), doc: "Size") },
  graphs: {
    "inner": (params: { "size": Number(default: 1, range: (0.1, 9), doc: "Size") },
      nodes: { "cells": Worley(size: "$size"), "soft": Blur(input: "cells", radius: 0.2) }, outputs: { "soft": "soft" }),
  },
  nodes: {
    // Points: few.
    "dots": PoissonPoints(pitch: 1),

    // Bumps.
    "use": Use(graph: "inner", with: { "size": "$side" }),
    "more": "= use * $gain",
    "ball": MeshShape(shape: Sphere, size: (8, 8, 8)),
    "atlas": MeshAtlas(mesh: "ball"),
    "m": Material(base_color: "#804020", height: "more"),
    "_broken": Quantize(input: "more", levels: 4),
  },
  outputs: { "more": "more", "m": "m" })`;

/** Modules of the page, in an expression. */
export const module = (name) => `(await import(new URL('${name}', location.href)))`;
export const inside = (page, body) => page.eval(`(async () => { ${body} })()`);

export async function show(page, fragment, title, size = 128) {
  await page.eval(`location.hash = ${JSON.stringify(fragment)}`);
  await page.wait(`document.title.startsWith(${JSON.stringify(title)}) && shibo.text.length > 0`);
  await page.eval(`shibo.setSize(${size}); 0`);
  await page.eval("shibo.sharp()");
  await page.wait(`${ROOT}.errors === "0"`);
}

export const views = ({ packed, keep, axe }) => ({
  async "shapes are cut from wood"(page) {
    await show(page, "shibo:walnut", "walnut.ron");
    await page.eval("document.querySelector('[data-view=lit]').click()");
    await page.wait("!document.querySelector('[data-shape=solid-cube]').hidden");
    for (const [name, shape] of [["solid-sphere", "sphere"], ["solid-cube", "cube"], ["solid-leg", "leg"]]) {
      const before = await page.eval("+document.getElementById('lit').dataset.drawn || 0");
      await page.eval(`document.querySelector('[data-shape=${name}]').click()`);
      await page.wait(`+document.getElementById('lit').dataset.drawn > ${before}`);
      // The texture of the colour has many colours, and the normal is there, too: all channels are cut.
      const found = await inside(page, `
        const { views } = ${module("session.js")};
        for (let i = 0; i < 1200; i += 1) {
          const wanted = [...views.cuts].filter(([key]) => JSON.parse(key).shape === '${shape}' && JSON.parse(key).target.endsWith('.base_color'));
          const made = wanted.length ? await wanted[0][1] : null;
          if (!made) { await new Promise((done) => setTimeout(done, 50)); continue; }
          const colors = new Set(new Uint32Array(made.data));
          return { colors: colors.size, wide: made.width, targets: [...new Set([...views.cuts.keys()].map((key) => JSON.parse(key).target.split('.').at(-1)))] };
        }`);
      assert.ok(found.colors > 100, `${name}: ${found.colors} colours`);
      assert.ok(found.wide >= 500, `${name}: ${found.wide} pixels`);
      assert.ok(found.targets.includes("roughness"), `${found.targets}`);
      await keep(page, name);
    }
    // A graph without wood has no such shapes.
    await show(page, "shibo:starter", "starter.ron");
    await page.wait("document.querySelector('[data-shape=solid-cube]').hidden");
    await page.eval("document.querySelector('[data-view=picture]').click()");
  },

  async "variations of one and of two parameters"(page) {
    await show(page, packed(text), "graph.ron");
    await page.eval("document.querySelector('#outputs [data-target=\"more\"]').click(); document.getElementById('tab-history').click()");
    await page.wait("document.querySelector('#sheet-param option[value=gain]') && !document.getElementById('sheet-make').disabled");
    await page.eval("document.getElementById('sheet-param').value = 'gain'; document.getElementById('sheet-count').value = '4'; document.getElementById('sheet-make').click()");
    await page.wait("document.querySelector('#sheet .sheet').dataset.done === '1'");
    // The first is black, because a gain of 0 makes everything 0; the mean grows with the gain.
    const means = await page.eval(`[...document.querySelectorAll('#sheet .sheet canvas')].map((canvas) => {
      const { data } = canvas.getContext('2d').getImageData(60, 60, 1, 1);
      return [canvas.dataset.drawn, data[0]];
    })`);
    assert.deepEqual(means.map(([value]) => +value), [0, 0.6667, 1.333, 2]);
    assert.equal(means[0][1], 0);
    assert.ok(means[3][1] > means[1][1], `${means}`);
    await page.eval("document.querySelectorAll('#sheet .sheet button')[3].click()");
    await page.eval("shibo.sharp()");
    await page.wait("document.querySelector('.param[data-param=\"gain\"] .number-box').value === '2'");
    // Two parameters.
    await page.eval("document.getElementById('sheet-second').value = 'side'; document.getElementById('sheet-make').click()");
    await page.wait("document.getElementById('contact').dataset.done && document.querySelectorAll('#contact canvas[data-drawn=yes]').length === 16");
    await keep(page, "contact");
    await page.eval("document.querySelectorAll('#contact .cells button')[7].click()");
    await page.wait("document.querySelector('#contact .large .go')");
    await page.eval("document.querySelector('#contact .large .go').click()");
    await page.wait("document.getElementById('contact').hidden");
    await page.eval("shibo.sharp()");
    const values = await page.eval("['gain', 'side'].map((name) => +document.querySelector(`.param[data-param=\"${name}\"] .number-box`).value)");
    assert.ok(Math.abs(values[0] - 0.667) < 0.01 && values[1] === 4, `${values}`);
  },

  async "slots keep looks"(page) {
    await page.eval("document.getElementById('tab-look').click()");
    await page.wait("document.querySelectorAll('.slots button').length === 9");
    await page.eval("document.querySelectorAll('.slots button')[0].click()");
    await page.eval("shibo.set('gain', 0.1)");
    await page.eval("shibo.sharp()");
    await page.eval("document.querySelectorAll('.slots button')[0].click()");
    await page.wait("Math.abs(+document.querySelector('.param[data-param=\"gain\"] .number-box').value - 0.667) < 0.01");
    await page.eval("shibo.sharp()");
  },

  async "the graph is drawn, and a node shows its value"(page) {
    await show(page, packed(text), "graph.ron");
    await page.eval("document.getElementById('picture').focus()");
    await page.key("g", { code: "KeyG" });
    await page.wait("!document.getElementById('drawer').hidden && document.getElementById('graph').dataset.nodes === '7'");
    await page.wait("document.getElementById('types').textContent.includes('Gray')");
    // The pictures of nodes, and the work for them.
    const drawn = await inside(page, `
      const { page } = ${module("app.js")};
      for (let i = 0; i < 600 && page.graph.thumbs.size < 7; i += 1) await new Promise((done) => setTimeout(done, 50));
      return Object.fromEntries([...page.graph.thumbs].map(([name, { image, object }]) => [name, image ? image.width : object ? object.count : 0]));`);
    assert.equal(drawn.more, 96);
    assert.equal(drawn.use, 96);
    assert.ok(drawn.dots > 5, JSON.stringify(drawn));
    await page.wait("+document.getElementById('graph').dataset.computed > 0");
    await page.wait("document.getElementById('graph').dataset.unused.split(' ').includes('dots')");
    await keep(page, "graph");
    // A node that is found shows its picture and its facts, and its line in the text.
    const find = (name) => page.eval(`document.getElementById('find').value = '${name}'; document.getElementById('find').onchange()`);
    await find("use/cells");
    await page.wait(`${ROOT}.shown === "@use/cells" && document.querySelector('#inspector .kind')?.textContent === 'Worley'`);
    await page.eval("shibo.sharp()");
    const cells = await page.eval("(() => { const p = shibo.picture(); return [p.name, p.width, p.height, p.channels]; })()");
    assert.deepEqual(cells, ["@use/cells", 128, 64, 1]);
    // The level of the sub-graph, by the keyboard.
    await find("more");
    await page.wait(`${ROOT}.shown === "@more"`);
    const of = await page.eval("[...shibo.picture().data]");
    await page.eval("document.querySelector('#outputs [data-target=\"more\"]').click()");
    await page.eval("shibo.sharp()");
    assert.deepEqual(await page.eval("[...shibo.picture().data]"), of, "the node has the numbers of the output");
    await inside(page, `const { page } = ${module("app.js")}; await page.graph.enter('use');`);
    await page.wait("document.getElementById('graph').dataset.level === 'use' && document.getElementById('crumbs').textContent.includes('use')");
    await page.eval("document.getElementById('graph').focus()");
    await page.key("Backspace", { keyCode: 8 });
    await page.wait("document.getElementById('graph').dataset.level === ''");
    await inside(page, `const { jump } = ${module("net.js")}; await jump('atlas');`);
    await page.wait(`${EDITOR}.querySelector('.cm-activeLine').textContent.includes('"atlas"')`);
    // Points are drawn on the stage.
    await find("dots");
    await page.wait(`${ROOT}.shown === "@dots Points"`);
    await keep(page, "points");
    // A value reaches the selected node, too.
    await find("more");
    await page.wait(`${ROOT}.shown === "@more"`);
    await page.eval("shibo.set('gain', 0)");
    await page.eval("shibo.sharp()");
    assert.ok((await page.eval("[...shibo.picture().data]")).every((value) => value === 0));
    // A node that leaves the text is left.
    await page.eval("shibo.setText(shibo.text.replace('    \"_broken\": Quantize(input: \"more\", levels: 4),\\n', ''))");
    await page.wait("document.getElementById('graph').dataset.nodes === '6'");
    await page.eval(axe);
    for (const theme of ["dark", "light"]) {
      await page.eval(`${ROOT}.theme === "${theme}" || document.getElementById("theme").click()`);
      const found = await page.eval("axe.run(document).then((r) => r.violations.map((v) => `${v.id}: ${v.nodes.map((n) => `${n.target} ${n.failureSummary}`).join('; ')}`))");
      assert.deepEqual(found, [], theme);
    }
    // The jump to a line has put the focus into the text.
    await page.eval("document.getElementById('picture').focus()");
    await page.key("Escape", { keyCode: 27 });
    await page.wait(`!${ROOT}.target.startsWith("@")`);
    await page.eval("document.getElementById('graph-close').click()");
  },

  async "the mesh of a graph wears the material"(page) {
    await show(page, packed(text), "graph.ron");
    await page.eval("document.querySelector('[data-view=lit]').click()");
    await page.wait("!document.querySelector('[data-shape=mesh]').hidden");
    await page.eval("document.querySelector('[data-shape=mesh]').click()");
    await page.wait("!document.getElementById('marks').hidden && +document.getElementById('lit').dataset.drawn > 0");
    await page.eval("document.querySelector('[data-mark=charts]').click()");
    const charts = await inside(page, `
      const { page } = ${module("app.js")};
      for (let i = 0; i < 600 && !page.lit.marks.data; i += 1) await new Promise((done) => setTimeout(done, 50));
      return page.lit.marks.data.charts.length;`);
    assert.ok(charts > 100, `${charts}`);
    await keep(page, "mesh");
    await page.eval("document.querySelector('[data-mark=charts]').click(); document.querySelector('[data-shape=sphere]').click()");
  },

  async "a body is shown with its report"(page) {
    await show(page, "shibo:coaster", "coaster.ron");
    await page.eval("document.querySelector('[data-view=lit]').click()");
    await page.wait("document.querySelector('[data-shape=\"body:coaster\"]')");
    await page.eval("document.querySelector('[data-shape=\"body:coaster\"]').click()");
    await page.wait("/mm³/.test(document.getElementById('body-facts')?.textContent)", 180_000);
    const facts = await page.eval("document.getElementById('body-facts').textContent");
    assert.match(facts, /Plate, \d+/);
    await keep(page, "body");
    // Another graph has no such body.
    await show(page, "shibo:starter", "starter.ron");
    await page.wait("!document.querySelector('[data-shape=\"body:coaster\"]')");
    await page.eval("document.querySelector('[data-view=picture]').click()");
  },
});
