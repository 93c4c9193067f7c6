// What tests of a page in a browser begin with: a server of the page, a browser, and a line per test.
//   node TEST.mjs strandcast-server [FOLDER for screenshots]
// Ends with 77 where there is no browser; the exit status is 1 when any test fails.
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { Browser, whyNoBrowser } from './browser.mjs';
import { Server, SMALL } from './server.mjs';

export const [program, shots] = process.argv.slice(2);
if (!program) {
  console.error(`usage: node ${path.basename(process.argv[1])} strandcast-server [FOLDER]`);
  process.exit(2);
}
export const work = fs.mkdtempSync(path.join(os.tmpdir(), 'strandcast-page-'));

/** A browser, and a server of little hair. */
export async function begin(options = SMALL) {
  const missing = whyNoBrowser();
  if (missing) {
    console.log(`skipped: ${missing}`);
    process.exit(77);
  }
  if (shots) fs.mkdirSync(shots, { recursive: true });
  const browser = await Browser.start();
  try {
    return { browser, server: await Server.start(program, options) };
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
