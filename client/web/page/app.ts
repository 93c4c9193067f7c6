// The page: its window, controls and measurements. The connection and the drawing are in workers (session.ts,
// drawer.ts); what comes here is small, but for the server's pictures.
import { keepToken, keptToken, linkTo, readFragment, withoutToken } from './address';
import { timecodeText } from './clock';
import { compileCore } from './core';
import { HIDDEN_MS, type Asked, type Camera, type DrawFigures, type FromDraw, type FromNet, type NetFigures, type ToDraw, type ToNet } from './messages';
import { element } from './ui/element';
import { followFiles } from './ui/files';
import { Hud, Row, Warnings } from './ui/hud';
import type { SocketStart } from './socket';
import { TAPE_URL, type TapePlace, type ToTape } from './tape';
import { cameraOf, fittedTo, followKey, followPointers, presets } from './ui/orbit';
import { Panel } from './ui/panel';
import { Timeline } from './ui/timeline';
import {
  CameraMessage, Command, Device, FrameQualityMessage, LookMessage, Mode, Role, StatusMessage, StreamQualityMessage,
  WelcomeMessage,
} from './wire';

const MOST_PICTURE_SIDE = 1280; // of pictures that the server draws for this window
const SAMPLES = 4;
const FILLS_WITHIN = 0.05; // of a window's shape
const WINDOW_MS = 150; // between two sizes that the server hears of
const QUIET_MS = 1500; // so long a picture may stand without a word about the connection

// The token leaves the address before anything is asked for.
const wishes = readFragment(location.hash);
const bundle = globalThis.strandcastBundle;
if (!bundle) history.replaceState(null, '', location.pathname + location.search + withoutToken(location.hash));
if (wishes.token && wishes.keepsToken) keepToken(wishes.token);
wishes.token ||= keptToken();

const at = <T extends HTMLElement>(id: string): T => document.getElementById(id) as T;
const stage = at('stage');
const pictures = at<HTMLCanvasElement>('pictures');
const strands = at<HTMLCanvasElement>('strands');
const hud = new Hud(at<HTMLButtonElement>('hud-line'), at('hud-table'));
const warnings = new Warnings(at('warnings'), at('lasting'));

interface Assets {
  core: string;
  stepCore: string; // takes steps of the default solver
  wholeCore: string; // of every solver
}
function assets(): Assets {
  const content = document.querySelector<HTMLMetaElement>('meta[name=strandcast-assets]')?.content ?? '';
  return content.startsWith('{') ? (JSON.parse(content) as Assets) : { core: 'strand_page.wasm', stepCore: 'strand_step.wasm', wholeCore: 'strand_core.wasm' };
}

const ownScript = (): string => document.querySelector<HTMLScriptElement>('script[type=module]')!.src;

const sentence = (text: string): string => (text ? `${text[0]!.toUpperCase()}${text.slice(1).replace(/\.$/, '')}.` : '');

const fitted = (camera: Camera): Camera => fittedTo(camera, stage.clientWidth / Math.max(stage.clientHeight, 1));

/** A value of a look by its path, in a copy. */
function withValue(look: LookMessage, path: string, value: string): LookMessage {
  const copy = structuredClone(look) as LookMessage;
  const names = path.split('.').slice(1);
  let place = copy as unknown as { [name: string]: unknown };
  for (const name of names.slice(0, -1)) place = place[name] as { [name: string]: unknown };
  const last = names[names.length - 1]!;
  place[last] = typeof place[last] === 'number' ? Number(value) : value;
  return copy;
}

class Viewer {
  private readonly net: Worker;
  private draw?: Worker;
  private readonly states = new MessageChannel(); // from the connection to what draws
  private canDraw = false;
  private isDrawingMade = false;
  private asked: Asked;
  private welcome?: WelcomeMessage;
  private status?: StatusMessage;
  private quality?: StreamQualityMessage;
  private frameQuality?: FrameQualityMessage;
  private look?: LookMessage; // the scene's
  private ownLook?: LookMessage; // of this window alone
  private home: Camera = cameraOf(undefined);
  private camera: Camera = this.home;
  private isOwnCamera = false;
  private isHeld = false;
  private shown: number = -1;
  private reason = '';
  private figures?: NetFigures;
  private drawFigures?: DrawFigures;
  private drawnBy = '';
  private drawWhy = '';
  private device: number = Device.unknown;
  private isDrawingLost = false;
  private rate = { bytes: 0, timeMs: 0, kbits: 0 };
  private pictureTimes: number[] = [];
  private pictureCount = 0;
  private isConnected = false;
  private sentCamera = '';
  private windowTimer = 0;
  private retryAtMs = 0;
  private lostAtMs = 0; // 0 while connected
  private readonly panel: Panel;
  private timeline?: Timeline; // of a recording in the page
  private hiddenTimer = 0;

