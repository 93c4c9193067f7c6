// The connection, in a worker of its own: decoding, acknowledgements and clock. Nothing here waits for
// whoever draws: the newest state waits for it, and the one before is dropped.
import { ClockOffset, nowNs, Recent } from './clock';
import { compileCore, Core, StrandDecoder } from './core';
import type { Asked, Camera, FromNet, NetFigures, State, StatePort, ToNet } from './messages';
import { decodablePictures, PictureDecoder, type Decoded } from './pictures';
import { DOUBTED_MS, faultOf, GIVEN_UP_CODE, IDLE_MS, mayComeBack, ReconnectPolicy, SILENT_MS, WELCOME_MS, wordsFor } from './reconnect';
import { DistantSocket, type ServerSocket } from './socket';
import { TAPE_URL } from './tape';
import {
  ClientMessage, decodeServerMessage, encodeClientMessage, FrameHeader, kControl, kFrameHeaderBytes, Mode, Opcode,
  PictureCodec, Partly, readFrameHeader, readStateHash, Role, type WelcomeMessage,
} from './wire';

const PROTOCOL = 'strandcast.v1';
const QUICK_PINGS = 10;
const QUICK_PING_MS = 20;
const PING_MS = 1000;
const KEYFRAME_REQUEST_MS = 1000;
const CAMERA_MS = 33;
const WAKE_MS = 1000; // so long an answer may take after sleep
const SLEPT_MS = 3000; // a timer that is so late has slept
const REPORT_MS = 1000;
const MOST_WAITING = 256; // messages for the core, which has not come yet
const PICTURE_BITS: { [wish: string]: number } = {
  jpeg: 0, tiles: 1 << PictureCodec.jpegTiles, vp8: 1 << PictureCodec.vp8, h264: 1 << PictureCodec.h264,
};
const PICTURE_NAMES: { [codec: number]: string } = {
  [PictureCodec.jpeg]: 'JPEG', [PictureCodec.jpegTiles]: 'JPEG tiles', [PictureCodec.vp8]: 'VP8', [PictureCodec.h264]: 'H.264',
};

/** Clocks of browsers are coarse: what is quicker than they can tell is still something. */
const LEAST_STEP_NS = 5;
const NEWEST_ASSET_LAYOUT = 3; // that the cores decode
const EXACT_BIT = 128; // of a strand frame's first byte: it carries no corrections

/** Where a session runs: whom it tells, what its socket is, and where modules of the core come from. */
export interface Surroundings {
  post(message: FromNet, transfer?: Transferable[]): void;
  openSocket(url: string, protocol: string): ServerSocket;
  loadCore(file: string): Promise<WebAssembly.Module>;
  states: StatePort;
}

/** An attempt, and what it has come to. */
interface Line {
  readonly socket: ServerSocket;
  connection?: Connection; // once it is open
  openedMs: number;
  patience: number; // with a server that lets nobody in
}

/** What lasts over reconnections. */
export class Net {
  private core?: Core;
  private coreAnswered!: () => void;
  private readonly coreAnswer = new Promise<void>((done) => (this.coreAnswered = done)); // it is there, or never comes
  private noCore = '';
  private stepCore = '';
  private wholeCore = '';
  private isLoading = false;
  stepNs = 0; // of one vertex in a solver's step here; 0 until something here takes steps
  private asked!: Asked;
  private pictureCodecs!: Promise<number>;
  private prepared!: Promise<void>;
  private isPrepared = false;
  private waitsForModule = false; // the server's patience ended before it came
  private line?: Line;
  private beside?: Line; // tried while the other one is silent
  private besideMs = 0; // none before
  private readonly policy = new ReconnectPolicy();
  private retry = 0;
  private reports = 0;
  private lookedMs = Date.now();
  private isHidden = false;
  private wasIn = false; // somebody said Welcome
  drawn = { drawMs: 0, shownHz: 0, device: 0 };
  private wantsState = false;
  private waitingAsset?: ArrayBuffer;
  isPictureFree = true;

