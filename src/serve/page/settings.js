// @ts-check
// The user's settings.

// Settings live in a cookie of the host: each run has another port and token, and local storage is separate for each
// port.
const COOKIE = 'shibo-page';
/** @type {() => Record<string, any>} */
const read = () => {
  const found = document.cookie.split('; ').find((c) => c.startsWith(`${COOKIE}=`));
  try { return JSON.parse(decodeURIComponent(/** @type {string} */ (found).slice(COOKIE.length + 1))); } catch { return {}; }
};

/** @param {string} name */
export const setting = (name) => read()[name] ?? null;

/** @param {string} name @param {unknown} value */
export function keep(name, value) {
  const all = { ...read(), [name]: value };
  document.cookie = `${COOKIE}=${encodeURIComponent(JSON.stringify(all))}; path=/; max-age=31536000; SameSite=Strict`;
}
