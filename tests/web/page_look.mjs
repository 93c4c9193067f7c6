// What the page draws of a state beside what strandcast-view draws of it: by tiles the same pixels, by WebGL2 nearly so. The
// server's pictures by JPEG tiles are the same pixels in both.
//   node tests/web/page_look.mjs strandcast-server [FOLDER for pictures]
// Ends with 77 where there is no browser.
import { execFileSync } from 'node:child_process';
import path from 'node:path';
import { Browser, comeToStand, sleep } from './browser.mjs';
import { psnr, readPng } from './png.mjs';
import { begin, program, runAll, shots, work } from './served.mjs';

const LEAST_DB = 45;
const SIZE = { width: 640, height: 360 };
const BLOCKS = { width: 640, height: 384 }; // as the server draws it: sides are whole blocks
const { browser, server } = await begin(['--set', 'groom.procedural.strand_count=1000']);
const [viewProgram, ctlProgram] = ['strandcast-view', 'strandcast-ctl'].map((name) => path.join(path.dirname(program), name));
const address = `127.0.0.1:${server.port}`;

/** The page's picture, once it stands. */
async function shownBy(from, wishes, shows, size) {
  const tab = await from.open(`${server.url}#${wishes}`, size);
  await tab.until(async () => (await tab.evaluate('document.body.dataset.shows')) === shows, shows);
  await comeToStand(tab, 2000);
  await tab.evaluate('for (const card of document.querySelectorAll(".card, #warnings")) card.hidden = true');
  await sleep(200);
  const picture = readPng(await tab.screenshot(shots && path.join(shots, `${wishes.replaceAll('&', '_')}.png`)));
  await tab.close();
  return picture;
}
function viewed(options, size) {
  const file = path.join(work, 'view.png');
  execFileSync(viewProgram, ['--connect', address, '--headless', ...options, '--size', `${size.width}x${size.height}`,
    '--screenshot', file], { stdio: 'ignore' });
  return readPng(file);
}
function compare(expected, seen, least) {
  const alike = psnr(expected, seen);
  console.log(`  ${alike.toFixed(2)} dB, at least ${least}`);
  if (!(alike >= least)) throw new Error(`${alike} dB`);
}

await sleep(1000); // some hair has moved
execFileSync(ctlProgram, ['--connect', address, 'pause']);
const drawn = ['--mode', 'strands', '--codec', 'tangent', '--renderer', 'tiles', '--after-frames', '1'];
viewed(drawn, SIZE);
// Without readers not every step is published: the first one makes the server publish where it stands, and may itself
// have begun with a state from before.
const expected = viewed(drawn, SIZE);
const strands = (from, draw) => shownBy(from, `mode=strands&draw=${draw}&codec=tangent`, 'strands', SIZE);
await runAll({
  'by tiles it is the same bytes': async () => compare(expected, await strands(browser, 'tiles'), Infinity),
  'by WebGL2 on Mesa it is nearly so': async () => compare(expected, await strands(browser, 'gl'), LEAST_DB),
  async 'by WebGL2 on SwiftShader it is nearly so'() {
    const other = await Browser.start('swiftshader');
    try {
      compare(expected, await strands(other, 'gl'), LEAST_DB);
    } finally {
      await other.end();
    }
  },
  // The last one of those that a standing scene gets.
  'the server\'s tiles are the same bytes': async () => compare(viewed(['--mode', 'frames', '--pictures', 'tiles', '--seconds', '3'], BLOCKS),
    await shownBy(browser, 'mode=pictures&pictures=tiles', 'pictures', BLOCKS), Infinity),
}, browser, server);
