// The page of a server in a real browser: joins, sees states and pictures, turns the camera, comes back after a restart, says
// what is wrong with a token, and lets none of it leave the Hello.
//   node tests/web/page_browser.mjs strandcast-server [FOLDER for screenshots]
// Ends with 77 where there is no browser; a line per test; the exit status is 1 when any fails.
import { spawn } from 'node:child_process';
import assert from 'node:assert/strict';
import fs from 'node:fs';
import http from 'node:http';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import zlib from 'node:zlib';
import { sleep } from './browser.mjs';
import { begin, program, runAll, sharedTab, shots, work } from './served.mjs';
import { Server, SMALL } from './server.mjs';

const SLIDERS = ['Quality', 'Length', 'Curl', 'Stiffness', 'Friction', 'Wind'];
const LITTLE = { width: 320, height: 180 }; // where what is drawn decides nothing
const { browser, server } = await begin();

function get(url, headers = {}) {
  return new Promise((done, fail) => {
    http.get(url, { headers, agent: false }, (answer) => {
      const parts = [];
      answer.on('data', (part) => parts.push(part)).on('end', () => done({ status: answer.statusCode, headers: answer.headers, body: Buffer.concat(parts) }));
    }).on('error', fail);
  });
}

const all = {
  async 'strands come, and every state has its hash'() {
    const tab = await sharedTab(browser, server, 'mode=strands');
    // With hair on the screen come the solver's steps, for what it takes of the link.
    const state = await tab.until((now) => now.mode === 'strands' && now.codec === 'step' && now.states > 60 && now.hz > 0, 'strands');
    assert.equal(state.hash_ok, true);
    assert.equal(state.error, '');
    if (shots) await tab.screenshot(path.join(shots, 'strands.png'));
    assert.deepEqual(tab.errors, [], 'nothing is an error in the console');
    const begun = await tab.evaluate('performance.timeOrigin + performance.getEntriesByName("first picture")[0].startTime');
    const asked = tab.requests.filter((one) => one.url.startsWith('http'));
    const files = new Set(asked.filter((one) => 1e3 * one.at < begun).map((one) => one.url));
    const later = new Set(asked.filter((one) => 1e3 * one.at >= begun).map((one) => one.url));
    assert.ok(files.size <= 4, `${files.size} files: ${[...files]}`);
    assert.ok(later.size === 1 && [...later][0].includes('strand_step'), `behind the first picture: ${[...later]}`);
    for (const one of tab.requests) assert.ok(new URL(one.url).host === new URL(server.url).host, one.url);
  },
  async 'the server\'s pictures come'() {
    const tab = await sharedTab(browser, server, 'mode=pictures&view-only');
    await tab.until((now) => now.mode === 'pictures' && now.pictures > 5, 'pictures');
    if (shots) await tab.screenshot(path.join(shots, 'pictures.png'));
    assert.deepEqual(tab.errors, []);
  },
  async 'mouse and keys turn the camera'() {
    const tab = await sharedTab(browser, server, 'mode=strands');
    const before = await tab.state();
    await tab.drag([320, 120], [400, 140]);
    const dragged = await tab.until((now) => String(now.camera) !== String(before.camera), 'another camera');
    await tab.evaluate('document.getElementById("stage").focus()');
    for (let i = 0; i < 5; ++i) await tab.press('ArrowLeft');
    await tab.until((now) => String(now.camera) !== String(dragged.camera), 'another camera by keys');
  },
  async 'what is changed first stands on top of the panel, and moves'() {
    const tab = await sharedTab(browser, server, 'mode=strands');
    await tab.press('l');
    const rows = () => tab.evaluate(`[...document.querySelectorAll('#controls .control')].map((row) => row.innerText.replace(/\\s+/g, ' ').trim())`);
    await tab.until(async () => (await rows()).length === SLIDERS.length, 'sliders');
    assert.deepEqual((await rows()).map((row) => row.split(' ')[0]), SLIDERS);
    assert.equal(await tab.evaluate('document.querySelector("#panel .more").open'), false, 'all else is folded');
    const fits = await tab.evaluate(`[...document.querySelectorAll('#controls .control')].every((row) => {
      const box = row.getBoundingClientRect(); return box.top >= 0 && box.bottom <= innerHeight && box.right <= innerWidth; })`);
    assert.ok(fits, 'in a window of 640 x 360');
    if (shots) await tab.screenshot(path.join(shots, 'controls.png'));
    // By keys: the wind goes up, and the server says so.
    await tab.evaluate('document.getElementById("control-wind").focus()');
    for (let i = 0; i < 5; ++i) await tab.press('ArrowRight');
    await tab.until(() => /hair\.wind=1\.3/.test(server.log), 'the server hears of it');
    assert.match((await rows()).at(-1), /Wind 1\.3/);
    // A second page hears of it, a double click takes it back.
    const other = await sharedTab(browser, server, 'mode=pictures&view-only');
    await other.press('l');
    await other.until(async () => /1\.3/.test(await other.evaluate('document.getElementById("controls").innerText')), 'its value there');
    assert.equal(await other.evaluate('document.getElementById("control-wind").disabled'), true);
    assert.match(await other.evaluate('document.getElementById("control-reason").textContent'), /no right to steer/);
    await tab.evaluate(`document.getElementById('control-wind').dispatchEvent(new MouseEvent('dblclick', { bubbles: true }))`);
    await tab.until(() => /hair\.wind=1(\s|$)/m.test(server.log), 'the default comes back');
    await other.until(async () => /Wind\s+1$/.test((await other.evaluate('document.getElementById("controls").innerText')).trim()), 'and is told');
    for (const one of [other, tab]) await one.press('Escape');
    assert.deepEqual(tab.errors, []);
  },
  async 'of two heads the chosen one is drawn'() {
    const scene = path.join(path.dirname(fileURLToPath(import.meta.url)), '../../deploy/scenes/two_heads.textproto');
    const two = await Server.start(program, ['--scene', scene, ...SMALL]);
    const tab = await browser.open(`${two.url}#mode=strands`, LITTLE);
    await tab.until((now) => now.mode === 'strands' && now.states > 3, 'strands');
    const words = () => tab.evaluate('document.getElementById("hud-line").textContent');
    assert.match(await words(), /strands of anna alone/);
    assert.equal(await tab.evaluate('document.getElementById("head-choice").hidden'), false);
    await tab.evaluate(`(() => { const head = document.getElementById('head'); head.value = 'ben'; head.dispatchEvent(new Event('change')); })()`);
    await tab.until(async (now) => now.isConnected && now.hash_ok && /strands of ben alone/.test(await words()), 'the other head');
    if (shots) await tab.screenshot(path.join(shots, 'other_head.png'));
    assert.deepEqual(tab.errors, []);
    await tab.close();
    await two.end();
  },
  async 'a stream of another solver brings its kernel'() {
    const other = await Server.start(program, [...SMALL, '--set', 'solver.name=direct_rod']);
    const tab = await browser.open(`${other.url}#mode=strands&codec=step`, LITTLE);
    // The module that the page begins with cannot step these.
    const state = await tab.until((now) => now.states > 10 && now.codec === 'step', 'states');
    assert.equal(state.hash_ok, true);
    await tab.close();
    await other.end();
  },
  async 'what comes while a module is on its way is not refused'() {
    // Fast on a head that is a field, as a server in full quality comes to run that was too slow; and a model for which
    // the page fetches the whole core.
    for (const [options, takesWhole] of [[['quality=fast', 'head.collider=field'], false], [['solver.name=xpbd'], true]]) {
      const other = await Server.start(program, [...SMALL, ...options.flatMap((one) => ['--set', one])]);
      const tab = await browser.open(`${other.url}#mode=strands`, { ...LITTLE, seesWorkers: true });
      await tab.until((now) => now.states !== undefined, 'the page');
      await tab.evaluate(`(() => {
        window.refused = [];
        new MutationObserver(() => {
          const { hash_ok, rejected } = JSON.parse(document.documentElement.dataset.strandcast);
          if (!hash_ok) window.refused.push(rejected);
        }).observe(document.documentElement, { attributes: true });
      })()`);
      await tab.until((now) => now.codec === 'step' && now.states > 10, 'steps');
      assert.deepEqual(await tab.evaluate('window.refused'), [], options.join(' '));
      assert.equal(tab.requests.some((one) => one.url.includes('strand_core')), takesWhole, options.join(' '));
      await tab.close();
      await other.end();
    }
  },
  async 'a second tab sees the same, from the cache'() {
    const first = await sharedTab(browser, server, 'mode=strands');
    const begin = server.log.length;
    const second = await browser.open(`${server.url}#mode=strands`, LITTLE);
    await second.until((now) => now.states > 3, 'states in the second tab');
    await first.until((now) => now.isConnected, 'the first one stays');
    // A browser opens connections ahead and asks nothing on some: those end after 5 s.
    const refused = server.log.slice(begin).split('\n').filter((line) => /refused/.test(line) && !/no request answered/.test(line));
    assert.deepEqual(refused, []);
    await second.close();
  },
  async 'comes back after a restart of the server'() {
    const mortal = await Server.start(program, SMALL);
    const tab = await browser.open(`${mortal.url}#mode=strands`, LITTLE);
    await tab.until((now) => now.states > 3, 'states');
    await mortal.end();
    await tab.until((now) => !now.isConnected, 'the loss is noticed');
    const again = await Server.start(program, SMALL, mortal.port);
    await tab.until((now) => now.isConnected && now.states > 3, 'states of the new server');
    await tab.close();
    await again.end();
  },
  async 'a link of 2 Mbit/s carries page and strands'() {
    const chaos = path.join(path.dirname(program), 'strandcast-chaos');
    if (!fs.existsSync(chaos)) return console.log('  skipped: needs strandcast-chaos beside the server');
    const more = await Server.start(program, [...SMALL, '--set', 'groom.procedural.strand_count=400']);
    const listen = `127.0.0.1:${more.port + 1}`;
    const relay = spawn(chaos, ['--to', `127.0.0.1:${more.port}`, '--listen', listen, '--rate-mbit', '2', '--delay-ms', '20'], { stdio: 'ignore' });
    try {
      await sleep(500);
      const tab = await browser.open(`http://${listen}/#mode=strands`, LITTLE);
      const first = await tab.until((now) => now.states > 3, 'states');
      const later = await tab.until((now) => now.states > first.states + 10, 'more states', 3_000);
      assert.ok(later.isConnected && later.hash_ok, JSON.stringify(later));
      await tab.close();
    } finally {
      relay.kill();
      await more.end();
    }
  },
  async 'memory stays where it is'() {
    const seconds = Number(process.env.STRANDCAST_SOAK_S ?? 0);
    if (!seconds) return console.log('  skipped: STRANDCAST_SOAK_S says for how long (tests/nightly.sh: 600)');
    const tab = await browser.open(`${server.url}#mode=strands`, LITTLE);
    await tab.until((now) => now.states > 100, 'states');
    // Of the page and its workers, after a collection.
    const bytes = async () => (await tab.evaluate('performance.measureUserAgentSpecificMemory()')).bytes;
    const begin = await bytes();
    await sleep(seconds * 1000);
    const end = await bytes();
    console.log(`  ${(begin / 1e6).toFixed(1)} MB, after ${seconds} s ${(end / 1e6).toFixed(1)} MB`);
    assert.ok(end < 1.2 * begin + 5e6, 'it grows');
    await tab.close();
  },
  async 'tokens: a wrong one is named, a right one lets in, and none is anywhere but in the Hello'() {
    const right = 'right-0123456789abcdef';
    const wrong = 'wrong-0123456789abcdef';
    const file = path.join(work, 'tokens');
    fs.writeFileSync(file, `viewer ${right}\n`, { mode: 0o600 });
    const strict = await Server.start(program, [...SMALL, '--token-file', file, '--distrust-loopback']);
    const tab = await browser.open(`${strict.url}#token=${wrong}&mode=strands&view-only`, LITTLE);
    await tab.until((now) => /token/i.test(now.error ?? ''), 'the reason');
    await tab.evaluate(`document.getElementById('token').value = '${right}'; document.getElementById('token-form').requestSubmit()`);
    await tab.until((now) => now.states > 3, 'states');
    const address = await tab.evaluate('location.href');
    const history = await tab.send('Page.getNavigationHistory');
    for (const secret of [right, wrong]) {
      assert.ok(!address.includes(secret));
      assert.ok(!strict.log.includes(secret), 'in the log');
      assert.ok(!history.entries.some((one) => one.url.includes(secret)), 'in the history');
      for (const one of tab.requests) {
        assert.ok(!one.url.includes(secret), 'in an address');
        assert.ok(!JSON.stringify(one.headers).includes(secret), 'in a field');
      }
    }
    const referring = tab.requests.filter((one) => Object.keys(one.headers).some((name) => name.toLowerCase() === 'referer' && one.headers[name]));
    assert.deepEqual(referring, [], 'nobody is told where a request comes from');
    // After a reload the token is asked for, unless the tab was told to keep it.
    const reload = async (one) => {
      await one.evaluate('window.isBefore = true');
      await one.send('Page.reload');
      await one.until(async () => !(await one.evaluate('window.isBefore')), 'the page anew');
    };
    await reload(tab);
    await tab.until((now) => /token/i.test(now.error ?? ''), 'the question');
    await tab.close();
    const keeping = await browser.open(`${strict.url}#token=${right}&keep-token&mode=strands`, LITTLE);
    await keeping.until((now) => now.states > 3, 'states');
    await reload(keeping);
    await keeping.until((now) => now.states > 0 && now.isConnected, 'states without a question');
    assert.equal(await keeping.evaluate('Object.keys(localStorage).length + document.cookie.length'), 0);
    await keeping.close();
    const other = await browser.open(`${strict.url}#mode=strands`, LITTLE);
    await other.until((now) => /token/i.test(now.error ?? ''), 'another tab is asked');
    await other.close();
    await strict.end();
  },
  async 'a page of another origin is refused, and may not show this one'() {
    const foreign = http.createServer((_, answer) => {
      answer.setHeader('Content-Type', 'text/html');
      answer.end(`<iframe src="${server.url}"></iframe><script>
        const socket = new WebSocket('${server.url.replace('http', 'ws')}v1', 'strandcast.v1');
        socket.onopen = () => (document.title = 'open'); socket.onerror = () => (document.title = 'refused');</script>`);
    });
    await new Promise((done) => foreign.listen(0, '127.0.0.1', done));
    const tab = await browser.open(`http://127.0.0.1:${foreign.address().port}/`, LITTLE);
    await tab.until(async () => (await tab.evaluate('document.title')) === 'refused', 'the refusal');
    await tab.until(() => tab.errors.some((error) => /frame-ancestors|ERR_BLOCKED/.test(error)), 'no frame');
    assert.match(server.log, /refused 127\.0\.0\.1 origin/);
    await tab.close();
    foreign.close();
  },
  async 'files are compressed, kept and typed'() {
    const page = await get(server.url, { 'accept-encoding': 'gzip' });
    assert.equal(page.headers['content-encoding'], 'gzip');
    assert.equal(page.headers['cache-control'], 'no-cache');
    assert.equal((await get(server.url, { 'accept-encoding': 'gzip', 'if-none-match': page.headers.etag })).status, 304);
    const text = (await get(server.url)).body.toString();
    const assets = JSON.parse(/name="strandcast-assets" content="([^"]*)"/.exec(text)[1].replaceAll('&quot;', '"').replaceAll('&amp;', '&'));
    const linked = [...text.matchAll(/(?:src|href)="([^"]+\.(?:js|css))"/g)].map((one) => one[1]);
    const begun = [assets.core, ...linked]; // what every page begins with
    let bytes = page.body.length;
    for (const name of new Set([...begun, assets.stepCore, assets.wholeCore])) {
      const file = await get(server.url + name, { 'accept-encoding': 'gzip' });
      const smaller = await get(server.url + name, { 'accept-encoding': 'gzip, deflate, br' });
      assert.equal(smaller.headers['content-encoding'], 'br', name);
      assert.ok(zlib.brotliDecompressSync(smaller.body).equals(zlib.gunzipSync(file.body)), name);
      assert.ok(smaller.body.length < file.body.length, name);
      assert.equal(file.status, 200, name);
      assert.equal(file.headers['content-encoding'], 'gzip');
      assert.match(file.headers['cache-control'], /immutable/);
      assert.equal(file.headers['content-type'].split(';')[0],
        { js: 'text/javascript', css: 'text/css', wasm: 'application/wasm' }[name.split('.').pop()]);
      if (begun.includes(name)) bytes += file.body.length;
    }
    console.log(`  ${begun.length + 1} requests, ${bytes} bytes compressed`);
  },
};

// What a page asks for, its console and its history are told by Chromium alone.
await runAll(all, browser, server, ['strands come', 'what comes while', 'tokens', 'a page of another origin', 'memory stays']);
