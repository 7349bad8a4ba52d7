// Runs the Khronos validator on all .glb and .gltf files below a folder: `node validate.js FOLDER`. Fails on errors and warnings.
const fs = require('fs');
const path = require('path');
const validator = require('gltf-validator');

const found = fs.readdirSync(process.argv[2], { recursive: true }).filter((name) => /\.gl(b|tf)$/.test(name)).sort();
(async () => {
  let bad = found.length ? 0 : 1;
  for (const name of found) {
    const bytes = new Uint8Array(fs.readFileSync(path.join(process.argv[2], name)));
    const { issues } = await validator.validateBytes(bytes, {
      uri: name,
      externalResourceFunction: async (uri) =>
        new Uint8Array(fs.readFileSync(path.join(process.argv[2], path.dirname(name), decodeURIComponent(uri)))),
    });
    if (issues.numErrors + issues.numWarnings > 0) {
      bad += 1;
      console.error(name, JSON.stringify(issues.messages.slice(0, 5), null, 1));
    }
  }
  console.log(`${found.length} glb and gltf`);
  process.exit(bad ? 1 : 0);
})();
