// A browser for tests: headless Chromium over its own protocol on a pipe, without any package of Node.
//   const browser = await Browser.start(); const tab = await browser.open('http://127.0.0.1:7878/');
//   await tab.until('document.title === "Strandcast"'); await browser.end();
import { spawn } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';

const USUAL_MS = 30_000;
const STAND_MS = 60_000;
const POLL_MS = 100; // the page tells of itself twice a second
const MOST_SAID = 4000; // characters of its complaints

function findChromium() {
  const names = ['chromium', 'chromium-browser', 'google-chrome'];
  const folders = (process.env.PATH ?? '').split(':');
  return folders.flatMap((folder) => names.map((name) => path.join(folder, name))).find((file) => fs.existsSync(file));
}
/** Why there is no browser to test with; undefined where there may be one. */
export const whyNoBrowser = () => (findChromium() ? undefined : 'needs a browser (chromium)');
const asRoot = () => (process.getuid?.() === 0 ? ['--no-sandbox'] : []);
export const sleep = (ms) => new Promise((done) => setTimeout(done, ms));
/** What ends a wait for something else, and keeps no test from ending. */
export const limit = (ms) => new Promise((done) => setTimeout(done, ms).unref());

/** So many has the page shown. */
export const picturesOf = (tab) => tab.evaluate('Number(document.body?.dataset.pictures ?? 0)');
/** Waits until no further picture comes for so long. Where little time is, what moves is drawn smaller: that is none. */
export async function comeToStand(tab, stillMs, count = picturesOf) {
  const end = Date.now() + STAND_MS;
  for (let before = -1, since = 0; Date.now() < end; await sleep(POLL_MS)) {
    const pictures = await count(tab);
    const { mode, share } = await tab.state();
    const isSmaller = mode === 'strands' && share < 1;
    if (pictures === 0 || pictures !== before || isSmaller) since = Date.now();
    else if (Date.now() - since >= stillMs) return;
    before = pictures;
  }
  throw new Error(`no picture stands within ${STAND_MS} ms; ${tab.errors?.join(' | ')}`);
}

/** Its last files come late, from processes that outlive the first. What is left after that is the system's. */
async function removeFolder(folder) {
  for (let attempt = 0; attempt < 50; ++attempt) {
    try {
      return fs.rmSync(folder, { recursive: true, force: true });
    } catch {
      await sleep(100);
    }
  }
}

