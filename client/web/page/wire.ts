// The wire protocol's bytes (proto/WIRE.md): control messages by tables that proto/schema.py makes of
// proto/strandcast/v1/*.proto, and the media header. Times are numbers: nanoseconds are exact up to 2^53, 104 days.

type Scalar = 'double' | 'float' | 'uint32' | 'uint64' | 'fixed32' | 'sfixed64' | 'bool' | 'string' | 'enum';
type Field = readonly [number, Scalar | Schema] | readonly [number, Scalar | Schema, 'repeated'];
export interface Schema {
  readonly [name: string]: Field;
}
type ScalarValue<K> = K extends 'bool' ? boolean : K extends 'string' ? string : number;
type FieldValue<F> = F extends readonly [number, infer K, 'repeated']
  ? (K extends Schema ? Message<K> : ScalarValue<K>)[]
  : F extends readonly [number, infer K]
  ? (K extends Schema ? Message<K> | undefined : ScalarValue<K>)
  : never;
/** All fields are there: scalars have their default where the bytes do not tell, messages are undefined. */
export type Message<S> = { -readonly [N in keyof S]: FieldValue<S[N]> };
export type Partly<S> = {
  [N in keyof S]?: S[N] extends readonly [number, infer K] ? (K extends Schema ? Partly<K> : FieldValue<S[N]>) : FieldValue<S[N]>;
};

// ---- messages

