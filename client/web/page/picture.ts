// Strands as the core makes them ready to be drawn (client/web/strand_picture.h).
import type { Core } from './core';
import type { Camera } from './messages';
import type { HairShading, LookMessage, Message, StrandStyle } from './wire';

export interface PictureParts {
  block: number;
  blockBytes: number;
  pointCount: number;
  points: number;
  strands: number;
  strandCount: number;
  strandOf: number;
  layoutNumber: number;
  cornerCount: number;
  corners: number;
  keyDepth: number;
  otherDepth: number;
  latticeSize: [number, number, number];
  halfSize: [number, number, number];
  lightNumber: number;
  rgba: number;
  tileCount: number;
  headNumber: number;
}

export interface PictureHead {
  positions: Float32Array;
  normals: Float32Array;
  covers: Float32Array;
  triangles: Uint32Array;
}

const VIEW_FLOATS = 17;
const PARTS = 8; // of a picture that may be left

const rgb = (c?: { r: number; g: number; b: number }): number[] => [c?.r ?? 0, c?.g ?? 0, c?.b ?? 0];
const xyz = (v?: { x: number; y: number; z: number }): number[] => [v?.x ?? 0, v?.y ?? 0, v?.z ?? 0];

// schema begin: look block writer
const LOOK_FLOATS = 57;
type Style = Message<typeof StrandStyle>;
type Shading = Message<typeof HairShading>;
function numbersOf(look: LookMessage, style: Style, shading: Shading): number[] {
  return [
    ...rgb(look.root_color), ...rgb(look.tip_color), look.strand_radius_m, look.tip_scale, look.followers,
    look.segments, ...xyz(look.light_direction), ...rgb(look.light_color), look.ambient, ...rgb(look.background),
    ...rgb(look.skin_color), look.eumelanin, look.pheomelanin, ...xyz(look.rim_direction), ...rgb(look.rim_color),
    look.exposure, style.clump, style.locks, style.spread, style.wave_m, style.wave_count, style.frizz_m,
    style.frizz_count, style.stray_share, style.stray_spread, style.length_spread, style.short_share, style.tip_fade,
    shading.diffuse, shading.scatter, shading.highlight, shading.transmission, shading.second_highlight,
    shading.highlight_width_deg, shading.cuticle_deg, shading.cuticle_spread_deg, shading.root_darkening,
    shading.strand_variation, shading.lock_variation, shading.warmth_variation, shading.wetness,
  ];
}
// schema end
/** In the order of StrandPictureLook. A server tells all of a look. */
export function lookNumbers(look: LookMessage): Float32Array {
  if (!look.style || !look.shading) throw new Error('the server tells no whole look');
  return Float32Array.from(numbersOf(look, look.style, look.shading));
}

const bytesOf = (floats: Float32Array): Uint8Array => new Uint8Array(floats.buffer, floats.byteOffset, floats.byteLength);

export class StrandPicture {
  private readonly picture: number;
  private viewAt: number;
  private rotation: readonly number[] = [1, 0, 0, 0];
  private bust: readonly number[] = [0, 0, 0];
  background: number[] = [0, 0, 0];

  constructor(private readonly core: Core, asset: Uint8Array) {
    this.picture = core.lend(asset, (at, size) => core.call.strand_picture_make(at, size));
    if (!this.picture) throw new Error(core.error());
    this.viewAt = core.call.strand_core_allocate(4 * VIEW_FLOATS);
  }
  delete(): void {
    this.core.call.strand_picture_delete(this.picture);
    this.core.call.strand_core_free(this.viewAt);
  }
  bytes(at: number, count: number): Uint8Array {
    return new Uint8Array(this.core.call.memory.buffer, at, count);
  }
  shorts(at: number, count: number): Uint16Array {
    return new Uint16Array(this.core.call.memory.buffer, at, count);
  }
  uints(at: number, count: number): Uint32Array {
    return new Uint32Array(this.core.call.memory.buffer, at, count);
  }
  floats(at: number, count: number): Float32Array {
    return new Float32Array(this.core.call.memory.buffer, at, count);
  }

  setLook(look: LookMessage): void {
    const numbers = lookNumbers(look);
    if (numbers.length !== LOOK_FLOATS) throw new Error('a look has other numbers');
    this.background = rgb(look.background);
    this.core.lend(bytesOf(numbers), (at) =>
      this.core.lend(new TextEncoder().encode(look.hair_color), (name, size) =>
        this.core.call.strand_picture_set_look(this.picture, at, name, size)));
  }
  setState(positions: Float32Array, rotation: readonly number[], bust: readonly number[]): void {
    const at = this.core.call.strand_picture_positions(this.picture);
    if (at) this.floats(at, positions.length).set(positions);
    this.rotation = rotation;
    this.bust = bust;
    this.core.call.strand_picture_changed(this.picture);
  }
  head(): PictureHead {
    const at = this.core.call.strand_picture_head(this.picture);
    const [vertices, triangles, positions, normals, covers, corners] = this.uints(at, 6) as unknown as number[];
    return {
      positions: this.floats(positions!, 3 * vertices!), normals: this.floats(normals!, 3 * vertices!),
      covers: this.floats(covers!, vertices!), triangles: this.uints(corners!, 3 * triangles!),
    };
  }

  private lookFrom(camera: Camera, size: { width: number; height: number }, share: number): void {
    this.floats(this.viewAt, VIEW_FLOATS).set([
      size.width, size.height, ...camera.offset, ...camera.target, camera.fov, ...this.rotation, share, ...this.bust,
    ]);
  }
  private parts(at: number): PictureParts {
    if (!at) throw new Error(this.core.error());
    const n = Array.from(this.uints(at, 22));
    return {
      block: n[0]!, blockBytes: n[1]!, pointCount: n[2]!, points: n[3]!, strands: n[4]!, strandCount: n[5]!,
      strandOf: n[6]!, layoutNumber: n[7]!, cornerCount: n[8]!, corners: n[9]!, keyDepth: n[10]!, otherDepth: n[11]!,
      latticeSize: [n[12]!, n[13]!, n[14]!], halfSize: [n[15]!, n[16]!, n[17]!], lightNumber: n[18]!, rgba: n[19]!, tileCount: n[20]!, headNumber: n[21]!,
    };
  }
  /** For a graphics card. */
  prepare(camera: Camera, size: { width: number; height: number }, share: number): PictureParts {
    this.lookFrom(camera, size, share);
    return this.parts(this.core.call.strand_picture_prepare(this.picture, this.viewAt));
  }
  /** By this processor, a part of the tiles at a time: (height x width x 4). Nothing where somebody does not want it any more. */
  async draw(camera: Camera, size: { width: number; height: number }, share: number,
             isUnwanted?: () => Promise<boolean>): Promise<Uint8Array | undefined> {
    this.lookFrom(camera, size, share);
    const parts = this.parts(this.core.call.strand_picture_begin(this.picture, this.viewAt));
    const step = isUnwanted ? Math.ceil(parts.tileCount / PARTS) : parts.tileCount;
    for (let begin = 0; begin < parts.tileCount; begin += step) {
      if (isUnwanted && (await isUnwanted())) return undefined;
      this.core.call.strand_picture_draw_tiles(this.picture, begin, begin + step);
    }
    return this.bytes(parts.rgba, 4 * size.width * size.height);
  }
}