  constructor(private readonly around: Surroundings) {}
  post(message: FromNet, transfer: Transferable[] = []): void {
    this.around.post(message, transfer);
  }
  start(message: Pick<Extract<ToNet, { kind: 'start' }>, 'asked' | 'stepCore' | 'wholeCore'>): void {
    this.asked = message.asked;
    this.around.states.onmessage = () => {
      this.wantsState = true;
      this.offerState();
    };
    this.stepCore = message.stepCore;
    this.wholeCore = message.wholeCore;
    this.pictureCodecs = decodablePictures();
    this.prepared = this.prepare();
    this.connect();
    this.reports = setInterval(() => this.look(), 500);
  }
  /** What a Hello says depends on the module. A socket opens meanwhile, so that no round trip waits for another. */
  private async prepare(): Promise<void> {
    if (this.asked.drawsStrands && this.asked.mode !== Mode.frames) await this.coreAnswer;
    if (this.asked.codec && this.asked.codec !== 'tangent') await this.learnSteps();
    this.isPrepared = true;
    if (this.waitsForModule) this.connect();
  }
  end(): void {
    clearInterval(this.reports);
    this.leave();
  }
  private get connection(): Connection | undefined {
    return this.line?.connection;
  }
  private look(): void {
    const lateMs = Date.now() - this.lookedMs;
    if (lateMs > SLEPT_MS) this.wake();
    this.lookedMs = Date.now();
    this.connection?.report();
    // Who stood still itself has heard nothing meanwhile.
    const isDue = lateMs < DOUBTED_MS && performance.now() >= this.besideMs && this.asked.url !== TAPE_URL;
    if (isDue && !this.beside && this.connection?.isSilentFor(this.policy.doubtMs)) this.beside = this.dial();
  }
  /** After sleep a connection may be dead and not know it, and who waits to come back has waited long enough. */
  private wake(): void {
    if (!this.retry) return this.connection?.probe();
    this.connect();
  }
  async setCore(module: WebAssembly.Module): Promise<void> {
    this.use(await Core.load(module));
    this.coreAnswered();
  }
  private use(core: Core): void {
    if (core.call.strand_core_step_ns) this.stepNs = Math.max(core.call.strand_core_step_ns(), LEAST_STEP_NS);
    this.core = core;
    for (const line of [this.line, this.beside]) line?.connection?.setCore(core);
  }
  /** There are the server's pictures then. */
  withoutCore(reason: string): void {
    this.noCore = reason;
    this.asked = { ...this.asked, drawsStrands: false };
    this.coreAnswered();
    this.post({ kind: 'notice', isError: true, text: `Strands cannot be drawn here: ${reason}. The server’s pictures are shown.` });
  }
  private load(file: string): Promise<void> {
    return this.around.loadCore(file).then(Core.load).then((core) => this.use(core), () => undefined);
  }
  /** With hair on the screen: streams of steps take a fraction of the link. */
  private async learnSteps(): Promise<void> {
    const file = this.stepCore;
    this.stepCore = ''; // once
    if (file) await this.load(file);
  }
  get changesModule(): boolean {
    return this.isLoading;
  }
  /** True when the stream needs another module: it comes with that one again. */
  changesCore(error: Error): boolean {
    if (this.isLoading) return true;
    let loaded: Promise<void>;
    if (this.stepCore && error.message.includes('this module decodes tangent alone')) {
      loaded = this.learnSteps();
    } else if (this.wholeCore && /this build has no sim\/\w+\.comp/.test(error.message)) {
      loaded = this.load(this.wholeCore);
      this.wholeCore = ''; // once
    } else {
      return false;
    }
    this.isLoading = true;
    void loaded.then(() => {
      this.isLoading = false;
      this.reconnect(this.asked);
    });
    return true;
  }
  get window(): { frame_width: number; frame_height: number; is_hidden: boolean } {
    return { frame_width: this.asked.width, frame_height: this.asked.height, is_hidden: this.isHidden };
  }
  reconnect(asked: Asked): void {
    this.asked = asked;
    this.connect();
  }
  private leave(): void {
    clearTimeout(this.retry);
    this.retry = 0;
    this.waitsForModule = false;
    this.leaveBeside();
    if (this.line) this.hangUp(this.line);
    this.line = undefined; // whoever asks its connection for a state meanwhile gets none
  }
  private leaveBeside(): void {
    if (this.beside) this.hangUp(this.beside);
    this.beside = undefined;
  }
  private hangUp(line: Line): void {
    clearTimeout(line.patience);
    line.socket.onclose = undefined;
    line.socket.drop(1000, '');
    line.connection?.end();
  }

