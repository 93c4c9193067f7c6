// Bundles (strandcast-ctl bundle) in a browser, from their files: the states that were recorded, and the picture that a
// server's page shows of the same state.
//   node tests/web/page_bundle.mjs strandcast-server [FOLDER for screenshots]
// Ends with 77 where there is no browser; the exit status is 1 when any test fails.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import fs from 'node:fs';
import path from 'node:path';
import { comeToStand, sleep } from './browser.mjs';
import { psnr, readPng } from './png.mjs';
import { begin, program, runAll, shots, work } from './served.mjs';
import { SMALL } from './server.mjs';

const SIZE = { width: 320, height: 180 };
const LEAST_DB = 40;
const MOST_KB = 600; // of page and modules
const [KEYFRAME, DELTA] = [0x20, 0x21];
const HEADER_BYTES = 32;
const WINDY = [...SMALL, '--set', 'wind.mean_mps.x=6'];
const { browser, server } = await begin(WINDY.concat('--lockstep', '--record', path.join(work, 'run.mcap')));
const ctlProgram = path.join(path.dirname(program), 'strandcast-ctl');
const ctl = (...words) => execFileSync(ctlProgram, words, { encoding: 'utf8' });
const bundle = (name, ...words) => {
  const page = path.join(work, name);
  const said = ctl('bundle', ...words, page);
  console.log(`  ${said.trim()}`);
  const [frames, all, recording] = said.match(/: (\d+) frames.*; (\d+) kB, (\d+) kB/).slice(1).map(Number);
  assert.ok(all - recording <= MOST_KB, `page and modules: ${all - recording} kB`);
  return { page, frames };
};
const open = async (page) => {
  const tab = await browser.open(`file://${page}`, SIZE);
  await tab.until((now) => now.mode === 'strands', 'strands');
  return tab;
};
/** Without what lies over it, once it stands. */
async function picture(tab, name) {
  await comeToStand(tab, 600);
  await tab.evaluate('for (const card of document.querySelectorAll(".card, #warnings")) card.style.visibility = "hidden"');
  return readPng(await tab.screenshot(shots && path.join(shots, `${name}.png`)));
}
/** What the page says of a dropped file; that it stays. */
const drop = (tab, name) => tab.evaluate(`(() => {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File(['x'], '${name}'));
  const goes = (type) => dispatchEvent(new DragEvent(type, { dataTransfer, cancelable: true }));
  return [goes('dragover'), goes('drop'), document.getElementById('warnings').lastElementChild?.textContent];
})()`);
/** How many frames of the page are keyframes, and how many are exact. */
function kindsOf(page) {
  const tape = Buffer.from(fs.readFileSync(page, 'utf8').match(/ id="tape"[^>]*>([^<]*)/)[1], 'base64');
  const kinds = { keyframes: 0, exact: 0 };
  for (let at = 4; at < tape.length; at += 8 + tape.readUInt32LE(at + 4)) {
    kinds.keyframes += tape[at + 8] === KEYFRAME ? 1 : 0;
    kinds.exact += tape[at + 8] === DELTA && (tape[at + 8 + HEADER_BYTES] & 128) !== 0 ? 1 : 0;
  }
  return kinds;
}
/** Gives a delta of the page another hash. Returns how many frames stand before it. */
function damage(page, delta) {
  const html = fs.readFileSync(page, 'utf8');
  const [whole, head, text] = html.match(/(<script[^>]* id="tape"[^>]*>)([^<]*)/);
  const tape = Buffer.from(text, 'base64');
  let before = 0;
  let at = 4;
  for (let left = delta; tape[at + 8] !== DELTA || left-- > 0; at += 8 + tape.readUInt32LE(at + 4)) before += tape[at + 8] >= KEYFRAME ? 1 : 0;
  const isExact = (tape[at + 8 + HEADER_BYTES] & 128) !== 0;
  tape[at + 8 + HEADER_BYTES + (isExact ? 1 : 88)] ^= 1;
  fs.writeFileSync(page, html.replace(whole, () => head + tape.toString('base64')));
  return before;
}