// schema begin: page tables
export const Hello = {
  role: [1, 'enum'], mode: [2, 'enum'], name: [3, 'string'], token: [4, 'string'], frame_width: [5, 'uint32'],
  frame_height: [6, 'uint32'], acknowledges: [7, 'bool'], picture_codecs: [8, 'uint32'], gets_no_stream: [9, 'bool'],
  step_ns: [10, 'double'], codec_wish: [11, 'string'], keeps_camera: [16, 'bool'], head: [17, 'string'],
  relay_id: [18, 'string'], strand_class: [19, 'uint32'], asset_layout: [20, 'uint32'],
} as const;
export const Vec3 = { x: [1, 'double'], y: [2, 'double'], z: [3, 'double'] } as const;
export const Camera = { offset_m: [1, Vec3], target_m: [2, Vec3], fov_y_rad: [3, 'float'] } as const;
export const CameraChange = { camera: [1, Camera] } as const;
export const KeyframeRequest = {} as const;
export const FrameAck = {
  sequence: [1, 'fixed32'], receive_time_ns: [2, 'sfixed64'], decode_us: [3, 'uint32'], stream_id: [4, 'uint32'],
} as const;
export const Ping = { client_time_ns: [1, 'sfixed64'] } as const;
export const ControlCommand = { command: [1, 'enum'], step_count: [2, 'uint32'] } as const;
export const SetParameter = { assignment: [1, 'string'] } as const;
export const AdminCommand = { action: [1, 'enum'], session: [2, 'uint64'], ban_s: [3, 'double'] } as const;
export const ViewerReport = {
  decode_ms: [1, 'double'], draw_ms: [2, 'double'], picture_decode_ms: [3, 'double'], shown_hz: [4, 'double'],
  device: [5, 'enum'], hair_px: [6, 'double'], step_ns: [7, 'double'], wrong_states: [8, 'uint32'],
} as const;
export const ModeRequest = { mode: [1, 'enum'] } as const;
export const SceneRequest = {} as const;
export const LiveCommand = { action: [1, 'enum'], subject: [2, 'string'] } as const;
export const ParameterRequest = { prefix: [1, 'string'], first: [2, 'uint32'], is_watching: [3, 'bool'] } as const;
export const CameraCommand = { session: [1, 'uint64'], camera: [2, Camera] } as const;
export const StateTimesRequest = { is_wanted: [1, 'bool'] } as const;
export const RecordCommand = {
  is_wanted: [1, 'bool'], name: [2, 'string'], slate: [3, 'string'], take: [4, 'uint32'],
} as const;
export const WindowChange = {
  frame_width: [1, 'uint32'], frame_height: [2, 'uint32'], is_hidden: [3, 'bool'],
} as const;
export const Color = { r: [1, 'double'], g: [2, 'double'], b: [3, 'double'] } as const;
export const StrandStyle = {
  clump: [1, 'float'], locks: [2, 'uint32'], spread: [3, 'float'], wave_m: [4, 'float'], wave_count: [5, 'float'],
  frizz_m: [6, 'float'], frizz_count: [7, 'float'], stray_share: [8, 'float'], stray_spread: [9, 'float'],
  length_spread: [10, 'float'], short_share: [11, 'float'], tip_fade: [12, 'float'],
} as const;
export const HairShading = {
  diffuse: [1, 'float'], scatter: [2, 'float'], highlight: [3, 'float'], transmission: [4, 'float'],
  second_highlight: [5, 'float'], highlight_width_deg: [6, 'float'], cuticle_deg: [7, 'float'],
  cuticle_spread_deg: [8, 'float'], root_darkening: [9, 'float'], strand_variation: [10, 'float'],
  lock_variation: [11, 'float'], warmth_variation: [12, 'float'], wetness: [13, 'float'],
} as const;
export const RenderMethods = {
  shading: [1, 'string'], scattering: [2, 'string'], evaluation: [3, 'string'], shadow: [4, 'string'],
  transparency: [5, 'string'], antialiasing: [6, 'string'], curve: [7, 'string'], joints: [8, 'string'],
  detail: [9, 'string'], culling: [10, 'string'], shadow_detail: [11, 'string'],
} as const;
export const Look = {
  root_color: [1, Color], tip_color: [2, Color], strand_radius_m: [3, 'float'], tip_scale: [4, 'float'],
  followers: [5, 'uint32'], segments: [6, 'uint32'], light_direction: [7, Vec3], light_color: [8, Color],
  ambient: [9, 'float'], background: [10, Color], skin_color: [11, Color], hair_color: [12, 'string'],
  eumelanin: [13, 'float'], pheomelanin: [14, 'float'], style: [15, StrandStyle], shading: [16, HairShading],
  rim_direction: [17, Vec3], rim_color: [18, Color], exposure: [19, 'float'], methods: [20, RenderMethods],
} as const;
export const Welcome = {
  session_id: [1, 'string'], server_version: [2, 'string'], scene_name: [3, 'string'], mode: [4, 'enum'],
  mode_reason: [5, 'string'], codec: [6, 'string'], strand_count: [7, 'uint32'], vertex_count: [8, 'uint32'],
  bound_m: [9, 'float'], step_rate_hz: [10, 'double'], look: [11, Look], camera: [12, Camera],
  frame_width: [13, 'uint32'], frame_height: [14, 'uint32'], sim_device: [15, 'string'], role: [20, 'enum'],
  codec_reason: [21, 'string'], heads: [26, 'string', 'repeated'], relays: [27, 'string', 'repeated'],
} as const;
export const Pong = {
  client_time_ns: [1, 'sfixed64'], server_receive_ns: [2, 'sfixed64'], server_send_ns: [3, 'sfixed64'],
} as const;
export const PictureMotion = { sim_time_ns: [1, 'sfixed64'], motion_time_ns: [2, 'sfixed64'] } as const;
export const LiveValue = { text: [1, 'string'] } as const;
export const LiveInput = {
  input: [1, 'string'], sender: [2, 'string'], subject: [3, 'string'], subjects: [4, 'string'], is_stale: [5, 'bool'],
  is_calibrated: [6, 'bool'], rate_hz: [7, 'double'], jitter_ms: [8, 'double'], age_ms: [9, 'double'],
  packets: [10, 'uint64'], received_bytes: [11, 'uint64'], malformed: [12, 'uint64'], refused: [13, 'uint64'],
  over_rate: [14, 'uint64'], impossible: [15, 'uint64'], clamped: [16, 'uint64'], gated: [17, 'uint64'],
  resequenced: [18, 'uint64'], late: [19, 'uint64'], lost: [20, 'uint64'], values: [21, LiveValue, 'repeated'],
} as const;
export const Timecode = {
  rate_numerator: [1, 'uint32'], rate_denominator: [2, 'uint32'], is_drop: [3, 'bool'], frame: [4, 'uint32'],
  part: [5, 'double'],
} as const;
export const ServerStatus = {
  tick: [1, 'uint64'], sim_ms: [2, 'double'], encode_ms: [3, 'double'], render_ms: [4, 'double'],
  realtime_factor: [5, 'double'], is_paused: [6, 'bool'], is_motion_stale: [7, 'bool'], viewer_count: [8, 'uint32'],
  dropped_frames: [9, 'uint64'], rejected_samples: [10, 'uint64'], quarantined_strands: [11, 'uint64'],
  overstretched_strands: [12, 'uint64'], queue_delay_ms: [13, 'double'], slow_motion: [14, 'string'],
  picture_motions: [15, PictureMotion, 'repeated'], detail: [16, 'string'], live_inputs: [24, LiveInput, 'repeated'],
  recording: [28, 'string'], timecode: [29, Timecode], away_s: [30, 'double'],
} as const;
export const Goodbye = { reason: [1, 'string'] } as const;
export const Notice = {
  is_error: [1, 'bool'], text: [2, 'string'], tick: [3, 'uint64'], state_hash: [4, 'uint64'],
} as const;
export const StreamQuality = {
  stream_id: [1, 'uint32'], rate_divisor: [2, 'uint32'], strand_share: [3, 'float'], bound_m: [4, 'float'],
  reason: [5, 'string'], codec: [6, 'string'],
} as const;
export const FrameQuality = {
  stream_id: [1, 'uint32'], width: [2, 'uint32'], height: [3, 'uint32'], rate_hz: [4, 'double'], quality: [5, 'uint32'],
  codec: [6, 'enum'], reason: [7, 'string'],
} as const;
export const SessionInfo = {
  id: [1, 'uint64'], name: [2, 'string'], address: [3, 'string'], role: [4, 'enum'], mode: [5, 'enum'],
  sent_bytes: [6, 'uint64'], queue_delay_ms: [7, 'double'], connected_s: [8, 'double'],
} as const;
export const SessionList = { sessions: [1, SessionInfo, 'repeated'] } as const;
export const ModeChange = {
  mode: [1, 'enum'], reason: [2, 'string'], frame_width: [3, 'uint32'], frame_height: [4, 'uint32'],
} as const;
export const LookChange = { look: [1, Look], camera: [2, Camera] } as const;
export const SceneText = { text: [1, 'string'] } as const;
export const ParameterInfo = {
  path: [1, 'string'], value: [2, 'string'], unset_value: [3, 'string'], unit: [4, 'string'], has_range: [5, 'bool'],
  minimum: [6, 'double'], maximum: [7, 'double'], is_live: [8, 'bool'], note: [9, 'string'],
} as const;
export const ParameterList = {
  parameters: [1, ParameterInfo, 'repeated'], total: [2, 'uint32'], is_change: [3, 'bool'],
} as const;
export const StateTime = {
  tick: [1, 'uint64'], sim_time_ns: [2, 'sfixed64'], source_ns: [3, 'sfixed64'], motion_ns: [4, 'sfixed64'],
  published_ns: [5, 'sfixed64'], encoded_ns: [6, 'sfixed64'], timecode: [7, Timecode],
} as const;
export const StateTimes = { states: [1, StateTime, 'repeated'] } as const;
export const StreamClass = {
  rate_divisor: [1, 'uint32'], strand_share: [2, 'float'], coarsening: [3, 'uint32'], bound_m: [4, 'float'],
  frame_rate_hz: [5, 'double'],
} as const;
export const StreamList = {
  classes: [1, StreamClass, 'repeated'], codecs: [2, 'string', 'repeated'], reason: [3, 'string'],
  solver: [4, 'string'], solver_cost: [5, 'double'], substeps: [6, 'uint32'],
} as const;
export const ClientMessage = {
  hello: [1, Hello], camera: [4, CameraChange], keyframe_request: [5, KeyframeRequest], frame_ack: [6, FrameAck],
  ping: [7, Ping], command: [8, ControlCommand], set_parameter: [9, SetParameter], admin: [12, AdminCommand],
  viewer_report: [10, ViewerReport], mode_request: [11, ModeRequest], scene_request: [13, SceneRequest],
  live_command: [18, LiveCommand], parameter_request: [16, ParameterRequest], camera_command: [24, CameraCommand],
  state_times_request: [25, StateTimesRequest], record_command: [28, RecordCommand], window: [29, WindowChange],
} as const;
export const ServerMessage = {
  welcome: [1, Welcome], pong: [2, Pong], status: [3, ServerStatus], goodbye: [4, Goodbye], notice: [5, Notice],
  quality: [6, StreamQuality], frame_quality: [8, FrameQuality], sessions: [12, SessionList],
  mode_change: [9, ModeChange], look_change: [13, LookChange], scene_text: [14, SceneText],
  parameter_list: [16, ParameterList], camera: [24, CameraChange], state_times: [25, StateTimes],
  stream_list: [28, StreamList],
} as const;
/** By the names of the .proto files, for the test. */
export const schemas: { readonly [name: string]: Schema } = {
  Hello, Vec3, Camera, CameraChange, KeyframeRequest, FrameAck, Ping, ControlCommand, SetParameter, AdminCommand,
  ViewerReport, ModeRequest, SceneRequest, LiveCommand, ParameterRequest, CameraCommand, StateTimesRequest,
  RecordCommand, WindowChange, Color, StrandStyle, HairShading, RenderMethods, Look, Welcome, Pong, PictureMotion,
  LiveValue, LiveInput, Timecode, ServerStatus, Goodbye, Notice, StreamQuality, FrameQuality, SessionInfo, SessionList,
  ModeChange, LookChange, SceneText, ParameterInfo, ParameterList, StateTime, StateTimes, StreamClass, StreamList,
  ClientMessage, ServerMessage,
};
export const Role = { viewer: 0, controller: 1, source: 2, admin: 3 } as const;
export const Mode = { strands: 0, frames: 1, auto: 2 } as const;
export const Command = { pause: 1, resume: 2, stepOnce: 3, reset: 4 } as const;
export const Device = { unknown: 0, none: 1, software: 2, hardware: 3 } as const;
export const PictureCodec = { jpeg: 0, jpegTiles: 1, vp8: 2, h264: 3 } as const;
// schema end