  private connect(): void {
    this.leave();
    const fault = faultOf(this.asked);
    if (fault) return this.post({ kind: 'state', state: 'ended', reason: fault, retryMs: 0 });
    this.post({ kind: 'state', state: 'connecting', reason: '', retryMs: 0 });
    this.line = this.dial();
  }
  private dial(): Line {
    const socket = this.around.openSocket(this.asked.url, PROTOCOL);
    const line: Line = { socket, openedMs: 0, patience: 0 };
    const wait = (): void => {
      line.patience = setTimeout(() => {
        if (!line.connection?.hasWelcome) socket.drop(GIVEN_UP_CODE, 'the server does not answer');
      }, WELCOME_MS);
    };
    wait();
    socket.onopen = () => {
      line.openedMs = performance.now();
      if (!this.isPrepared) clearTimeout(line.patience);
      void Promise.all([this.pictureCodecs, this.prepared]).then(([codecs]) => {
        if (!socket.isOpen) return;
        clearTimeout(line.patience);
        wait();
        line.connection = new Connection(this, socket, this.asked, this.core);
        line.connection.hello(codecs);
      });
    };
    socket.onmessage = (data, receivedNs) => {
      if (line === this.line) this.leaveBeside(); // it speaks again
      line.connection?.receive(data, receivedNs);
    };
    socket.onclose = (code, said) => {
      clearTimeout(line.patience);
      line.connection?.end();
      if (line === this.line) return this.lose(line, code, said);
      this.beside = undefined;
      this.besideMs = performance.now() + this.policy.nextDelayMs(0);
    };
    return line;
  }
  /** The server has let this one in: it takes the place of one that is silent. */
  welcome(connection: Connection): void {
    if (connection !== this.beside?.connection) return;
    const line = this.beside;
    this.beside = undefined;
    this.policy.replace(performance.now() - this.line!.openedMs);
    this.leave();
    this.line = line;
  }
  private lose({ connection, openedMs }: Line, code: number, said: string): void {
    this.leaveBeside();
    this.line = undefined;
    if (!this.isPrepared && openedMs > 0) return void (this.waitsForModule = true);
    const reason = connection?.goodbye || said || wordsFor(code, openedMs > 0);
    const hadWelcome = connection?.hasWelcome ?? false;
    this.wasIn ||= hadWelcome;
    // A token may be good for watching only; servers of before say so by 1008.
    if ((code === 4004 || code === 1008) && !hadWelcome && this.asked.role === Role.controller) {
      this.asked = { ...this.asked, role: Role.viewer };
      return this.connect();
    }
    if (!mayComeBack(code, this.wasIn)) return this.post({ kind: 'state', state: 'ended', reason, retryMs: 0 });
    const retryMs = this.policy.nextDelayMs(openedMs ? performance.now() - openedMs : 0);
    this.post({ kind: 'state', state: 'waiting', reason, retryMs });
    this.retry = setTimeout(() => this.connect(), retryMs);
  }

  command(message: ToNet): void {
    const connection = this.connection;
    switch (message.kind) {
      case 'mode':
        if (this.noCore && message.mode !== Mode.frames)
          return this.post({ kind: 'notice', isError: true, text: `Strands cannot be drawn here: ${this.noCore}.` });
        this.asked.mode = message.mode;
        // A relay has one mode for all of a session.
        if (connection?.needsAnother(message.mode)) return this.reconnect(this.asked);
        return connection?.send({ mode_request: { mode: message.mode } });
      case 'camera':
        return connection?.lookFrom(message.camera);
      case 'window':
        this.asked = { ...this.asked, width: message.width, height: message.height };
        this.isHidden = message.isHidden;
        return connection?.tellWindow();
      case 'wake':
        return this.wake();
      case 'rest':
        return this.leave();
      case 'command':
        return connection?.send({ command: { command: message.command } });
      case 'set':
        return connection?.send({ set_parameter: { assignment: message.assignment } });
      case 'scene':
        return connection?.send({ scene_request: {} });
      case 'controls':
        return connection?.send({ parameter_request: { prefix: 'quality,hair.', is_watching: true } });
      case 'drawn':
        this.drawn = message;
        if (message.shownHz > 0 && connection?.showsStrands && !this.asked.codec) void this.learnSteps();
        return;
      case 'pictureShown':
        this.isPictureFree = true;
        return connection?.offerPicture();
    }
  }

