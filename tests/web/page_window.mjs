// The page's window in a real browser: pictures follow its size, a hidden tab costs nothing and is back at once, and every
// control can be reached on small screens, by keys and by fingers.
//   node tests/web/page_window.mjs strandcast-server [FOLDER for screenshots]
// Ends with 77 where there is no browser; a line per test; the exit status is 1 when any fails.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import { Browser, sleep } from './browser.mjs';
import { begin, program, runAll, sharedTab, shots, work } from './served.mjs';
import { Link, Server, SMALL } from './server.mjs';

const isWhole = process.env.STRANDCAST_TEST_GRID === 'whole';
// With them a window of 1280 x 720 at one, two, three and four times its size; by day the first and the last of these.
const BETWEEN = isWhole ? [[568, 320], [480, 270], [427, 240]] : [];
const SIZES = [[1280, 720], [640, 360], ...BETWEEN, [360, 640], [320, 256], [320, 180]];
const LITTLE = { width: 320, height: 180 }; // where what is drawn decides nothing
const { browser, server } = await begin([...SMALL, '--log-level', 'debug']);

/** Sessions whose window somebody sees, as the server has it. */
function seenSessions() {
  const seen = new Set();
  for (const [line, session] of server.log.matchAll(/session (\d+)[^\n]*/g)) {
    if (/ left$| a window of .*, hidden$/.test(line)) seen.delete(session);
    else if (/ joined: | a window of /.test(line)) seen.add(session);
  }
  return seen;
}
/** The page's account of itself after so many further ones. */
async function accountAfter(tab, count) {
  await tab.evaluate(`new Promise((done) => {
    let left = ${count};
    new MutationObserver((all, observer) => { if ((left -= all.length) <= 0) done(observer.disconnect()); })
      .observe(document.documentElement, { attributeFilter: ['data-strandcast'] });
  })`);
  return tab.state();
}

const shown = (tab) => tab.evaluate('Number(document.body.dataset.pictures ?? 0)');
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

/** The least contrast of the page's texts and icons with what may be behind them (WCAG 2.2, 1.4.3 and 1.4.11): what lets light
    through lies on white and on black, whichever is worse. In shares of what each needs; 1 is enough. */
const LEAST_CONTRAST = `(() => {
  const rgba = (text) => { const [r, g, b, a = 1] = text.match(/[\\d.]+/g).map(Number); return [r, g, b, a]; };
  const over = ([r, g, b, a], under) => [r, g, b].map((one, i) => one * a + under[i] * (1 - a));
  const light = (color) => color.map((one) => one / 255).map((one) => (one <= 0.04045 ? one / 12.92 : ((one + 0.055) / 1.055) ** 2.4))
    .reduce((sum, one, i) => sum + one * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = (one, base) => {
    const layers = [];
    for (let at = one; at && at.localName !== 'main' && at !== document.body; at = at.parentElement) layers.unshift(rgba(getComputedStyle(at).backgroundColor));
    return layers.reduce((under, layer) => over(layer, under), base);
  };
  const isOff = (one) => one.closest(':disabled, [aria-disabled=true]') || one.closest('.control')?.querySelector('input:disabled');
  let least = [Infinity, ''];
  for (const one of document.querySelectorAll('main *')) {
    const isText = one.matches('select, input:not([type=range], [type=checkbox], [type=color])') || [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
    if (!(isText || one.matches('svg, input')) || !one.checkVisibility({ visibilityProperty: true }) || !one.getClientRects().length || isOff(one)) continue;
    const style = getComputedStyle(one);
    let opacity = 1;
    for (let at = one; at; at = at.parentElement) opacity *= Number(getComputedStyle(at).opacity);
    const isLarge = parseFloat(style.fontSize) >= 24 || (parseFloat(style.fontSize) >= 18.66 && Number(style.fontWeight) >= 700);
    for (const base of [[0, 0, 0], [255, 255, 255]]) {
      const under = behind(one, base);
      const [r, g, b, a] = rgba(style.color);
      const [low, high] = [light(under), light(over([r, g, b, a * opacity], under))].sort((x, y) => x - y);
      const share = (high + 0.05) / (low + 0.05) / (isText && !isLarge ? 4.5 : 3);
      if (share < least[0]) least = [share, (one.id || one.className || one.localName) + ' ' + one.textContent.trim().slice(0, 20) + ' ' + style.color + ' on ' + under.map(Math.round)];
    }
  }
  return least;
})()`;
const SCHEMES = [['prefers-color-scheme', 'dark'], ['forced-colors', 'active'], ['prefers-color-scheme', 'light']];