  constructor() {
    this.canDraw = typeof OffscreenCanvas !== 'undefined' && 'transferControlToOffscreen' in strands;
    const scheme = location.protocol === 'https:' ? 'wss:' : 'ws:';
    const beside = location.pathname.replace(/[^/]*$/, ''); // behind a proxy a session has a folder of its own
    this.asked = {
      url: bundle ? TAPE_URL : `${scheme}//${location.host}${beside}v1`, token: wishes.token, mode: bundle ? Mode.strands : wishes.mode,
      codec: bundle?.codec ?? wishes.codec, head: wishes.head, pictures: wishes.pictures,
      role: wishes.isViewOnly ? Role.viewer : Role.controller, ...this.pictureSize(), drawsStrands: this.canDraw,
    };
    const sockets = new MessageChannel();
    const { stepCore, wholeCore } = assets();
    const start: SocketStart = { port: sockets.port2, tape: bundle?.tape };
    const socket = this.startWorker('socket');
    socket.postMessage(start, [sockets.port2]);
    if (bundle) this.showTimeline(socket);
    this.net = this.startWorker('net');
    this.net.onmessage = (event: MessageEvent<FromNet>) => this.fromNet(event.data);
    this.toNet({ kind: 'start', stepCore, wholeCore, asked: this.asked, states: this.states.port1, sockets: sockets.port1 },
      [this.states.port1, sockets.port1]);
    // Who asks for the server's pictures sees one before anything is made ready to draw here.
    if (wishes.mode !== Mode.frames) this.makeDrawing();
    if (wishes.camera) {
      this.camera = wishes.camera;
      this.isOwnCamera = true;
    }
    this.panel = new Panel(at('panel'), {
      set: (path, value) => this.set(path, value),
      askScene: () => this.askScene(),
      askControls: () => this.toNet({ kind: 'controls' }),
      close: () => this.togglePanel(),
    });
    this.bind();
    setInterval(() => this.tick(), 500);
    if (!isSecureContext) {
      warnings.say('This page came without TLS: the browser then decodes no video. Over https pictures would take less of the link.');
    }
  }

  private showTimeline(socket: Worker): void {
    const timeline = (this.timeline = new Timeline((wish: ToTape) => socket.postMessage(wish)));
    socket.onmessage = (event: MessageEvent<TapePlace>) => timeline.show(event.data);
    document.querySelector('main')!.append(timeline.card);
    for (const id of ['mode', 'link', 'reset']) (at(id).closest('label') ?? at(id)).hidden = true;
    at('keys').querySelector('dl')!.append(element('dt', 'Home, End, comma, point'), element('dd', 'begin, end, a second back or on'));
  }
  private startWorker(name: string): Worker {
    // A file's document may start no modules of its own as workers.
    const made = bundle ? new Worker(bundle.script, { name }) : new Worker(ownScript(), { type: 'module', name });
    made.onerror = () => this.ended('this browser does not start the page’s workers');
    return made;
  }
  /** What draws here, and what it draws and the connection decodes with. */
  private makeDrawing(): void {
    if (this.isDrawingMade) return;
    this.isDrawingMade = true;
    const compiled = compileCore(new URL(assets().core, location.href).href);
    if (this.canDraw) {
      this.draw = this.startWorker('draw');
      this.draw.onmessage = (event: MessageEvent<FromDraw>) => this.fromDraw(event.data);
      // What draws is found while the core still comes.
      const canvas = strands.transferControlToOffscreen();
      this.toDraw({ kind: 'start', canvas, wish: wishes.draw, samples: SAMPLES }, [canvas as unknown as Transferable]);
      this.tellVisible();
      this.toDraw({ kind: 'camera', camera: this.camera, isMoving: this.isHeld });
      if (this.look) this.showLook();
    } else {
      this.device = Device.none;
      this.drawWhy = 'this browser cannot draw beside the page';
    }
    const { port2 } = this.states;
    compiled.then((module) => {
      this.toNet({ kind: 'core', core: module });
      this.toDraw({ kind: 'core', core: module, states: port2 }, [port2]);
    }, (error: Error) => this.toNet({ kind: 'noCore', reason: error.message }));
  }

