// What the page asks of link, browser and processor, of one run; tests/bench/page.sh calls it.
//   node tests/bench/page.mjs strandcast-server strandcast-view strandcast-ctl
// Prints requests and bytes, navigation to the first picture, what the server's pictures take to decode, and WebGL2 beside
// the desktop's OpenGL on the same state. Times of a machine that does other things too are upper bounds: each is the
// least of its tries.
import { execFileSync, spawn } from 'node:child_process';
import fs from 'node:fs';
import http from 'node:http';
import os from 'node:os';
import path from 'node:path';
import { Browser, sleep, whyNoBrowser } from '../web/browser.mjs';

const [serverProgram, viewProgram, ctlProgram] = process.argv.slice(2);
if (!ctlProgram || whyNoBrowser()) {
  console.error('usage: node page.mjs strandcast-server strandcast-view strandcast-ctl (needs chromium)');
  process.exit(2);
}
const TRIES = 5;
const SIZE = { width: 640, height: 360 };
const work = fs.mkdtempSync(path.join(os.tmpdir(), 'strandcast-page-bench-'));
const portFile = path.join(work, 'port');
const server = spawn(serverProgram, ['--port', '0', '--port-file', portFile], { stdio: 'ignore' });
for (let i = 0; i < 600 && !(fs.existsSync(portFile) && fs.readFileSync(portFile, 'utf8').trim()); ++i) await sleep(50);
const address = `127.0.0.1:${fs.readFileSync(portFile, 'utf8').trim()}`;

const get = (name, coding) => new Promise((done, fail) => {
  http.get(`http://${address}/${name}`, { headers: { 'accept-encoding': coding }, agent: false }, (answer) => {
    const parts = [];
    answer.on('data', (part) => parts.push(part)).on('end', () => done(Buffer.concat(parts)));
  }).on('error', fail);
});

async function printFiles(browser) {
  const tab = await browser.open(`http://${address}/#mode=strands`, { ...SIZE, seesWorkers: true });
  await tab.until((now) => now.codec === 'step' && now.states > 10, 'strands by steps');
  const begunMs = await tab.evaluate('performance.timeOrigin + performance.getEntriesByName("first picture")[0].startTime');
  const asked = tab.requests.filter((one) => one.url.startsWith('http'));
  await tab.close();
  for (const [what, isWanted] of [['with hair on the screen (at most 4, at most 180 kB)', (one) => 1e3 * one.at < begunMs],
                                  ['behind that', (one) => 1e3 * one.at >= begunMs]]) {
    const files = [...new Set(asked.filter(isWanted).map((one) => new URL(one.url).pathname.slice(1)))];
    let [gzip, brotli] = [0, 0];
    for (const file of files) {
      gzip += (await get(file, 'gzip')).length;
      brotli += (await get(file, 'br')).length;
    }
    console.log(`requests ${what}: ${files.length}, ${(gzip / 1e3).toFixed(1)} kB by gzip, ${(brotli / 1e3).toFixed(1)} by Brotli`);
  }
}

/** Milliseconds from navigation, nothing cached. */
async function firstMs(browser, mode) {
  let least = Infinity;
  for (let i = 0; i < TRIES; ++i) {
    const tab = await browser.open('about:blank', SIZE);
    await tab.send('Network.setCacheDisabled', { cacheDisabled: true });
    await tab.go(`http://${address}/#mode=${mode}`);
    await tab.until(async () => (await tab.evaluate('performance.getEntriesByName("first picture").length')) > 0, 'a picture');
    least = Math.min(least, await tab.evaluate('performance.getEntriesByName("first picture")[0].startTime'));
    await tab.close();
    await sleep(200);
  }
  return least;
}

async function printFirst(browser) {
  const strands = await firstMs(browser, 'strands');
  const pictures = await firstMs(browser, 'pictures');
  console.log(`navigation to the first picture: strands ${strands.toFixed(0)} ms (at most 1500), pictures ${pictures.toFixed(0)} ms (at most 800)`);
}

async function printPictures(browser) {
  for (const codec of ['vp8', 'h264', 'tiles']) {
    const tab = await browser.open(`http://${address}/#mode=pictures&pictures=${codec}`, SIZE);
    const now = await tab.until((state) => state.mode === 'pictures' && state.states > 60, 'pictures');
    console.log(`pictures by ${codec}: ${now.hz.toFixed(1)} Hz, decoded in ${now.decodeMs.toFixed(1)} ms (at most 5)`);
    await tab.close();
  }
}

async function printGl() {
  const report = path.join(work, 'report.txt');
  const renderMs = () => {
    execFileSync(viewProgram, ['--connect', address, '--headless', '--mode', 'strands', '--codec', 'tangent', '--renderer', 'gl',
      '--size', `${SIZE.width}x${SIZE.height}`, '--seconds', '6', '--clip', path.join(work, 'clip.webp'), // without one it draws nothing
      '--clip-size', `${SIZE.width}x${SIZE.height}`, '--report', report], { stdio: 'ignore' });
    return Number(/^render_ms_median=(.*)$/m.exec(fs.readFileSync(report, 'utf8'))[1]);
  };
  const ctl = (...words) => execFileSync(ctlProgram, ['--connect', address, ...words]);
  const tiles = Math.min(renderMs(), renderMs());
  // A look that names its method is drawn by quads, as the page draws; both have as many segments.
  ctl('set', 'look.methods.transparency=hashed');
  const quads = Math.min(renderMs(), renderMs());
  ctl('set', 'look.methods.transparency=main');
  ctl('pause');
  const browser = await Browser.start('mesa');
  const tab = await browser.open(`http://${address}/#mode=strands&draw=gl&codec=tangent`, SIZE);
  await tab.until((now) => now.wholeMs > 0, 'a whole picture');
  await tab.evaluate('document.getElementById("stage").focus()');
  for (let i = 0; i < 2 * TRIES; ++i) {
    await tab.press('ArrowLeft');
    await sleep(1500);
  }
  const { wholeMs } = await tab.state();
  await browser.end();
  console.log(`WebGL2 on llvmpipe, ${SIZE.width}x${SIZE.height}: ${wholeMs.toFixed(0)} ms; the desktop's OpenGL by quads ${quads.toFixed(0)} ms: ` +
    `${(wholeMs / quads).toFixed(2)}x (at most 1.5); by compute kernels ${tiles.toFixed(0)} ms: ${(wholeMs / tiles).toFixed(2)}x`);
}

const browser = await Browser.start();
try {
  await printFiles(browser);
  await printFirst(browser);
  await printPictures(browser);
  await browser.end();
  await printGl();
} finally {
  server.kill();
  await browser.end().catch(() => {});
  fs.rmSync(work, { recursive: true, force: true });
}
