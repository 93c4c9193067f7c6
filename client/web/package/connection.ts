// A connection as its user has it (strandcast.d.ts): commands out, and what the session tells by name.
import { HIDDEN_MS, type Camera, type FromNet, type State as StreamState, type ToNet } from '../page/messages';
import { cameraOf } from '../page/ui/orbit';
import { Command, Mode, Role, type WelcomeMessage } from '../page/wire';
import type { Session, SessionPlan } from './near';
import type { Connection, Events, Link, Look, Options, State, Welcome } from './strandcast';

type Kind = keyof Events;
const ROLES = { viewer: Role.viewer, controller: Role.controller } as const;

function addressOf(url: string | URL): string {
  const address = new URL(url);
  if (!/^(ws|http)s?:$/.test(address.protocol)) throw new TypeError(`${address.protocol} is no address of a server: ws:, wss:, http: or https:`);
  const isPage = address.protocol.startsWith('http');
  address.protocol = address.protocol.replace('http', 'ws');
  address.hash = '';
  if (isPage || address.pathname === '/') address.pathname = address.pathname.replace(/[^/]*$/, 'v1');
  return address.href;
}

const PICTURE = { width: 640, height: 360 }; // a size that the server takes; no pictures are asked for

const welcomeOf = (welcome: WelcomeMessage): Welcome => ({
  scene: welcome.scene_name, role: welcome.role === Role.viewer ? 'viewer' : 'controller', codec: welcome.codec,
  strandCount: welcome.strand_count, vertexCount: welcome.vertex_count, heads: welcome.heads, camera: cameraOf(welcome.camera),
});

export class UserConnection implements Connection {
  readonly opened: Promise<Welcome>;
  welcome?: Welcome;
  link: Link = { state: 'connecting', reason: '', retryMs: 0 };
  look?: Look;
  asset?: ArrayBuffer;
  private readonly session?: Session;
  private readonly listeners = new Map<Kind, Set<(event: never) => void>>();
  private waiting: { give: (state: State) => void; end: (error?: Error) => void }[] = [];
  private isAsked = false;
  private isClosed = false;
  private failure?: Error;
  private stopFollowing?: () => void;

  /** `open`: a session where it shall run. `states`: where its states go instead of to the listeners. */
  constructor(url: string | URL, options: Options, files: URL, open: (plan: SessionPlan) => Session, states?: MessagePort) {
    this.opened = new Promise((done, fail) => {
      this.on('welcome', done);
      this.on('link', ({ state, reason }) => state === 'ended' && fail(new Error(reason)));
    });
    this.opened.catch(() => undefined); // who wants to know asks
    this.session = open({
      asked: {
        url: addressOf(url), token: options.token ?? '', mode: Mode.strands, role: ROLES[options.role ?? 'controller'],
        codec: options.codec ?? '', head: options.head ?? '', pictures: '', ...PICTURE, drawsStrands: true,
        name: options.name ?? 'strandcast',
      },
      step: new URL('strand_step.wasm', files).href, whole: new URL('strand_core.wasm', files).href,
      tell: (message) => this.hear(message), give: (state) => this.take(state), states,
    });
    if (this.isClosed) this.session.end(); // refused before a connection was tried
    if (!states) this.ask();
  }

  on<K extends Kind>(kind: K, listener: (event: Events[K]) => void): () => void {
    const all = this.listeners.get(kind) ?? new Set();
    this.listeners.set(kind, all.add(listener));
    const { welcome, link, look, asset } = this;
    const newest = ({ welcome, link, look, asset } as Partial<Events>)[kind];
    if (newest) listener(newest);
    if (kind === 'state') this.ask();
    return () => void all.delete(listener);
  }
  private tell<K extends Kind>(kind: K, event: Events[K]): void {
    for (const listener of [...(this.listeners.get(kind) ?? [])]) (listener as (event: Events[K]) => void)(event);
  }

