// A recording in the page itself (strandcast-ctl bundle), which is played as a server would send it. Its bytes: how many
// messages come before the first frame, then of each message its time in ms, its size and itself. What comes first is a keyframe.
import { Command, encodeServerMessage, kControl, Opcode } from './wire';

interface Message {
  timeMs: number;
  bytes: Uint8Array;
}
export interface Bundle {
  tape: ArrayBuffer;
  codec: string; // of the strands
  script: string; // URL of the page's own
}
declare global {
  var strandcastBundle: Bundle | undefined; // absent where a server sent the page
}

export const TAPE_URL = 'tape:';
const FRAME_MS = 1000 / 60; // between the last frame and the first one again
const STATUS_MS = 500;
const PORTION = 16; // frames at once on a way, so that whoever wants to go elsewhere meanwhile need not wait for its end
const LATE_MS = 200; // who decodes so much later than in real time sees slow motion
const STEADY_PACE = 0.95;
const PACE_SHARE = 0.25; // of the newest STATUS_MS
const FIRST_PACE = 1.3; // the first span may be a part of one, and tells nothing yet

export type ToTape =
  | { kind: 'command'; command: number } // as a server gets it; a reset goes to the begin
  | { kind: 'seek'; timeMs: number }
  | { kind: 'loop'; isLooping: boolean };
/** Of the last frame that was given. */
export interface TapePlace {
  timeMs: number;
  lengthMs: number;
  isLooping: boolean;
}
/** Who listens. mark() is answered by passed() when all that was given is decoded. */
export interface TapeReader {
  give(message: ArrayBuffer): void;
  mark(): void;
  tell(place: TapePlace): void;
}

export function readTape(tape: ArrayBuffer): { first: Message[]; frames: Message[]; looks: (Message & { at: number })[] } {
  const view = new DataView(tape);
  const messages: Message[] = [];
  for (let at = 4; at + 8 <= tape.byteLength; ) {
    const size = view.getUint32(at + 4, true);
    messages.push({ timeMs: view.getUint32(at, true), bytes: new Uint8Array(tape, at + 8, Math.min(size, tape.byteLength - at - 8)) });
    at += 8 + size;
  }
  const frames: Message[] = [];
  const looks: (Message & { at: number })[] = []; // each stands before the frame `at`
  const count = view.getUint32(0, true);
  for (const message of messages.slice(count)) {
    if (message.bytes[0] === kControl) looks.push({ ...message, at: frames.length });
    else frames.push(message);
  }
  return { first: messages.slice(0, count), frames, looks };
}

/** Gives each frame when it is due, and never more than are decoded in time. */
export class Tape {
  private readonly all: ReturnType<typeof readTape>;
  private next = 0; // frame to give
  private look = -1; // given last
  private beginMs = 0; // when the first frame was or would have been due
  private isPlaying = true;
  private isLooping = true;
  private isWaiting = false; // for what was given to be decoded
  private wanted = -1; // frame to go to after that
  private playedMs = 0; // since the last status
  private pace = FIRST_PACE;
  private timer = 0;
  private statusTimer = 0;

  private reader!: TapeReader;