  /** Asset first: what is drawn needs it. */
  setAsset(payload: Uint8Array): void {
    this.waitingAsset = payload.slice().buffer;
    this.offerState();
  }
  offerState(): void {
    if (!this.wantsState) return;
    let state: State | undefined;
    if (this.waitingAsset) {
      state = { kind: 'asset', payload: this.waitingAsset };
      this.waitingAsset = undefined;
      this.around.states.postMessage(state, [state.payload]);
    } else if ((state = this.connection?.takeState())) {
      this.around.states.postMessage(state, [state.positions.buffer]);
    }
    if (state) this.wantsState = false;
  }
}

/** One connection. */
class Connection {
  goodbye = '';
  hasWelcome = false;
  private welcome?: WelcomeMessage;
  private readonly clock = new ClockOffset();
  private pings: number[] = [];
  private pingCount = 0;
  private readonly timers: number[] = [];
  private lastReceivedMs = performance.now();
  private isSilent = false;
  private isAway = false; // the relay's server
  private now?: StrandDecoder;
  private next?: StrandDecoder;
  private assetPayload?: Uint8Array;
  private strandStream = -1;
  private lastSequence = 0;
  private decodedSequence = -1; // of this stream's strands
  private wrongStates = 0; // since the welcome, as in a ViewerReport
  private hasState = false;
  private isStateFresh = false;
  private stateHash = 0n;
  private pictures?: PictureDecoder; // with the first of them: Node has none
  private pictureQueue: Promise<void> = Promise.resolve();
  private waitingPicture?: Decoded;
  private pictureSize = { width: 0, height: 0 };
  private lastPicture = { stream: -1, sequence: 0 };
  private readonly strandMs = new Recent();
  private readonly pictureMs = new Recent();
  private readonly motionMs = new Recent();
  private motions = new Map<number, number>();
  private lastMotionNs = 0;
  private newestSentNs = 0;
  private lastKeyframeRequestMs = -KEYFRAME_REQUEST_MS;
  private lastReportMs = 0;
  private shown = -1;
  private reason = '';
  private camera?: Camera;
  private cameraTimer = 0;
  private strandFrames = 0;
  private exactFrames = 0;
  private figures = { receivedBytes: 0, decodedFrames: 0, rejectedFrames: 0, missedFrames: 0, replacedStates: 0, lastError: '' };
  private codec = '';
  private codecReason = '';
  private pictureCodec = '';

  private waitingForCore: (() => void)[] = [];

  constructor(private readonly net: Net, private readonly socket: ServerSocket, private readonly asked: Asked, private core?: Core) {}

  /** For the next decoders. What came before the first one is looked at now. */
  setCore(core: Core): void {
    this.core = core;
    const waiting = this.waitingForCore;
    this.waitingForCore = [];
    this.guard(() => {
      if (this.welcome && !this.now) this.now = this.decoderOf(this.welcome.codec);
      for (const take of waiting) take();
    });
  }
  private withCore(take: () => void): void {
    if (this.core) return take();
    if (this.waitingForCore.push(take) > MOST_WAITING) throw new Error('strands came before there was anything to decode them');
  }
  private decoderOf(codec: string): StrandDecoder {
    return new StrandDecoder(this.core!, codec, this.welcome!.strand_count, this.welcome!.vertex_count);
  }