  private hear(message: FromNet): void {
    if (this.isClosed) return;
    switch (message.kind) {
      case 'welcome':
        this.welcome = welcomeOf(message.welcome);
        this.tell('welcome', this.welcome);
        return this.lookLike(message.welcome.look);
      case 'look':
        return this.lookLike(message.look);
      case 'state':
        this.link = { state: message.state, reason: message.reason, retryMs: message.retryMs };
        this.tell('link', this.link);
        return message.state === 'ended' ? this.finish(new Error(message.reason)) : undefined;
      case 'notice':
        return this.tell('notice', { isError: message.isError, text: message.text });
      case 'status': {
        const { is_paused, realtime_factor, viewer_count } = message.status;
        return this.tell('status', { isPaused: is_paused, realtimeFactor: realtime_factor, viewerCount: viewer_count });
      }
    }
  }
  private lookLike(look: object | undefined): void {
    if (look) this.tell('look', (this.look = look as Look));
  }

  // ---- states

  private ask(): void {
    if (this.isAsked || this.isClosed || !this.session) return;
    if (this.asset && !this.waiting.length && !this.listeners.get('state')?.size) return;
    this.isAsked = true;
    this.session?.ask();
  }
  private take(state: StreamState): void {
    this.isAsked = false;
    if (this.isClosed) return;
    if (state.kind === 'asset') this.tell('asset', (this.asset = state.payload));
    else this.give(state);
    this.ask();
  }
  private give(state: Extract<StreamState, { kind: 'strands' }>): void {
    const { tick, simTimeNs, motionTimeNs, positions, rotation, place, bust } = state;
    const { strandCount, vertexCount } = this.welcome!;
    const event: State = {
      tick, simTimeNs, motionTimeNs, positions, strandCount, vertexCount, bust, pose: { position: place, rotation },
      hash: state.hash.toString(16).padStart(16, '0'),
    };
    const waiting = this.waiting;
    this.waiting = [];
    for (const { give } of waiting) give(event);
    this.tell('state', event);
  }
  [Symbol.asyncIterator](): AsyncIterator<State> {
    return {
      next: () => new Promise((done, fail) => {
        const end = (error?: Error): void => (error ? fail(error) : done({ done: true, value: undefined }));
        if (this.isClosed) return end(this.failure);
        this.waiting.push({ give: (value) => done({ done: false, value }), end });
        this.ask();
      }),
      return: () => Promise.resolve({ done: true, value: undefined }),
    };
  }
  private finish(error?: Error): void {
    if (this.isClosed) return;
    this.isClosed = true;
    this.failure = error;
    this.stopFollowing?.();
    for (const { end } of this.waiting.splice(0)) end(error);
    this.session?.end();
  }

  // ---- commands

  private steer(message: ToNet): void {
    if (this.link.state !== 'open' && this.link.state !== 'silent') throw new Error('not connected');
    if (this.welcome?.role !== 'controller') throw new Error('this session may watch only');
    this.session?.send(message);
  }
  set(path: string, value: string | number): void {
    this.steer({ kind: 'set', assignment: `${path}=${value}` });
  }
  pause(): void {
    this.steer({ kind: 'command', command: Command.pause });
  }
  resume(): void {
    this.steer({ kind: 'command', command: Command.resume });
  }
  step(): void {
    this.steer({ kind: 'command', command: Command.stepOnce });
  }
  reset(): void {
    this.steer({ kind: 'command', command: Command.reset });
  }
  setCamera(camera: Camera): void {
    this.session?.send({ kind: 'camera', camera });
  }
  /** What is drawn of the states: the server chooses by it. */
  report(drawMs: number, shownHz: number, device: number): void {
    this.session?.send({ kind: 'drawn', drawMs, shownHz, device });
  }
  /** For what draws in a document: nothing comes while nobody sees it. */
  followVisibility(): void {
    if (this.stopFollowing || this.isClosed) return;
    let timer = 0;
    const tell = (): void => this.session?.send({ kind: 'window', ...PICTURE, isHidden: document.hidden });
    const follow = (): void => {
      clearTimeout(timer);
      if (document.hidden) timer = window.setTimeout(tell, HIDDEN_MS);
      else {
        tell();
        this.session?.send({ kind: 'wake' });
      }
    };
    document.addEventListener('visibilitychange', follow);
    this.stopFollowing = () => {
      clearTimeout(timer);
      document.removeEventListener('visibilitychange', follow);
    };
    if (document.hidden) follow();
  }
  close(): void {
    this.finish();
  }
}