  private toNet(message: ToNet, transfer: Transferable[] = []): void {
    this.net.postMessage(message, transfer);
  }
  private toDraw(message: ToDraw, transfer: Transferable[] = []): void {
    this.draw?.postMessage(message, transfer);
  }
  private get isController(): boolean {
    return this.welcome?.role === Role.controller || this.welcome?.role === Role.admin;
  }

  // ---- from the connection

  private fromNet(message: FromNet): void {
    switch (message.kind) {
      case 'welcome':
        return this.begin(message.welcome);
      case 'state':
        return this.connection(message.state, message.reason, message.retryMs);
      case 'shown':
        this.shown = message.mode;
        this.reason = message.reason || this.reason;
        return this.showMode();
      case 'modeReason':
        this.reason = message.reason;
        return this.tick();
      case 'look':
        return this.sceneLook(message.look, message.camera);
      case 'moved': // by somebody who controls
        return this.change(() => fitted(cameraOf(message.camera)));
      case 'status':
        this.status = message.status;
        at('pause').classList.toggle('paused', message.status.is_paused);
        at('pause').querySelector('.label')!.textContent = message.status.is_paused ? 'Resume' : 'Pause';
        at<HTMLButtonElement>('step').disabled = !message.status.is_paused;
        return;
      case 'quality':
        this.quality = message.quality;
        return;
      case 'frameQuality':
        this.frameQuality = message.quality;
        return;
      case 'notice':
        return this.notice(message.text, message.isError);
      case 'sceneText':
        return this.panel.showScene(message.text);
      case 'parameters':
        return this.panel.showControls(message.parameters);
      case 'picture':
        return this.showPicture(message.picture, message.width, message.height);
      case 'figures':
        this.figures = message.figures;
        return;
    }
  }

  private notice(text: string, isError: boolean): void {
    // A slider says itself what it has done.
    if (isError || !/^(hair\.|quality=|Left out: a newer)/.test(text)) warnings.say(text, isError);
  }
  private begin(welcome: WelcomeMessage): void {
    this.welcome = welcome;
    this.reason = welcome.mode_reason;
    this.quality = undefined;
    at('simulation-tools').hidden = !this.isController && !bundle;
    this.sceneLook(welcome.look, welcome.camera);
    this.panel.setRole(this.isController, this.shown !== Mode.frames);
    at('head').replaceChildren(...welcome.heads.map((name) => new Option(name)));
    at<HTMLSelectElement>('head').value = welcome.scene_name;
    this.showHeads();
    if (this.panel.isOpen) this.panel.ask();
    this.sentCamera = '';
    this.lookFrom(this.camera);
    if (wishes.codec && wishes.codec !== welcome.codec) warnings.say(`Not by the codec ${wishes.codec}: ${sentence(welcome.codec_reason)}`);
    const isFull = welcome.look?.methods && Object.values(welcome.look.methods).some((name) => name && name !== 'main');
    if (isFull) warnings.say('This look asks for ways to draw that only the server has: strands are drawn here by the usual ones.');
  }
  /** Strands are those of one head; the server's pictures show all. */
  private showHeads(): void {
    at('head-choice').hidden = (this.welcome?.heads.length ?? 0) < 2 || this.shown === Mode.frames;
  }
  private sceneLook(look: LookMessage | undefined, camera: CameraMessage | undefined): void {
    if (look) {
      this.look = look;
      this.showLook();
    }
    if (!camera) return;
    this.home = cameraOf(camera);
    if (!this.isOwnCamera) this.lookFrom(fitted(this.home));
  }
  private showLook(): void {
    const look = this.ownLook ?? this.look!;
    this.toDraw({ kind: 'look', look });
    this.panel.showLook(look);
  }