  send(message: Partly<typeof ClientMessage>): void {
    this.socket.send(encodeClientMessage(message));
  }
  hello(pictureCodecs: number): void {
    this.send({
      hello: {
        role: this.asked.role, mode: this.asked.drawsStrands ? this.asked.mode : Mode.frames, name: this.asked.name ?? 'browser', token: this.asked.token,
        frame_width: this.asked.width, frame_height: this.asked.height, acknowledges: true,
        picture_codecs: pictureCodecs & (PICTURE_BITS[this.asked.pictures] ?? ~0), codec_wish: this.asked.codec, head: this.asked.head, step_ns: this.net.stepNs,
        asset_layout: NEWEST_ASSET_LAYOUT,
      },
    });
  }
  end(): void {
    for (const timer of this.timers) clearTimeout(timer);
    clearTimeout(this.cameraTimer);
    this.now?.delete();
    this.next?.delete();
    this.now = this.next = undefined;
    this.pictures?.close();
    this.waitingPicture?.close();
    this.waitingPicture = undefined;
  }

  /** Whatever a server sends: it may end this connection, never this page. */
  receive(data: unknown, receivedNs: number): void {
    this.lastReceivedMs = performance.now();
    this.guard(() => {
      if (!(data instanceof ArrayBuffer) || data.byteLength === 0) throw new Error('the server sent no message of bytes');
      const message = new Uint8Array(data);
      this.figures.receivedBytes += message.length;
      if (message[0] === kControl) this.control(message, receivedNs);
      else if (!this.welcome) throw new Error('the server sent media before its Welcome');
      else this.media(message, receivedNs);
    });
  }
  private guard(take: () => void): void {
    try {
      take();
    } catch (error) {
      this.giveUp(`the server sent what cannot be read: ${(error as Error).message}`);
    }
  }

  private control(bytes: Uint8Array, received: number): void {
    const message = decodeServerMessage(bytes);
    if (message.welcome) this.begin(message.welcome);
    else if (message.goodbye) this.goodbye = message.goodbye.reason;
    else if (message.notice && !this.welcome) this.net.post({ kind: 'notice', isError: message.notice.is_error, text: message.notice.text });
    else if (!this.welcome) throw new Error('the server sent something else before its Welcome');
    if (message.pong) this.pong(message.pong, received);
    if (message.status) {
      for (const motion of message.status.picture_motions) this.motions.set(motion.sim_time_ns, motion.motion_time_ns);
      this.net.post({ kind: 'status', status: message.status });
      this.isAway = message.status.away_s > 0;
      this.listen();
    }
    if (message.notice && this.welcome) this.net.post({ kind: 'notice', isError: message.notice.is_error, text: message.notice.text });
    if (message.quality) {
      const { codec, reason } = message.quality;
      this.withCore(() => this.followCodec(codec, reason));
      this.net.post({ kind: 'quality', quality: message.quality });
    }
    if (message.frame_quality) {
      this.pictureCodec = PICTURE_NAMES[message.frame_quality.codec] ?? '';
      this.net.post({ kind: 'frameQuality', quality: message.frame_quality });
    }
    if (message.mode_change) {
      this.reason = message.mode_change.reason;
      this.net.post({ kind: 'modeReason', reason: this.reason });
    }
    if (message.look_change) this.net.post({ kind: 'look', look: message.look_change.look, camera: message.look_change.camera });
    if (message.camera) this.net.post({ kind: 'moved', camera: message.camera.camera });
    if (message.parameter_list) this.net.post({ kind: 'parameters', parameters: message.parameter_list.parameters });
    if (message.scene_text) this.net.post({ kind: 'sceneText', text: message.scene_text.text });
  }

  private begin(welcome: WelcomeMessage): void {
    if (this.welcome) throw new Error('the server sent a second Welcome');
    this.net.welcome(this);
    this.welcome = welcome;
    if (this.core) this.now = this.decoderOf(welcome.codec);
    this.hasWelcome = true;
    this.reason = welcome.mode_reason;
    this.codec = welcome.codec;
    this.codecReason = welcome.codec_reason;
    this.net.post({ kind: 'welcome', welcome });
    this.net.post({ kind: 'state', state: 'open', reason: '', retryMs: 0 });
    this.ping();
    this.timers.push(setInterval(() => this.listen(), 500));
    const { frame_width, frame_height, is_hidden } = this.net.window;
    if (is_hidden || frame_width !== this.asked.width || frame_height !== this.asked.height) this.tellWindow();
  }
  tellWindow(): void {
    if (this.welcome) this.send({ window: this.net.window });
  }
  /** Whether the server still answers. */
  probe(): void {
    if (!this.welcome) return; // it has its own patience
    const sinceMs = this.lastReceivedMs;
    this.send({ ping: { client_time_ns: nowNs() } });
    this.timers.push(setTimeout(() => {
      if (this.lastReceivedMs === sinceMs) this.giveUp('the server did not answer after this machine slept');
    }, WAKE_MS));
  }
  private giveUp(why: string): void {
    this.goodbye ||= why;
    this.socket.drop(GIVEN_UP_CODE, this.goodbye);
  }

