// What tests of a page in a browser begin with: a server of the page, a browser, and a line per test.
//   node TEST.mjs strandcast-server [FOLDER for screenshots]        STRANDCAST_BROWSER=firefox: in Firefox
// Ends with 77 where there is no browser; the exit status is 1 when any test fails.
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { Browser } from './browser.mjs';
import { Firefox, whyNoFirefox } from './firefox.mjs';
import { Server, SMALL } from './server.mjs';

export const [program, shots] = process.argv.slice(2);
if (!program) {
  console.error(`usage: node ${path.basename(process.argv[1])} strandcast-server [FOLDER]`);
  process.exit(2);
}
export const work = fs.mkdtempSync(path.join(os.tmpdir(), 'strandcast-page-'));

export const isFirefox = process.env.STRANDCAST_BROWSER === 'firefox';
async function startBrowser() {
  const missing = isFirefox && whyNoFirefox();
  if (!missing) return isFirefox ? (await Firefox.start()).withTabs : Browser.startOrSkip();
  console.log(`skipped: ${missing}`);
  process.exit(77);
}

/** A browser, and a server of little hair. */
export async function begin(options = SMALL) {
  const browser = await startBrowser();
  if (shots) fs.mkdirSync(shots, { recursive: true });
  try {
    return { browser, server: await Server.start(program, options) };
  } catch (error) {
    await browser.end();
    throw error;
  }
}

const kept = new Map();
/** The tab of these wishes that tests share, since opening one costs as much as most tests: in front, and moving. */
export async function sharedTab(browser, server, wishes, size = [640, 360]) {
  const tab = kept.get(wishes) ?? (await browser.open(`${server.url}#${wishes}`, { seesWorkers: true }));
  kept.set(wishes, tab);
  await tab.send('Page.bringToFront');
  await tab.resize(...size);
  const { states = 0 } = await tab.state().catch(() => ({}));
  await tab.until((now) => now.isConnected && now.states > states + 3, wishes);
  return tab;
}
/** What a test that failed has done to them is not known. */
async function forgetTabs() {
  for (const tab of kept.values()) await tab.close().catch(() => {});
  kept.clear();
}

/** Those whose name has STRANDCAST_TEST in it, and the end of all. In Firefox without those that ask what only Chromium tells. */
export async function runAll(all, browser, server, chromiumAlone = []) {
  const isAsked = (name) => name.includes(process.env.STRANDCAST_TEST ?? '') && !(isFirefox && chromiumAlone.some((part) => name.startsWith(part)));
  const tests = Object.entries(all).filter(([name]) => isAsked(name));
  let failed = 0;
  for (const [name, test] of tests) {
    const since = Date.now();
    try {
      await test();
      console.log(`passed: ${name} (${((Date.now() - since) / 1000).toFixed(1)} s)`);
    } catch (error) {
      ++failed;
      console.log(`FAILED: ${name}: ${error.stack}`);
      await forgetTabs();
    }
  }
  await browser.end();
  await server.end();
  fs.rmSync(work, { recursive: true, force: true });
  console.log(`${tests.length - failed} of ${tests.length} passed`);
  process.exit(failed ? 1 : 0);
}
