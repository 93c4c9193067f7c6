// A recording in the page itself (strandcast-ctl bundle): it is played as a server would send it, over and over.
// Its bytes: how many messages come before the first frame, then of each message its time in ms, its size and itself.
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

export function readTape(tape: ArrayBuffer): { first: Message[]; frames: Message[] } {
  const view = new DataView(tape);
  const messages: Message[] = [];
  for (let at = 4; at + 8 <= tape.byteLength; ) {
    const size = view.getUint32(at + 4, true);
    messages.push({ timeMs: view.getUint32(at, true), bytes: new Uint8Array(tape, at + 8, Math.min(size, tape.byteLength - at - 8)) });
    at += 8 + size;
  }
  const count = view.getUint32(0, true);
  return { first: messages.slice(0, count), frames: messages.slice(count) };
}

/** Gives each message when it is due, until the returned function is called. */
export function playTape(tape: ArrayBuffer, give: (message: ArrayBuffer) => void): () => void {
  const { first, frames } = readTape(tape);
  for (const { bytes } of first) give(bytes.slice().buffer);
  let next = 0;
  let beginMs = performance.now();
  let timer = 0;
  const play = (): void => {
    for (; next < frames.length && beginMs + frames[next]!.timeMs <= performance.now(); ++next) give(frames[next]!.bytes.slice().buffer);
    if (next === frames.length) {
      beginMs = performance.now() + FRAME_MS;
      next = 0;
    }
    timer = self.setTimeout(play, Math.max(0, beginMs + (frames[next]?.timeMs ?? FRAME_MS) - performance.now()));
  };
  play();
  return () => clearTimeout(timer);
}