  /** Never before its first frame: one long message may be under way. */
  isSilentFor(ms: number): boolean {
    return this.shown >= 0 && performance.now() - this.lastReceivedMs > ms;
  }
  /** A silent server is shown as away, and after IDLE_MS it is looked for anew. */
  private listen(): void {
    const silentMs = performance.now() - this.lastReceivedMs;
    if (silentMs > IDLE_MS) return this.giveUp(`nothing came from the server for ${IDLE_MS / 1000} s`);
    const isSilent = silentMs > SILENT_MS || this.isAway;
    if (isSilent === this.isSilent) return;
    this.isSilent = isSilent;
    const reason = !isSilent ? '' : this.isAway ? 'nothing comes to this relay from its server' : `nothing has come for ${SILENT_MS / 1000} s`;
    this.net.post({ kind: 'state', state: isSilent ? 'silent' : 'open', reason, retryMs: 0 });
  }

  // ---- clock

  private ping(): void {
    const time = nowNs();
    this.pings.push(time);
    if (this.pings.length > 100) this.pings.shift();
    this.send({ ping: { client_time_ns: time } });
    this.timers[0] = setTimeout(() => this.ping(), ++this.pingCount < QUICK_PINGS ? QUICK_PING_MS : PING_MS);
  }
  private pong(pong: { client_time_ns: number; server_receive_ns: number; server_send_ns: number }, received: number): void {
    const at = this.pings.indexOf(pong.client_time_ns);
    if (at < 0) return; // no answer to a probe of ours
    this.pings.splice(at, 1);
    this.clock.add(pong.client_time_ns, pong.server_receive_ns, pong.server_send_ns, received);
  }

  // ---- media

  private media(message: Uint8Array, received: number): void {
    if (!(Object.values(Opcode) as number[]).includes(message[0]!)) return; // of a later version
    const header = readFrameHeader(message);
    switch (header.opcode) {
      case Opcode.asset:
        return this.withCore(() => this.takeAsset(header, message, received));
      case Opcode.strandKeyframe:
      case Opcode.strandDelta:
        return this.withCore(() => this.takeStrands(header, message, received));
      case Opcode.jpegFrame:
      case Opcode.jpegTiles:
      case Opcode.vp8Frame:
      case Opcode.h264Frame:
        this.pictureQueue = this.pictureQueue.then(() => this.takePicture(header, message, received));
        return;
      default:
        throw new Error(`a media message of kind ${header.opcode}`);
    }
  }
  private acknowledge(header: FrameHeader, received: number): void {
    this.send({
      frame_ack: {
        sequence: header.sequence, receive_time_ns: received, stream_id: header.streamId,
        decode_us: Math.max(0, Math.round((nowNs() - received) / 1000)),
      },
    });
  }
  private reject(error: Error): void {
    ++this.figures.rejectedFrames;
    this.figures.lastError = error.message;
    if (performance.now() - this.lastKeyframeRequestMs < KEYFRAME_REQUEST_MS) return;
    this.lastKeyframeRequestMs = performance.now();
    this.send({ keyframe_request: {} });
  }
  private takeAsset(header: FrameHeader, message: Uint8Array, received: number): void {
    const payload = message.subarray(kFrameHeaderBytes);
    this.net.setAsset(payload); // who draws prepares it meanwhile
    this.now!.setAsset(payload);
    this.next?.setAsset(payload);
    this.assetPayload = payload;
    this.acknowledge(header, received);
    this.net.post({ kind: 'asset' });
  }