export class Browser {
  /** draws: 'mesa' (ANGLE on the system's OpenGL, llvmpipe where there is no GPU), 'swiftshader' or 'none'. */
  static async start(draws = process.env.STRANDCAST_BROWSER_DRAWS ?? 'mesa', options = []) {
    const profile = fs.mkdtempSync(path.join(os.tmpdir(), 'strandcast-browser-'));
    const graphics = { mesa: ['--use-gl=angle', '--use-angle=gl-egl', '--ignore-gpu-blocklist'], swiftshader: ['--enable-unsafe-swiftshader'] }[draws] ?? [];
    const child = spawn(findChromium(), [
      '--headless=new', '--remote-debugging-pipe', `--user-data-dir=${profile}`, '--no-first-run', '--no-default-browser-check',
      '--disable-background-networking', '--disable-component-update', '--disable-extensions', '--disable-dev-shm-usage',
      '--hide-scrollbars', '--mute-audio', '--ignore-certificate-errors',
      ...asRoot(), ...graphics, ...options, 'about:blank',
    ], { stdio: ['ignore', 'ignore', 'pipe', 'pipe', 'pipe'] });
    return new Browser(child, profile);
  }
  /** The first one of a test, which is skipped where the browser shows no page. */
  static async startOrSkip(...wishes) {
    const missing = whyNoBrowser();
    if (!missing) {
      const browser = await Browser.start(...wishes);
      const tab = await Promise.race([browser.open('data:text/html,<p>here</p>').catch(() => undefined), limit(2 * USUAL_MS)]);
      if (await tab?.until(() => tab.evaluate('document.body?.innerText === "here"').catch(() => false), 'a page').catch(() => false)) return tab.close().then(() => browser);
      console.log(`skipped: ${findChromium()} shows no page here: ${browser.said.trim().split('\n').pop()}`);
      await browser.end();
    } else console.log(`skipped: ${missing}`);
    process.exit(77);
  }
  constructor(child, profile) {
    Object.assign(this, { child, profile, nextId: 1, waiting: new Map(), tabs: new Map(), rest: '', said: '' });
    child.stdio[2].setEncoding('utf8').on('data', (text) => (this.said = (this.said + text).slice(-MOST_SAID)));
    child.stdio[3].on('error', () => {}); // of a browser that has ended
    child.stdio[4].setEncoding('utf8').on('data', (text) => {
      const parts = (this.rest + text).split('\0');
      this.rest = parts.pop();
      for (const part of parts) this.take(JSON.parse(part));
    });
    child.on('exit', () => {
      for (const { fail } of this.waiting.values()) fail(new Error('the browser ended'));
    });
  }
  take(message) {
    const asked = this.waiting.get(message.id);
    if (!asked) return this.tabs.get(message.sessionId)?.hear(message.method, message.params);
    this.waiting.delete(message.id);
    if (message.error) asked.fail(new Error(`${asked.method}: ${message.error.message}`));
    else asked.done(message.result);
  }
  send(method, params = {}, sessionId = undefined) {
    const id = this.nextId++;
    return new Promise((done, fail) => {
      this.waiting.set(id, { done, fail, method });
      this.child.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId })}\0`);
    });
  }
  /** seesWorkers: `requests` has those of the page's workers too. */
  async open(url, { width = 640, height = 360, seesWorkers = false } = {}) {
    const { targetId } = await this.send('Target.createTarget', { url: 'about:blank' });
    const { sessionId } = await this.send('Target.attachToTarget', { targetId, flatten: true });
    const tab = new Tab(this, targetId, sessionId);
    this.tabs.set(sessionId, tab);
    for (const domain of ['Page', 'Runtime', 'Network', 'Log']) await tab.send(`${domain}.enable`);
    if (seesWorkers) await tab.send('Target.setAutoAttach', { autoAttach: true, waitForDebuggerOnStart: false, flatten: true });
    await tab.resize(width, height);
    await tab.go(url);
    return tab;
  }
  async end() {
    await Promise.race([this.send('Browser.close').catch(() => {}), limit(2_000)]);
    if (this.child.exitCode === null && this.child.signalCode === null) {
      this.child.kill('SIGKILL');
      await new Promise((done) => this.child.once('exit', done));
    }
    await removeFolder(this.profile);
  }
}

export class Tab {
  constructor(browser, targetId, sessionId) {
    Object.assign(this, { browser, targetId, sessionId, errors: [], requests: [] });
  }
  send(method, params) {
    return this.browser.send(method, params, this.sessionId);
  }
  /** `errors` are what the console shows as such; `requests` what the page itself asked for. */
  hear(method, params) {
    if (method === 'Runtime.exceptionThrown') this.errors.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === 'Runtime.consoleAPICalled' && params.type === 'error') this.errors.push(params.args.map((one) => one.value ?? one.description).join(' '));
    if (method === 'Log.entryAdded' && params.entry.level === 'error') this.errors.push(`${params.entry.text} ${params.entry.url ?? ''}`);
    if (method === 'Network.requestWillBeSent') this.requests.push({ url: params.request.url, headers: params.request.headers, at: params.wallTime });
    if (method === 'Target.attachedToTarget') {
      this.browser.tabs.set(params.sessionId, this);
      void this.browser.send('Network.enable', {}, params.sessionId);
    }
    if (method === 'Network.webSocketCreated') this.requests.push({ url: params.url, headers: {} });
  }
  go(url) {
    return this.send('Page.navigate', { url });
  }
  resize(width, height) {
    return this.send('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: 1, mobile: false });
  }
  async evaluate(expression) {
    const { result, exceptionDetails } = await this.send('Runtime.evaluate', { expression, awaitPromise: true, returnByValue: true });
    if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description ?? exceptionDetails.text}`);
    return result.value;
  }
  /** The page's own account of itself. */
  async state() {
    return JSON.parse((await this.evaluate('document.documentElement.dataset.strandcast ?? "{}"')) || '{}');
  }
  /** Waits for condition(state) to hold, and gives that state; throws with what the state was instead. */
  async until(condition, what, ms = USUAL_MS) {
    const end = Date.now() + ms;
    let state;
    while (Date.now() < end) {
      state = await this.state().catch(() => ({}));
      if (await condition(state)) return state;
      await sleep(POLL_MS);
    }
    const words = await this.evaluate('document.body?.innerText ?? ""').catch(() => '');
    throw new Error(`${what}: not within ${ms} ms; state ${JSON.stringify(state)}; ${this.errors.join(' | ')}; ${words.slice(0, 300)}`);
  }
  async press(key) {
    const code = key.length === 1 ? `Key${key.toUpperCase()}` : key;
    const text = { Enter: '\r' }[key] ?? (key.length === 1 ? key : undefined);
    const windowsVirtualKeyCode = { ArrowLeft: 37, ArrowUp: 38, ArrowRight: 39, ArrowDown: 40, Enter: 13, Escape: 27, Tab: 9 }[key] ?? key.toUpperCase().charCodeAt(0);
    await this.send('Input.dispatchKeyEvent', { type: 'keyDown', key, code, text, windowsVirtualKeyCode });
    await this.send('Input.dispatchKeyEvent', { type: 'keyUp', key, code, windowsVirtualKeyCode });
  }
  async drag(from, to, steps = 5) {
    const mouse = (type, x, y) => this.send('Input.dispatchMouseEvent', { type, x, y, button: 'left', buttons: type === 'mouseReleased' ? 0 : 1, clickCount: 1 });
    await mouse('mousePressed', ...from);
    for (let i = 1; i <= steps; ++i) await mouse('mouseMoved', from[0] + ((to[0] - from[0]) * i) / steps, from[1] + ((to[1] - from[1]) * i) / steps);
    await mouse('mouseReleased', ...to);
  }
  /** PNG; also to a file where one is named. */
  async screenshot(file = undefined) {
    const { data } = await this.send('Page.captureScreenshot', { format: 'png' });
    const bytes = Buffer.from(data, 'base64');
    if (file) fs.writeFileSync(file, bytes);
    return bytes;
  }
  async close() {
    await this.browser.send('Target.closeTarget', { targetId: this.targetId });
    this.browser.tabs.delete(this.sessionId);
  }
}
