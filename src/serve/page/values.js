// @ts-check
// Values that the user set: of parameters, and in the texts of nodes.

/** @type {(edit: FieldEdit) => string} */
export const keyOf = ({ node, field, index }) => [node, field, ...(index === null || index === undefined ? [] : [index])].join(' ');

/** @type {(edit: FieldEdit) => FieldEdit} */
const plain = ({ node, field, index, value }) => ({ node, field, index: index ?? null, value });

// The values as the server takes them.
/** @param {Values} values @returns {SentValues} */
export const sent = ({ preset, set, edits }) => ({ preset, set: [...set], edits: (edits ?? []).map(plain) });

/** @param {Values} values */
const comparable = ({ preset, set, edits }) => JSON.stringify([preset, [...set].sort(), (edits ?? []).map((edit) => [keyOf(edit), edit.value]).sort()]);

/** @param {Values} a @param {Values} b */
export const same = (a, b) => comparable(a) === comparable(b);
