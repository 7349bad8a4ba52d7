// @ts-check
// Opens what the address names. Reading may take a while: an answer for an address that is no longer shown is ignored.

/** @typedef {{ name: string, text: string, values: import('./work.js').Chosen }} Graph */

// Begins to read the graph of an address; `show` and `refuse` are called only while `address` still gives the same.
/** @param {{ address: () => string, read: (address: string) => Promise<Graph | null>, show: (graph: Graph) => void, refuse: (error: Error) => void | Promise<void> }} of */
export async function openAddress({ address, read, show, refuse }) {
  const asked = address();
  try {
    const graph = await read(asked);
    if (!graph || address() !== asked) return false;
    show(graph);
    return true;
  } catch (error) {
    if (address() === asked) await refuse(/** @type {Error} */ (error));
    return false;
  }
}