export type LookMessage = Message<typeof Look>;
export type CameraMessage = Message<typeof Camera>;
export type WelcomeMessage = Message<typeof Welcome>;
export type StatusMessage = Message<typeof ServerStatus>;
export type StreamQualityMessage = Message<typeof StreamQuality>;
export type FrameQualityMessage = Message<typeof FrameQuality>;
export type ParameterMessage = Message<typeof ParameterInfo>;
export type HelloMessage = Partly<typeof Hello>;

// ---- writing

const VARINT = 0;
const FIXED64 = 1;
const BYTES = 2;
const FIXED32 = 5;

/** Beyond 64 bits the nearest there is. */
function int64(value: number): bigint {
  const most = (1n << 63n) - 1n;
  const whole = BigInt(Math.round(value));
  return whole > most ? most : whole < -most ? -most - 1n : whole;
}

class Writer {
  private readonly bytes: number[] = [];
  private readonly scratch = new DataView(new ArrayBuffer(8));
  varint(value: number): void {
    let rest = value;
    while (rest >= 0x80) {
      this.bytes.push((rest % 0x80) | 0x80);
      rest = Math.floor(rest / 0x80);
    }
    this.bytes.push(rest);
  }
  append(bytes: Iterable<number>): void {
    for (const byte of bytes) this.bytes.push(byte);
  }
  private fixed(size: number): void {
    for (let i = 0; i < size; ++i) this.bytes.push(this.scratch.getUint8(i));
  }
  scalar(number: number, kind: Scalar, value: number | boolean | string): void {
    const tag = (wire: number): void => this.varint(number * 8 + wire);
    switch (kind) {
      case 'double':
        tag(FIXED64);
        this.scratch.setFloat64(0, value as number, true);
        return this.fixed(8);
      case 'float':
        tag(FIXED32);
        this.scratch.setFloat32(0, value as number, true);
        return this.fixed(4);
      case 'fixed32':
        tag(FIXED32);
        this.scratch.setUint32(0, value as number, true);
        return this.fixed(4);
      case 'sfixed64':
        tag(FIXED64);
        this.scratch.setBigInt64(0, int64(value as number), true);
        return this.fixed(8);
      case 'string': {
        const text = new TextEncoder().encode(value as string);
        tag(BYTES);
        this.varint(text.length);
        return this.append(text);
      }
      default:
        tag(VARINT);
        this.varint(Number(value));
    }
  }
  take(): Uint8Array {
    return Uint8Array.from(this.bytes);
  }
}

