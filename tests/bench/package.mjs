// What the npm package takes of a page's main thread for each state of 10,000 strands x 16: processor time, as the browser counts
// it, for a state that comes and for its picture by three.js. Called by tests/bench/page.sh.
//   node tests/bench/package.mjs strandcast-server strandcast-<version>.tgz
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { Browser, sleep, whyNoBrowser } from '../web/browser.mjs';
import { HEAD, PackageSite, whyNoThree } from '../web/package_site.mjs';
import { Server } from '../web/server.mjs';

const [program, tar] = process.argv.slice(2);
const missing = whyNoBrowser() ?? whyNoThree();
if (missing) {
  console.log(`skipped: ${missing}`);
  process.exit(0);
}
const SECONDS = 8;
const MOST_MS = 4;
const begin = () => `${HEAD}<canvas></canvas><script type="module">
  import { connect } from 'strandcast';
  const told = { states: 0, pictures: 0 };
  const tell = () => (document.documentElement.dataset.strandcast = JSON.stringify(told));
  const connection = connect('ws://127.0.0.1:${server.port}');
  connection.on('state', () => (++told.states, tell()));`;
const PAGES = {
  '/states.html': () => `${begin()}
</script>`,
  // Pictures of what changed alone. Software would draw two a second: it gets all of the data, and few corners of them.
  '/hair.html': () => `${begin()}
    import * as THREE from 'three';
    import { StrandcastHair } from 'strandcast/three';
    const canvas = document.querySelector('canvas');
    const context = canvas.getContext('webgl2');
    const draw = context.drawElements.bind(context);
    context.drawElements = (mode, count, type, at) => draw(mode, Math.min(count, 300), type, at);
    const renderer = new THREE.WebGLRenderer({ canvas, context });
    renderer.setSize(innerWidth, innerHeight, false);
    const camera = new THREE.PerspectiveCamera(35, innerWidth / innerHeight, 0.05, 20);
    camera.position.set(0.22, 0.02, 0.62);
    camera.lookAt(new THREE.Vector3(0, -0.055, 0));
    const hair = new StrandcastHair(connection);
    const scene = new THREE.Scene();
    scene.add(hair);
    const drawWhatIsNew = () => {
      if (!hair.isDirty) return;
      renderer.render(scene, camera);
      ++told.pictures;
      tell();
    };
    hair.worker.addEventListener('message', () => setTimeout(drawWhatIsNew)); // no clock: it would cost more than it measures
    connection.on('state', drawWhatIsNew);</script>`,
};
const work = fs.mkdtempSync(path.join(os.tmpdir(), 'strandcast-package-bench-'));
const site = await PackageSite.open(tar, work, PAGES);
const server = await Server.start(program, ['--allow-origin', site.origin, '--set', 'groom.procedural.strand_count=10000']);
const browser = await Browser.start();
/** Processor time of a page's main thread over some seconds, and what came meanwhile. */
async function measured(name, counted) {
  const tab = await browser.open(`${site.origin}/${name}.html`, { width: 640, height: 360 });
  await tab.send('Performance.enable', { timeDomain: 'threadTicks' });
  await tab.until((now) => now[counted] > 5, counted, 60_000);
  const look = async () => {
    const { metrics } = await tab.send('Performance.getMetrics');
    return { busyMs: 1e3 * metrics.find((one) => one.name === 'TaskDuration').value, ...(await tab.state()) };
  };
  const first = await look();
  await sleep(SECONDS * 1e3);
  const last = await look();
  await tab.close();
  return { busyMs: last.busyMs - first.busyMs, states: last.states - first.states, pictures: last.pictures - first.pictures };
}
const alone = await measured('states', 'states');
const stateMs = alone.busyMs / alone.states;
const drawn = await measured('hair', 'pictures');
const pictureMs = (drawn.busyMs - drawn.states * stateMs) / drawn.pictures;
console.log(`package, main thread, 10,000 x 16: ${stateMs.toFixed(2)} ms for a state (of ${alone.states}), ${pictureMs.toFixed(2)} ms for its picture by three ` +
  `(of ${drawn.pictures}): ${(stateMs + pictureMs).toFixed(1)} ms of processor together, at most ${MOST_MS}`);
await browser.end();
await server.end();
site.close();
fs.rmSync(work, { recursive: true, force: true });
