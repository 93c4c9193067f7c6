// A worker that makes a state ready for a graphics card of another page: what page/gl/strand_gl.ts uploads, in arrays of its own.
import { Core } from '../page/core';
import type { Camera, StrandState } from '../page/messages';
import { StrandPicture } from '../page/picture';
import type { LookMessage } from '../page/wire';

export const POINTS_PER_ROW = 2048; // of hair.vert.glsl
export const STRANDS_PER_ROW = 1024; // of strand_point.glsl

const CORNERS = [0, 1, 2, 2, 1, 3];
const roomFor = (count: number): number => 2 * POINTS_PER_ROW * Math.ceil(count / (2 * POINTS_PER_ROW)); // whole rows of pairs

export type ToPrepare =
  | { kind: 'core'; core: WebAssembly.Module }
  | { kind: 'asset'; asset: ArrayBuffer }
  | { kind: 'look'; look: LookMessage }
  | { kind: 'state'; state: Pick<StrandState, 'positions' | 'rotation' | 'bust'> }
  | { kind: 'view'; camera: Camera; width: number; height: number };

/** Places on a lattice of 65,536 steps along each axis, which is finer than a hair: half of what floats would take. */
export interface Points {
  data: Float32Array; // rows of two points a texel, of each two whole numbers: x + 2^16 (y mod 256), z + 2^16 (y / 256)
  least: number[]; // m
  step: number[]; // m
}
/** What has changed since the answer before. Arrays keep their lengths until they must grow. */
export interface Prepared {
  block: ArrayBuffer; // TileFrameBlock
  order: Float32Array; // rows of first points of segments, from back to front
  segmentCount: number;
  corners?: Uint32Array; // of each segment that `order` has room for: two triangles between four corners
  points?: Points;
  strands?: Float32Array; // rows of strands: first point, points, number among all, lock
  strandOf?: Float32Array; // rows of points: number of the strand
  depths?: { data: Uint16Array; size: [number, number, number] }[]; // key, rim, sky
  head?: { positions: Float32Array; normals: Float32Array; covers: Float32Array; triangles: Uint32Array };
}
export type FromPrepare = { kind: 'prepared'; prepared: Prepared } | { kind: 'failed'; reason: string };

class Preparing {
  private core!: Core;
  private picture?: StrandPicture;
  private look?: LookMessage;
  private seen = { light: -1, layout: -1, head: -1 };
  private segmentRoom = 0;
  private pointRoom = 0;

  async take(message: ToPrepare): Promise<FromPrepare | undefined> {
    if (message.kind === 'core') {
      this.core = await Core.load(message.core);
      this.core.call.strand_picture_expect_asset();
    } else if (message.kind === 'asset') {
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
    const made: Prepared = { block: picture.bytes(parts.block, parts.blockBytes).slice().buffer, ...this.order(picture.uints(parts.corners, parts.cornerCount), parts.pointCount) };
    if (this.seen.light !== parts.lightNumber) {
      this.seen.light = parts.lightNumber;
      made.points = this.points(picture.floats(parts.points, 3 * (parts.pointCount + 2)));
      const cells = (size: readonly number[]): number => size[0]! * size[1]! * size[2]!;
      const depth = (at: number, size: [number, number, number]) => ({ data: picture.shorts(at, cells(size)).slice(), size });
      made.depths = [depth(parts.keyDepth, parts.latticeSize), depth(parts.otherDepth, parts.halfSize),
        depth(parts.otherDepth + 2 * cells(parts.halfSize), parts.halfSize)];
    }
    if (this.seen.layout !== parts.layoutNumber) {
      this.seen.layout = parts.layoutNumber;
      made.strands = new Float32Array(4 * STRANDS_PER_ROW * Math.max(1, Math.ceil(parts.strandCount / STRANDS_PER_ROW)));
      made.strands.set(picture.uints(parts.strands, 4 * parts.strandCount)); // whole numbers far below 2^24
      made.strandOf = new Float32Array(this.pointRoom);
      made.strandOf.set(picture.uints(parts.strandOf, parts.pointCount));
    }
    if (this.seen.head !== parts.headNumber) {
      this.seen.head = parts.headNumber;
      const { positions, normals, covers, triangles } = picture.head();
      made.head = { positions: positions.slice(), normals: normals.slice(), covers: covers.slice(), triangles: triangles.slice() };
    }
    return made;
  }
  /** Room for all that the points can have: what is near the eye leaves some out. */
  private order(corners: Uint32Array, pointCount: number): Pick<Prepared, 'order' | 'segmentCount' | 'corners'> {
    const segmentCount = corners.length / CORNERS.length;
    const isGrown = pointCount > this.segmentRoom;
    if (isGrown) this.segmentRoom = roomFor(pointCount);
    const order = new Float32Array(this.segmentRoom);
    for (let i = 0; i < segmentCount; ++i) order[i] = corners[CORNERS.length * i]! >> 1;
    if (!isGrown) return { order, segmentCount };
    const all = new Uint32Array(CORNERS.length * this.segmentRoom);
    for (let i = 0; i < this.segmentRoom; ++i) CORNERS.forEach((corner, k) => (all[CORNERS.length * i + k] = 4 * i + corner));
    return { order, segmentCount, corners: all };
  }
  private points(places: Float32Array): Points {
    const count = places.length / 3;
    if (count > this.pointRoom) this.pointRoom = roomFor(count);
    const data = new Float32Array(2 * this.pointRoom);
    const least = [Infinity, Infinity, Infinity];
    const most = [-Infinity, -Infinity, -Infinity];
    for (let i = 3; i < places.length - 3; ++i) {
      const axis = i % 3;
      const at = places[i]!;
      if (at < least[axis]!) least[axis] = at;
      if (at > most[axis]!) most[axis] = at;
    }
    const step = most.map((at, axis) => Math.max(at - least[axis]!, 1e-6) / 65535);
    const onLattice = (i: number, axis: number): number =>
      Math.min(Math.max(Math.round((places[3 * i + axis]! - least[axis]!) / step[axis]!), 0), 65535);
    for (let i = 0; i < count; ++i) {
      const y = onLattice(i, 1);
      data[2 * i] = onLattice(i, 0) + 65536 * (y & 255);
      data[2 * i + 1] = onLattice(i, 2) + 65536 * (y >> 8);
    }
    return { data, least, step };
  }
}

export function runPrepare(): void {
  const preparing = new Preparing();
  const post = (message: FromPrepare, transfer: Transferable[] = []): void => (self as unknown as WorkerScope).postMessage(message, transfer);
  let before: Promise<void> = Promise.resolve();
  self.onmessage = ({ data }: MessageEvent<ToPrepare>) => {
    before = before.then(() => preparing.take(data)).then((answer) => {
      if (answer?.kind !== 'prepared') return;
      const { block, order, corners, points, strands, strandOf, depths, head } = answer.prepared;
      const arrays = [order, corners, points?.data, strands, strandOf, ...(depths ?? []).map((one) => one.data), ...Object.values(head ?? {})];
      post(answer, [block, ...arrays.flatMap((one) => (one ? [one.buffer] : []))]);
    }).catch((error: Error) => post({ kind: 'failed', reason: error.message }));
  };
}
