// The socket in a worker of its own: what arrives is stamped when it arrives, however long decoding of what came
// before takes, so that the server does not take a busy viewer for a slow link. DistantSocket is its other end.
import { Tape, TAPE_URL, type ToTape } from './tape';

/** Once, from the page: the port that DistantSockets speak by, and a recording to play instead of a server. */
export interface SocketStart {
  port: MessagePort;
  tape?: ArrayBuffer;
}
type ToSocket =
  | { kind: 'open'; number: number; url: string; protocol: string; originMs: number }
  | { kind: 'send'; number: number; bytes: Uint8Array }
  | { kind: 'close'; number: number; code: number }
  | { kind: 'passed'; number: number };
type FromSocket =
  | { kind: 'open'; number: number }
  | { kind: 'mark'; number: number } // when it passes, all that came before it has been heard
  | { kind: 'message'; number: number; data: unknown; receivedNs: number }
  | { kind: 'closed'; number: number; code: number; reason: string };

export function runSocket(): void {
  let tape: Tape | undefined;
  self.onmessage = ({ data }: MessageEvent<SocketStart | ToTape>) => {
    if (!('port' in data)) return tape?.hear(data);
    const { port } = data;
    const sockets = new Map<number, WebSocket>();
    let played = 0; // the socket that the tape is
    port.onmessage = ({ data: wish }: MessageEvent<ToSocket>) => {
      const post = (message: FromSocket, transfer: Transferable[] = []): void => port.postMessage(message, transfer);
      const socket = sockets.get(wish.number);
      if (wish.kind === 'open') {
        const { number, url, protocol, originMs } = wish;
        const early = performance.timeOrigin - originMs;
        const give = (data: unknown): void => {
          const receivedNs = Math.round((performance.now() + early) * 1e6);
          post({ kind: 'message', number, data, receivedNs }, data instanceof ArrayBuffer ? [data] : []);
        };
        if (url === TAPE_URL && data.tape) {
          played = number;
          post({ kind: 'open', number });
          tape ??= new Tape(data.tape);
          return tape.begin({ give, mark: () => post({ kind: 'mark', number }), tell: (place) => (self as unknown as WorkerScope).postMessage(place) });
        }
        let opened: WebSocket;
        try {
          opened = new WebSocket(url, protocol);
        } catch (error) {
          return post({ kind: 'closed', number, code: 4005, reason: (error as Error).message });
        }
        sockets.set(number, opened);
        opened.binaryType = 'arraybuffer';
        opened.onopen = () => post({ kind: 'open', number });
        opened.onmessage = ({ data }: MessageEvent<unknown>) => give(data);
        opened.onclose = ({ code, reason }) => {
          sockets.delete(number);
          post({ kind: 'closed', number, code, reason });
        };
      } else if (wish.number === played) {
        if (wish.kind === 'close') tape?.end();
        else if (wish.kind === 'passed') tape?.passed();
      } else if (wish.kind === 'close') {
        socket?.close(wish.code);
      } else if (wish.kind === 'send' && socket?.readyState === WebSocket.OPEN) {
        socket.send(wish.bytes);
      }
    };
  };
}

/** A socket as a session has it. */
export interface ServerSocket {
  readonly isOpen: boolean;
  onopen?: () => void;
  onmessage?: (data: unknown, receivedNs: number) => void;
  onclose?: (code: number, reason: string) => void;
  send(bytes: Uint8Array): void;
  drop(code: number, reason: string): void;
}

let lastNumber = 0;
const present = new Map<number, DistantSocket>();

export class DistantSocket implements ServerSocket {
  isOpen = false;
  onopen?: () => void;
  onmessage?: (data: unknown, receivedNs: number) => void;
  onclose?: (code: number, reason: string) => void;
  private readonly number = ++lastNumber;
  constructor(private readonly port: MessagePort, url: string, protocol: string) {
    present.set(this.number, this);
    port.onmessage = ({ data }: MessageEvent<FromSocket>) => present.get(data.number)?.hear(data);
    this.post({ kind: 'open', number: this.number, url, protocol, originMs: performance.timeOrigin });
  }
  private hear(message: FromSocket): void {
    if (message.kind === 'message') return this.onmessage?.(message.data, message.receivedNs);
    if (message.kind === 'mark') return this.post({ kind: 'passed', number: this.number });
    this.isOpen = message.kind === 'open';
    if (message.kind === 'open') return this.onopen?.();
    present.delete(this.number);
    this.onclose?.(message.code, message.reason);
  }
  private post(wish: ToSocket, transfer: Transferable[] = []): void {
    this.port.postMessage(wish, transfer);
  }
  send(bytes: Uint8Array): void {
    if (this.isOpen) this.post({ kind: 'send', number: this.number, bytes }, [bytes.buffer]);
  }
  /** Ends it here and now: over a link that is dead the browser's closing handshake takes a minute. */
  drop(code: number, reason: string): void {
    if (!present.delete(this.number)) return;
    this.isOpen = false;
    this.post({ kind: 'close', number: this.number, code });
    this.onclose?.(code, reason);
  }
}