  private connection(state: 'connecting' | 'open' | 'silent' | 'waiting' | 'ended', reason: string, retryMs: number): void {
    this.isConnected = state === 'open';
    document.body.dataset.connection = state;
    const box = at('trouble');
    const isTokenWanted = state === 'ended' && /token|role/i.test(reason);
    const wasAway = !box.hidden;
    this.lostAtMs = state === 'open' ? 0 : this.lostAtMs || performance.now();
    box.hidden = state === 'open' || (state !== 'ended' && box.hidden && this.isQuiet());
    const title = at('trouble-title');
    title.textContent = isTokenWanted ? 'Sign in' : state === 'silent' ? 'Not connected' : state === 'ended' ? `No connection to ${location.host}`
      : this.welcome ? `Connection to ${location.host} lost` : `Connecting to ${location.host}`;
    title.dataset.short = isTokenWanted ? 'Sign in' : state === 'connecting' && !this.welcome ? 'Connecting' : 'Not connected';
    if (reason || state === 'open') at('trouble-why').textContent = sentence(reason);
    this.retryAtMs = state === 'waiting' ? performance.now() + retryMs : 0;
    at('trouble-next').textContent = state === 'connecting' ? 'Waiting for its answer.' : '';
    at('try-now').hidden = state !== 'waiting' && !(state === 'ended' && !isTokenWanted);
    at('token-form').hidden = !isTokenWanted;
    if (isTokenWanted) {
      keepToken(''); // it was refused
      at('token').focus();
    }
    if (state === 'open' && wasAway && this.shown >= 0) warnings.say('Connected again.');
    this.tick();
  }
  /** What was seen stays seen for the moment that a reconnection takes. */
  private isQuiet(): boolean {
    return this.shown >= 0 && performance.now() - this.lostAtMs < QUIET_MS;
  }
  private ended(reason: string): void {
    this.connection('ended', reason, 0);
  }

  private showPicture(picture: VideoFrame | ImageBitmap, width: number, height: number): void {
    if (pictures.width !== width) pictures.width = width;
    if (pictures.height !== height) pictures.height = height;
    // Sides are whole blocks: what differs from the window's by that much is cut off.
    const shape = (width / height) / (stage.clientWidth / Math.max(stage.clientHeight, 1));
    pictures.classList.toggle('fills', Math.abs(shape - 1) < FILLS_WITHIN);
    pictures.getContext('2d', { alpha: false })!.drawImage(picture as ImageBitmap, 0, 0, width, height);
    picture.close();
    this.pictureTimes.push(performance.now());
    this.notePicture(Mode.frames);
    requestAnimationFrame(() => this.toNet({ kind: 'pictureShown' }));
    this.makeDrawing();
  }
  /** For who measures the page: what it shows, and how many pictures it has shown. */
  private notePicture(mode: number): void {
    if (!this.pictureCount++) performance.mark('first picture');
    document.body.dataset.pictures = String(this.pictureCount);
    document.body.dataset.shows = mode === Mode.frames ? 'pictures' : 'strands';
  }
  private showMode(): void {
    const isFrames = this.shown === Mode.frames;
    pictures.hidden = !isFrames;
    strands.hidden = isFrames;
    this.tellVisible();
    this.panel.setRole(this.isController, !isFrames);
    this.showHeads();
    this.sentCamera = '';
    this.lookFrom(this.camera);
    this.tick();
  }

  // ---- from the drawing

  private fromDraw(message: FromDraw): void {
    switch (message.kind) {
      case 'ready':
        this.device = message.device;
        this.drawnBy = message.drawnBy;
        this.drawWhy = message.why;
        this.sendSize();
        if (this.isDrawingLost) this.toNet({ kind: 'mode', mode: this.asked.mode }); // the card is back
        this.isDrawingLost = false;
        return;
      case 'figures':
        this.drawFigures = message.figures;
        return;
      case 'drawn':
        return this.notePicture(Mode.strands);
      case 'shot':
        if (message.blob) this.save(message.blob);
        return;
      case 'failed':
        this.device = Device.none;
        this.isDrawingLost = true;
        this.drawWhy = message.reason;
        warnings.say(`Strands cannot be drawn here: ${message.reason}. The server’s pictures are shown.`, true);
        return this.toNet({ kind: 'mode', mode: Mode.frames });
    }
  }

  // ---- what a person does