  constructor(tape: ArrayBuffer) {
    this.all = readTape(tape);
  }
  /** For a new session, which goes on where the last one was. */
  begin(reader: TapeReader): void {
    this.end();
    this.reader = reader;
    const at = Math.max(0, this.next - 1);
    this.next = 0;
    this.look = -1;
    this.isWaiting = false;
    for (const { bytes } of this.all.first) this.give(bytes);
    this.statusTimer = setInterval(() => {
      this.pace = this.isPlaying && this.wanted < 0 ? this.pace + PACE_SHARE * (this.playedMs / STATUS_MS - this.pace) : FIRST_PACE;
      this.playedMs = 0;
      this.tellStatus();
    }, STATUS_MS);
    this.goTo(at);
  }
  end(): void {
    clearTimeout(this.timer);
    clearInterval(this.statusTimer);
  }
  hear(wish: ToTape): void {
    const { frames } = this.all;
    if (wish.kind === 'loop') {
      this.isLooping = wish.isLooping;
    } else if (wish.kind === 'seek') {
      const later = frames.findIndex(({ timeMs }) => timeMs > wish.timeMs);
      this.goTo((later < 0 ? frames.length : Math.max(1, later)) - 1);
    } else if (wish.command === Command.stepOnce) {
      this.goTo(this.next % frames.length);
    } else if (wish.command === Command.reset) {
      this.goTo(0);
    } else {
      this.isPlaying = wish.command === Command.resume;
      if (this.isPlaying && this.next === frames.length) this.goTo(0);
      else this.goOn();
    }
    this.tellStatus();
    this.tellPlace();
  }
  /** All that was given is decoded. */
  passed(): void {
    this.isWaiting = false;
    if (this.wanted >= 0) return this.goTo(this.wanted);
    if (performance.now() - this.dueMs(this.next) > LATE_MS) this.goOn();
    else this.play();
  }

  private give(bytes: Uint8Array): void {
    this.reader.give(bytes.slice().buffer);
  }
  private tellStatus(): void {
    const isSlow = this.isPlaying && this.pace < STEADY_PACE;
    const slow_motion = isSlow ? `Slow motion: this browser simulates ${this.pace.toFixed(2)} of real time` : '';
    this.give(encodeServerMessage({ status: { is_paused: !this.isPlaying, slow_motion } }));
  }
  private tellPlace(): void {
    const { frames } = this.all;
    this.reader.tell({
      timeMs: frames[Math.max(0, this.next - 1)]!.timeMs, lengthMs: frames[frames.length - 1]!.timeMs, isLooping: this.isLooping,
    });
  }
  private dueMs(frame: number): number {
    const { frames } = this.all;
    return this.beginMs + (frames[frame]?.timeMs ?? frames[frames.length - 1]!.timeMs + FRAME_MS);
  }
  /** In real time from where it is. */
  private goOn(): void {
    this.beginMs += performance.now() - this.dueMs(this.next);
    this.play();
  }
  private play(): void {
    clearTimeout(this.timer);
    const { frames } = this.all;
    if (!this.isPlaying || this.isWaiting || frames.length === 1) return;
    if (this.next === frames.length && performance.now() >= this.dueMs(this.next)) {
      if (this.isLooping) return this.goTo(0);
      this.isPlaying = false;
      return this.tellStatus();
    }
    const before = this.next - 1;
    let last = before;
    while (last + 1 < frames.length && last < before + PORTION && this.dueMs(last + 1) <= performance.now()) ++last;
    this.playedMs += this.dueMs(last) - this.dueMs(before);
    if (last > before) this.giveUpTo(last);
    else this.timer = setTimeout(() => this.play(), Math.max(0, this.dueMs(this.next) - performance.now()));
  }
  /** By the last keyframe before it, where that is nearer than the frame that was given last. */
  private goTo(frame: number): void {
    clearTimeout(this.timer);
    this.wanted = this.isWaiting ? frame : -1;
    if (this.isWaiting) return;
    let from = frame;
    while (from > 0 && from !== this.next && this.all.frames[from]!.bytes[0] !== Opcode.strandKeyframe) --from;
    if (frame !== this.next - 1) {
      this.next = from;
      this.giveUpTo(frame);
    }
    this.goOn();
  }
  private giveUpTo(frame: number): void {
    const { frames, looks } = this.all;
    const last = Math.min(frame, this.next + PORTION - 1);
    if (last < frame) this.wanted = frame;
    for (; this.next <= last; ++this.next) {
      const look = looks.filter(({ at }) => at <= this.next).length - 1;
      if (look >= 0 && look !== this.look) this.give(looks[look]!.bytes);
      this.look = look;
      this.give(frames[this.next]!.bytes);
    }
    this.isWaiting = true;
    this.reader.mark();
    this.tellPlace();
  }
}
