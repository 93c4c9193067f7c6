// The npm package in a real browser: the element and the object of three.js beside the server's own page on the same state, and
// the example. three.js is Debian's libjs-three, or what STRANDCAST_THREE names.
//   node tests/web/package_browser.mjs strandcast-server strandcast-<version>.tgz [FOLDER for pictures]
// Ends with 77 where there is no browser or no three.js; a line per test; the exit status is 1 when any fails.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { Browser, comeToStand, picturesOf as shownPictures, sleep } from './browser.mjs';
import { NodeSocket } from './node_socket.mjs';
import { HEAD, PackageSite, root, whyNoThree } from './package_site.mjs';
import { psnr, readPng } from './png.mjs';
import { Server } from './server.mjs';

const [program, tar, shots] = process.argv.slice(2);
const missing = whyNoThree();
if (missing) {
  console.log(`skipped: ${missing}`);
  process.exit(77);
}
const browser = await Browser.startOrSkip();
const work = fs.mkdtempSync(path.join(os.tmpdir(), 'strandcast-package-'));
const Socket = globalThis.WebSocket ?? NodeSocket;
const LEAST_DB = 40;
const [STRANDS, VERTICES] = [400, 12]; // enough to cover a head
const SIZE = { width: 640, height: 360 };
const address = () => `ws://127.0.0.1:${server.port}`;
/** Pages of tests; what they have learnt stands in document.documentElement.dataset.strandcast. */
const PAGES = {
  '/view.html': () => `${HEAD}<strandcast-view src="${address()}" codec="tangent" draw="tiles"></strandcast-view><script type="module">
    import 'strandcast/view';
    let pictures = 0;
    document.querySelector('strandcast-view').addEventListener('picture', () =>
      (document.documentElement.dataset.strandcast = JSON.stringify({ pictures: ++pictures })));</script>`,
  // The state as the page has it, its sessions in workers, and as a worker has it that is one itself.
  '/states.html': () => `${HEAD}<script type="module">
    import { connect } from 'strandcast';
    const hash = new Promise((done) => (new Worker('/in_worker.js', { type: 'module' }).onmessage = ({ data }) => done(data)));
    for await (const state of connect('${address()}', { codec: 'tangent' })) {
      document.documentElement.dataset.strandcast = JSON.stringify({ here: state.hash, there: await hash, floats: state.positions.length });
      break;
    }</script>`,
  '/in_worker.js': () => `import { connect } from '/node_modules/strandcast/strandcast.js';
    for await (const { hash } of connect('${address()}', { codec: 'tangent' })) postMessage(hash);`,
  // The page's camera about a head that turns, before the page's background.
  '/hair.html': () => `${HEAD}<canvas></canvas><script type="module">
    import * as THREE from 'three';
    import { connect } from 'strandcast';
    import { StrandcastHair } from 'strandcast/three';
    const canvas = document.querySelector('canvas');
    const renderer = new THREE.WebGLRenderer({ canvas, context: canvas.getContext('webgl2', { antialias: true, alpha: true }), alpha: true });
    renderer.setSize(innerWidth, innerHeight, false);
    const connection = connect('${address()}', { codec: 'tangent' });
    const hair = new StrandcastHair(connection, { head: true, followsPose: true });
    const scene = new THREE.Scene();
    scene.add(hair);
    const { camera: { offset, target, fov } } = await connection.opened;
    const camera = new THREE.PerspectiveCamera(fov * 180 / Math.PI, innerWidth / innerHeight, 0.05, 20);
    // How many colours a wall before the left half has.
    window.wall = (opacity) => {
      const wall = new THREE.Mesh(new THREE.PlaneGeometry(1, 2), new THREE.MeshBasicMaterial({ color: 0xff0000, opacity, transparent: opacity < 1 }));
      wall.quaternion.copy(camera.quaternion);
      wall.position.copy(camera.position).add(new THREE.Vector3(-0.5, 0, -0.3).applyQuaternion(camera.quaternion));
      scene.add(wall);
      renderer.render(scene, camera);
      scene.remove(wall);
      const gl = renderer.getContext();
      const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
      const pixels = new Uint32Array((width / 2 - 8) * height);
      gl.readPixels(0, 0, width / 2 - 8, height, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(pixels.buffer));
      wall.geometry.dispose();
      return new Set(pixels).size;
    };
    window.end = () => {
      const held = { ...renderer.info.memory };
      hair.dispose();
      return [held, { ...renderer.info.memory }];
    };
    let states = 0;
    connection.on('state', () => ++states);
    let quiet = 0; // pictures since the worker was last busy
    renderer.setAnimationLoop(() => {
      camera.position.set(...offset).add(new THREE.Vector3(...target)).add(hair.position);
      camera.lookAt(new THREE.Vector3(...target).add(hair.position));
      renderer.render(scene, camera);
      quiet = states && !hair.isBusy ? quiet + 1 : 0;
      if (quiet < 3) return;
      renderer.setAnimationLoop(null);
      document.documentElement.dataset.strandcast = JSON.stringify({ pictures: 1 });
    });
    const middle = connection.look.background;
    const shown = (height) => Object.values(middle).map((one) => one * (1 + 0.35 * (2 * height - 1)))
      .map((one) => Math.round(255 * (one < 0.0031308 ? 12.92 * one : 1.055 * one ** (1 / 2.4) - 0.055)));
    const behind = document.createElement('canvas');
    Object.assign(behind, { width: 1, height: innerHeight });
    const painting = behind.getContext('2d');
    for (let y = 0; y < innerHeight; ++y) {
      painting.fillStyle = \`rgb(\${shown((innerHeight - y - 0.5) / innerHeight)})\`;
      painting.fillRect(0, y, 1, 1);
    }
    document.body.style.background = \`url(\${behind.toDataURL()}) repeat-x\`;</script>`,
};