await runAll({
  async 'the last state of a recording looks as on the page of the server that made it'() {
    ctl('--connect', `127.0.0.1:${server.port}`, 'step', '90');
    const served = await browser.open(`${server.url}#mode=strands&view-only`, SIZE);
    await served.until((now) => now.mode === 'strands', 'strands');
    assert.deepEqual(await drop(served, 'a.ply'), [false, false, 'a.ply is hair: strandcast-server --groom a.ply serves it.']);
    const expected = await picture(served, 'served');
    await served.close();
    await server.end();
    const tab = await open(bundle('run.html', path.join(work, 'run.mcap')).page);
    await tab.press(' ');
    await tab.press('End');
    const end = await tab.until((now) => now.timeMs === 1500 && now.codec, 'the end');
    const alike = psnr(expected, await picture(tab, 'bundle'));
    console.log(`  ${alike.toFixed(1)} dB, at least ${LEAST_DB}`);
    assert.ok(alike >= LEAST_DB, `${alike} dB`);
    assert.deepEqual([end.codec, end.wrong, end.error], ['step', 0, '']);
    assert.deepEqual(await drop(tab, 'a.txt'), [false, false, 'a.txt is neither hair nor motion.']);
    await tab.press('Home');
    await tab.until((now) => now.timeMs === 0, 'the begin');
    assert.ok(psnr(expected, await picture(tab, 'begin')) < LEAST_DB, 'another state looks otherwise');
    await tab.close();
  },
  async 'a scene plays from its file with the hash of every state, up to the one that was changed'() {
    const motion = path.join(work, 'turn.bvh');
    fs.writeFileSync(motion, ['HIERARCHY', 'ROOT Head', '{', 'OFFSET 0 0 0', 'CHANNELS 3 Zrotation Xrotation Yrotation', 'End Site', '{', 'OFFSET 0 18 0', '}', '}',
      'MOTION', 'Frames: 30', 'Frame Time: 0.033333', ...Array.from({ length: 30 }, (_, i) => `0 0 ${40 * Math.sin(i / 5)}`), ''].join('\n'));
    const { page, frames } = bundle('scene.html', ...SMALL, '--motion', motion, '--seconds', '1');
    assert.equal(frames, 61, 'every state has a frame');
    const { keyframes, exact } = kindsOf(page);
    assert.equal(keyframes, 2, 'at rest, and as soon as all can go on from one');
    assert.ok(exact >= 40, `${exact} exact frames`);
    const right = damage(page, 50);
    const tab = await open(page);
    const state = await tab.until((now) => now.wrong > 0, 'a refusal');
    assert.ok(state.states >= right, `${state.states} states, ${right} before the one that was changed`);
    assert.match(state.rejected, /announced|needs frame/);
    assert.deepEqual([state.codec, state.error, tab.errors], ['step', '', []]);
    assert.deepEqual(tab.requests.filter(({ url }) => !/^(file|blob|data):/.test(url)), [], 'nothing is asked of any server');
    await tab.close();
  },
  async 'Ctrl-C leaves neither a server nor its files'() {
    const folder = fs.mkdtempSync(path.join(work, 'tmp-'));
    const page = path.join(work, 'stopped.html');
    const child = spawn(ctlProgram, ['bundle', page, ...SMALL, '--seconds', '600'], { env: { ...process.env, TMPDIR: folder }, stdio: 'ignore' });
    const ended = new Promise((done) => child.once('exit', done));
    while (!fs.readdirSync(folder, { recursive: true }).some((name) => name.endsWith('scene.mcap'))) await sleep(20);
    await sleep(300); // steps are under way
    child.kill('SIGINT');
    assert.equal(await ended, 130);
    assert.deepEqual([fs.readdirSync(folder), fs.existsSync(page)], [[], false]);
  },
}, browser, server);
