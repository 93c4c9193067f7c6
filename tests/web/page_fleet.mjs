// The page of a session that is behind a path of a proxy (deploy/fleet): a real HAProxy and a Slurm that is none before real
// servers and relays. Joins a session and a relay, switches the mode, turns the camera, and goes on when the relay is killed.
//   node tests/web/page_fleet.mjs SOURCE BIN [FOLDER for screenshots]
// Ends with 77 where browser, HAProxy or Python is missing; a line per test; the exit status is 1 when any fails.
import { execFile, spawn } from 'node:child_process';
import assert from 'node:assert/strict';
import fs from 'node:fs';
import net from 'node:net';
import os from 'node:os';
import path from 'node:path';
import { Browser, sleep } from './browser.mjs';

const [source, programs, shots] = process.argv.slice(2);
if (!programs) {
  console.error('usage: node page_fleet.mjs SOURCE BIN [FOLDER]');
  process.exit(2);
}
const folders = [...(process.env.PATH ?? '').split(':'), '/usr/sbin'];
const find = (name) => folders.map((folder) => path.join(folder, name)).find((file) => fs.existsSync(file));
const missing = ['haproxy', 'python3'].filter((name) => !find(name)).map((name) => `needs ${name}`)[0];
if (missing) {
  console.log(`skipped: ${missing}`);
  process.exit(77);
}

const browser = await Browser.startOrSkip();
const work = fs.mkdtempSync(path.join(os.tmpdir(), 'strandcast-page-fleet-'));
const env = {
  ...process.env, STRANDCAST_FLEET: path.join(work, 'fleet'), FAKE_SLURM: path.join(work, 'slurm'), FAKE_GPUS: '1',
  PATH: `${source}/tests/fleet/slurm:${process.env.PATH}`,
};
const SMALL = ['--set', 'groom.procedural.strand_count=150', '--set', 'groom.procedural.vertex_count=12', '--sim-device', 'lanes'];
const LITTLE = { width: 320, height: 180 };
const MOST_AWAY_S = 2;
const RELAYS = 2;
const started = [];

function begin(program, words, log) {
  const to = fs.openSync(path.join(work, log), 'w');
  const child = spawn(program, words, { env, stdio: ['ignore', to, to] });
  fs.closeSync(to);
  started.push(child);
}
function fleet(...words) {
  return new Promise((done, fail) => {
    execFile('python3', ['-B', path.join(source, 'deploy/fleet/strandcast-fleet'), ...words], { env, timeout: 60_000 },
      (error, out, said) => (error ? fail(new Error(`${words[0]}: ${out}${said}`)) : done(out)));
  });
}
async function until(isSo, what) {
  for (let i = 0; i < 150; ++i, await sleep(200)) if (await isSo()) return;
  const logs = ['tend.log', 'haproxy.log'].map((name) => fs.readFileSync(path.join(work, name), 'utf8').slice(-1000));
  throw new Error(`it does not come to this: ${what}; ${logs.join(' | ')}`);
}
function freePort() {
  return new Promise((done) => {
    const probe = net.createServer().listen(0, '127.0.0.1', () => {
      const { port } = probe.address();
      probe.close(() => done(port));
    });
  });
}
/** HAProxy's own count of connections: what serves this session -> how many. */
function served() {
  return new Promise((done, fail) => {
    let said = '';
    net.connect(path.join(work, 'socket')).on('connect', function () { this.write('show stat\n'); }).on('error', fail)
      .on('data', (part) => (said += part)).on('end', () => {
        const rows = said.split('\n').map((line) => line.split(','));
        done(new Map(rows.filter((row) => row[0].startsWith('slot') && row[1] !== 'BACKEND' && row[17]?.startsWith('UP'))
          .map((row) => [row[1], Number(row[4])])));
      });
  });
}
const relaysUp = async () => [...(await served())].filter(([name]) => name.startsWith('relay')).length;
/** With all that runs in it. */
function killJob(folder) {
  const job = fs.readFileSync(path.join(folder, 'job'), 'utf8').trim();
  process.kill(-Number(fs.readFileSync(path.join(work, 'slurm', job, 'pid'), 'utf8')), 'SIGKILL');
}

let port;
let token;
const link = (words) => `http://127.0.0.1:${port}/s/anna/#token=${token}&${words}`;

/** Strands, then the server's pictures, both turned by the mouse. */
async function walkAround(tab, name) {
  const strands = await tab.until((now) => now.mode === 'strands' && now.states > 10 && now.hz > 0, 'strands');
  assert.equal(strands.hash_ok, true, `refused: ${strands.rejected}`);
  const turn = async (before) => {
    await tab.drag([240, 100], [300, 110]);
    return tab.until((now) => String(now.camera) !== String(before.camera), 'another camera');
  };
  const turned = await turn(strands);
  if (shots) await tab.screenshot(path.join(shots, `${name}_strands.png`));
  await tab.evaluate('document.getElementById("stage").focus()');
  await tab.press('m');
  const pictures = await tab.until((now) => now.mode === 'pictures' && now.pictures > turned.pictures + 5, 'pictures');
  await turn(pictures);
  if (shots) await tab.screenshot(path.join(shots, `${name}_pictures.png`));
  assert.deepEqual(tab.errors, []);
  for (const one of tab.requests) assert.ok(new URL(one.url).pathname.startsWith('/s/anna'), one.url);
  await tab.evaluate('document.getElementById("stage").focus()');
  for (const _ of [0, 1]) await tab.press('m'); // auto, strands
  await tab.until((now) => now.mode === 'strands' && now.hz > 0, 'strands again');
}

