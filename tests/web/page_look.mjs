// What the page draws of a state beside what strandcast-view draws of it: by tiles the same pixels, by WebGL2 nearly so.
//   node tests/web/page_look.mjs strandcast-server strandcast-view strandcast-ctl [FOLDER for pictures]
// Ends with 77 where there is no browser.
import { execFileSync, spawn } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { Browser, findChromium, sleep } from './browser.mjs';
import { psnr, readPng } from './png.mjs';

const [serverProgram, viewProgram, ctlProgram, shots] = process.argv.slice(2);
if (!findChromium()) {
  console.log('skipped: needs a browser (chromium)');
  process.exit(77);
}
const LEAST_DB = 45;
const SIZE = { width: 640, height: 360 };
const work = shots ?? fs.mkdtempSync(path.join(os.tmpdir(), 'strandcast-look-'));
const portFile = path.join(work, 'port');
fs.rmSync(portFile, { force: true });
const server = spawn(serverProgram, ['--port', '0', '--port-file', portFile], { stdio: 'ignore' });
for (let i = 0; i < 600 && !(fs.existsSync(portFile) && fs.readFileSync(portFile, 'utf8').trim()); ++i) await sleep(50);
const address = `127.0.0.1:${fs.readFileSync(portFile, 'utf8').trim()}`;

/** The page's picture, once it stands. */
async function drawnBy(wish, device) {
  const browser = await Browser.start(device);
  try {
    const tab = await browser.open(`http://${address}/#mode=strands&draw=${wish}&codec=tangent`, SIZE);
    await tab.until(async () => (await tab.evaluate('document.body.dataset.shows')) === 'strands', 'strands');
    // Whole, and once more sharpened: no further picture comes.
    for (let before = -1, quiet = 0; quiet < 6; await sleep(500)) {
      const count = Number(await tab.evaluate('document.body.dataset.pictures ?? 0'));
      quiet = count > 0 && count === before ? quiet + 1 : 0;
      before = count;
    }
    await tab.evaluate('for (const card of document.querySelectorAll(".card, #warnings")) card.hidden = true');
    await sleep(200);
    return readPng(await tab.screenshot(shots && path.join(shots, `${wish}_${device}.png`)));
  } finally {
    await browser.end();
  }
}

try {
  await sleep(1000); // some hair has moved
  execFileSync(ctlProgram, ['--connect', address, 'pause']);
  const file = path.join(work, 'view.png');
  // Without readers not every step is published: the first one makes the server publish where it stands, and may itself
  // have begun with a state from before.
  for (let reader = 0; reader < 2; ++reader)
    execFileSync(viewProgram, ['--connect', address, '--headless', '--mode', 'strands', '--codec', 'tangent', '--renderer', 'tiles',
      '--size', `${SIZE.width}x${SIZE.height}`, '--after-frames', '1', '--screenshot', file], { stdio: 'ignore' });
  const expected = readPng(file);
  for (const [wish, device, least] of [['tiles', 'mesa', Infinity], ['gl', 'mesa', LEAST_DB], ['gl', 'swiftshader', LEAST_DB]]) {
    const alike = psnr(expected, await drawnBy(wish, device));
    console.log(`${alike >= least ? 'passed' : 'FAILED'}: ${wish} on ${device}: ${alike.toFixed(2)} dB, at least ${least}`);
    if (alike < least) process.exitCode = 1;
  }
} finally {
  server.kill();
  if (!shots) fs.rmSync(work, { recursive: true, force: true });
}
