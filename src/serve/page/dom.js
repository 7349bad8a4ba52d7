// Small helps with the page's elements, and what the user has chosen.
export const $ = (id) => document.getElementById(id);

export function element(tag, props = {}, ...children) {
  const { dataset, ...rest } = props;
  const made = Object.assign(document.createElement(tag), rest);
  Object.assign(made.dataset, dataset);
  made.append(...children.filter((c) => c !== null && c !== undefined));
  return made;
}

// Writes only what is another text: a text that is written anew is laid out anew.
export function say(node, text) { if (node.textContent !== text) node.textContent = text; }

// Settings live in a cookie of the host: every run has another port and another token, and local storage would forget them.
const COOKIE = 'shibo-page';
const read = () => {
  const found = document.cookie.split('; ').find((c) => c.startsWith(`${COOKIE}=`));
  try { return JSON.parse(decodeURIComponent(found.slice(COOKIE.length + 1))); } catch { return {}; }
};

export const setting = (name) => read()[name] ?? null;

export function keep(name, value) {
  const all = { ...read(), [name]: value };
  document.cookie = `${COOKIE}=${encodeURIComponent(JSON.stringify(all))}; path=/; max-age=31536000; SameSite=Strict`;
}

// The pressed button of a group.
export function press(group, is) {
  for (const b of group.children) if (b.matches('button')) b.ariaPressed = String(!!is(b));
}

// Within a group Tab stops once, and arrows go on from there.
export function rove(group) {
  const buttons = () => [...group.querySelectorAll('button')].filter((b) => !b.hidden && !b.disabled);
  const settle = () => {
    const list = buttons();
    const one = list.find((b) => b === document.activeElement) ?? list.find((b) => b.ariaPressed === 'true') ?? list[0];
    for (const b of list) if (b.tabIndex !== (b === one ? 0 : -1)) b.tabIndex = b === one ? 0 : -1;
  };
  new MutationObserver(settle).observe(group, { childList: true, subtree: true, attributeFilter: ['aria-pressed', 'hidden', 'disabled'] });
  group.addEventListener('keydown', (e) => {
    const list = buttons();
    const at = list.indexOf(document.activeElement);
    const to = { ArrowRight: at + 1, ArrowDown: at + 1, ArrowLeft: at - 1, ArrowUp: at - 1, Home: 0, End: list.length - 1 }[e.key];
    if (at < 0 || to === undefined) return;
    e.preventDefault();
    e.stopPropagation();
    list[(to + list.length) % list.length].focus();
    settle();
  });
  settle();
}

// Says something for a moment.
let fading = null;
export function notice(text, bad = false) {
  const box = $('notice');
  box.textContent = text;
  box.classList.toggle('bad', bad);
  box.hidden = false;
  clearTimeout(fading);
  fading = setTimeout(() => { box.hidden = true; }, bad ? 9000 : 3500);
}

export const short = (v) => String(Math.abs(v) >= 100 ? +v.toFixed(1) : +v.toPrecision(4));
