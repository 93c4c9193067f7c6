// Firefox for tests: headless, over Marionette's TCP port, without any package of Node. A window is what browser.mjs calls a
// tab, as far as tests of both browsers use one.
//   const firefox = await Firefox.start(); const tab = await firefox.open('http://127.0.0.1:7878/'); await firefox.end();
import { spawn } from 'node:child_process';
import fs from 'node:fs';
import net from 'node:net';
import os from 'node:os';
import path from 'node:path';
import { limit, sleep } from './browser.mjs';

const START_MS = 60_000;
const USUAL_MS = 30_000;
const POLL_MS = 50;
const PREFERENCES = {
  'marionette.port': 0, 'remote.prefs.recommended': true, 'webgl.force-enabled': true, 'browser.shell.checkDefaultBrowser': false,
  'datareporting.policy.dataSubmissionEnabled': false, 'toolkit.telemetry.enabled': false, 'app.update.auto': false,
  'app.normandy.enabled': false, 'browser.startup.page': 0, 'layout.css.devPixelsPerPx': '1.0', 'ui.systemUsesDarkTheme': 0,
};

function findFirefox() {
  const folders = (process.env.PATH ?? '').split(':');
  return folders.flatMap((folder) => ['firefox-esr', 'firefox'].map((name) => path.join(folder, name))).find((file) => fs.existsSync(file));
}
/** Why there is no Firefox to test with; undefined where there is one. */
export const whyNoFirefox = () => (findFirefox() ? undefined : 'needs Firefox (firefox-esr)');

