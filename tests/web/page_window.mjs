// The page's window in a real browser: pictures follow its size, a hidden tab costs nothing and is back at once, and every
// control can be reached on small screens, by keys and by fingers.
//   node tests/web/page_window.mjs strandcast-server [FOLDER for screenshots]
// Ends with 77 where there is no browser; a line per test; the exit status is 1 when any fails.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { Browser, sleep } from './browser.mjs';
import { begin, program, runAll, shots, work } from './served.mjs';
import { Server, SMALL } from './server.mjs';

// The last one is a window of 1280 x 720 at four times its size.
const SIZES = [[640, 360], [568, 320], [480, 270], [360, 640], [320, 256], [320, 180]];
const { browser, server } = await begin();

const shown = (tab) => tab.evaluate('Number(document.body.dataset.pictures ?? 0)');
const resize = (tab, [width, height]) => tab.send('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: 1, mobile: false });
const shoot = async (tab, name) => void (shots && (await tab.screenshot(path.join(shots, `${name}.png`))));
/** Of the server's pictures, for a window of this size. */
const pictureSide = (side) => Math.max(64, Math.round(side / 16) * 16);
const pictureSize = (tab) => tab.evaluate('[document.getElementById("pictures").width, document.getElementById("pictures").height]');

/** Controls that are shown and cannot be used: cut off, or under something else. Those in what scrolls are scrolled to. */
const UNREACHABLE = `(() => {
  const faults = [];
  for (const one of document.querySelectorAll('button, select, input, summary, a[href]:not(.skip)')) {
    if (!one.checkVisibility({ visibilityProperty: true })) continue;
    const cover = ['panel', 'keys', 'trouble', 'tools'].map((id) => document.getElementById(id))
      .find((sheet) => !sheet.hidden && (sheet.id !== 'tools' || sheet.classList.contains('open')) && sheet.offsetWidth > (sheet.id === 'panel' ? 0.99 : 0.85) * innerWidth);
    if (cover && !cover.contains(one)) continue;
    one.scrollIntoView({ block: 'nearest', inline: 'nearest' });
    const box = one.getBoundingClientRect();
    const name = one.id || one.textContent.trim().slice(0, 20);
    const inside = box.left >= -0.5 && box.top >= -0.5 && box.right <= innerWidth + 0.5 && box.bottom <= innerHeight + 0.5;
    const above = document.elementFromPoint((box.left + box.right) / 2, (box.top + box.bottom) / 2);
    if (!inside) faults.push(name + ': cut off at ' + [box.left, box.top, box.right, box.bottom].map(Math.round));
    else if (!one.contains(above) && !above?.contains(one)) faults.push(name + ': under ' + (above?.id || above?.className || above?.tagName));
    const words = one.labels?.[0]?.innerText ?? one.getAttribute('aria-label') ?? one.innerText;
    if (!words?.trim()) faults.push(name + ': has no name');
  }
  if (document.documentElement.scrollWidth > innerWidth) faults.push('the page is wider than the window');
  return faults;
})()`;

/** Of what happens in the page between now and its next picture after it is seen again, ms. */
const UNTIL_PICTURE = `window.seen = new Promise((done) => document.addEventListener('visibilitychange', () => {
  const begun = performance.now();
  new MutationObserver((_, observer) => { observer.disconnect(); done(performance.now() - begun); })
    .observe(document.body, { attributeFilter: ['data-pictures'] });
}, { once: true })); 0`;

const all = {
  async 'the server\'s pictures are as large as the window, soon after it changes'() {
    for (const codec of ['tiles', 'vp8']) {
      const tab = await browser.open(`${server.url}#mode=pictures&pictures=${codec}`);
      await tab.until((now) => now.pictures > 3, 'pictures');
      assert.deepEqual(await pictureSize(tab), [640, pictureSide(360)]);
      const since = Date.now();
      await resize(tab, [360, 640]);
      const size = [pictureSide(360), 640];
      await tab.until(async () => String(await pictureSize(tab)) === String(size), 'pictures of the new size');
      console.log(`  ${codec}: after ${Date.now() - since} ms`);
      const state = await tab.until((now) => now.pictures > 6, 'more of them');
      assert.equal(state.hash_ok, true, state.rejected);
      assert.equal(await tab.evaluate('document.getElementById("pictures").classList.contains("fills")'), true, 'no strip');
      if (codec === 'tiles') await shoot(tab, 'turned');
      await tab.close();
    }
  },
  async 'a hidden tab gets nothing, and is back at once'() {
    const tabs = [];
    for (const mode of ['strands', 'pictures']) {
      const tab = await browser.open(`${server.url}#mode=${mode}`); // which hides the one before
      await tab.until((now) => now.states > 20 && now.pictures > 3, 'frames');
      tabs.push({ tab, mode, now: {} });
    }
    const other = await browser.open('about:blank');
    // What was on its way, and the account of it, which comes once a second.
    for (const one of tabs) {
      await one.tab.until(async (now) => {
        const isQuiet = now.states === one.now.states;
        one.now = now;
        if (!isQuiet) await sleep(1500);
        return isQuiet;
      }, 'silence');
      one.drawn = await shown(one.tab);
    }
    await sleep(1500);
    for (const { tab, mode, now, drawn } of tabs) {
      assert.equal(await tab.evaluate('document.visibilityState'), 'hidden');
      const after = await tab.state();
      assert.equal(after.states, now.states, `${mode}: frames came to a hidden tab`);
      assert.ok(after.bytes - now.bytes < 4000, `${mode}: ${after.bytes - now.bytes} bytes meanwhile`);
      assert.equal(await shown(tab), drawn, `${mode}: pictures were drawn for nobody`);
    }
    for (const { tab, mode, now } of tabs) {
      await tab.evaluate(UNTIL_PICTURE);
      await tab.send('Page.bringToFront');
      console.log(`  ${mode}: seen again after ${(await tab.evaluate('window.seen')).toFixed(0)} ms`);
      const state = await tab.until((later) => later.isConnected && later.states > now.states + 10, 'frames again');
      assert.equal(state.hash_ok, true, state.rejected);
      assert.equal(state.error, '');
    }
    for (const { tab } of [...tabs, { tab: other }]) await tab.close();
  },
  async 'a tab that is hidden for a moment misses nothing'() {
    const tab = await browser.open(`${server.url}#mode=strands`);
    await tab.until((now) => now.states > 20, 'states');
    const other = await browser.open('about:blank'); // which hides it
    await sleep(500);
    const { states } = await tab.state();
    await sleep(1100);
    assert.equal(await tab.evaluate('document.visibilityState'), 'hidden');
    const after = (await tab.state()).states;
    await tab.send('Page.bringToFront');
    console.log(`  ${after - states} states came meanwhile`);
    assert.ok(after > states + 8, `${after - states} states`);
    for (const one of [tab, other]) await one.close();
  },
  async 'what slept comes back at once'() {
    const mortal = await Server.start(program, SMALL);
    const tab = await browser.open(`${mortal.url}#mode=strands`);
    await tab.until((now) => now.states > 3, 'states');
    mortal.child.kill('SIGSTOP'); // as if the link had died unnoticed
    await tab.until(async (now) => {
      await tab.evaluate('dispatchEvent(new Event("online"))'); // once more, as frames may still be on their way
      return /after this machine slept/.test(now.error);
    }, 'the answer that does not come');
    mortal.child.kill('SIGCONT');
    await tab.until((now) => now.isConnected && now.states > 3, 'states again');
    await mortal.end();
    await tab.close();
  },
  async 'the way back finds hair that moves'() {
    const tab = await browser.open(`${server.url}#mode=strands`);
    await tab.until((now) => now.states > 10, 'states');
    await tab.evaluate('addEventListener("pageshow", (event) => (window.wasKept = event.persisted))');
    await tab.go('about:blank');
    await tab.until(async () => (await tab.evaluate('location.href')) === 'about:blank', 'another page');
    await tab.evaluate('setTimeout(() => history.back(), 50)'); // after the answer
    await tab.until((now) => now.isConnected && now.states > 0, 'the page');
    const { states } = await tab.state();
    await tab.until((now) => now.isConnected && now.states > states + 10 && now.hash_ok, 'states after the way back');
    console.log(`  the page was ${(await tab.evaluate('window.wasKept')) ? 'kept' : 'loaded anew'}`);
    await tab.close();
  },
  async 'a graphics card that was away draws again'() {
    const own = await Browser.start();
    try {
      const tab = await own.open(`${server.url}#mode=strands&draw=gl`);
      await tab.until((now) => now.pictures > 3, 'pictures');
      await own.send('Browser.crashGpuProcess').catch(() => {});
      await sleep(500);
      const before = await shown(tab);
      await tab.until(async () => (await shown(tab)) > before + 3, 'pictures again');
      assert.equal((await tab.state()).mode, 'strands');
      assert.match(await tab.evaluate('document.getElementById("warnings").textContent'), /^(?!.*taken away)/);
      await tab.close();
    } finally {
      await own.end();
    }
  },
  async 'every control can be reached on every screen'() {
    const tab = await browser.open(`${server.url}#mode=strands`);
    await tab.until((now) => now.states > 3, 'states');
    const check = async (what, size) => {
      await shoot(tab, `${what}_${size.join('x')}`);
      assert.deepEqual(await tab.evaluate(UNREACHABLE), [], `${what} at ${size.join(' x ')}`);
    };
    const press = async (key) => (await tab.press(key), sleep(50));
    for (const size of SIZES) {
      await resize(tab, size);
      await sleep(100);
      await check('plain', size);
      const collapses = await tab.evaluate('getComputedStyle(document.getElementById("menu")).display !== "none"');
      assert.equal(collapses, size[1] <= 400, `${size}: the menu stands for the tools where it is low`);
      if (collapses) {
        await tab.evaluate('document.getElementById("menu").click()');
        await check('menu', size);
        await press('Escape');
        assert.equal(await tab.evaluate('document.activeElement.id'), 'menu');
      }
      await press('l');
      await tab.until(() => tab.evaluate('document.querySelectorAll("#controls .control").length > 5'), 'sliders');
      await check('look', size);
      if (collapses) assert.deepEqual(await tab.evaluate('(({ width, height }) => [width, height])(document.getElementById("panel").getBoundingClientRect())'), size);
      await tab.evaluate('document.querySelectorAll("#panel details").forEach((one) => (one.open = true))');
      await check('more', size);
      await tab.evaluate('document.querySelectorAll("#panel details").forEach((one) => (one.open = false))');
      await tab.evaluate('document.getElementById("control-wind").focus()');
      await press('Escape'); // from within a slider, too
      assert.equal(await tab.evaluate('document.getElementById("panel").hidden'), true);
      await press('h');
      await check('keys', size);
      await press('Escape');
      await tab.evaluate('document.getElementById("hud-line").click()');
      await check('measurements', size);
      await tab.evaluate('document.getElementById("hud-line").click()');
    }
    // Without the rules for small screens the same check finds what the panel hides.
    await tab.evaluate(`for (const rule of [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules]))
      if (rule.media?.mediaText.startsWith('(max-')) rule.media.mediaText = 'not all'`);
    await resize(tab, [320, 256]);
    await press('l');
    assert.notDeepEqual(await tab.evaluate(UNREACHABLE), []);
    await tab.close();
  },
  async 'keys alone reach everything, and the focus is seen'() {
    const tab = await browser.open(`${server.url}#mode=strands`, { width: 480, height: 270 });
    await tab.until((now) => now.states > 3, 'states');
    await tab.send('Emulation.setEmulatedMedia', { features: [{ name: 'forced-colors', value: 'active' }, { name: 'prefers-reduced-motion', value: 'reduce' }] });
    const around = async (most) => {
      const names = [];
      for (let i = 0; i < most; ++i) {
        await tab.press('Tab');
        const [name, outline, moves] = await tab.evaluate(`(() => { const one = document.activeElement; const style = getComputedStyle(one);
          return [one === document.body ? '' : one.id || one.textContent.trim().slice(0, 12), style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) > 0,
            style.transitionDuration !== '0s' || style.animationName !== 'none']; })()`);
        if (one(name, names)) break;
        names.push(name);
        assert.ok(outline || name === '', `the focus on ${name} is not seen`);
        assert.ok(!moves, `${name} moves`);
      }
      return names;
    };
    const one = (name, names) => names.length > 0 && name === names[0];
    assert.ok((await around(12)).includes('menu'));
    await tab.evaluate('document.getElementById("menu").focus()');
    await tab.press('Enter');
    const open = await around(20);
    for (const name of ['view', 'mode', 'shot', 'link', 'look', 'help', 'hud-line', 'stage']) assert.ok(open.includes(name), `${name} of ${open}`);
    await shoot(tab, 'forced_colors');
    await tab.close();
  },
  async 'a drag ends where it is let go of, and two fingers zoom and turn'() {
    const tab = await browser.open(`${server.url}#mode=pictures`);
    await tab.until((now) => now.pictures > 3, 'pictures');
    const camera = () => tab.evaluate('JSON.parse(document.documentElement.dataset.strandcast).camera');
    const pointer = (type, x, buttons) => tab.evaluate(`(() => {
      const stage = document.getElementById('stage');
      stage.setPointerCapture = () => {}; // of a pointer that is none
      stage.dispatchEvent(new PointerEvent('${type}', { pointerId: 7, clientX: ${x}, clientY: 150, buttons: ${buttons}, bubbles: true })); })()`);
    const start = await camera();
    const isDragging = () => tab.evaluate('document.getElementById("stage").classList.contains("dragging")');
    for (const end of ['pointermove', 'lostpointercapture', 'blur']) {
      await pointer('pointerdown', 300, 1);
      await pointer('pointermove', 320, 1);
      assert.equal(await isDragging(), true);
      if (end === 'blur') await tab.evaluate('dispatchEvent(new Event("blur"))');
      else await pointer(end, 320, 0);
      assert.equal(await isDragging(), false, end);
    }
    await tab.until((now) => String(now.camera) !== String(start), 'another camera');
    await sleep(600);
    const turned = await camera();
    await pointer('pointermove', 420, 0);
    await sleep(600);
    assert.deepEqual(await camera(), turned, 'it goes on without a button');
    const touch = (type, points) => tab.send('Input.dispatchTouchEvent', { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
    const two = async (from, to) => {
      await sleep(600);
      const before = await camera();
      await touch('touchStart', from);
      await touch('touchMove', to);
      await touch('touchEnd', []);
      await sleep(600);
      const after = await camera();
      const yaw = ([x, , z]) => Math.atan2(x, z);
      return { nearer: Math.hypot(...before) / Math.hypot(...after), turned: yaw(after) - yaw(before) };
    };
    const pinch = await two([[280, 180], [360, 180]], [[240, 180], [400, 180]]);
    assert.ok(pinch.nearer > 1.5 && Math.abs(pinch.turned) < 0.05, JSON.stringify(pinch));
    const twist = await two([[280, 180], [360, 180]], [[290, 140], [350, 220]]);
    assert.ok(Math.abs(twist.turned) > 0.3, JSON.stringify(twist));
    assert.equal(await tab.evaluate('getComputedStyle(document.getElementById("stage")).touchAction'), 'none');
    assert.equal(await tab.evaluate('getComputedStyle(document.getElementById("tools")).touchAction'), 'auto');
    await tab.close();
  },
  async 'who lacks a token signs in, and what a browser lacks is said'() {
    const file = path.join(work, 'tokens');
    fs.writeFileSync(file, 'viewer right-0123456789abcdef\n', { mode: 0o600 });
    const strict = await Server.start(program, [...SMALL, '--token-file', file, '--distrust-loopback']);
    const tab = await browser.open(strict.url, { width: 320, height: 180 });
    await tab.until(() => tab.evaluate('document.getElementById("token-form")?.hidden === false'), 'the question');
    assert.equal(await tab.evaluate('document.getElementById("trouble-title").textContent'), 'Sign in');
    await tab.until(async () => /^Sign in: /.test(await tab.evaluate('document.title')), 'its title');
    assert.deepEqual(await tab.evaluate(UNREACHABLE), []);
    await shoot(tab, 'sign_in');
    await tab.close();
    await strict.end();
    const bare = await Browser.start('none', ['--disable-3d-apis', '--disable-blink-features=WebCodecs']);
    try {
      const poor = await bare.open('about:blank');
      await poor.send('Page.addScriptToEvaluateOnNewDocument', { source: 'delete globalThis.WebAssembly' });
      await poor.go(server.url);
      await poor.until((now) => now.mode === 'pictures' && now.pictures > 3, 'pictures without WebAssembly, WebGL and WebCodecs');
      assert.match(await poor.evaluate('document.body.innerText'), /Strands cannot be drawn here: this browser has no WebAssembly/);
      await shoot(poor, 'bare');
      await poor.send('Emulation.setScriptExecutionDisabled', { value: true });
      await poor.send('Page.reload');
      await sleep(500);
      await shoot(poor, 'no_script');
      const { root } = await poor.send('DOM.getDocument', { depth: -1 });
      assert.match(JSON.stringify(root), /This page needs JavaScript/);
    } finally {
      await bare.end();
    }
  },
};

await runAll(all, browser, server);
