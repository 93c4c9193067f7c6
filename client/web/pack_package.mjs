// Makes the npm package of what is to be in it, beside its bundles, and a tar file of it as `npm pack` lays it out:
//   node client/web/pack_package.mjs FOLDER VERSION FILE...     FOLDER/strandcast has the bundles; files are copied there
// Prints what its scripts take by gzip, without the modules.
import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import path from 'node:path';
import zlib from 'node:zlib';

const [folder, version, ...files] = process.argv.slice(2);
if (!files.length) {
  console.error('usage: node pack_package.mjs FOLDER VERSION FILE...');
  process.exit(2);
}
const inside = path.join(folder, 'strandcast');
for (const file of files) fs.copyFileSync(file, path.join(inside, path.basename(file)));
const entry = (name, node) => ({ types: `./${name}.d.ts`, ...(node && { node: `./${node}.js` }), default: `./${name}.js` });
fs.writeFileSync(path.join(inside, 'package.json'), `${JSON.stringify({
  name: 'strandcast', version, description: 'Hair that a Strandcast server simulates, in a page of your own', license: 'Apache-2.0',
  type: 'module', sideEffects: ['./view.js'], types: './strandcast.d.ts', peerDependencies: { three: '>=0.111' }, peerDependenciesMeta: { three: { optional: true } },
  exports: { '.': entry('strandcast', 'node'), './three': entry('hair'), './view': entry('view'), './*.wasm': './*.wasm', './worker.js': './worker.js' },
}, null, 2)}\n`);
const scripts = fs.readdirSync(inside).filter((name) => name.endsWith('.js'));
const bytes = scripts.reduce((all, name) => all + zlib.gzipSync(fs.readFileSync(path.join(inside, name)), { level: 9 }).length, 0);
execFileSync('tar', ['--sort=name', '--owner=0', '--group=0', '--mtime=@0', '--transform', 's,^strandcast,package,', '-C', folder, '-czf',
  path.join(folder, `strandcast-${version}.tgz`), 'strandcast']);
console.log(`strandcast-${version}.tgz: scripts ${bytes} bytes by gzip`);
