// @ts-check
// Files of the graph: pictures and meshes that were dropped on the page or chosen. They stay in this tab.
import { element, notice } from './dom.js';
import { base64 } from './base64.js';
import { model } from './session.js';

// All files of a graph come with one request.
const MOST = 11 << 20;
const PICTURES = /\.(png|jpe?g|tiff?|svg)$/i;
const OTHERS = /\.(obj|glb|gltf|exr|hdr|csv|ron)$/i;

/** @param {File[]} files @param {() => void} changed @returns {Promise<File[]>} the files that became part of the graph */
export async function take(files, changed) {
  const taken = files.filter((file) => PICTURES.test(file.name) || OTHERS.test(file.name));
  for (const file of taken) {
    const held = Object.values(model.files).reduce((sum, text) => sum + text.length * 0.75, 0);
    if (held + file.size > MOST) { notice(`${file.name} is too large: files of a graph have at most ${MOST >> 20} MiB here`, true); continue; }
    model.setFile(file.name, await base64(file));
    const node = PICTURES.test(file.name) ? 'Image' : /\.(obj|gl(b|tf))$/i.test(file.name) ? 'LoadMesh' : null;
    notice(`${file.name} is a file of the graph now${node ? `: ${node}(path: "${file.name}")` : ''}`);
  }
  changed();
  return taken;
}

/** @param {File} file */
export const isPhoto = (file) => isPicture(file) && !/\.svg$/i.test(file.name);

// Pictures are files of the graph or photographs; meshes and panoramas are also for the 3D view.
/** @param {File} file */
export const isPicture = (file) => PICTURES.test(file.name);

/** @param {HTMLDialogElement} dialog */
export function filesDialog(dialog) {
  const list = element('ul', { className: 'files' });
  const chooser = element('input', { type: 'file', id: 'files-chooser', multiple: true, accept: '.png,.jpg,.jpeg,.tif,.tiff,.svg,.obj,.glb,.exr,.hdr,.csv,.ron' });
  const close = element('button', { textContent: 'Close' });
  close.onclick = () => dialog.close();
  const build = () => {
    const names = Object.keys(model.files);
    list.replaceChildren(...names.map((name) => {
      const gone = element('button', { textContent: 'Remove', ariaLabel: `Remove ${name}` });
      gone.onclick = () => { model.dropFile(name); build(); };
      return element('li', {}, element('code', { textContent: name }), gone);
    }));
    if (!names.length) list.append(element('li', { textContent: 'None yet. Drop pictures or meshes on the text, or choose them here.' }));
  };
  chooser.onchange = () => take([...(chooser.files ?? [])], build);
  dialog.replaceChildren(
    element('h2', { id: 'files-title', textContent: 'Files of the graph' }),
    element('p', { className: 'doc', textContent: 'The graph reads them by their names. They stay in this tab, are never sent, and are not part of a link.' }),
    list, element('label', { htmlFor: 'files-chooser', textContent: 'Add files ' }, chooser), element('div', { className: 'row' }, close),
  );
  dialog.setAttribute('aria-labelledby', 'files-title');
  return { build, open: () => { build(); dialog.showModal(); } };
}