export class Firefox {
  static async start() {
    const profile = fs.mkdtempSync(path.join(os.tmpdir(), 'strandcast-firefox-'));
    const lines = Object.entries(PREFERENCES).map(([name, value]) => `user_pref(${JSON.stringify(name)}, ${JSON.stringify(value)});`);
    fs.writeFileSync(path.join(profile, 'user.js'), `${lines.join('\n')}\n`);
    const child = spawn(findFirefox(), ['--headless', '--marionette', '--no-remote', '--profile', profile, 'about:blank'],
      { stdio: 'ignore', env: { ...process.env, HOME: profile, MOZ_CRASHREPORTER_DISABLE: '1' } });
    const portFile = path.join(profile, 'MarionetteActivePort');
    const since = Date.now();
    while (!(fs.existsSync(portFile) && fs.readFileSync(portFile, 'utf8'))) {
      if (child.exitCode !== null || Date.now() - since > START_MS) throw new Error('Firefox did not start');
      await sleep(POLL_MS);
    }
    const firefox = new Firefox(child, profile, net.connect(Number(fs.readFileSync(portFile, 'utf8')), '127.0.0.1'));
    await firefox.send('WebDriver:NewSession', { capabilities: { alwaysMatch: { acceptInsecureCerts: true } } });
    return firefox;
  }
  constructor(child, profile, socket) {
    Object.assign(this, { child, profile, socket, nextId: 1, waiting: new Map(), rest: Buffer.alloc(0) });
    socket.on('data', (bytes) => this.take(bytes));
    socket.on('error', () => {});
    child.on('exit', () => {
      for (const { fail } of this.waiting.values()) fail(new Error('Firefox ended'));
    });
  }
  /** Messages are LENGTH:JSON. The first one only greets. */
  take(bytes) {
    this.rest = Buffer.concat([this.rest, bytes]);
    for (let colon; (colon = this.rest.indexOf(':')) > 0; ) {
      const size = Number(this.rest.subarray(0, colon));
      if (this.rest.length < colon + 1 + size) return;
      const message = JSON.parse(this.rest.subarray(colon + 1, colon + 1 + size));
      this.rest = this.rest.subarray(colon + 1 + size);
      if (!Array.isArray(message)) continue;
      const [, id, error, result] = message;
      const asked = this.waiting.get(id);
      this.waiting.delete(id);
      if (error) asked?.fail(new Error(`${asked.name}: ${error.message}`));
      else asked?.done(result);
    }
  }
  send(name, params = {}) {
    const id = this.nextId++;
    return new Promise((done, fail) => {
      this.waiting.set(id, { done, fail, name });
      const text = JSON.stringify([0, id, name, params]);
      this.socket.write(`${Buffer.byteLength(text)}:${text}`);
    });
  }
  /** In the one window, whose inside gets this size. */
  async open(url, { width = 640, height = 360 } = {}) {
    await this.send('WebDriver:Navigate', { url: 'about:blank' });
    await this.resize(width, height);
    await this.send('WebDriver:Navigate', { url });
    return this;
  }
  async resize(width, height) {
    await this.send('WebDriver:SetWindowRect', { width, height });
    const [inWidth, inHeight] = await this.evaluate('[innerWidth, innerHeight]');
    await this.send('WebDriver:SetWindowRect', { width: 2 * width - inWidth, height: 2 * height - inHeight });
  }
  /** The same with tabs, as browser.mjs has them. What the console and the network say is not seen. */
  get withTabs() {
    const turnTo = (handle, focus) => this.send('WebDriver:SwitchToWindow', { handle, focus });
    const open = async (url, size) => {
      const [first] = await this.send('WebDriver:GetWindowHandles'); // the one before may be closed
      await turnTo(first, true);
      const { handle } = await this.send('WebDriver:NewWindow', { type: 'tab', focus: true });
      const tab = Object.assign(Object.create(this), { errors: [], requests: [] });
      tab.send = (name, params) => (name === 'Page.bringToFront' ? turnTo(handle, true) : turnTo(handle, false).then(() => this.send(name, params)));
      tab.close = () => tab.send('WebDriver:CloseWindow');
      await turnTo(handle, true);
      return tab.open(url, size);
    };
    return { open, end: () => this.end() };
  }
  async evaluate(expression) {
    return (await this.send('WebDriver:ExecuteScript', { script: `return (${expression});`, args: [] })).value;
  }
  /** What the page says of itself (app.ts). */
  async state() {
    return JSON.parse((await this.evaluate('document.documentElement.dataset.strandcast')) ?? '{}');
  }
  async until(isSo, what, patienceMs = USUAL_MS) {
    const since = Date.now();
    for (;;) {
      const now = await this.state();
      if (await isSo(now)) return now;
      if (Date.now() - since > patienceMs) throw new Error(`waited in vain for ${what}: ${JSON.stringify(now)}`);
      await sleep(POLL_MS);
    }
  }
  async press(key) {
    const names = { End: '\uE010', Home: '\uE011', ArrowLeft: '\uE012', ArrowUp: '\uE013', ArrowRight: '\uE014', ArrowDown: '\uE015', Enter: '\uE007', Escape: '\uE00C', Tab: '\uE004' };
    const value = names[key] ?? key;
    await this.send('WebDriver:PerformActions', { actions: [{ type: 'key', id: 'keys', actions: [{ type: 'keyDown', value }, { type: 'keyUp', value }] }] });
  }
  async drag(from, to, steps = 5) {
    const move = (part) => ({ type: 'pointerMove', duration: 20, x: Math.round(from[0] + (to[0] - from[0]) * part), y: Math.round(from[1] + (to[1] - from[1]) * part) });
    const moves = Array.from({ length: steps }, (_, i) => move((i + 1) / steps));
    const actions = [move(0), { type: 'pointerDown', button: 0 }, ...moves, { type: 'pointerUp', button: 0 }];
    await this.send('WebDriver:PerformActions', { actions: [{ type: 'pointer', id: 'mouse', parameters: { pointerType: 'mouse' }, actions }] });
  }
  /** PNG; also to a file where one is named. */
  async screenshot(file = undefined) {
    const { value } = await this.send('WebDriver:TakeScreenshot', { full: false, hash: false });
    const bytes = Buffer.from(value, 'base64');
    if (file) fs.writeFileSync(file, bytes);
    return bytes;
  }
  async end() {
    await Promise.race([this.send('Marionette:Quit', { flags: ['eForceQuit'] }).catch(() => {}), limit(3_000)]);
    if (this.child.exitCode === null && this.child.signalCode === null) {
      this.child.kill('SIGKILL');
      await new Promise((done) => this.child.once('exit', done));
    }
    this.socket.destroy();
    for (let attempt = 0; attempt < 50; ++attempt) {
      try {
        return fs.rmSync(this.profile, { recursive: true, force: true });
      } catch {
        await sleep(100);
      }
    }
  }
}
