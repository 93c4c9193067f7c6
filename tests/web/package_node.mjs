// connect() of the npm package in Node, installed as its tar file, beside clients that were written by the words of
// proto/WIRE.md alone.
//   node tests/web/package_node.mjs strandcast-server strandcast-<version>.tgz
// A line per test; the exit status is 1 when any fails.
import { execFileSync, spawn, spawnSync } from 'node:child_process';
import assert from 'node:assert/strict';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';
import zlib from 'node:zlib';
import { NodeSocket } from './node_socket.mjs';
import { HAIR, Link, Server, SMALL } from './server.mjs';

const MOST_BYTES = 60_000; // of scripts, by gzip, without the modules
const [program, tar] = process.argv.slice(2);
const here = path.dirname(fileURLToPath(import.meta.url));
const work = fs.mkdtempSync(path.join(os.tmpdir(), 'strandcast-package-'));
const installed = path.join(work, 'node_modules', 'strandcast');

/** As a project has it, by npm where there is one. */
function install() {
  fs.writeFileSync(path.join(work, 'package.json'), '{"type": "module"}');
  const npm = spawnSync('npm', ['install', '--offline', '--no-audit', '--no-fund', path.resolve(tar)], { cwd: work, encoding: 'utf8' });
  if (npm.status === 0) return 'npm';
  fs.mkdirSync(installed, { recursive: true });
  execFileSync('tar', ['-xzf', path.resolve(tar), '--strip-components=1', '-C', installed]);
  return 'tar';
}

const Socket = globalThis.WebSocket ?? NodeSocket;
let connect, headOf;
const open = (server, options = {}) => connect(server.url, { WebSocket: Socket, ...options });
const until = async (condition, what, ms = 20_000) => {
  for (const end = Date.now() + ms; Date.now() < end; await new Promise((done) => setTimeout(done, 20)))
    if (await condition()) return;
  throw new Error(`${what}: not within ${ms} ms`);
};
/** The same socket; see(bytes) gets each message before it is taken. */
const socketThat = (see) => class extends Socket {
  set onmessage(take) {
    this.taken = take;
    const seen = (event) => {
      see(new Uint8Array(event.data));
      take(event);
    };
    if (Socket === NodeSocket) Object.defineProperty(this, 'onmessage', { value: seen, writable: true });
    else super.onmessage = seen;
  }
  get onmessage() {
    return this.taken;
  }
};
/** So many states. */
async function take(connection, count) {
  const states = [];
  for await (const state of connection) if (states.push(state) === count) break;
  return states;
}

