// <strandcast-view src="wss://HOST:7878">: hair of a server in a page, without a line of script. It is drawn as the server's own
// page draws it; mouse, touch and keys turn it.
import { compileCore } from '../page/core';
import type { Camera, FromDraw, ToDraw } from '../page/messages';
import { fittedTo, followKey, followPointers } from '../page/ui/orbit';
import { Device } from '../page/wire';
import { connectDrawer, filesOf, startWorker } from './connect';
import type { UserConnection } from './connection';
import type { Connection } from './strandcast';

const SAMPLES = 4;
const STYLE = `:host { display: block; position: relative; aspect-ratio: 16 / 9; touch-action: none; }
canvas { display: block; width: 100%; height: 100%; }
p { position: absolute; inset: auto 0 0; margin: 0; padding: 0.5em; text-align: center; font: 0.9em sans-serif; color: #fff; background: #0008; }`;

/** One stream on one canvas. */
class Shown {
  readonly connection: UserConnection;
  private readonly draw: Worker;
  private readonly observer: ResizeObserver;
  private camera?: Camera;
  private isHeld = false;
  private device: number = Device.unknown;

  constructor(private readonly host: HTMLElement, private readonly canvas: HTMLCanvasElement, private readonly say: (words: string) => void) {
    const name = (attribute: string): string | undefined => host.getAttribute(attribute) ?? undefined;
    const states = new MessageChannel();
    const files = filesOf(name('files'));
    this.draw = startWorker(files, 'draw.js', 'draw');
    this.draw.onmessage = ({ data }: MessageEvent<FromDraw>) => this.fromDraw(data);
    const drawn = canvas.transferControlToOffscreen();
    this.toDraw({ kind: 'start', canvas: drawn, wish: name('draw') ?? '', samples: SAMPLES }, [drawn as unknown as Transferable]);
    compileCore(new URL('strand_page.wasm', files).href).then(
      (core) => this.toDraw({ kind: 'core', core, states: states.port2 }, [states.port2]), (error: Error) => say(error.message));
    const options = { token: name('token'), head: name('head'), codec: name('codec'), files: name('files'), role: 'viewer' as const };
    this.connection = connectDrawer(new URL(name('src')!, document.baseURI).href, options, states.port1);
    this.connection.followVisibility();
    this.connection.on('link', ({ state, reason }) => say(state === 'open' ? '' : state === 'connecting' ? 'Connecting' : reason));
    this.connection.on('look', (look) => this.toDraw({ kind: 'look', look: look as never }));
    this.connection.on('welcome', ({ camera }) => this.lookFrom(this.camera ?? fittedTo(camera, host.clientWidth / Math.max(host.clientHeight, 1))));
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(host);
  }
  private toDraw(message: ToDraw, transfer: Transferable[] = []): void {
    this.draw.postMessage(message, transfer);
  }
  private fromDraw(message: FromDraw): void {
    if (message.kind === 'ready') {
      this.device = message.device;
      this.say('');
      this.resize();
    } else if (message.kind === 'figures') this.connection.report(message.figures.drawMs, message.figures.shownHz, this.device);
    else if (message.kind === 'failed') this.say(`Nothing can be drawn here: ${message.reason}`);
    else if (message.kind === 'drawn') this.host.dispatchEvent(new Event('picture'));
  }
  private resize(): void {
    const ratio = Math.min(devicePixelRatio, 2);
    const side = (length: number): number => Math.max(1, Math.round(length * ratio));
    this.toDraw({ kind: 'size', width: side(this.canvas.clientWidth), height: side(this.canvas.clientHeight) });
  }
  private lookFrom(camera: Camera): void {
    this.camera = camera;
    this.toDraw({ kind: 'camera', camera, isMoving: this.isHeld });
    this.connection.setCamera(camera);
  }
  change(move: (camera: Camera) => Camera): void {
    if (this.camera) this.lookFrom(move(this.camera));
  }
  hold(isHeld: boolean): void {
    this.isHeld = isHeld;
    this.change((camera) => camera);
  }
  end(): void {
    this.observer.disconnect();
    this.connection.close();
    this.draw.terminate();
  }
}

class StrandcastView extends HTMLElement {
  static readonly observedAttributes = ['src', 'token', 'head', 'codec', 'draw', 'files'];
  private shown?: Shown;
  private readonly words = document.createElement('p');
  private readonly stage: ShadowRoot;

  constructor() {
    super();
    this.stage = this.attachShadow({ mode: 'open' });
    const style = new CSSStyleSheet();
    style.replaceSync(STYLE);
    this.stage.adoptedStyleSheets = [style];
    const moves = {
      change: (move: (camera: Camera) => Camera) => this.shown?.change(move),
      hold: (isHeld: boolean) => this.shown?.hold(isHeld),
    };
    followPointers(this, moves);
    this.addEventListener('keydown', (event) => followKey(event, moves) && event.preventDefault());
  }
  get connection(): Connection | undefined {
    return this.shown?.connection;
  }
  connectedCallback(): void {
    if (!this.hasAttribute('tabindex')) this.tabIndex = 0;
    if (!this.hasAttribute('role')) this.setAttribute('role', 'img');
    if (!this.hasAttribute('aria-label')) this.setAttribute('aria-label', 'Simulated hair; drag or use the arrow keys to turn it');
    this.begin();
  }
  disconnectedCallback(): void {
    this.shown?.end();
    this.shown = undefined;
  }
  attributeChangedCallback(): void {
    if (this.isConnected) this.begin();
  }
  private begin(): void {
    this.disconnectedCallback();
    const canvas = document.createElement('canvas');
    canvas.setAttribute('aria-hidden', 'true');
    this.stage.replaceChildren(canvas, this.words);
    const say = (words: string): void => {
      this.words.textContent = words;
      this.words.hidden = !words;
    };
    try {
      if (this.getAttribute('src')) this.shown = new Shown(this, canvas, say);
    } catch (error) {
      say((error as Error).message);
    }
  }
}

customElements.define('strandcast-view', StrandcastView);
