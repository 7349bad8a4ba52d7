// Tries the unpacked site behind a server: node site.mjs FOLDER ADDRESS PICTURES. Every file must be served as it is, every link within the
// site must lead to a file of it, and nothing may be loaded from elsewhere. The served module must write the files in PICTURES, which
// are those of `shibo render graphs/starter.ron --resolution 64`.
import assert from 'node:assert/strict';
import { readFile, readdir } from 'node:fs/promises';
import { dirname, join, posix } from 'node:path';
import { load, write } from '../../hosts/npm/index.js';

const [folder, address, pictures] = process.argv.slice(2);
const all = await readdir(folder, { recursive: true, withFileTypes: true });
const names = all.filter((one) => one.isFile()).map((one) => join(one.parentPath ?? one.path, one.name).slice(folder.length + 1));
const known = new Set(names);
for (const name of ['index.html', 'play/index.html', 'play/shibo.wasm', 'docs/gallery.html', 'LICENSE-MIT']) assert.ok(known.has(name), name);

const isForeign = (target) => /^([a-z][a-z0-9+.-]*:)?\/\//i.test(target);
/** The file that a link of a page leads to. */
function file(page, target) {
  const path = posix.join(dirname(page), decodeURIComponent(target.split(/[#?]/)[0]));
  return path === '.' || path.endsWith('/') ? posix.join(path, 'index.html') : path;
}

let links = 0;
for (const name of names) {
  const response = await fetch(new URL(name.split('/').map(encodeURIComponent).join('/'), address));
  assert.equal(response.status, 200, name);
  const bytes = Buffer.from(await response.arrayBuffer());
  assert.ok(bytes.equals(await readFile(join(folder, name))), `${name} is served otherwise`);
  const text = /\.(html|css)$/.test(name) ? bytes.toString() : '';
  // What a browser loads by itself: it must be relative, or a part of the page.
  const loads = name.endsWith('.html') ? /<(?:script|img|link|iframe|source|video)\b[^>]*?\s(?:src|href)="([^"]*)"/g : /\burl\(\s*["']?([^"')]*)|@import\s+["']([^"']*)/g;
  const loaded = [...text.matchAll(loads)].map((match) => match[1] ?? match[2]);
  for (const target of loaded.filter((target) => !/^(data:|blob:|#)/.test(target))) {
    assert.ok(!isForeign(target) && !target.startsWith('/'), `${name} loads ${target}`);
    assert.ok(known.has(file(name, target)), `${name} loads ${target}, which is no file of the site`);
    links += 1;
  }
  if (!name.endsWith('.html')) continue;
  if (name === 'docs/internals/page/mockup.html') {
    // A drawing of a page, which is a file of docs/ and has a script in itself.
    assert.doesNotMatch(text, /https?:/);
    continue;
  }
  // The policy of the page forbids the rest, also to scripts.
  const policy = /http-equiv="Content-Security-Policy" content="([^"]*)"/.exec(text)?.[1] ?? '';
  assert.match(policy, /^default-src 'none'/, name);
  for (const source of policy.split(/[;\s]+/).filter((word) => /[:'*.]/.test(word))) {
    assert.match(source, /^('none'|'self'|'wasm-unsafe-eval'|'sha\d+-[\w+/=]+'|data:|blob:)$/, `${name} allows ${source}`);
  }
  for (const [, target] of text.matchAll(/<a\b[^>]*?\shref="([^"#][^"]*)"/g)) {
    if (/^[a-z]+:/.test(target)) continue;
    assert.ok(known.has(file(name, target)), `${name} leads to ${target}, which is no file of the site`);
    links += 1;
  }
}

await load(new URL('play/shibo.wasm', address).href);
const written = await write('shibo:starter', { resolution: 64 });
const wanted = (await readdir(pictures)).sort();
assert.deepEqual(written.map((one) => one.name).sort(), wanted);
for (const { name, bytes } of written) assert.ok(Buffer.from(bytes).equals(await readFile(join(pictures, name))), `${name} has other bytes`);
console.log(`${names.length} files and ${links} links of the site; ${wanted.length} pictures equal those of the command`);