  private followCodec(codec: string, reason: string): void {
    if (!codec || codec === (this.next ?? this.now)!.codec) return;
    this.next?.delete();
    this.next = undefined;
    this.codecReason = reason;
    if (codec === this.now!.codec) return;
    this.next = this.decoderOf(codec);
    if (this.assetPayload) this.next.setAsset(this.assetPayload);
    if (!this.hasState) this.beginNext();
  }
  private beginNext(): void {
    this.now!.delete();
    this.now = this.next!;
    this.next = undefined;
    this.codec = this.now.codec;
    this.strandMs.clear();
  }

  private takeStrands(header: FrameHeader, message: Uint8Array, received: number): void {
    const isKeyframe = header.opcode === Opcode.strandKeyframe;
    const isOther = header.streamId !== this.strandStream;
    // The module that can decode its keyframe is on its way, and a session of its own follows.
    if (this.net.changesModule) return;
    if (isOther && !isKeyframe) return this.reject(new Error(`delta ${header.sequence} is of stream ${header.streamId}`));
    if (isOther) {
      this.lastSequence = 0;
      this.decodedSequence = -1;
    }
    if (this.lastSequence && header.sequence > this.lastSequence + 1)
      this.figures.missedFrames += header.sequence - this.lastSequence - 1;
    this.lastSequence = header.sequence;
    const hasBase = isKeyframe || (!isOther && header.sequence === this.decodedSequence + 1);
    const isNext = this.next !== undefined && isKeyframe && isOther;
    const begin = performance.now();
    try {
      (isNext ? this.next! : this.now!).decode(message);
    } catch (error) {
      if (this.net.changesCore(error as Error)) return;
      if (hasBase) ++this.wrongStates;
      return this.reject(error as Error);
    }
    this.decodedSequence = header.sequence;
    this.acknowledge(header, received);
    if (isNext) this.beginNext();
    this.strandMs.add(performance.now() - begin);
    ++this.figures.decodedFrames;
    ++this.strandFrames;
    if (!isKeyframe && message[kFrameHeaderBytes]! & EXACT_BIT) ++this.exactFrames;
    this.strandStream = header.streamId;
    this.stateHash = readStateHash(message);
    this.noteMotion(this.now!.motionTimeNs(), header);
    if (this.isStateFresh) ++this.figures.replacedStates;
    this.hasState = this.isStateFresh = true;
    if (this.assetPayload) this.show(Mode.strands);
    this.net.offerState();
  }
  /** The newest state once; copied only when somebody draws it. */
  takeState(): Extract<State, { kind: 'strands' }> | undefined {
    if (!this.isStateFresh || !this.assetPayload) return undefined;
    this.isStateFresh = false;
    return { kind: 'strands', hash: this.stateHash, ...this.now!.state() };
  }
  private noteMotion(motionNs: number, header: FrameHeader): void {
    this.newestSentNs = header.sendTimeNs;
    if (motionNs === 0 || motionNs === this.lastMotionNs || !this.clock.hasValue) return;
    // Only the first state with a new sample counts: in later ones it is held, not late.
    if (this.lastMotionNs !== 0) this.motionMs.add((this.clock.toServerNs(nowNs()) - motionNs) * 1e-6);
    this.lastMotionNs = motionNs;
  }

  private async takePicture(header: FrameHeader, message: Uint8Array, received: number): Promise<void> {
    const begin = performance.now();
    let picture: Decoded;
    try {
      picture = await (this.pictures ??= new PictureDecoder()).decode(header, message);
    } catch (error) {
      return this.reject(error as Error);
    }
    if (!this.socket.isOpen) return picture.close();
    this.acknowledge(header, received);
    this.pictureMs.add(performance.now() - begin);
    ++this.figures.decodedFrames;
    if (header.streamId === this.lastPicture.stream && header.sequence > this.lastPicture.sequence + 1)
      this.figures.missedFrames += header.sequence - this.lastPicture.sequence - 1;
    this.lastPicture = { stream: header.streamId, sequence: header.sequence };
    const motion = this.motions.get(header.simTimeNs);
    if (motion !== undefined) this.noteMotion(motion, header);
    this.motions = new Map([...this.motions].slice(-64));
    this.newestSentNs = header.sendTimeNs;
    if (this.waitingPicture) {
      this.waitingPicture.close();
      ++this.figures.replacedStates;
    }
    this.waitingPicture = picture;
    this.pictureSize = 'displayWidth' in picture
      ? { width: picture.displayWidth, height: picture.displayHeight }
      : { width: picture.width, height: picture.height };
    this.offerPicture();
    this.show(Mode.frames);
  }
  offerPicture(): void {
    if (!this.waitingPicture || !this.net.isPictureFree) return;
    this.net.isPictureFree = false;
    const picture = this.waitingPicture;
    this.waitingPicture = undefined;
    this.net.post({ kind: 'picture', picture, ...this.pictureSize }, [picture as unknown as Transferable]);
  }

