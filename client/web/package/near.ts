// A session on the thread that asks for it: a socket of this thread, and states by calls.
import { compileCore, Core } from '../page/core';
import type { Asked, FromNet, State, StatePort, ToNet } from '../page/messages';
import { StrandPicture } from '../page/picture';
import { Net } from '../page/session';
import type { ServerSocket } from '../page/socket';
import { nowNs } from '../page/clock';
import type { Mesh } from './strandcast';

/** What a connection has of its session, wherever that runs. */
export interface Session {
  send(message: ToNet): void;
  /** Asks for the next state, or asset. */
  ask(): void;
  end(): void;
}
export interface SessionPlan {
  asked: Asked;
  step: string; // URLs of the modules
  whole: string;
  tell(message: FromNet): void;
  give(state: State): void;
  states?: MessagePort; // where they go instead
}

class NearSocket implements ServerSocket {
  onopen?: () => void;
  onmessage?: (data: unknown, receivedNs: number) => void;
  onclose?: (code: number, reason: string) => void;
  private socket?: WebSocket;
  private isDropped = false;
  constructor(Socket: typeof WebSocket, url: string, protocol: string) {
    try {
      this.socket = new Socket(url, protocol);
    } catch (error) {
      queueMicrotask(() => this.drop(4005, (error as Error).message)); // no address: nothing to come back to
      return;
    }
    this.socket.binaryType = 'arraybuffer';
    this.socket.onopen = () => !this.isDropped && this.onopen?.();
    this.socket.onmessage = ({ data }: MessageEvent<unknown>) => !this.isDropped && this.onmessage?.(data, nowNs());
    this.socket.onclose = ({ code, reason }) => this.told(code, reason);
    this.socket.onerror = () => undefined; // the close follows
  }
  private told(code: number, reason: string): void {
    if (this.isDropped) return;
    this.isDropped = true;
    this.onclose?.(code, reason);
  }
  get isOpen(): boolean {
    return !this.isDropped && this.socket?.readyState === 1;
  }
  send(bytes: Uint8Array): void {
    if (this.isOpen) this.socket!.send(bytes);
  }
  drop(code: number, reason: string): void {
    this.told(code, reason);
    this.socket?.close(code);
  }
}

export function openNear(plan: SessionPlan, Socket: typeof WebSocket, load = compileCore): Session {
  const states: StatePort = { onmessage: null, postMessage: (state) => queueMicrotask(() => plan.give(state)) };
  const net = new Net({
    post: (message) => plan.tell(message), states, loadCore: load,
    openSocket: (url, protocol) => new NearSocket(Socket, url, protocol),
  });
  let isEnded = false;
  const fail = (error: Error): void => plan.tell({ kind: 'state', state: 'ended', reason: error.message, retryMs: 0 });
  load(plan.step).then((module) => (isEnded ? undefined : net.setCore(module))).catch(fail);
  net.start({ asked: plan.asked, stepCore: '', wholeCore: plan.whole });
  return {
    send: (message) => net.command(message),
    ask: () => (states.onmessage as (() => void) | null)?.(),
    end: () => {
      isEnded = true;
      net.end();
    },
  };
}

/** The head of an asset, by the module that draws. */
export async function headIn(asset: ArrayBuffer, module: WebAssembly.Module): Promise<Mesh> {
  const picture = new StrandPicture(await Core.load(module), new Uint8Array(asset));
  const { positions, normals, triangles } = picture.head();
  return { positions: positions.slice(), normals: normals.slice(), triangles: triangles.slice() };
}
