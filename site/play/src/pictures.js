// Graphs with a picture in the gallery. The build replaces this file.
/** @type {string[]} */
export const PICTURES = [];