  needsAnother(mode: number): boolean {
    return (this.welcome?.relays.length ?? 0) > 0 && (mode === Mode.frames) !== (this.welcome!.mode === Mode.frames);
  }
  get showsStrands(): boolean {
    return this.shown === Mode.strands;
  }
  /** A frame of this mode was decoded. */
  private show(mode: number): void {
    if (this.shown === mode) return;
    this.shown = mode;
    this.lastSequence = 0;
    this.lastPicture = { stream: -1, sequence: 0 };
    this.motionMs.clear();
    this.lastMotionNs = 0;
    this.net.post({ kind: 'shown', mode, reason: this.reason });
  }

  lookFrom(camera: Camera): void {
    this.camera = camera;
    if (this.cameraTimer) return;
    this.cameraTimer = setTimeout(() => {
      this.cameraTimer = 0;
      const { offset, target, fov } = this.camera!;
      const vec = (v: number[]): { x: number; y: number; z: number } => ({ x: v[0]!, y: v[1]!, z: v[2]! });
      this.send({ camera: { camera: { offset_m: vec(offset), target_m: vec(target), fov_y_rad: fov } } });
    }, CAMERA_MS);
  }

  /** To the page, and once a second to the server, which chooses by it. */
  report(): void {
    if (!this.welcome) return;
    const figures: NetFigures = {
      ...this.figures, mode: this.shown, exactShare: this.exactFrames / Math.max(this.strandFrames, 1),
      decodeMs: this.shown === Mode.frames ? this.pictureMs.median : this.strandMs.median,
      ageMs: this.newestSentNs && this.clock.hasValue ? (this.clock.toServerNs(nowNs()) - this.newestSentNs) * 1e-6 : 0,
      motionMs: this.motionMs.median, roundTripMs: this.clock.roundTripMs, codec: this.codec,
      codecReason: this.codecReason, pictureCodec: this.pictureCodec,
    };
    this.net.post({ kind: 'figures', figures });
    if (performance.now() - this.lastReportMs < REPORT_MS) return;
    this.lastReportMs = performance.now();
    const { drawMs, shownHz, device } = this.net.drawn;
    this.send({
      viewer_report: {
        decode_ms: Math.min(this.strandMs.median, 60_000), draw_ms: Math.min(drawMs, 60_000),
        picture_decode_ms: Math.min(this.pictureMs.median, 60_000), shown_hz: Math.min(shownHz, 1000), device,
        step_ns: this.net.stepNs, wrong_states: this.wrongStates,
      },
    });
  }
}

export function runNet(): void {
  const post = (message: FromNet, transfer: Transferable[] = []): void =>
    (self as unknown as WorkerScope).postMessage(message, transfer);
  let net: Net;
  self.onmessage = (event: MessageEvent<ToNet>) => {
    const message = event.data;
    if (message.kind === 'start') {
      net = new Net({
        post, states: message.states, openSocket: (url, protocol) => new DistantSocket(message.sockets, url, protocol),
        loadCore: (file) => compileCore(new URL(file, self.location.href).href),
      });
      net.start(message);
    } else if (message.kind === 'core') {
      net.setCore(message.core).catch((error: Error) => net.withoutCore(error.message));
    } else if (message.kind === 'noCore') net.withoutCore(message.reason);
    else if (message.kind === 'reconnect') net.reconnect(message.asked);
    else net.command(message);
  };
}