/** Where a vertex is in the world: Hamilton's product, written out. */
function inWorld({ positions, strandCount, pose }, strand, vertex) {
  const p = positions.subarray(3 * (vertex * strandCount + strand)).subarray(0, 3);
  const [w, x, y, z] = pose.rotation;
  const rows = [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
  return rows.map((row, i) => pose.position[i] + row[0] * p[0] + row[1] * p[1] + row[2] * p[2]);
}

let server;
const tests = {
  async 'scripts are small, and all that the package names is in it'() {
    const { exports: entries } = JSON.parse(fs.readFileSync(path.join(installed, 'package.json'), 'utf8'));
    const named = Object.values(entries).flatMap((entry) => (typeof entry === 'string' ? [entry] : Object.values(entry)));
    for (const name of named) assert.ok(name.includes('*') || fs.existsSync(path.join(installed, name)), name);
    const scripts = fs.readdirSync(installed).filter((name) => name.endsWith('.js'));
    const bytes = scripts.reduce((all, name) => all + zlib.gzipSync(fs.readFileSync(path.join(installed, name)), { level: 9 }).length, 0);
    console.log(`  ${bytes} bytes by gzip, at most ${MOST_BYTES}`);
    assert.ok(bytes > 10_000 && bytes <= MOST_BYTES);
  },
  async 'states are those that another client decodes, and lie where it says'() {
    const raw = await Server.start(program, [...SMALL, '--set', 'stream.codec=raw']);
    const connection = open(raw, { codec: 'raw' });
    const states = new Map();
    connection.on('state', (state) => states.set(state.tick, state));
    const other = spawn(process.execPath, [path.join(here, '../../examples/javascript/join.mjs'), '127.0.0.1', String(raw.port), '60']);
    let words = '';
    other.stdout.on('data', (text) => (words += text));
    await new Promise((done) => other.once('exit', done));
    connection.close();
    await raw.end();
    let both = 0;
    for (const [, tick, at, hash] of words.matchAll(/tick (\d+): tip of strand 0 at (.*) m, state (\w+)/g)) {
      const state = states.get(Number(tick));
      if (!state) continue;
      ++both;
      assert.equal(state.hash, hash, `tick ${tick}`);
      const tip = inWorld(state, 0, state.vertexCount - 1);
      at.split(' ').forEach((x, axis) => assert.ok(Math.abs(Number(x) - tip[axis]) < 1e-4, `tick ${tick}: ${tip} instead of ${at}`));
    }
    assert.ok(both >= 20, `${both} states in common: ${words.slice(0, 200)}`);
  },
  async 'states come in order, whole, and stop with the loop'() {
    const connection = open(server);
    const welcome = await connection.opened;
    const states = await take(connection, 10);
    assert.deepEqual([welcome.strandCount, welcome.vertexCount, welcome.role], [HAIR.strands, HAIR.vertices, 'controller']);
    states.forEach((state, i) => {
      assert.equal(state.positions.length, 3 * HAIR.strands * HAIR.vertices);
      assert.match(state.hash, /^[0-9a-f]{16}$/);
      assert.ok(i === 0 || state.tick >= states[i - 1].tick, `ticks ${states.map(({ tick, hash }) => `${tick} ${hash}`)}`);
    });
    assert.ok(connection.asset.byteLength > 0 && connection.look.methods);
    connection.close();
    assert.deepEqual(await take(connection, 1), []);
  },
  async 'the built-in head is made as the server made it'() {
    const connection = open(server);
    await take(connection, 1);
    const asset = connection.asset.slice(0);
    connection.close();
    assert.equal(new Uint8Array(asset)[0], 3, 'the layout that has the form alone');
    const head = await headOf(asset); // refuses a mesh of another hash
    assert.deepEqual([head.positions.length, head.triangles.length], [3 * 15_548, 3 * 31_092]);
    new Uint8Array(asset)[asset.byteLength - 93] ^= 1; // of its size
    await assert.rejects(headOf(asset), /head/);
    const kept = fs.readFileSync(path.join(here, '../conformance/vectors/asset_3.txt'), 'utf8').trim().split('\n');
    for (const line of kept) await headOf(Uint8Array.from(Buffer.from(line.split(' ')[2], 'hex')).buffer); // fitted
    assert.equal(kept.length, 2);
  },
  async 'exact frames are states like others'() {
    // A head that stands still: soon every vertex is where the steps lead.
    let exact = 0;
    const Counting = socketThat((bytes) => (exact += bytes[0] === 0x21 && bytes[32] >= 128 ? 1 : 0));
    const links = [];
    const connection = open(server, { WebSocket: Counting, codec: 'step' });
    connection.on('link', ({ state, reason }) => links.push(state === 'waiting' ? reason : ''));
    await until(() => exact >= 5 || links.some(Boolean), 'exact frames');
    assert.match((await take(connection, 1))[0].hash, /^[0-9a-f]{16}$/);
    assert.deepEqual(links.filter(Boolean), []);
    connection.close();
  },
  async 'a frame that was changed on its way is no state'() {
    // The same socket with a bit of every frame turned over after the first few: without that, frames go on (above).
    let frames = 0;
    const Turning = socketThat((bytes) => {
      if (bytes[0] >= 0x20 && bytes[0] < 0x30 && ++frames > 3) bytes[bytes.length - 1] ^= 1;
    });
    const connection = open(server, { WebSocket: Turning });
    let states = 0;
    connection.on('state', () => ++states);
    await until(() => frames > 30, 'frames');
    connection.close();
    assert.ok(states >= 1 && states <= 3, `${states} states of ${frames} frames`);
  },
  async 'who may steer does, who watches may not'() {
    const connection = open(server);
    await connection.opened;
    let isPaused;
    connection.on('status', (status) => (isPaused = status.isPaused));
    connection.pause();
    await until(() => isPaused === true, 'the pause');
    connection.resume();
    await until(() => isPaused === false, 'the end of it');
    connection.set('look.hair_color', 'red');
    await until(() => connection.look?.hair_color === 'red', 'the colour');
    const watching = open(server, { role: 'viewer' });
    assert.throws(() => watching.pause(), /not connected/);
    assert.equal((await watching.opened).role, 'viewer');
    assert.throws(() => watching.pause(), /watch only/);
    watching.close();
    connection.close();
  },
  async 'beside a silent link another is tried, which takes its place unless the first one speaks'() {
    const link = await Link.start(server);
    const connection = open(link);
    const words = [];
    connection.on('link', ({ state }) => words.push(state));
    let welcomes = 0;
    connection.on('welcome', () => ++welcomes);
    await take(connection, 2);
    link.holdsNew = true;
    link.fallSilent();
    await until(() => link.connections.length === 2, 'another', 12_000); // ReconnectPolicy.ThePageHasTheSameNumbers: 15 s otherwise
    link.speak(1);
    await take(connection, 2);
    link.speak(2); // which lets nobody in any more
    await take(connection, 20);
    assert.equal(welcomes, 1);
    link.holdsNew = false;
    const since = Date.now();
    link.fallSilent();
    await until(() => welcomes === 2, 'one more', 12_000);
    console.log(`  after ${Date.now() - since} ms`);
    await take(connection, 2);
    assert.ok(!words.includes('waiting'), words.join());
    connection.close();
    link.end();
  },
  async 'a lost server is found again, an ended session says why'() {
    const mortal = await Server.start(program, SMALL);
    const connection = open(mortal);
    const links = [];
    connection.on('link', ({ state }) => links.push(state));
    await take(connection, 2);
    await mortal.end();
    await until(() => links.includes('waiting'), 'the loss');
    const again = await Server.start(program, SMALL, mortal.port);
    const begin = links.length;
    await take(connection, 2);
    assert.ok(links.slice(begin).includes('open') || connection.link.state === 'open');
    connection.close();
    await again.end();
    const file = path.join(work, 'tokens');
    fs.writeFileSync(file, 'viewer right-0123456789abcdef\n', { mode: 0o600 });
    const strict = await Server.start(program, [...SMALL, '--token-file', file, '--distrust-loopback']);
    await assert.rejects(open(strict, { token: 'wrong-0123456789abcdef' }).opened, /token/);
    await assert.rejects(take(open(strict), 1), /token/);
    await assert.rejects(open(strict, { token: 'x'.repeat(257) }).opened, /longer than 256 bytes/);
    const right = open(strict, { token: 'right-0123456789abcdef' });
    assert.equal((await right.opened).role, 'viewer');
    right.close();
    await strict.end();
    assert.throws(() => open({ url: 'ftp://127.0.0.1/' }), /no address of a server/);
  },
};

let failed = 0;
try {
  console.log(`installed by ${install()}`);
  ({ connect, headOf } = await import(pathToFileURL(path.join(installed, 'node.js'))));
  server = await Server.start(program, SMALL);
  for (const [name, test] of Object.entries(tests)) {
    const begin = Date.now();
    await test().then(() => console.log(`passed: ${name} (${((Date.now() - begin) / 1000).toFixed(1)} s)`),
      (error) => (++failed, console.log(`FAILED: ${name}: ${error.stack}`)));
  }
} finally {
  await server?.end();
  fs.rmSync(work, { recursive: true, force: true });
}
process.exitCode = failed ? 1 : 0;
setTimeout(() => {
  console.log(`FAILED: closed connections keep Node awake by ${process.getActiveResourcesInfo()}`);
  process.exit(1);
}, 5_000).unref();
