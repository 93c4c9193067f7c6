// What the page draws of a state beside what strandcast-view draws of it: by tiles the same pixels, by WebGL2 nearly so. The
// server's pictures by JPEG tiles are the same pixels in both.
//   node tests/web/page_look.mjs strandcast-server strandcast-view strandcast-ctl [FOLDER for pictures]
// Ends with 77 where there is no browser.
import { execFileSync, spawn } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { Browser, sleep, whyNoBrowser } from './browser.mjs';
import { psnr, readPng } from './png.mjs';

const [serverProgram, viewProgram, ctlProgram, shots] = process.argv.slice(2);
const missing = whyNoBrowser();
if (missing) {
  console.log(`skipped: ${missing}`);
  process.exit(77);
}
const LEAST_DB = 45;
const SIZE = { width: 640, height: 360 };
const BLOCKS = { width: 640, height: 384 }; // as the server draws it: sides are whole blocks
const work = shots ?? fs.mkdtempSync(path.join(os.tmpdir(), 'strandcast-look-'));
const portFile = path.join(work, 'port');
fs.rmSync(portFile, { force: true });
const server = spawn(serverProgram, ['--port', '0', '--port-file', portFile], { stdio: 'ignore' });
for (let i = 0; i < 600 && !(fs.existsSync(portFile) && fs.readFileSync(portFile, 'utf8').trim()); ++i) await sleep(50);
const address = `127.0.0.1:${fs.readFileSync(portFile, 'utf8').trim()}`;

/** The page's picture, once it stands. */
async function shownBy(wishes, shows, device, size) {
  const browser = await Browser.start(device);
  try {
    const tab = await browser.open(`http://${address}/#${wishes}`, size);
    await tab.until(async () => (await tab.evaluate('document.body.dataset.shows')) === shows, shows);
    // Whole, and once more sharpened: no further picture comes.
    for (let before = -1, quiet = 0; quiet < 6; await sleep(500)) {
      const count = Number(await tab.evaluate('document.body.dataset.pictures ?? 0'));
      quiet = count > 0 && count === before ? quiet + 1 : 0;
      before = count;
    }
    await tab.evaluate('for (const card of document.querySelectorAll(".card, #warnings")) card.hidden = true');
    await sleep(200);
    return readPng(await tab.screenshot(shots && path.join(shots, `${wishes.replaceAll('&', '_')}_${device}.png`)));
  } finally {
    await browser.end();
  }
}

function viewed(options, size) {
  const file = path.join(work, 'view.png');
  execFileSync(viewProgram, ['--connect', address, '--headless', ...options, '--size', `${size.width}x${size.height}`,
    '--screenshot', file], { stdio: 'ignore' });
  return readPng(file);
}
function compare(name, expected, seen, least) {
  const alike = psnr(expected, seen);
  console.log(`${alike >= least ? 'passed' : 'FAILED'}: ${name}: ${alike.toFixed(2)} dB, at least ${least}`);
  if (!(alike >= least)) process.exitCode = 1;
}

try {
  await sleep(1000); // some hair has moved
  execFileSync(ctlProgram, ['--connect', address, 'pause']);
  const drawn = ['--mode', 'strands', '--codec', 'tangent', '--renderer', 'tiles', '--after-frames', '1'];
  viewed(drawn, SIZE);
  // Without readers not every step is published: the first one makes the server publish where it stands, and may itself
  // have begun with a state from before.
  const expected = viewed(drawn, SIZE);
  for (const [wish, device, least] of [['tiles', 'mesa', Infinity], ['gl', 'mesa', LEAST_DB], ['gl', 'swiftshader', LEAST_DB]])
    compare(`${wish} on ${device}`, expected, await shownBy(`mode=strands&draw=${wish}&codec=tangent`, 'strands', device, SIZE), least);
  // The last one of those that a standing scene gets.
  const picture = viewed(['--mode', 'frames', '--pictures', 'tiles', '--seconds', '3'], BLOCKS);
  compare('the server\'s tiles', picture, await shownBy('mode=pictures&pictures=tiles', 'pictures', 'mesa', BLOCKS), Infinity);
} finally {
  server.kill();
  if (!shots) fs.rmSync(work, { recursive: true, force: true });
}
