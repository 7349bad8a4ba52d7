// The measuring panel. Stand-ins replace the elements of the page.
import assert from 'node:assert/strict';
import { beforeEach, test } from 'node:test';

/** An element with what the panel uses. */
class Element {
  constructor(tag) { Object.assign(this, { tag, dataset: {}, children: [], value: '', checked: false, hidden: false, listeners: {} }); }
  get valueAsNumber() { return this.value === '' ? NaN : Number(this.value); }
  append(...children) { this.children.push(...children); }
  replaceChildren(...children) { this.children = children; }
  addEventListener(kind, listener) { this.listeners[kind] = listener; }
  closest() { return this.hiding; }
  /** The first element below that has all properties of `like`. */
  find(like) {
    for (const child of this.children) {
      if (!(child instanceof Element)) continue;
      if (Object.entries(like).every(([name, value]) => child[name] === value)) return child;
      const found = child.find(like);
      if (found) return found;
    }
    return null;
  }
  getContext() { return new Proxy({}, { get: () => () => undefined, set: () => true }); }
}
const byId = {};
globalThis.document = { createElement: (tag) => new Element(tag), getElementById: (id) => byId[id], documentElement: new Element('html') };
globalThis.getComputedStyle = () => ({ getPropertyValue: () => '' });
const { Measure } = await import('../measure.js');

const SOURCE = {
  type: 'Gray', unit: 'mm', range: [0, 4],
  samples: { width: 4, height: 2, channels: 1, type: 'Gray', data: Float32Array.from([0, 1, 2, 3, 1, 2, 3, 4]) },
};
let root, measure, tones, source, drawn;

beforeEach(() => {
  byId['contour-unit'] = new Element('span');
  root = new Element('div');
  root.hiding = null;
  [tones, drawn, source] = [[], [], SOURCE];
  measure = new Measure(root, {
    ontone: (tone) => tones.push(tone),
    source: () => source,
    facts: () => ({ resolution: [4, 2], size_mm: [40, 20] }),
    online: (ends) => { drawn.push(ends); measure.cut(ends); },
  });
});
const box = (id) => root.find({ id });
const press = (text) => root.find({ tag: 'button', textContent: text }).onclick();

test('the panel starts with the range of the picture', () => {
  measure.show();
  assert.deepEqual([box('black-point').value, box('white-point').value], ['0', '4']);
  assert.equal(box('histogram-note').textContent, 'least 0 mm · mean 2 mm · greatest 4 mm');
  assert.equal(byId['contour-unit'].textContent, 'mm');
});

test('the first step of contour lines is a round number, about an eighth of the range', () => {
  const steps = [[[0, 4], '0.5'], [[0, 1], '0.1'], [[-10, 30], '5'], [[0, 0.02], '0.002'], [[0, 100], '10']];
  for (const [range, step] of steps) {
    source = { ...SOURCE, range };
    measure.show();
    assert.equal(box('contour-step').value, step, `${range}`);
  }
});

test('a step that the user chose stays', () => {
  measure.show();
  box('contour-step').value = '3';
  box('contour-step').onchange();
  measure.show();
  assert.equal(box('contour-step').value, '3');
});

test('black and white point make a range if white lies above black', () => {
  measure.show();
  [box('black-point').value, box('white-point').value] = ['1', '3'];
  box('white-point').onchange();
  assert.deepEqual(tones.at(-1), { range: [1, 3], exposure: 0, heat: false, contours: 0 });
  box('black-point').value = '5';
  box('black-point').onchange();
  assert.equal(tones.at(-1).range, null);
});

test('a locked range stays when the picture changes', () => {
  measure.show();
  box('lock-range').checked = true;
  box('lock-range').onchange();
  source = { ...SOURCE, range: [0, 100] };
  measure.show();
  assert.deepEqual([tones.at(-1).range, box('white-point').value], [[0, 4], '4']);
});

test('contour lines need the switch and a positive step', () => {
  measure.show();
  box('contour-step').value = '0.25';
  box('contour-step').onchange();
  assert.equal(tones.at(-1).contours, 0);
  box('contours').checked = true;
  box('contours').onchange();
  assert.equal(tones.at(-1).contours, 0.25);
  box('contour-step').value = '-1';
  box('contour-step').onchange();
  assert.equal(tones.at(-1).contours, 0);
});

test('the first range can be taken from the values, and everything be reset', () => {
  source = { ...SOURCE, range: [0, 100] };
  measure.show();
  press('Auto');
  assert.deepEqual(tones.at(-1).range, [0, 4]);
  box('picture-exposure').value = '2';
  box('picture-exposure').oninput();
  assert.equal(tones.at(-1).exposure, 2);
  press('Reset tone');
  assert.deepEqual(tones.at(-1), { range: null, exposure: 0, heat: false, contours: 0 });
  assert.equal(box('white-point').value, '100');
});

test('a profile tells its length in mm and its extremes', () => {
  measure.show();
  press('Across');
  assert.deepEqual(drawn.at(-1), [[0, 1], [3, 1]]);
  assert.equal(box('profile-note').textContent, '30 mm long · from 1 mm to 4 mm, 3 mm apart');
  press('None');
  assert.ok(measure.line.hidden);
  assert.match(box('profile-note').textContent, /^Shift-drag/);
});

test('a closed panel draws nothing', () => {
  root.hiding = {};
  measure.show();
  assert.equal(box('black-point').value, '');
});
