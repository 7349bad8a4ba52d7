// @ts-check
// The user's settings: they live as long as the tab.
const KEY = 'shibo-settings';

/** @returns {Record<string, any>} */
const read = () => { try { return JSON.parse(sessionStorage.getItem(KEY) ?? '{}'); } catch { return {}; } };

/** @param {string} name */
export const setting = (name) => read()[name] ?? null;

/** @param {string} name @param {unknown} value */
export function keep(name, value) {
  try { sessionStorage.setItem(KEY, JSON.stringify({ ...read(), [name]: value })); } catch { /* there is no storage, or it is full */ }
}