/** Canonical bytes: fields by number, defaults left out as in proto3, but for those of messages with `optional`. */
export function encodeMessage<S extends Schema>(schema: S, message: Partly<S>): Uint8Array {
  const writer = new Writer();
  const names = Object.keys(schema).sort((a, b) => schema[a]![0] - schema[b]![0]);
  for (const name of names) {
    const [number, kind, repeated] = schema[name]!;
    const value = message[name] as unknown;
    if (value === undefined) continue;
    for (const one of repeated ? (value as unknown[]) : [value]) {
      if (typeof kind === 'string') {
        if (one === 0 || one === false || one === '') continue;
        writer.scalar(number, kind, one as number);
      } else {
        const inner = encodeMessage(kind, one as Partly<Schema>);
        writer.varint(number * 8 + BYTES);
        writer.varint(inner.length);
        writer.append(inner);
      }
    }
  }
  return writer.take();
}

export const kControl = 0x01;

/** With its opcode. */
export function encodeClientMessage(message: Partly<typeof ClientMessage>): Uint8Array {
  return Uint8Array.of(kControl, ...encodeMessage(ClientMessage, message));
}
export function encodeServerMessage(message: Partly<typeof ServerMessage>): Uint8Array {
  return Uint8Array.of(kControl, ...encodeMessage(ServerMessage, message));
}

