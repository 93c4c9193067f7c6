// What the page's threads tell one another. The page itself (app.ts) has the window, one worker the connection
// (session.ts), one its socket (socket.ts), one the drawing
// (drawer.ts). States go straight from the connection to the drawing, pictures to
// the page; at most one of each is on its way, and the newest waits.
import type {
  CameraMessage, FrameQualityMessage, LookMessage, ParameterMessage, StatusMessage, StreamQualityMessage, WelcomeMessage,
} from './wire';

export type Vec3 = [number, number, number];
export interface Camera {
  offset: Vec3; // m, from the point looked at, world axes
  target: Vec3; // m, from the head joint, world axes
  fov: number; // rad, vertical
}

export interface Asked {
  url: string; // ws: or wss:
  token: string;
  mode: number;
  role: number;
  codec: string; // of strands, insisted on
  head: string; // which one of the server's; empty: the first
  pictures: string; // of pictures, likewise
  width: number; // of pictures that the server draws
  height: number;
  drawsStrands: boolean;
  name?: string; // as the server lists it
}

export type ToNet =
  | { kind: 'start'; stepCore: string; wholeCore: string; asked: Asked; states: MessagePort; sockets: MessagePort }
  | { kind: 'core'; core: WebAssembly.Module }
  | { kind: 'noCore'; reason: string }
  | { kind: 'reconnect'; asked: Asked }
  | { kind: 'mode'; mode: number }
  | { kind: 'camera'; camera: Camera }
  | { kind: 'window'; width: number; height: number; isHidden: boolean } // of the server's pictures; nobody sees it
  | { kind: 'wake' } // it may have slept: is the server still there?
  | { kind: 'rest' } // until the page is shown again
  | { kind: 'command'; command: number }
  | { kind: 'set'; assignment: string }
  | { kind: 'scene' }
  | { kind: 'controls' } // values of what is on top of the panel, and what changes of them
  | { kind: 'drawn'; drawMs: number; shownHz: number; device: number }
  | { kind: 'pictureShown' };

/** Numbers of the connection, twice a second. */
export interface NetFigures {
  mode: number; // shown
  decodeMs: number; // median
  receivedBytes: number;
  decodedFrames: number;
  exactShare: number; // of the strand frames: without corrections
  rejectedFrames: number;
  missedFrames: number;
  replacedStates: number; // decoded, and never drawn: a newer one was there first
  ageMs: number; // of the newest state or picture, since the server sent it
  motionMs: number; // from a motion sample at the server to what was decoded and shows it
  roundTripMs: number;
  codec: string;
  codecReason: string;
  pictureCodec: string;
  lastError: string;
}

export type FromNet =
  | { kind: 'welcome'; welcome: WelcomeMessage }
  | { kind: 'state'; state: 'connecting' | 'open' | 'silent' | 'waiting' | 'ended'; reason: string; retryMs: number }
  | { kind: 'asset' }
  | { kind: 'shown'; mode: number; reason: string }
  | { kind: 'modeReason'; reason: string }
  | { kind: 'look'; look?: LookMessage; camera?: CameraMessage }
  | { kind: 'moved'; camera?: CameraMessage }
  | { kind: 'status'; status: StatusMessage }
  | { kind: 'quality'; quality: StreamQualityMessage }
  | { kind: 'frameQuality'; quality: FrameQualityMessage }
  | { kind: 'notice'; isError: boolean; text: string }
  | { kind: 'sceneText'; text: string }
  | { kind: 'parameters'; parameters: readonly ParameterMessage[] }
  | { kind: 'picture'; picture: VideoFrame | ImageBitmap; width: number; height: number }
  | { kind: 'figures'; figures: NetFigures };

/** From the connection to the drawing, by their own port; the drawing asks for each with 'next'. */
export type State =
  | { kind: 'asset'; payload: ArrayBuffer }
  | ({ kind: 'strands'; hash: bigint } & StrandState);
export interface StrandState {
  positions: Float32Array; // of all strands, m, head space: (vertices x strands x 3)
  rotation: [number, number, number, number]; // world from head: w x y z
  bust: [number, number, number]; // against the head: x y z of a quaternion
  place: Vec3; // of the head, m, world
  tick: number;
  simTimeNs: number;
  motionTimeNs: number;
}
/** Where states go; who gets them asks for each by a message. */
export interface StatePort {
  onmessage: ((event: MessageEvent) => void) | null;
  postMessage(state: State, transfer: Transferable[]): void;
}

export type ToDraw =
  | { kind: 'start'; canvas: OffscreenCanvas; wish: string; samples: number }
  | { kind: 'core'; core: WebAssembly.Module; states: MessagePort }
  | { kind: 'look'; look: LookMessage }
  | { kind: 'camera'; camera: Camera; isMoving: boolean }
  | { kind: 'size'; width: number; height: number }
  | { kind: 'visible'; isVisible: boolean }
  | { kind: 'shot' };

export interface DrawFigures {
  drawMs: number; // median of pictures in motion, of at least half the sides
  stepMs: number; // of pictures as they are drawn now
  shownHz: number;
  share: number; // of the window's sides
  leastWholeMs: number; // of pictures with all of them
  strands: number;
  segments: number;
}
export type FromDraw =
  | { kind: 'ready'; device: number; drawnBy: string; why: string }
  | { kind: 'figures'; figures: DrawFigures }
  | { kind: 'drawn' }
  | { kind: 'shot'; blob: Blob | null }
  | { kind: 'failed'; reason: string };

/** So long a tab may be hidden before the server hears of it. */
export const HIDDEN_MS = 2000;
