// The page over links of every rate, round trip and share of stalls (strandcast-chaos), joined anew on each: the class of
// strands that it finds and keeps, and its first picture. What a native viewer finds stands in strandcast-vopr --links.
//   node tests/web/page_links.mjs strandcast-server [RATE ROUND_TRIP_MS STALLED_PERCENT]
// A line a link; ends with 1 where one breaks a rule. All 36 take most of an hour: tests/nightly.sh links.
import { spawn } from 'node:child_process';
import path from 'node:path';
import { sleep } from './browser.mjs';
import { begin, program } from './served.mjs';

const FOUND_S = 10; // after joining
const STEADY_S = 30; // after that
const MOST_CHANGES = 1;
const FITTING_SHARE = 0.7; // of the rate
const FIRST_MS = 1500; // from the files on, and ROUND_TRIPS
const ROUND_TRIPS = 3;
const STALL_MS = 100;
const JITTER_MS = 10;
const EVERYTHING = [1, 1]; // share of strands, steps between two frames: as long as the server says nothing
const SIZE = { width: 320, height: 180 };

const one = process.argv.slice(3).map(Number);
const links = one.length === 3 ? [one] : [1, 2, 5, 20].flatMap((rate) => [20, 80, 200].flatMap((tripMs) => [0, 1, 3].map((stalled) => [rate, tripMs, stalled])));
process.argv.length = 3; // no folder for screenshots
const { browser, server } = await begin(['--set', 'groom.procedural.vertex_count=16']);
const chaos = path.join(path.dirname(program), 'strandcast-chaos');

/** What all strands take where nothing limits them, Mbit/s. */
async function wholeMbit() {
  const tab = await browser.open(`${server.url}#mode=strands&codec=tangent`, SIZE);
  const first = await tab.until((now) => now.states > 120, 'states');
  const begun = Date.now();
  await sleep(10_000);
  const last = await tab.state();
  const seconds = (Date.now() - begun) / 1e3;
  await tab.close();
  if ((last.stream ?? EVERYTHING)[0] !== 1) throw new Error(`not all strands without a limit: ${last.stream}`);
  return (8e-6 * (last.bytes - first.bytes)) / seconds;
}

async function walk([rate, tripMs, stalled], listen) {
  const stalls = stalled ? ['--freeze-every-ms', String((100 * STALL_MS) / stalled), '--freeze-ms', String(STALL_MS)] : [];
  const relay = spawn(chaos, ['--to', `127.0.0.1:${server.port}`, '--listen', listen, '--rate-mbit', String(rate), '--delay-ms', String(tripMs / 2),
    '--jitter-ms', String(Math.min(JITTER_MS, tripMs / 2)), ...stalls], { stdio: 'ignore' });
  try {
    await sleep(500);
    const tab = await browser.open(`http://${listen}/#mode=strands&codec=tangent`, SIZE);
    await tab.until((now) => now.pictures > 0, 'a picture', 60_000);
    const joined = Date.now();
    const firstMs = await tab.evaluate(`performance.getEntriesByName('first picture')[0].startTime -
      Math.max(...performance.getEntriesByType('resource').filter(({ name }) => !name.includes('strand_step')).map((one) => one.responseEnd))`);
    const seen = [];
    for (; Date.now() - joined < 1e3 * (FOUND_S + STEADY_S); await sleep(250)) {
      const stream = String((await tab.state()).stream ?? EVERYTHING);
      if (stream !== seen.at(-1)?.stream) seen.push({ stream, atS: (Date.now() - joined) / 1e3 });
    }
    const state = await tab.state();
    await tab.close();
    return { firstMs, found: seen.filter(({ atS }) => atS < FOUND_S).at(-1).stream, changes: seen.filter(({ atS }) => atS >= FOUND_S).length, state };
  } finally {
    relay.kill();
  }
}

let broken = 0;
try {
  const whole = await wholeMbit();
  console.log(`all strands take ${whole.toFixed(2)} Mbit/s\nMbit/s  ms  stalled  share,steps  changes  first ms`);
  for (const [i, link] of links.entries()) {
    const [rate, tripMs, stalled] = link;
    const { firstMs, found, changes, state } = await walk(link, `127.0.0.1:${server.port + 1 + i}`);
    const why = [
      firstMs > FIRST_MS + ROUND_TRIPS * tripMs && 'late', whole <= FITTING_SHARE * rate && !found.startsWith('1,1') && 'coarse',
      changes > MOST_CHANGES && 'restless', !(state.isConnected && state.hash_ok) && 'wrong',
    ].filter(Boolean);
    broken += why.length ? 1 : 0;
    console.log(`${String(rate).padStart(6)} ${String(tripMs).padStart(3)} ${String(stalled).padStart(6)} % ${found.padStart(12)} ${String(changes).padStart(8)} ` +
      `${firstMs.toFixed(0).padStart(9)}${why.length ? `  BROKEN: ${why.join(' ')}` : ''}`);
  }
} finally {
  await browser.end();
  await server.end();
}
console.log(`${broken} of ${links.length} links break a rule`);
process.exitCode = broken ? 1 : 0;
