// Drawing, in a worker of its own: the newest state under the newest camera, by WebGL2 where a graphics card draws,
// else tile by tile on this processor. One picture is under way at a time; while something moves a slow machine
// draws smaller ones (client/app/draw_plan.h), and sharpens what stands.
import { Recent } from './clock';
import { Core } from './core';
import { StrandGl } from './gl/strand_gl';
import type { Camera, FromDraw, State, ToDraw } from './messages';
import { StrandPicture } from './picture';
import { Device, type LookMessage } from './wire';

const STEPS = [
  { size: 1, share: 1 }, { size: 0.75, share: 1 }, { size: 0.5, share: 1 },
  { size: 0.5, share: 0.5 }, { size: 0.35, share: 0.5 }, { size: 0.25, share: 0.35 },
];
const COARSEST_FAIR = 2;
const BUDGET_MS = 100;
const TOO_LONG = 1.25;
const LEAVES_ROOM = 0.8;
const COST = [1, 0.65, 0.35, 0.18, 0.1, 0.05];
const STAND_MS = 200;
const LOST_MS = 3000; // so long a graphics card may be away
const SOFTWARE = /swiftshader|llvmpipe|lavapipe|softpipe|software|basic render/i;

const post = (message: FromDraw, transfer: Transferable[] = []): void =>
  (self as unknown as WorkerScope).postMessage(message, transfer);

interface Size {
  width: number;
  height: number;
}

interface Counts {
  strands: number;
  segments: number;
}

/** Pictures onto the canvas. */
interface Painter {
  readonly device: number;
  readonly drawnBy: string;
  /** Whether its graphics card was taken away. */
  readonly isLost: boolean;
  setPicture(picture: StrandPicture): void;
  /** The same with everything made anew. */
  again(): Painter;
  /** Resolves when the picture is there, or left because it is unwanted. */
  paint(picture: StrandPicture, camera: Camera, size: Size, share: number, isUnwanted?: () => Promise<boolean>): Promise<Counts | undefined>;
}

class GlPainter implements Painter {
  private readonly strands: StrandGl;
  constructor(private readonly canvas: OffscreenCanvas, private readonly gl: WebGL2RenderingContext, readonly device: number,
              readonly drawnBy: string, private readonly samples: number) {
    this.strands = new StrandGl(gl, samples);
  }
  get isLost(): boolean {
    return this.gl.isContextLost();
  }
  again(): Painter {
    return new GlPainter(this.canvas, this.gl, this.device, this.drawnBy, this.samples);
  }
  setPicture(picture: StrandPicture): void {
    this.strands.setHead(picture);
  }
  async paint(picture: StrandPicture, camera: Camera, size: Size, share: number): Promise<Counts> {
    if (this.canvas.width !== size.width) this.canvas.width = size.width;
    if (this.canvas.height !== size.height) this.canvas.height = size.height;
    const parts = picture.prepare(camera, size, share);
    this.strands.draw(picture, parts, size, picture.background);
    await this.finished();
    return { strands: parts.strandCount, segments: parts.cornerCount / 6 };
  }
  private finished(): Promise<void> {
    const gl = this.gl;
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    if (!fence) return Promise.resolve();
    return new Promise((resolve) => {
      const ask = (): void => {
        const status = gl.clientWaitSync(fence, 0, 0);
        if (status === gl.TIMEOUT_EXPIRED) return void setTimeout(ask, 1);
        gl.deleteSync(fence);
        resolve();
      };
      ask();
    });
  }
}

class TilePainter implements Painter {
  readonly device = Device.software;
  readonly isLost = false;
  private readonly drawing: OffscreenCanvasRenderingContext2D;
  constructor(private readonly canvas: OffscreenCanvas, readonly drawnBy: string) {
    const drawing = canvas.getContext('2d', { alpha: false });
    if (!drawing) throw new Error('this browser gives no canvas to draw on');
    this.drawing = drawing;
  }
  setPicture(): void {}
  again(): Painter {
    return this;
  }
  async paint(picture: StrandPicture, camera: Camera, size: Size, share: number, isUnwanted?: () => Promise<boolean>): Promise<Counts | undefined> {
    const rgba = await picture.draw(camera, size, share, isUnwanted);
    if (!rgba) return undefined;
    if (this.canvas.width !== size.width) this.canvas.width = size.width;
    if (this.canvas.height !== size.height) this.canvas.height = size.height;
    this.drawing.putImageData(new ImageData(new Uint8ClampedArray(rgba), size.width, size.height), 0, 0);
    return { strands: 0, segments: 0 };
  }
}

