// What tests of a page in a browser begin with: a server of the page, a browser, and a line per test.
//   node TEST.mjs strandcast-server [FOLDER for screenshots]
// Ends with 77 where there is no browser; the exit status is 1 when any test fails.
import { spawn } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { Browser, sleep, whyNoBrowser } from './browser.mjs';

export const [program, shots] = process.argv.slice(2);
export const SMALL = ['--set', 'groom.procedural.strand_count=400', '--set', 'groom.procedural.vertex_count=12'];
if (!program) {
  console.error(`usage: node ${path.basename(process.argv[1])} strandcast-server [FOLDER]`);
  process.exit(2);
}
export const work = fs.mkdtempSync(path.join(os.tmpdir(), 'strandcast-page-'));

export class Server {
  static async start(options = [], port = 0) {
    const server = new Server();
    server.log = '';
    const portFile = path.join(work, `port${Math.random()}`);
    server.child = spawn(program, ['--port', String(port), '--port-file', portFile, ...options], { stdio: ['ignore', 'ignore', 'pipe'] });
    server.child.stderr.setEncoding('utf8').on('data', (text) => (server.log += text));
    for (let i = 0; i < 600 && !(fs.existsSync(portFile) && fs.readFileSync(portFile, 'utf8').trim()); ++i) {
      if (server.child.exitCode !== null) throw new Error(server.log);
      await sleep(50);
    }
    if (!fs.existsSync(portFile)) {
      server.child.kill('SIGKILL');
      throw new Error(`the server did not start in time: ${server.log}`);
    }
    server.port = Number(fs.readFileSync(portFile, 'utf8'));
    server.url = `http://127.0.0.1:${server.port}/`;
    return server;
  }
  async end() {
    if (this.child.exitCode !== null || this.child.signalCode !== null) return;
    this.child.kill('SIGTERM');
    await new Promise((done) => this.child.once('exit', done));
  }
}

/** A browser, and a server of little hair. */
export async function begin() {
  const missing = whyNoBrowser();
  if (missing) {
    console.log(`skipped: ${missing}`);
    process.exit(77);
  }
  if (shots) fs.mkdirSync(shots, { recursive: true });
  const browser = await Browser.start();
  try {
    return { browser, server: await Server.start(SMALL) };
  } catch (error) {
    await browser.end();
    throw error;
  }
}

/** Those whose name has STRANDCAST_TEST in it, and the end of all. */
export async function runAll(all, browser, server) {
  const tests = Object.entries(all).filter(([name]) => name.includes(process.env.STRANDCAST_TEST ?? ''));
  let failed = 0;
  for (const [name, test] of tests) {
    const since = Date.now();
    try {
      await test();
      console.log(`passed: ${name} (${((Date.now() - since) / 1000).toFixed(1)} s)`);
    } catch (error) {
      ++failed;
      console.log(`FAILED: ${name}: ${error.stack}`);
    }
  }
  await browser.end();
  await server.end();
  fs.rmSync(work, { recursive: true, force: true });
  console.log(`${tests.length - failed} of ${tests.length} passed`);
  process.exit(failed ? 1 : 0);
}