// ---- reading

const MAX_DEPTH = 16;

class Reader {
  private at = 0;
  constructor(private readonly bytes: Uint8Array) {}
  get isAtEnd(): boolean {
    return this.at >= this.bytes.length;
  }
  take(size: number): Uint8Array {
    if (size > this.bytes.length - this.at) throw new Error('a message is cut off');
    return this.bytes.subarray(this.at, (this.at += size));
  }
  view(size: number): DataView {
    const part = this.take(size);
    return new DataView(part.buffer, part.byteOffset, size);
  }
  varint(): number {
    let value = 0;
    for (let shift = 1, i = 0; i < 10; shift *= 0x80, ++i) {
      const byte = this.take(1)[0]!;
      value += (byte & 0x7f) * shift;
      if (byte < 0x80) return value;
    }
    throw new Error('a number in a message does not end');
  }
  skip(wire: number): void {
    if (wire === VARINT) this.varint();
    else if (wire === FIXED64) this.take(8);
    else if (wire === FIXED32) this.take(4);
    else if (wire === BYTES) this.take(this.varint());
    else throw new Error(`a message has wire type ${wire}`);
  }
  scalar(kind: Scalar): number | boolean | string {
    switch (kind) {
      case 'double':
        return this.view(8).getFloat64(0, true);
      case 'float':
        return this.view(4).getFloat32(0, true);
      case 'fixed32':
        return this.view(4).getUint32(0, true);
      case 'sfixed64':
        return Number(this.view(8).getBigInt64(0, true));
      case 'string':
        return new TextDecoder('utf-8', { fatal: true }).decode(this.take(this.varint()));
      case 'bool':
        return this.varint() !== 0;
      default:
        return this.varint();
    }
  }
}