  private pictureSize(): { width: number; height: number } {
    if (wishes.size) return wishes.size;
    const ratio = Math.min(devicePixelRatio, MOST_PICTURE_SIDE / Math.max(innerWidth, innerHeight, 1));
    const side = (length: number): number => Math.max(64, Math.round((length * ratio) / 16) * 16);
    return { width: side(innerWidth), height: side(innerHeight) };
  }
  /** The server draws for this size, and nothing while nobody sees it. */
  private tellWindow(): void {
    clearTimeout(this.windowTimer);
    this.windowTimer = 0;
    Object.assign(this.asked, this.pictureSize());
    this.toNet({ kind: 'window', width: this.asked.width, height: this.asked.height, isHidden: document.hidden });
  }
  private tellVisible(): void {
    this.toDraw({ kind: 'visible', isVisible: this.shown !== Mode.frames && !document.hidden });
  }
  /** Who looks at another tab for a moment comes back to a stream that went on. */
  private followVisibility(): void {
    this.tellVisible();
    clearTimeout(this.hiddenTimer);
    if (document.hidden) this.hiddenTimer = window.setTimeout(() => this.tellWindow(), HIDDEN_MS);
    else this.tellWindow();
    if (!document.hidden) this.toNet({ kind: 'wake' });
    this.tick();
  }
  private sendSize(): void {
    const ratio = Math.min(devicePixelRatio, 2);
    const size = wishes.size ?? { width: Math.round(stage.clientWidth * ratio), height: Math.round(stage.clientHeight * ratio) };
    this.toDraw({ kind: 'size', ...size });
  }
  private lookFrom(camera: Camera): void {
    this.camera = camera;
    this.toDraw({ kind: 'camera', camera, isMoving: this.isHeld });
    const text = JSON.stringify(camera);
    if (text === this.sentCamera || !this.welcome) return;
    this.sentCamera = text;
    this.toNet({ kind: 'camera', camera });
  }
  private change = (move: (camera: Camera) => Camera): void => {
    this.isOwnCamera = true;
    at<HTMLSelectElement>('view').value = '';
    this.lookFrom(move(this.camera));
  };
  private usePreset(index: number): void {
    const preset = presets[index];
    if (!preset) return;
    this.isOwnCamera = index !== 0;
    at<HTMLSelectElement>('view').value = String(index);
    this.lookFrom(preset.from(fitted(this.home)));
  }
  private set(path: string, value: string): void {
    if (this.isController) return this.toNet({ kind: 'set', assignment: `${path}=${value}` });
    if (!this.look || !path.startsWith('look.')) return;
    this.ownLook = withValue(this.ownLook ?? this.look, path, value);
    this.showLook();
  }
  /** Who only watches may not even ask. */
  private askScene(): void {
    if (this.isController) this.toNet({ kind: 'scene' });
  }
  private command(command: number): void {
    if (this.timeline) this.timeline.send({ kind: 'command', command });
    else if (this.isController) this.toNet({ kind: 'command', command });
    else warnings.say('You watch here: the token or the server gives no right to steer.');
  }
  private togglePause(): void {
    this.command(this.status?.is_paused ? Command.resume : Command.pause);
  }
  private setMode(mode: number): void {
    this.asked.mode = mode;
    if (mode !== Mode.frames) this.makeDrawing();
    at<HTMLSelectElement>('mode').value = String(mode);
    this.toNet({ kind: 'mode', mode });
  }
  private togglePanel(): void {
    this.panel.toggle();
    at('look').setAttribute('aria-expanded', String(this.panel.isOpen));
    if (this.panel.isOpen) at('panel').querySelector('button')?.focus();
    else this.focusTool('look');
  }
  /** Or the menu, where it holds the tools back. */
  private focusTool(id: string): void {
    at(id).focus();
    if (document.activeElement !== at(id)) at('menu').focus();
  }
  private toggleKeys(): void {
    const keys = at('keys');
    keys.hidden = !keys.hidden;
    at('help').setAttribute('aria-expanded', String(!keys.hidden));
    if (!keys.hidden) at('close-keys').focus();
    else this.focusTool('help');
  }
  private toggleMenu(): void {
    at('menu').setAttribute('aria-expanded', String(at('tools').classList.toggle('open')));
  }
  private shoot(): void {
    if (this.shown === Mode.frames) pictures.toBlob((blob) => blob && this.save(blob));
    else this.toDraw({ kind: 'shot' });
  }
  private save(blob: Blob): void {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(blob);
    link.download = `strandcast-${new Date().toISOString().slice(0, 19).replace(/[:T]/g, '-')}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    warnings.say('Picture saved.');
  }
  private async copyLink(): Promise<void> {
    const link = linkTo(location.origin + location.pathname, this.camera, this.asked.mode, this.asked.head);
    history.replaceState(null, '', link);
    try {
      await navigator.clipboard.writeText(link);
      warnings.say('A link to this view is copied; it holds no token.');
    } catch {
      warnings.say('The link to this view stands in the address; it holds no token.');
    }
  }

  private bind(): void {
    const moves = {
      change: this.change,
      hold: (isHeld: boolean) => {
        this.isHeld = isHeld;
        this.lookFrom(this.camera);
      },
    };
    followPointers(stage, moves);
    followFiles(bundle !== undefined, (text) => warnings.say(text, true));
    const view = at<HTMLSelectElement>('view');
    view.append(new Option('own', ''));
    presets.forEach((preset, i) => view.append(new Option(preset.name, String(i))));
    view.value = this.isOwnCamera ? '' : '0';
    view.addEventListener('change', () => view.value !== '' && this.usePreset(Number(view.value)));
    const mode = at<HTMLSelectElement>('mode');
    mode.value = String(wishes.mode);
    mode.addEventListener('change', () => this.setMode(Number(mode.value)));
    const head = at<HTMLSelectElement>('head');
    head.addEventListener('change', () => {
      this.asked = { ...this.asked, head: head.value };
      this.toNet({ kind: 'reconnect', asked: this.asked });
    });
    at('pause').addEventListener('click', () => this.togglePause());
    at('step').addEventListener('click', () => this.command(Command.stepOnce));
    at('reset').addEventListener('click', () => this.command(Command.reset));
    at('shot').addEventListener('click', () => this.shoot());
    at('link').addEventListener('click', () => void this.copyLink());
    at('look').addEventListener('click', () => this.togglePanel());
    for (const id of ['help', 'close-keys']) at(id).addEventListener('click', () => this.toggleKeys());
    at('menu').addEventListener('click', () => this.toggleMenu());
    at('try-now').addEventListener('click', () => this.toNet({ kind: 'reconnect', asked: this.asked }));
    at('token-form').addEventListener('submit', (event) => {
      event.preventDefault();
      const field = at<HTMLInputElement>('token');
      this.asked = { ...this.asked, token: field.value.trim(), role: wishes.isViewOnly ? Role.viewer : Role.controller };
      keepToken(at<HTMLInputElement>('keep-token').checked ? this.asked.token : '');
      field.value = '';
      this.toNet({ kind: 'reconnect', asked: this.asked });
    });
    new ResizeObserver(() => {
      this.sendSize();
      if (!this.isOwnCamera) this.lookFrom(fitted(this.home));
      this.windowTimer ||= window.setTimeout(() => this.tellWindow(), WINDOW_MS);
    }).observe(stage);
    document.addEventListener('visibilitychange', () => this.followVisibility());
    addEventListener('online', () => this.toNet({ kind: 'wake' }));
    // The way back to a page is quick where the browser may keep it, and it keeps none with a connection.
    addEventListener('pagehide', (event) => event.persisted && this.toNet({ kind: 'rest' }));
    addEventListener('pageshow', (event) => event.persisted && this.toNet({ kind: 'reconnect', asked: this.asked }));
    addEventListener('keydown', (event) => this.key(event, moves));
  }
  private key(event: KeyboardEvent, moves: Parameters<typeof followKey>[1]): void {
    const target = event.target as HTMLElement;
    if (event.ctrlKey || event.metaKey || event.altKey || target.tagName === 'SELECT') return;
    if (event.key === 'Escape') {
      if (!at('keys').hidden) this.toggleKeys();
      else if (this.panel.isOpen) this.togglePanel();
      else if (at('tools').classList.contains('open')) {
        this.toggleMenu();
        at('menu').focus();
      }
      return;
    }
    if (/^(INPUT|TEXTAREA)$/.test(target.tagName)) return;
    if (event.key === ' ' && target.tagName === 'BUTTON') return;
    if (followKey(event, moves) || this.timeline?.key(event.key)) return event.preventDefault();
    const actions: { [key: string]: () => void } = {
      ' ': () => this.togglePause(), n: () => this.command(Command.stepOnce), r: () => this.usePreset(0),
      m: () => this.setMode({ [Mode.auto]: Mode.strands, [Mode.strands]: Mode.frames, [Mode.frames]: Mode.auto }[this.asked.mode] ?? Mode.auto),
      s: () => this.shoot(), l: () => this.togglePanel(), u: () => hud.toggle(), h: () => this.toggleKeys(),
      f: () => void (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen()),
    };
    const action = actions[event.key.toLowerCase()];
    if (action) action();
    else if (/^[1-6]$/.test(event.key)) this.usePreset(Number(event.key));
    else return;
    event.preventDefault();
    this.tick();
  }

  // ---- twice a second

  /** Of the tab: what one wants to know who looks at another one. */
  private title(): string {
    const what = at('trouble').hidden ? (this.status?.is_paused ? 'Paused' : '') : at('trouble-title').dataset.short;
    return [what, this.welcome?.scene_name, 'Strandcast'].filter(Boolean).join(': ');
  }
  private tick(): void {
    const now = performance.now();
    const title = this.title();
    if (document.title !== title) document.title = title;
    if (this.lostAtMs && !this.isQuiet()) at('trouble').hidden = false;
    if (this.retryAtMs) {
      const seconds = Math.max(0, (this.retryAtMs - now) / 1000);
      at('trouble-next').textContent = `Trying again in ${seconds.toFixed(0)} s.`;
    }
    const figures = this.figures;
    const bytes = figures?.receivedBytes ?? 0;
    if (now - this.rate.timeMs > 1500) {
      const kbits = (Math.max(0, bytes - this.rate.bytes) * 8) / Math.max(now - this.rate.timeMs, 1);
      this.rate = { bytes, timeMs: now, kbits };
    }
    this.pictureTimes = this.pictureTimes.filter((time) => now - time < 2000);
    const isFrames = this.shown === Mode.frames;
    const hz = isFrames ? this.pictureTimes.length / 2 : this.drawFigures?.shownHz ?? 0;
    this.toNet({ kind: 'drawn', drawMs: this.drawFigures?.drawMs ?? 0, shownHz: hz, device: this.device });
    this.showWarnings();
    at('why').textContent = this.isConnected && this.shown >= 0 ? sentence(this.reason) : '';
    this.tellTests(hz);
    if (!this.welcome || !figures) return hud.show(this.isConnected ? 'Connected' : 'Connecting', []);
    hud.show(this.line(hz), this.rows(hz));
  }
  /** What tests/web/page_browser.mjs and tests/bench/page.mjs read; nothing here reads it. */
  private tellTests(hz: number): void {
    document.documentElement.dataset.strandcast = JSON.stringify({
      isConnected: this.isConnected, mode: ['strands', 'pictures'][this.shown] ?? '', hz, camera: this.camera.offset,
      states: this.figures?.decodedFrames ?? 0, bytes: this.figures?.receivedBytes ?? 0, pictures: this.pictureCount, codec: this.figures?.codec ?? '',
      stream: this.quality && [this.quality.strand_share, this.quality.rate_divisor],
      decodeMs: this.figures?.decodeMs ?? 0, wholeMs: this.drawFigures?.leastWholeMs ?? 0, share: this.drawFigures?.share ?? 0,
      hash_ok: !this.figures?.rejectedFrames, wrong: this.figures?.rejectedFrames ?? 0, timeMs: this.timeline?.place?.timeMs, rejected: this.figures?.lastError ?? '', error: at('trouble').hidden ? '' : at('trouble-why').textContent,
    });
  }
  private showWarnings(): void {
    const all: string[] = [];
    if (bundle && this.figures?.rejectedFrames)
      all.push(`${this.figures.rejectedFrames} frames cannot be shown as they were recorded: ${this.figures.lastError}`);
    if (this.status?.is_paused) all.push(this.isController || bundle ? 'Paused: Space resumes, N steps' : 'Paused');
    if (this.isConnected && this.status?.is_motion_stale && !this.status.is_paused)
      all.push(`No head motion arrives at the server${this.isController ? ': strandcast-ctl feed sends some' : ''}`);
    if (this.isConnected && this.status?.slow_motion) all.push(this.status.slow_motion);
    if (this.isConnected && this.status?.detail) all.push(this.status.detail);
    warnings.keep(all);
  }
  private latencyMs(): number {
    const drawMs = this.shown === Mode.frames ? 0 : this.drawFigures?.drawMs ?? 0;
    return this.figures!.motionMs ? this.figures!.motionMs + drawMs : 0;
  }
  private line(hz: number): string {
    if (this.shown < 0) return this.isConnected ? 'Connected, the first picture is on its way' : 'not connected';
    const of = (this.welcome?.heads.length ?? 0) > 1 ? ` of ${this.welcome!.scene_name} alone` : '';
    const what = this.shown === Mode.frames ? 'server’s pictures' : `strands${of}`;
    const parts = [hz > 0 ? `${hz >= 9.5 ? hz.toFixed(0) : hz.toFixed(1)} fps` : 'nothing moves', what, `${this.rate.kbits.toFixed(0)} kbit/s`];
    if (this.latencyMs()) parts.push(`${this.latencyMs().toFixed(0)} ms from motion`);
    return this.isConnected ? parts.join(' · ') : `not connected · ${what}`;
  }
  private rows(hz: number): Row[] {
    const welcome = this.welcome!;
    const figures = this.figures!;
    const isFrames = this.shown === Mode.frames;
    const rows: Row[] = [
      ['scene', `${welcome.scene_name}, ${welcome.strand_count} strands x ${welcome.vertex_count}`],
      ['mode', `${isFrames ? 'the server’s pictures' : 'strands, drawn here'}; asked for ${['strands', 'pictures', 'auto'][this.asked.mode]}`],
    ];
    const add = (name: string, text: string): void => void (text && rows.push([name, text]));
    add('because', this.reason);
    if (!bundle) add('you', this.isController ? 'may steer' : 'watch');
    add('shown', `${hz.toFixed(1)} pictures/s`);
    add('drawn by', isFrames ? 'the server' : `${this.drawnBy}: ${this.drawWhy}`);
    const drawn = this.drawFigures;
    if (!isFrames && drawn) {
      add('drawn in', `${drawn.stepMs ? `${drawn.stepMs.toFixed(0)} ms, ` : ''}${drawn.share < 1 ? `at ${(drawn.share * 100).toFixed(0)} % of the window’s sides` : 'as large as the window'}`);
      if (drawn.segments) add('of', `${drawn.strands} strands, ${drawn.segments} segments`);
    }
    if (isFrames) {
      const quality = this.frameQuality;
      add('pictures by', figures.pictureCodec);
      if (quality) add('pictures', `${quality.width} x ${quality.height}, quality ${quality.quality}, at most ${quality.rate_hz.toFixed(0)} Hz: ${quality.reason}`);
    } else {
      const why = figures.codecReason.replace(new RegExp(`^${figures.codec}: `), '');
      add('strands by', figures.codec + (why && `: ${why}`));
      if (figures.exactShare) add('exact', `${(figures.exactShare * 100).toFixed(1)} % of the frames`);
      if (this.quality)
        add('stream of', `${this.quality.strand_share < 1 ? `${(this.quality.strand_share * 100).toFixed(0)} % of the` : 'all'} strands every ${this.quality.rate_divisor > 1 ? `${this.quality.rate_divisor} steps` : 'step'} within ${(this.quality.bound_m * 1000).toPrecision(2)} mm: ${this.quality.reason}`);
    }
    add('decoded in', `${figures.decodeMs.toFixed(2)} ms`);
    if (bundle) {
      add('states', `${figures.decodedFrames} with the hash that was recorded, ${figures.rejectedFrames} refused`);
      add('simulated by', welcome.sim_device);
      return rows;
    }
    const status = this.status;
    if (status) {
      add('simulation', `${status.sim_ms.toFixed(2)} ms, x${status.realtime_factor.toFixed(2)} real time`);
      add('encoded in', `${status.encode_ms.toFixed(2)} ms`);
    }
    add('simulated by', welcome.sim_device);
    add('received', `${this.rate.kbits.toFixed(0)} kbit/s, ${figures.decodedFrames} frames`);
    if (figures.ageMs > 0) add('age', `${figures.ageMs.toFixed(0)} ms`);
    if (this.latencyMs()) add('motion to photon', `${this.latencyMs().toFixed(0)} ms`);
    add('round trip', `${figures.roundTripMs.toFixed(1)} ms${status ? `, ${status.queue_delay_ms.toFixed(0)} ms queued` : ''}`);
    add('dropped', `${status?.dropped_frames ?? 0} at the server, ${figures.missedFrames} missed, ${figures.rejectedFrames} refused, ${figures.replacedStates} not drawn`);
    if (figures.lastError) add('last refused', figures.lastError);
    if (status?.timecode) add('timecode', timecodeText(status.timecode));
    if (status) add('tick', `${status.tick}, ${status.viewer_count} ${status.viewer_count === 1 ? 'viewer' : 'viewers'}`);
    return rows;
  }
}

new Viewer();