/** What draws here, and why. `wish`: "gl" or "tiles" insists. */
function choosePainter(canvas: OffscreenCanvas, wish: string, samples: number): { painter: Painter; why: string } {
  let why = 'WebGL2 is not there';
  if (wish !== 'tiles') {
    const scratch = new OffscreenCanvas(1, 1).getContext('webgl2');
    const info = scratch?.getExtension('WEBGL_debug_renderer_info');
    const name = scratch ? String(scratch.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : scratch.RENDERER)) : '';
    const isSoftware = SOFTWARE.test(name);
    if (scratch && (!isSoftware || wish === 'gl')) {
      try {
        new StrandGl(scratch, samples); // all that it needs is there
        const gl = canvas.getContext('webgl2', { alpha: false, antialias: false, depth: false, preserveDrawingBuffer: true });
        if (gl) {
          const device = isSoftware ? Device.software : Device.hardware;
          return { painter: new GlPainter(canvas, gl, device, `WebGL2 (${name})`, samples), why: isSoftware ? 'you asked for WebGL2' : 'a graphics card draws' };
        }
      } catch (error) {
        why = (error as Error).message;
      }
    } else if (scratch) {
      why = `WebGL2 is drawn by software here (${name}), and tiles are quicker`;
    }
    scratch?.getExtension('WEBGL_lose_context')?.loseContext();
  } else {
    why = 'you asked for tiles';
  }
  return { painter: new TilePainter(canvas, 'this processor, tile by tile'), why };
}

class Drawer {
  private canvas!: OffscreenCanvas;
  private painter!: Painter;
  private states!: MessagePort;
  private core!: Core;
  private picture?: StrandPicture;
  private look?: LookMessage;
  private camera?: Camera;
  private size: Size = { width: 640, height: 360 };
  private isVisible = true;
  private hasState = false;
  private isDirty = false;
  private isBusy = false;
  private isCameraMoving = false;
  private lastMovedMs = 0;
  private askedMs = 0;
  private drawnStep = 0;
  private step = 0;
  private readonly stepMs = STEPS.map(() => new Recent(5));
  private readonly fairMs = new Recent(20);
  private leastWholeMs = 0; // of whole pictures, which stand
  private shown: number[] = [];
  private counts = { strands: 0, segments: 0 };
  private shotAsked = false;
  private tellReady = (): void => {};

  start(message: Extract<ToDraw, { kind: 'start' }>): void {
    this.canvas = message.canvas;
    const { painter, why } = choosePainter(message.canvas, message.wish, message.samples);
    this.painter = painter;
    this.followCard(message.canvas);
    if (painter.device === Device.software) this.step = 2;
    this.tellReady = () => post({ kind: 'ready', device: this.painter.device, drawnBy: this.painter.drawnBy, why });
    this.tellReady();
  }
  /** It comes back after sleep or a fault of its driver, without anything that was on it. */
  private followCard(canvas: OffscreenCanvas): void {
    let patience = 0;
    let isAway = false;
    canvas.addEventListener('webglcontextlost', (event) => {
      event.preventDefault();
      patience = self.setTimeout(() => {
        isAway = true;
        post({ kind: 'failed', reason: 'the graphics card was taken away' });
      }, LOST_MS);
    });
    canvas.addEventListener('webglcontextrestored', () => {
      clearTimeout(patience);
      this.painter = this.painter.again();
      if (this.picture) this.painter.setPicture(this.picture);
      this.moved();
      if (isAway) this.tellReady();
      isAway = false;
    });
  }
  async begin(message: Extract<ToDraw, { kind: 'core' }>): Promise<void> {
    if (!this.painter) return; // said already
    this.core = await Core.load(message.core);
    this.states = message.states;
    this.states.onmessage = (event: MessageEvent<State>) => this.take(event.data);
    this.askNext();
    this.core.call.strand_picture_expect_asset();
    setInterval(() => this.report(), 500);
    const turn = (): void => {
      void this.turn();
      requestAnimationFrame(turn);
    };
    requestAnimationFrame(turn);
  }
  /** The next state is taken while this one is shown, not before: none waits here. */
  private askNext(): void {
    this.askedMs = performance.now();
    this.states.postMessage('next');
  }

