// @ts-check
// Helpers for elements of the page.
export { keep, setting } from './settings.js';

/** @type {<K extends string>(id: K) => K extends keyof Elements ? Elements[K] : HTMLElement} */
export const $ = (id) => /** @type {any} */ (document.getElementById(id));

/**
 * Makes an element with properties and children; children that are null are left out.
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {Props<HTMLElementTagNameMap[K]>} [props]
 * @param {...Child} children
 * @returns {HTMLElementTagNameMap[K]}
 */
export function element(tag, props = {}, ...children) {
  const { dataset, ...rest } = props;
  const made = Object.assign(document.createElement(tag), rest);
  Object.assign(made.dataset, dataset);
  made.append(...children.filter((c) => c !== null && c !== undefined));
  return /** @type {any} */ (made);
}

// Returns whether an element is in the shown tab.
/** @param {Element} node */
export const isShown = (node) => !node.closest('[hidden]');

// Sets the text only if it differs, since setting it causes a new layout.
/** @param {HTMLElement} node @param {string} text */
export function say(node, text) { if (node.textContent !== text) node.textContent = text; }

// Marks the pressed button of a group.
/** @param {HTMLElement} group @param {(button: HTMLElement) => boolean} is */
export function press(group, is) {
  for (const b of group.children) if (b.matches('button')) b.ariaPressed = String(!!is(/** @type {HTMLElement} */ (b)));
}

// Makes a group one stop for Tab; arrow keys move within it.
/** @param {Element} group */
export function rove(group) {
  /** @returns {HTMLButtonElement[]} */
  const buttons = () => [.../** @type {NodeListOf<HTMLButtonElement>} */ (group.querySelectorAll('button'))].filter((b) => !b.hidden && !b.disabled);
  const settle = () => {
    const list = buttons();
    const one = list.find((b) => b === document.activeElement) ?? list.find((b) => b.ariaPressed === 'true') ?? list[0];
    for (const b of list) if (b.tabIndex !== (b === one ? 0 : -1)) b.tabIndex = b === one ? 0 : -1;
  };
  new MutationObserver(settle).observe(group, { childList: true, subtree: true, attributeFilter: ['aria-pressed', 'hidden', 'disabled'] });
  group.addEventListener('keydown', (event) => {
    const e = /** @type {KeyboardEvent} */ (event);
    const list = buttons();
    const at = list.indexOf(/** @type {HTMLButtonElement} */ (document.activeElement));
    const to = { ArrowRight: at + 1, ArrowDown: at + 1, ArrowLeft: at - 1, ArrowUp: at - 1, Home: 0, End: list.length - 1 }[e.key];
    if (at < 0 || to === undefined) return;
    e.preventDefault();
    e.stopPropagation();
    list[(to + list.length) % list.length].focus();
    settle();
  });
  settle();
}

// Shows a message for a moment.
/** @type {number | undefined} */
let fading;
/** @param {string} text */
export function notice(text, bad = false) {
  const box = $('notice');
  box.textContent = text;
  box.classList.toggle('bad', bad);
  box.hidden = false;
  clearTimeout(fading);
  fading = setTimeout(() => { box.hidden = true; }, bad ? 9000 : 3500);
}

/** @param {number} v */
export const short = (v) => String(Math.abs(v) >= 100 ? +v.toFixed(1) : +v.toPrecision(4));
