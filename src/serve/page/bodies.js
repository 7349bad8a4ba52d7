// @ts-check
// Bodies of outputs such as Plate, and the figures of their reports. See serve/body.rs. Loaded if the graph has one.
import { $, element, short } from './dom.js';
import { body } from './net.js';

/** @type {(name: string) => string} */
const shapeOf = (name) => `body:${name}`;

export class Bodies {
  /** @param {import('./lit.js').Lit} lit */
  constructor(lit) {
    this.lit = lit;
    /** @type {Scene | null} */
    this.scene = null;
    /** @type {string[]} */
    this.names = [];
    // The output that is shown or loaded, and the generation of its body.
    /** @type {string | null} */
    this.name = null;
    this.generation = -1;
    // The shape at which it was chosen.
    this.from = '';
    this.turn = 0;
    this.facts = element('ul', {});
    this.panel = element('section', { id: 'body-facts', hidden: true }, element('h2', { textContent: 'Body' }), this.facts);
    lit.panel.before(this.panel);
  }

  // Follows the graph and the shape that is shown.
  /** @param {Scene} scene */
  follow(scene) {
    this.scene = scene;
    if (scene.bodies.join('\n') !== this.names.join('\n')) this.offer(scene.bodies);
    const { shape } = this.lit;
    // Another shape was chosen.
    if (this.name && shape !== shapeOf(this.name) && shape !== this.from) this.name = null;
    this.panel.hidden = !this.name;
    if (this.name && this.generation !== scene.generation) this.load(this.name);
  }

  // Offers a button for each body.
  /** @param {string[]} names */
  offer(names) {
    for (const name of this.names) {
      if (this.lit.shape === shapeOf(name)) this.lit.setShape('sphere');
      this.lit.put(shapeOf(name), null);
      document.querySelector(`[data-shape="${CSS.escape(shapeOf(name))}"]`)?.remove();
    }
    this.names = names;
    for (const name of names) {
      const button = element('button', { textContent: name, title: `The body of the output ${name}`, dataset: { shape: shapeOf(name) } });
      button.onclick = () => { this.lit.chosen = true; this.load(name); };
      $('shapes').append(button);
    }
    if (this.name && !names.includes(this.name)) this.name = null;
  }

  /** @param {string} name */
  async load(name) {
    const { scene } = this;
    if (!scene) return;
    this.turn += 1;
    const { turn } = this;
    this.from = this.lit.shape;
    this.name = name;
    this.generation = scene.generation;
    this.panel.hidden = false;
    if (!this.lit.shapes[shapeOf(name)]) this.tell(['It is made …']);
    const found = await body({ g: scene.generation, o: name }).catch((/** @type {Error} */ error) => error.message);
    // The graph has changed, or another body or shape was chosen.
    if (!found || turn !== this.turn || this.name !== name) return;
    if (typeof found === 'string') { this.tell([found]); return; }
    const isNew = this.lit.shape !== shapeOf(name);
    this.from = shapeOf(name);
    this.lit.put(shapeOf(name), { ...found, plain: true });
    if (isNew) this.lit.setShape(shapeOf(name)); else this.lit.draw();
    this.tell(words(found.report));
  }

  /** @param {string[]} lines */
  tell(lines) {
    this.facts.replaceChildren(...lines.map((textContent) => element('li', { textContent })));
    this.facts.dataset.generation = String(this.generation);
  }
}

// The report in words.
/** @param {BodyReport} report */
function words(report) {
  /** @type {(list: number[]) => string} */
  const list = (numbers) => numbers.map((number) => short(number)).join(', ');
  const lines = [
    `${report.kind}, ${report.size_mm.map((number) => short(number)).join(' × ')} mm`,
    `${report.volume_mm3 === null ? 'open' : `${short(report.volume_mm3)} mm³`}, ${short(report.area_mm2)} mm²`,
  ];
  if (report.height_mm) lines.push(`heights from ${short(report.height_mm[0])} to ${short(report.height_mm[1])} mm`);
  if (report.thinnest_mm !== undefined && report.thinnest_at_mm) lines.push(`thinnest: ${short(report.thinnest_mm)} mm at (${list(report.thinnest_at_mm)})`);
  if (report.steepest_deg !== undefined) lines.push(`steepest: ${short(report.steepest_deg)}°`);
  if (report.tool) lines.push(`a tool of ${short(report.tool.diameter_mm)} mm leaves ${short(report.tool.left_mm)} mm at (${list(report.tool.left_at_mm)})`);
  lines.push(`${report.triangles.toLocaleString('en')} triangles${report.error_mm === undefined ? '' : `, within ${short(report.error_mm)} mm; the file keeps its own error`}`);
  return [...lines, ...report.findings.map(({ message }) => message)];
}