/** Kills a relay, and gives how long the page's strands stood still, and what it said meanwhile. */
async function lose(tab, folder) {
  await tab.evaluate(`(() => {
    window.said = [];
    new MutationObserver(() => {
      const { connection, pictures } = document.body.dataset;
      window.said.push([performance.timeOrigin + performance.now(), connection, Number(pictures),
        document.getElementById('trouble').hidden ? '' : document.getElementById('trouble').innerText]);
    }).observe(document.body, { attributes: true, attributeFilter: ['data-connection', 'data-pictures'] });
  })()`);
  const killed = Date.now();
  killJob(folder);
  let moved;
  await until(async () => {
    const said = await tab.evaluate('window.said');
    const lost = said.findIndex(([, connection]) => connection !== 'open');
    const back = lost < 0 ? -1 : said.findIndex(([, connection], i) => i > lost && connection === 'open');
    // The picture under way when it came back shows what was there before.
    const seen = back < 0 ? [] : said.slice(back).filter(([, , pictures]) => pictures > said[back][2] + 1);
    if (seen.length) moved = { seconds: (seen[0][0] - killed) / 1000, words: said.find(([, , , words]) => words)?.[3] ?? '', noticed: (said[lost][0] - killed) / 1000 };
    return moved !== undefined;
  }, 'strands move again');
  return moved;
}

const all = {
  async 'the page of a session behind a path'() {
    // Whoever leaves the slash out is led to it.
    const tab = await browser.open(link('mode=strands').replace('/#', '#'), LITTLE);
    await walkAround(tab, 'session');
    await tab.close();
  },
  async 'the page of a relay behind a path, which is killed'() {
    // As many relays as the session wishes for; viewers are led to them alone.
    const wish = path.join(work, 'fleet/sessions/anna/session.json');
    fs.writeFileSync(wish, JSON.stringify({ ...JSON.parse(fs.readFileSync(wish)), relays: RELAYS }));
    await until(async () => (await relaysUp()) === RELAYS, 'relays');
    const tab = await browser.open(link('mode=strands'), LITTLE);
    await walkAround(tab, 'relay');
    for (const others of ['another relay', 'whatever is left']) {
      const [[relay]] = [...(await served())].filter(([name, count]) => name.startsWith('relay') && count > 0);
      const { seconds, noticed, words } = await lose(tab, path.join(work, 'fleet/sessions/anna/relays', relay.slice(5)));
      console.log(`  ${relay} was killed: noticed after ${noticed.toFixed(2)} s, by ${others} strands move after ${seconds.toFixed(2)} s ` +
        `(wanted: at most ${MOST_AWAY_S}); the page said: ${words.replaceAll('\n', ' ') || 'nothing'}`);
      const state = await tab.until((now) => now.isConnected && now.mode === 'strands' && now.hash_ok && now.hz > 0, 'strands');
      assert.equal(state.error, '');
    }
    await tab.close();
  },
};

let failed = 0;
try {
  for (const folder of ['fleet', 'slurm', ...(shots ? [path.relative(work, shots)] : [])]) fs.mkdirSync(path.join(work, folder), { recursive: true });
  port = await freePort();
  fs.writeFileSync(path.join(work, 'fleet/fleet.json'), JSON.stringify({
    haproxy_socket: path.join(work, 'socket'), haproxy_bind: `127.0.0.1:${port}`, public: `ws://127.0.0.1:${port}`,
    listen: '127.0.0.1', server: path.join(programs, 'strandcast-server'), slots: 1, tend_s: 0.5,
  }));
  fs.writeFileSync(path.join(work, 'haproxy.cfg'), await fleet('proxy-config'));
  begin(find('haproxy'), ['-db', '-f', path.join(work, 'haproxy.cfg')], 'haproxy.log');
  begin('python3', ['-B', path.join(source, 'deploy/fleet/strandcast-fleet'), 'tend'], 'tend.log');
  await until(() => fs.existsSync(path.join(work, 'socket')) && fs.readFileSync(path.join(work, 'tend.log'), 'utf8').includes('tending'), 'HAProxy and who tends');
  await fleet('start', 'anna', '--', ...SMALL);
  token = fs.readFileSync(path.join(work, 'fleet/sessions/anna/viewer_token'), 'utf8');
  for (const [name, test] of Object.entries(all)) {
    const since = Date.now();
    try {
      await test();
      console.log(`passed: ${name} (${((Date.now() - since) / 1000).toFixed(1)} s)`);
    } catch (error) {
      ++failed;
      console.log(`FAILED: ${name}: ${error.stack}`);
    }
  }
} finally {
  await browser.end();
  // Who tends first, so that nothing is started any more.
  await Promise.all(started.map((child) => child.exitCode ?? child.signalCode ?? new Promise((done) => child.once('exit', done).kill('SIGKILL'))));
  await fleet('stop', 'anna').catch(() => {});
  for (const job of fs.readdirSync(path.join(work, 'slurm'))) {
    try {
      process.kill(-Number(fs.readFileSync(path.join(work, 'slurm', job, 'pid'), 'utf8')), 'SIGKILL');
    } catch { /* it has ended, or is no job */ }
  }
  fs.rmSync(work, { recursive: true, force: true, maxRetries: 20, retryDelay: 100 });
}
process.exit(failed ? 1 : 0);
