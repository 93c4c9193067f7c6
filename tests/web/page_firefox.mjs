// The page in Firefox beside Chromium: one state of a server drawn by tiles and by WebGL2, the server's pictures, and a bundle
// from its file.
//   node tests/web/page_firefox.mjs strandcast-server [FOLDER for screenshots]
// With STRANDCAST_TEST_GRID=whole all of that, else strands by tiles and the bundle.
// Ends with 77 where a browser is missing; the exit status is 1 when any test fails.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import path from 'node:path';
import { comeToStand, sleep } from './browser.mjs';
import { Firefox, whyNoFirefox } from './firefox.mjs';
import { psnr, readPng } from './png.mjs';
import { begin, program, runAll, shots, work } from './served.mjs';
import { SMALL } from './server.mjs';

const missing = whyNoFirefox();
if (missing) {
  console.log(`skipped: ${missing}`);
  process.exit(77);
}
const isWhole = process.env.STRANDCAST_TEST_GRID === 'whole';
const LEAST_DB = 40;
const STILL_MS = 3000; // a busy machine takes a second or two for the whole picture of what stands
const { browser: chromium, server } = await begin([...SMALL, '--lockstep']);
const firefox = await Firefox.start();
const ctlProgram = path.join(path.dirname(program), 'strandcast-ctl');
const ctl = (...words) => execFileSync(ctlProgram, words, { encoding: 'utf8' });
ctl('--connect', `127.0.0.1:${server.port}`, 'step', '60');

/** Once it stands, sharp, without what lies over it. */
async function picture(tab, name) {
  await comeToStand(tab, STILL_MS);
  await tab.evaluate('[...document.querySelectorAll(".card, #warnings")].forEach((card) => { card.style.visibility = "hidden"; })');
  await sleep(200);
  return readPng(await tab.screenshot(shots && path.join(shots, `${name}.png`)));
}
async function compare(name, url, isThere) {
  const pictures = [];
  for (const [title, browser] of [['chromium', chromium], ['firefox', firefox]]) {
    const tab = await browser.open(url, { width: 640, height: 360 });
    const state = await tab.until(isThere, `${name} in ${title}`);
    assert.deepEqual([state.wrong, state.error], [0, ''], state.rejected);
    pictures.push(await picture(tab, `${name}_${title}`));
    if (title === 'chromium') await tab.close();
  }
  const alike = psnr(...pictures);
  console.log(`  ${name}: ${alike.toFixed(1)} dB, at least ${LEAST_DB}`);
  assert.ok(alike >= LEAST_DB, `${name}: ${alike} dB`);
}

await runAll({
  async 'strands look as in Chromium'() {
    for (const draw of isWhole ? ['tiles', 'gl'] : ['tiles'])
      await compare(draw, `${server.url}#mode=strands&draw=${draw}`, (now) => now.mode === 'strands');
  },
  async 'the server\'s pictures look as in Chromium'() {
    if (!isWhole) return;
    await compare('pictures', `${server.url}#mode=pictures&pictures=tiles`, (now) => now.mode === 'pictures');
  },
  async 'a bundle plays from its file, and every hash is right'() {
    const page = path.join(work, 'scene.html');
    console.log(`  ${ctl('bundle', page, ...SMALL, '--seconds', '1').trim()}`);
    await firefox.open(`file://${page}`);
    const state = await firefox.until((now) => now.states > 61, 'the second round');
    assert.deepEqual([state.mode, state.codec, state.wrong, state.error], ['strands', 'step', 0, '']);
  },
}, { end: () => Promise.all([chromium.end(), firefox.end()]) }, server);