function wireOf(kind: Scalar | Schema): number {
  if (typeof kind !== 'string' || kind === 'string') return BYTES;
  if (kind === 'double' || kind === 'sfixed64') return FIXED64;
  return kind === 'float' || kind === 'fixed32' ? FIXED32 : VARINT;
}

function defaultOf(field: Field): unknown {
  if (field[2]) return [];
  const kind = field[1];
  if (typeof kind !== 'string') return undefined;
  return kind === 'string' ? '' : kind === 'bool' ? false : 0;
}

const fieldsByNumber = new WeakMap<Schema, Map<number, string>>();
function namesOf(schema: Schema): Map<number, string> {
  let names = fieldsByNumber.get(schema);
  if (!names) fieldsByNumber.set(schema, (names = new Map(Object.entries(schema).map(([name, f]) => [f[0], name]))));
  return names;
}

/** Throws for bytes that are no message. Unknown fields are passed over. */
export function decodeMessage<S extends Schema>(schema: S, bytes: Uint8Array, depth = 0): Message<S> {
  if (depth > MAX_DEPTH) throw new Error('a message is nested too deeply');
  const message: { [name: string]: unknown } = {};
  for (const name of Object.keys(schema)) message[name] = defaultOf(schema[name]!);
  const reader = new Reader(bytes);
  const names = namesOf(schema);
  while (!reader.isAtEnd) {
    const tag = reader.varint();
    const wire = tag % 8;
    const name = names.get(Math.floor(tag / 8));
    if (name === undefined) {
      if (tag < 8) throw new Error('a message has a field 0');
      reader.skip(wire);
      continue;
    }
    const [, kind, repeated] = schema[name]!;
    if (wire !== wireOf(kind)) throw new Error(`the field ${name} has wire type ${wire}`);
    const value = typeof kind === 'string' ? reader.scalar(kind) : decodeMessage(kind, reader.take(reader.varint()), depth + 1);
    if (repeated) (message[name] as unknown[]).push(value);
    else message[name] = value;
  }
  return message as Message<S>;
}

/** With its opcode. */
export function decodeServerMessage(bytes: Uint8Array): Message<typeof ServerMessage> {
  return decodeMessage(ServerMessage, bytes.subarray(1));
}

// ---- media

export const Opcode = {
  asset: 0x10, strandKeyframe: 0x20, strandDelta: 0x21, jpegFrame: 0x30, jpegTiles: 0x31, vp8Frame: 0x32, h264Frame: 0x33,
} as const;
export const kFrameHeaderBytes = 32;

export interface FrameHeader {
  opcode: number;
  streamId: number;
  sequence: number;
  baseSequence: number;
  simTimeNs: number;
  sendTimeNs: number;
}

export function readFrameHeader(message: Uint8Array): FrameHeader {
  if (message.length < kFrameHeaderBytes) throw new Error('a media message is shorter than its header');
  const view = new DataView(message.buffer, message.byteOffset, message.length);
  if (view.getUint32(12, true) !== message.length - kFrameHeaderBytes)
    throw new Error('a media message is not as long as it says');
  return {
    opcode: view.getUint8(0),
    streamId: view.getUint16(2, true),
    sequence: view.getUint32(4, true),
    baseSequence: view.getUint32(8, true),
    simTimeNs: Number(view.getBigInt64(16, true)),
    sendTimeNs: Number(view.getBigInt64(24, true)),
  };
}

const STATE_HASH_AT = kFrameHeaderBytes + 88;
const EXACT_BIT = 128; // of a payload's first byte: the hash comes next
/** Of a strand frame that was decoded, and thereby compared with its state. */
export function readStateHash(message: Uint8Array): bigint {
  const isExact = (message[kFrameHeaderBytes]! & EXACT_BIT) !== 0;
  const view = new DataView(message.buffer, message.byteOffset, message.length);
  return view.getBigUint64(isExact ? kFrameHeaderBytes + 1 : STATE_HASH_AT, true);
}
