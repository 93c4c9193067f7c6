// A web site for tests of the npm package in a browser: the package, three.js, the example, and pages of a test's own.
//   const site = await PackageSite.open(tar, work, { '/one.html': () => HEAD + '...' }); site.url; site.close();
import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import http from 'node:http';
import path from 'node:path';
import { fileURLToPath } from 'node:url';

/** Debian's libjs-three, or another version of it. */
export const three = process.env.STRANDCAST_THREE ?? '/usr/share/javascript/three';
export const whyNoThree = () => (fs.existsSync(path.join(three, 'build/three.module.js')) ? undefined : 'needs three.js (libjs-three)');
export const root = path.join(path.dirname(fileURLToPath(import.meta.url)), '../..');

const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm', '.glb': 'model/gltf-binary' };
const IMPORTS = JSON.stringify({ imports: { three: '/node_modules/three/build/three.module.js', strandcast: '/node_modules/strandcast/strandcast.js',
  'strandcast/three': '/node_modules/strandcast/hair.js', 'strandcast/view': '/node_modules/strandcast/view.js' } });
/** What a page begins with, for something that fills it. */
export const HEAD = `<!DOCTYPE html><style>body { margin: 0; } canvas, strandcast-view { display: block; width: 100vw; height: 100vh; }</style>
  <script type="importmap">${IMPORTS}</script>`;

export class PackageSite {
  /** `pages`: functions by their paths. Other files are looked for in `work`, then in the example. */
  static async open(tar, work, pages) {
    const installed = path.join(work, 'node_modules/strandcast');
    fs.mkdirSync(installed, { recursive: true });
    execFileSync('tar', ['-xzf', path.resolve(tar), '--strip-components=1', '-C', installed]);
    const site = new PackageSite();
    site.files = http.createServer(({ url }, answer) => {
      const name = new URL(url, 'http://here').pathname;
      const inThree = name.replace('/node_modules/three/', '');
      const file = inThree !== name ? path.join(three, inThree)
        : [work, path.join(root, 'examples/three')].map((folder) => path.join(folder, name)).find((one) => fs.existsSync(one));
      const page = pages[name]?.();
      if (!page && !file) return answer.writeHead(404).end();
      answer.writeHead(200, { 'content-type': TYPES[path.extname(name)] ?? 'text/plain' });
      answer.end(page ?? fs.readFileSync(file));
    });
    await new Promise((done) => site.files.listen(0, '127.0.0.1', done));
    site.origin = `http://127.0.0.1:${site.files.address().port}`;
    return site;
  }
  close() {
    this.files.close();
    this.files.closeAllConnections?.();
  }
}