/** Of what can be chosen or typed into, as a screen reader is told. */
async function namelessControls(tab) {
  const { nodes } = await tab.send('Accessibility.getFullAXTree');
  const isControl = ({ ignored, properties = [] }) => !ignored && properties.some(({ name, value }) => name === 'focusable' && value.value);
  const named = nodes.filter((one) => isControl(one) && one.role.value !== 'RootWebArea');
  assert.ok(named.length > 3, `${named.length} controls`);
  return named.filter(({ name }) => !name?.value?.trim()).map(({ role, backendDOMNodeId }) => `${role.value} ${backendDOMNodeId}`);
}

/** Of what happens in the page between now and its next picture after it is seen again, ms. */
const UNTIL_PICTURE = `(window.seen = new Promise((done) => document.addEventListener('visibilitychange', () => {
  const begun = performance.now();
  new MutationObserver((_, observer) => { observer.disconnect(); done(performance.now() - begun); })
    .observe(document.body, { attributeFilter: ['data-pictures'] });
}, { once: true })), 0)`;

const all = {
  async 'the server\'s pictures are as large as the window, soon after it changes'() {
    for (const codec of ['tiles', 'vp8']) {
      const tab = await sharedTab(browser, server, `mode=pictures&pictures=${codec}`);
      assert.deepEqual(await pictureSize(tab), [640, pictureSide(360)]);
      const since = Date.now();
      await tab.resize(360, 640);
      const size = [pictureSide(360), 640];
      await tab.until(async () => String(await pictureSize(tab)) === String(size), 'pictures of the new size');
      console.log(`  ${codec}: after ${Date.now() - since} ms`);
      const state = await tab.until((now) => now.pictures > 6, 'more of them');
      assert.equal(state.hash_ok, true, state.rejected);
      assert.equal(await tab.evaluate('document.getElementById("pictures").classList.contains("fills")'), true, 'no strip');
      if (codec === 'tiles') await shoot(tab, 'turned');
    }
  },
  async 'a hidden tab gets nothing, and is back at once'() {
    const tabs = [];
    for (const mode of ['strands', 'pictures&pictures=tiles'])
      tabs.push({ tab: await sharedTab(browser, server, `mode=${mode}`), mode, now: {} }); // which hides the one before
    const other = await browser.open('about:blank');
    await tabs[0].tab.until(() => seenSessions().size === 0, 'the server knows that nobody sees them');
    await Promise.all(tabs.map(async (one) => {
      // What was on its way arrives.
      for (let before = -1, left = 5; one.now.states !== before && left > 0; --left) {
        before = one.now.states;
        one.now = await accountAfter(one.tab, 2);
      }
      one.drawn = await shown(one.tab);
    }));
    await Promise.all(tabs.map(({ tab }) => accountAfter(tab, 2)));
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
    await other.close();
  },
  async 'a tab that is hidden for a moment misses nothing'() {
    const tab = await sharedTab(browser, server, 'mode=strands');
    const other = await browser.open('about:blank'); // which hides it
    await sleep(500);
    const { states } = await tab.state();
    await sleep(1100);
    assert.equal(await tab.evaluate('document.visibilityState'), 'hidden');
    const after = (await tab.state()).states;
    await tab.send('Page.bringToFront');
    console.log(`  ${after - states} states came meanwhile`);
    assert.ok(after > states + 8, `${after - states} states`);
    await other.close();
  },
  async 'what slept comes back at once'() {
    const mortal = await Server.start(program, SMALL);
    const tab = await browser.open(`${mortal.url}#mode=strands`, LITTLE);
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
  async 'beside a silent link another is tried, and takes its place'() {
    if (!isWhole) return console.log('  by night; beside it page.test.mjs and package_node.mjs');
    const link = await Link.start(server);
    const tab = await browser.open(`${link.url}#mode=strands`, LITTLE);
    await tab.until((now) => now.codec === 'step' && now.states > 100, 'states');
    const since = Date.now();
    link.fallSilent();
    await tab.until((now) => now.isConnected && now.states < 100, 'another', 12_000); // it counts from 0
    console.log(`  after ${Date.now() - since} ms`);
    const state = await tab.until((now) => now.codec === 'step' && now.states > 30, 'its states');
    assert.equal(state.hash_ok, true, state.rejected);
    await tab.close();
    link.end();
  },
  async 'the way back finds hair that moves'() {
    const tab = await browser.open(`${server.url}#mode=strands`, LITTLE); // whose count of states begins anew
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
  async 'every control can be reached on every screen'() {
    const tab = await sharedTab(browser, server, 'mode=strands');
    let least = [Infinity];
    const check = async (what, size) => {
      await shoot(tab, `${what}_${size.join('x')}`);
      assert.deepEqual(await tab.evaluate(UNREACHABLE), [], `${what} at ${size.join(' x ')}`);
      assert.deepEqual(await namelessControls(tab), [], `${what} at ${size.join(' x ')}`);
      if (size !== SIZES[1] && size !== SIZES.at(-1)) return;
      for (const [name, value] of SCHEMES) {
        await tab.send('Emulation.setEmulatedMedia', { features: [{ name, value }] });
        const [share, text] = await tab.evaluate(LEAST_CONTRAST);
        if (share < least[0]) least = [share, `${text}, ${what}, ${value}`];
      }
    };
    const press = async (key) => (await tab.press(key), sleep(50));
    for (const size of SIZES) {
      await tab.resize(...size);
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
    console.log(`  least contrast: ${least[0].toFixed(2)} of what it needs, ${least[1]}`);
    assert.ok(least[0] >= 1, least.join(' '));
    // Without the rules for small screens the same check finds what the panel hides.
    await tab.evaluate(`window.small = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules])
      .filter((rule) => rule.media?.mediaText.startsWith('(max-')).map((rule) => [rule, rule.media.mediaText]);
      for (const [rule] of small) rule.media.mediaText = 'not all'`);
    await tab.resize(320, 256);
    await press('l');
    assert.notDeepEqual(await tab.evaluate(UNREACHABLE), []);
    await tab.evaluate('document.documentElement.style.setProperty("--quiet", "#8a919c")');
    assert.ok((await tab.evaluate(LEAST_CONTRAST))[0] < 1, 'a pale text is not found');
    await tab.evaluate('document.documentElement.removeAttribute("style")');
    await press('Escape');
    await tab.evaluate('for (const [rule, media] of small) rule.media.mediaText = media');
  },
  async 'keys alone reach everything, and the focus is seen'() {
    const tab = await sharedTab(browser, server, 'mode=strands', [480, 270]);
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
    await tab.send('Emulation.setEmulatedMedia', { features: [] });
    await tab.evaluate('document.getElementById("menu").click()');
  },
  async 'a drag ends where it is let go of, and two fingers zoom and turn'() {
    const tab = await sharedTab(browser, server, 'mode=pictures&pictures=tiles');
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
  async 'a graphics card that was away draws again'() {
    const tab = await browser.open(`${server.url}#mode=strands&draw=gl`, { width: 160, height: 90 });
    await tab.until((now) => now.pictures > 3, 'pictures');
    await browser.send('Browser.crashGpuProcess').catch(() => {});
    await sleep(500);
    const before = await shown(tab);
    await tab.until(async () => (await shown(tab)) > before + 3, 'pictures again');
    assert.equal((await tab.state()).mode, 'strands');
    assert.match(await tab.evaluate('document.getElementById("warnings").textContent'), /^(?!.*taken away)/);
    await tab.close();
  },
};

// Firefox gives no other media, sizes below its own window's, touches or lost cards to tests.
await runAll(all, browser, server, ["the server's pictures", 'every control', 'keys alone', 'a drag', 'who lacks', 'a graphics card', 'the way back']);