  private take(state: State): void {
    if (state.kind === 'asset') {
      this.picture?.delete();
      this.picture = new StrandPicture(this.core, new Uint8Array(state.payload));
      this.hasState = false;
      this.isDirty = true; // what is under way is left
      if (this.look) this.picture.setLook(this.look);
      this.painter.setPicture(this.picture);
      return this.askNext();
    }
    if (!this.picture) return;
    this.picture.setState(state.positions, state.rotation, state.bust);
    this.hasState = true;
    this.moved();
  }
  private moved(): void {
    this.isDirty = true;
    this.lastMovedMs = performance.now();
  }

  command(message: Exclude<ToDraw, { kind: 'start' } | { kind: 'core' }>): void {
    switch (message.kind) {
      case 'look':
        this.look = message.look;
        this.picture?.setLook(message.look);
        return this.moved();
      case 'camera':
        this.camera = message.camera;
        this.isCameraMoving = message.isMoving;
        return this.moved();
      case 'size':
        this.size = { width: message.width, height: message.height };
        return this.moved();
      case 'visible':
        this.isVisible = message.isVisible;
        this.isDirty = true;
        return;
      case 'shot':
        this.shotAsked = true;
    }
  }

  private async turn(): Promise<void> {
    if (this.isBusy || this.painter.isLost || !this.picture || !this.hasState || !this.camera || !this.look) return;
    const begin = performance.now();
    const isStanding = begin - Math.max(this.lastMovedMs, this.askedMs) > STAND_MS && !this.isCameraMoving;
    const step = isStanding || this.shotAsked ? 0 : this.step;
    if (!this.shotAsked && (!this.isVisible || (!this.isDirty && (step === this.drawnStep || !isStanding)))) return;
    this.isBusy = true;
    this.isDirty = false;
    try {
      const { size, share } = STEPS[step]!;
      const pixels = {
        width: Math.max(16, Math.round(this.size.width * size)), height: Math.max(16, Math.round(this.size.height * size)),
      };
      // What stands may be left for what moves.
      const isUnwanted = isStanding && !this.shotAsked
        ? async (): Promise<boolean> => (await new Promise((go) => setTimeout(go, 0)), this.isDirty)
        : undefined;
      const picture = this.picture;
      const counts = await this.painter.paint(picture, this.camera, pixels, share, isUnwanted);
      if (!counts) {
        this.isBusy = false;
        return;
      }
      this.counts = counts;
      this.drawnStep = step;
      const ms = performance.now() - begin;
      this.shown.push(performance.now());
      if (!isStanding) this.learn(step, ms);
      if (step === 0) this.leastWholeMs = Math.min(this.leastWholeMs || ms, ms);
      post({ kind: 'drawn' });
      if (this.shotAsked) {
        this.shotAsked = false;
        const blob = await this.canvas.convertToBlob({ type: 'image/png' });
        post({ kind: 'shot', blob });
      }
    } catch (error) {
      if (!this.painter.isLost) {
        post({ kind: 'failed', reason: (error as Error).message });
        this.picture = undefined;
      }
    }
    this.isBusy = false;
    this.askNext();
  }
  private learn(step: number, ms: number): void {
    this.stepMs[step]!.add(ms);
    if (step <= COARSEST_FAIR) this.fairMs.add(ms);
    const median = this.stepMs[step]!.median;
    if (median > BUDGET_MS * TOO_LONG && step + 1 < STEPS.length) this.step = step + 1;
    else if (step > 0 && (median * COST[step - 1]!) / COST[step]! < BUDGET_MS * LEAVES_ROOM) this.step = step - 1;
    if (this.step !== step) this.stepMs[this.step]!.clear();
  }
  private report(): void {
    const now = performance.now();
    this.shown = this.shown.filter((time) => now - time < 2000);
    post({
      kind: 'figures',
      figures: {
        drawMs: this.fairMs.median || this.stepMs[this.step]!.median, stepMs: this.stepMs[this.step]!.median, shownHz: this.shown.length / 2,
        share: STEPS[this.drawnStep]!.size, leastWholeMs: this.leastWholeMs, ...this.counts,
      },
    });
  }
}

export function runDrawer(): void {
  const drawer = new Drawer();
  self.onmessage = (event: MessageEvent<ToDraw>) => {
    const message = event.data;
    const fail = (error: Error): void => post({ kind: 'failed', reason: error.message });
    try {
      if (message.kind === 'start') drawer.start(message);
      else if (message.kind === 'core') drawer.begin(message).catch(fail);
      else drawer.command(message);
    } catch (error) {
      fail(error as Error);
    }
  };
}
