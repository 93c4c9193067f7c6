// The strand core in WebAssembly (client/web/strand_core.h, strand_picture.h), typed.
import { loadStrandCore } from '../strand_core.mjs';
import type { StrandState } from './messages';

export interface CoreFunctions {
  memory: WebAssembly.Memory;
  strand_core_allocate(bytes: number): number;
  strand_core_free(at: number): void;
  strand_core_make(codec: number, bytes: number, strands: number, vertices: number): number;
  strand_core_delete(decoder: number): void;
  strand_core_set_asset(decoder: number, at: number, bytes: number): number;
  strand_core_decode(decoder: number, at: number, bytes: number): number;
  strand_core_state(decoder: number): number;
  strand_core_positions(decoder: number): number;
  strand_core_all_positions(decoder: number): number;
  strand_core_position_floats(decoder: number): number;
  strand_core_step_ns?(): number; // of modules that take steps
  strand_core_error(): number;
  strand_picture_expect_asset(): void;
  strand_picture_make(at: number, bytes: number): number;
  strand_picture_delete(picture: number): void;
  strand_picture_head(picture: number): number;
  strand_picture_set_look(picture: number, look: number, color: number, colorBytes: number): void;
  strand_picture_positions(picture: number): number;
  strand_picture_changed(picture: number): void;
  strand_picture_prepare(picture: number, view: number): number;
  strand_picture_begin(picture: number, view: number): number;
  strand_picture_draw_tiles(picture: number, begin: number, end: number): void;
}

/** Once for all workers; while it still comes. */
export async function compileCore(url: string): Promise<WebAssembly.Module> {
  if (typeof WebAssembly === 'undefined') throw new Error('this browser has no WebAssembly');
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: the server says ${response.status}`);
  return WebAssembly.compileStreaming(response);
}

export class Core {
  private constructor(readonly call: CoreFunctions) {}

  static async load(module: WebAssembly.Module): Promise<Core> {
    return new Core((await loadStrandCore(module)) as CoreFunctions);
  }

  view(): DataView {
    return new DataView(this.call.memory.buffer);
  }
  bytes(): Uint8Array {
    return new Uint8Array(this.call.memory.buffer);
  }
  /** Calls use(pointer, size) with the bytes in the module's memory. */
  lend<T>(bytes: Uint8Array, use: (at: number, size: number) => T): T {
    const at = this.call.strand_core_allocate(Math.max(bytes.length, 1));
    if (!at) throw new Error('there is no memory left');
    this.bytes().set(bytes, at);
    try {
      return use(at, bytes.length);
    } finally {
      this.call.strand_core_free(at);
    }
  }
  error(): string {
    const memory = this.bytes();
    const begin = this.call.strand_core_error();
    return new TextDecoder().decode(memory.slice(begin, memory.indexOf(0, begin)));
  }
}

/** A decoder of one codec, with the newest state. */
export class StrandDecoder {
  private readonly decoder: number;
  constructor(private readonly core: Core, readonly codec: string, strands: number, vertices: number) {
    this.decoder = core.lend(new TextEncoder().encode(codec), (at, size) =>
      core.call.strand_core_make(at, size, strands, vertices));
    if (!this.decoder) throw new Error(core.error());
  }
  delete(): void {
    this.core.call.strand_core_delete(this.decoder);
  }
  setAsset(payload: Uint8Array): void {
    if (!this.core.lend(payload, (at, size) => this.core.call.strand_core_set_asset(this.decoder, at, size)))
      throw new Error(this.core.error());
  }
  /** Throws where the message cannot be used, or its state's hash is another one: the state is then what it was. */
  decode(message: Uint8Array): void {
    if (!this.core.lend(message, (at, size) => this.core.call.strand_core_decode(this.decoder, at, size)))
      throw new Error(this.core.error());
  }
  private time(at: number): number {
    return Number(this.core.view().getBigInt64(this.core.call.strand_core_state(this.decoder) + at, true));
  }
  motionTimeNs(): number {
    return this.time(16);
  }
  /** Copies. */
  state(): StrandState {
    const positionsAt = this.core.call.strand_core_all_positions(this.decoder);
    const state = this.core.call.strand_core_state(this.decoder);
    const view = this.core.view();
    const doubles = <T>(first: number, count: number): T =>
      Array.from({ length: count }, (_, i) => view.getFloat64(state + first + 8 * i, true)) as T;
    const floats = this.core.call.strand_core_position_floats(this.decoder);
    return {
      positions: new Float32Array(this.core.call.memory.buffer, positionsAt, floats).slice(),
      place: doubles(24, 3), rotation: doubles(48, 4), bust: doubles(96, 3),
      tick: this.time(0), simTimeNs: this.time(8), motionTimeNs: this.time(16),
    };
  }
}
