// @ts-check
// The user's own files, dropped on the page or chosen. A mesh (OBJ or glb) becomes a shape that shows the material, and
// stays in the browser. A panorama (EXR or HDR) becomes the environment; the server computes its light. A picture is a
// photograph to compare with: see photo.js. Vertices are as in shapes.js.
import { $, element, notice } from './dom.js';

/** @param {import('./lit.js').Lit} lit @param {Shape} made @param {string} file */
function wear(lit, made, file) {
  lit.put('own', made);
  const button = /** @type {HTMLElement} */ (document.querySelector('[data-shape=own]'));
  button.hidden = false;
  button.textContent = file.replace(/\.(obj|glb)$/i, '');
  button.title = `${file}, which was dropped on the page`;
  lit.setShape('own');
}

// Maximum size that the server accepts, in MiB.
const PANORAMA = 256;

// Loads a panorama as light.
/** @param {import('./lit.js').Lit} lit @param {() => void} look @param {File} file */
async function takePanorama(lit, look, file) {
  try {
    if (file.size > PANORAMA << 20) throw new Error(`it has more than ${PANORAMA} MiB; scale it down`);
    notice(`Reading ${file.name} …`);
    await lit.staging.setOwn(file);
    if (lit.failed) throw new Error('the lit view cannot be drawn in this browser');
    look();
    notice(`${file.name} lights the material`);
  } catch (error) {
    notice(`${file.name} cannot be the environment: ${/** @type {Error} */ (error).message}`, true);
  }
}

// The first bytes of PNG, JPEG and TIFF.
const PHOTOS = [[0x89, 0x50, 0x4e, 0x47], [0xff, 0xd8, 0xff], [0x49, 0x49, 0x2a], [0x4d, 0x4d, 0x00, 0x2a]];

// Loads a file; shows an error if that fails.
/** @param {import('./lit.js').Lit} lit @param {() => void} look @param {(file: File) => void} photo @param {File} file */
async function take(lit, look, photo, file) {
  const start = new Uint8Array(await file.slice(0, 4).arrayBuffer());
  /** @param {number[][]} kinds */
  const begins = (kinds) => kinds.some((magic) => magic.every((b, i) => start[i] === b));
  if (begins(PHOTOS)) { photo(file); return; }
  // The first bytes of OpenEXR and of Radiance.
  const isPanorama = begins([[0x76, 0x2f, 0x31, 0x01], [0x23, 0x3f]]);
  if (isPanorama || /\.(exr|hdr)$/i.test(file.name)) { await takePanorama(lit, look, file); return; }
  try {
    const buffer = await file.arrayBuffer();
    const { glb, obj, projected, shape } = await import('./meshes.js');
    const binary = buffer.byteLength > 28 && new DataView(buffer).getUint32(0, true) === 0x46546c67;
    if (!binary && !/\.(obj|glb)$/i.test(file.name)) throw new Error('only meshes (OBJ, glb), panoramas (EXR, HDR) and photographs (PNG, JPEG, TIFF) can be shown');
    const found = binary ? glb(buffer) : obj(new TextDecoder().decode(buffer));
    const mapped = 3 * found.uvs.length === 2 * found.positions.length;
    wear(lit, shape(mapped ? found : projected(found)), file.name);
    look();
    notice(`${file.name} wears the material${mapped ? '' : '; it has no texture coordinates, so the material is projected on it from six sides'}`);
  } catch (error) {
    notice(`${file.name} cannot wear the material: ${/** @type {Error} */ (error).message}`, true);
  }
}

// Accepts files dropped anywhere on the page, or chosen; `look` switches to the lit view, and `photo` takes a photograph.
/** @param {import('./lit.js').Lit} lit @param {() => void} look @param {(file: File) => void} photo */
export function drops(lit, look, photo) {
  /** @param {string} id @param {string} text @param {string} accept @param {string} title */
  const choice = (id, text, accept, title) => {
    const input = element('input', { type: 'file', id: `${id}-file`, accept, hidden: true, ariaLabel: text.replace(' …', '') });
    input.onchange = () => { if (input.files?.[0]) take(lit, look, photo, input.files[0]); input.value = ''; };
    const button = element('button', { id: `${id}-choose`, textContent: text, title });
    button.onclick = () => input.click();
    return [button, input];
  };
  const mesh = choice('own', 'Own mesh …', '.obj,.glb', 'Choose an OBJ or glb file, or drop one on the page');
  const light = choice('hdri', 'Own HDRI …', '.exr,.hdr', 'Choose an EXR or HDR panorama as the environment, or drop one on the page');
  $('light').append(element('div', { className: 'row' }, ...mesh, ...light));
  addEventListener('dragover', (e) => { if (e.dataTransfer && [...e.dataTransfer.types].includes('Files')) e.preventDefault(); });
  addEventListener('drop', (e) => {
    if (!e.dataTransfer?.files.length) return;
    e.preventDefault();
    take(lit, look, photo, e.dataTransfer.files[0]);
  });
}