PAGES['/lines.html'] = () => PAGES['/hair.html']().replace('followsPose: true', "followsPose: true, style: 'lines'");

let server;
let site;
let strandcast; // in this Node
let pausing; // stays, so that the state does
const picturesOf = (tab) => tab.state().then(({ pictures = 0 }) => pictures, () => 0);
/** Once it stands. */
async function shownBy(url, name, count, beforeEnd = () => undefined) {
  const tab = await browser.open(url, SIZE);
  await comeToStand(tab, 1200, count);
  await tab.evaluate('for (const card of document.querySelectorAll(".card, #warnings")) card.hidden = true');
  await sleep(100);
  const picture = readPng(await tab.screenshot(shots && path.join(shots, `${name}.png`)));
  assert.deepEqual(tab.errors.filter((error) => !error.includes('favicon')), []);
  await beforeEnd(tab);
  await tab.close();
  return picture;
}
let page;
const tests = {
  async 'the element shows what the page shows'() {
    page = await shownBy(`${server.url}#mode=strands&codec=tangent&draw=tiles`, 'page', shownPictures);
    const seen = await shownBy(`${site.origin}/view.html`, 'view', picturesOf);
    assert.equal(psnr(page, seen), Infinity);
  },
  async 'three shows what the page shows'() {
    const alike = psnr(page, await shownBy(`${site.origin}/hair.html`, 'hair', picturesOf, async (tab) => {
      assert.equal(await tab.evaluate('wall(1)'), 1, 'what is opaque hides hair');
      assert.ok((await tab.evaluate('wall(0.5)')) > 100, 'one sees through the rest');
      const [held, left] = await tab.evaluate('end()');
      assert.ok(held.geometries >= 3 && held.textures >= 7, JSON.stringify(held));
      assert.deepEqual([left.geometries, left.textures], [0, 0], 'what dispose() leaves on the graphics card');
    }));
    console.log(`  ${alike.toFixed(2)} dB`);
    assert.ok(alike >= LEAST_DB, `${alike} dB`);
  },
  async 'lines show the same hair'() {
    const bare = page.rgb.slice(0, 3);
    const covered = ({ rgb }) => { // by anything but what is behind it: of each pixel
      const all = new Uint8Array(rgb.length / 3);
      for (let i = 0; i < all.length; ++i) all[i] = Math.abs(rgb[3 * i] - bare[0]) + Math.abs(rgb[3 * i + 1] - bare[1]) + Math.abs(rgb[3 * i + 2] - bare[2]) > 150 ? 1 : 0;
      return all;
    };
    const lines = await shownBy(`${site.origin}/lines.html`, 'lines', picturesOf);
    const [ribbon, line] = [covered(page), covered(lines)];
    const both = ribbon.reduce((sum, is, i) => sum + (is & line[i]), 0);
    const either = ribbon.reduce((sum, is, i) => sum + (is | line[i]), 0);
    console.log(`  ${psnr(page, lines).toFixed(2)} dB, ${((100 * both) / either).toFixed(1)} % of the pixels in common`);
    assert.ok(psnr(page, lines) >= LEAST_DB && both > 0.8 * either, `${both} of ${either} pixels`);
  },
  async 'a page, a worker and Node have the same state'() {
    const tab = await browser.open(`${site.origin}/states.html`, SIZE);
    const { here, there, floats } = await tab.until((now) => now.here, 'a state');
    await tab.close();
    const node = strandcast.connect(server.url, { WebSocket: Socket, codec: 'tangent' });
    const { value: { hash } } = await node[Symbol.asyncIterator]().next();
    node.close();
    assert.deepEqual([here, there, floats], [hash, hash, 3 * STRANDS * VERTICES]);
  },
  async 'the example has hair on its head'() {
    fs.copyFileSync(path.join(root, 'examples/three/head.mjs'), path.join(work, 'head.mjs'));
    const { glbOf } = await import(pathToFileURL(path.join(work, 'head.mjs')));
    fs.writeFileSync(path.join(work, 'head.glb'), glbOf(await strandcast.headOf(pausing.asset)));
    const shares = async (to, least) => {
      const tab = await browser.open(`${site.origin}/index.html#${to}`, SIZE);
      await tab.until(async () => (await tab.evaluate('document.readyState')) === 'complete', 'the example');
      let seen;
      // Hair is dark, the head is not, and what is behind both is white.
      for (const end = Date.now() + 20_000; Date.now() < end && !(seen?.head > 0.03 && seen.hair > least); await sleep(100)) {
        const { rgb } = readPng(await tab.screenshot(shots && path.join(shots, 'example.png')));
        seen = { hair: 0, head: 0 };
        for (let at = 0; at < rgb.length; at += 3) {
          const light = rgb[at] + rgb[at + 1] + rgb[at + 2];
          if (light < 330) seen.hair += 3 / rgb.length;
          else if (light < 700) seen.head += 3 / rgb.length;
        }
      }
      await tab.close();
      return seen;
    };
    const bare = await shares('ws://127.0.0.1:1', -1);
    const whole = await shares(address(), bare.hair + 0.02);
    console.log(`  hair on ${(100 * whole.hair).toFixed(1)} % of the picture, ${(100 * bare.hair).toFixed(1)} % without`);
    assert.ok(bare.head > 0.03 && whole.head > 0.03 && whole.hair > bare.hair + 0.02, JSON.stringify([bare, whole]));
  },
};

let failed = 0;
try {
  if (shots) fs.mkdirSync(shots, { recursive: true });
  site = await PackageSite.open(tar, work, PAGES);
  server = await Server.start(program, ['--set', `groom.procedural.strand_count=${STRANDS}`, '--set', `groom.procedural.vertex_count=${VERTICES}`, '--allow-origin', site.origin]);
  strandcast = await import(pathToFileURL(path.join(work, 'node_modules/strandcast/node.js')));
  pausing = strandcast.connect(server.url, { WebSocket: Socket });
  await pausing.opened;
  for await (const { tick } of pausing) if (tick > 60) break; // some hair has moved
  pausing.pause();
  await sleep(300);
  for (const [name, test] of Object.entries(tests).filter(([one]) => one.includes(process.env.STRANDCAST_TEST ?? ''))) {
    const begin = Date.now();
    await test().then(() => console.log(`passed: ${name} (${((Date.now() - begin) / 1000).toFixed(1)} s)`),
      (error) => (++failed, console.log(`FAILED: ${name}: ${error.stack}`)));
  }
  pausing.close();
  site.close();
} finally {
  await browser.end();
  await server?.end();
  fs.rmSync(work, { recursive: true, force: true });
}
process.exitCode = failed ? 1 : 0;
