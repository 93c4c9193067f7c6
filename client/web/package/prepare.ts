// A worker that makes a state ready for a graphics card of another page: what page/gl/strand_gl.ts uploads, in arrays of its own.
import { Core } from '../page/core';
import type { Camera, StrandState } from '../page/messages';
import { StrandPicture } from '../page/picture';
import type { LookMessage } from '../page/wire';

export const POINTS_PER_ROW = 2048; // of hair.vert.glsl
export const STRANDS_PER_ROW = 1024; // of strand_point.glsl

export type ToPrepare =
  | { kind: 'core'; core: WebAssembly.Module }
  | { kind: 'asset'; asset: ArrayBuffer }
  | { kind: 'look'; look: LookMessage }
  | { kind: 'state'; state: Pick<StrandState, 'positions' | 'rotation' | 'bust'> }
  | { kind: 'view'; camera: Camera; width: number; height: number };

/** What has changed since the answer before. Arrays keep their lengths until they must grow. */
export interface Prepared {
  block: ArrayBuffer; // TileFrameBlock
  corners: Uint32Array;
  cornerCount: number;
  points?: Float32Array; // rows of points: place and strand
  strands?: Float32Array; // rows of strands
  depths?: { data: Uint16Array; size: [number, number, number] }[]; // key, rim, sky
  head?: { positions: Float32Array; normals: Float32Array; covers: Float32Array; triangles: Uint32Array };
}
export type FromPrepare = { kind: 'prepared'; prepared: Prepared } | { kind: 'failed'; reason: string };

class Preparing {
  private core!: Core;
  private picture?: StrandPicture;
  private look?: LookMessage;
  private seen = { light: -1, layout: -1, head: -1 };
  private cornerRoom = 0;
  private pointRoom = 0;

  async take(message: ToPrepare): Promise<FromPrepare | undefined> {
    if (message.kind === 'core') this.core = await Core.load(message.core);
    else if (message.kind === 'asset') {
      this.picture?.delete();
      this.picture = new StrandPicture(this.core, new Uint8Array(message.asset));
      this.seen = { light: -1, layout: -1, head: -1 };
      if (this.look) this.picture.setLook(this.look);
    } else if (message.kind === 'look') this.picture?.setLook((this.look = message.look));
    else if (message.kind === 'state') this.picture?.setState(message.state.positions, message.state.rotation, message.state.bust);
    else return { kind: 'prepared', prepared: this.prepare(this.picture!, message) };
    return undefined;
  }

  private prepare(picture: StrandPicture, { camera, width, height }: Extract<ToPrepare, { kind: 'view' }>): Prepared {
    const parts = picture.prepare(camera, { width, height }, 1);
    if (parts.cornerCount > this.cornerRoom) this.cornerRoom = Math.ceil(parts.cornerCount * 1.25);
    const corners = new Uint32Array(this.cornerRoom);
    corners.set(picture.uints(parts.corners, parts.cornerCount));
    const made: Prepared = { block: picture.bytes(parts.block, parts.blockBytes).slice().buffer, corners, cornerCount: parts.cornerCount };
    if (this.seen.light !== parts.lightNumber) {
      this.seen.light = parts.lightNumber;
      made.points = this.points(picture.floats(parts.points, 3 * (parts.pointCount + 2)), picture.uints(parts.strandOf, parts.pointCount));
      const cells = (size: readonly number[]): number => size[0]! * size[1]! * size[2]!;
      const depth = (at: number, size: [number, number, number]) => ({ data: picture.shorts(at, cells(size)).slice(), size });
      made.depths = [depth(parts.keyDepth, parts.latticeSize), depth(parts.otherDepth, parts.halfSize),
        depth(parts.otherDepth + 2 * cells(parts.halfSize), parts.halfSize)];
    }
    if (this.seen.layout !== parts.layoutNumber) {
      this.seen.layout = parts.layoutNumber;
      made.strands = new Float32Array(4 * STRANDS_PER_ROW * Math.max(1, Math.ceil(parts.strandCount / STRANDS_PER_ROW)));
      made.strands.set(picture.uints(parts.strands, 4 * parts.strandCount)); // whole numbers far below 2^24
    }
    if (this.seen.head !== parts.headNumber) {
      this.seen.head = parts.headNumber;
      const { positions, normals, covers, triangles } = picture.head();
      made.head = { positions: positions.slice(), normals: normals.slice(), covers: covers.slice(), triangles: triangles.slice() };
    }
    return made;
  }
  private points(places: Float32Array, strandOf: Uint32Array): Float32Array {
    const count = strandOf.length + 2;
    if (count > this.pointRoom) this.pointRoom = POINTS_PER_ROW * Math.ceil((count * 1.25) / POINTS_PER_ROW);
    const points = new Float32Array(4 * this.pointRoom);
    for (let i = 0; i < count; ++i) {
      points[4 * i] = places[3 * i]!;
      points[4 * i + 1] = places[3 * i + 1]!;
      points[4 * i + 2] = places[3 * i + 2]!;
      points[4 * i + 3] = strandOf[i - 1] ?? 0;
    }
    return points;
  }
}

export function runPrepare(): void {
  const preparing = new Preparing();
  const post = (message: FromPrepare, transfer: Transferable[] = []): void => (self as unknown as WorkerScope).postMessage(message, transfer);
  let before: Promise<void> = Promise.resolve();
  self.onmessage = ({ data }: MessageEvent<ToPrepare>) => {
    before = before.then(() => preparing.take(data)).then((answer) => {
      if (answer?.kind !== 'prepared') return;
      const { block, corners, points, strands, depths, head } = answer.prepared;
      const arrays = [corners, points, strands, ...(depths ?? []).map((one) => one.data), ...Object.values(head ?? {})];
      post(answer, [block, ...arrays.flatMap((one) => (one ? [one.buffer] : []))]);
    }).catch((error: Error) => post({ kind: 'failed', reason: error.message }));
  };
}
