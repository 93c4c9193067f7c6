// Hair of a Strandcast server, state by state. Lengths are in metres, times in nanoseconds of the server's clocks.

export type Vec3 = [number, number, number];
/** w x y z. */
export type Quaternion = [number, number, number, number];

/** One step of the simulation, as every viewer of the stream has it, bit for bit. */
export interface State {
  readonly tick: number;
  readonly simTimeNs: number;
  /** When the newest head motion was measured that the state shows; 0 without any. */
  readonly motionTimeNs: number;
  /** 16 hexadecimal digits; the receiver has compared it. */
  readonly hash: string;
  /** Of all strands, in head space: vertex by vertex, of each all strands, of each x y z. Yours to keep. */
  readonly positions: Float32Array;
  readonly strandCount: number;
  readonly vertexCount: number;
  /** Where the head is: world from head. */
  readonly pose: { readonly position: Vec3; readonly rotation: Quaternion };
  /** How neck and chest are turned against the head: x y z of a quaternion. */
  readonly bust: Vec3;
}

export interface Camera {
  /** From the point that is looked at, along the world's axes, m. */
  offset: Vec3;
  /** From the head's joint, along the world's axes, m. */
  target: Vec3;
  /** Vertical, rad. */
  fov: number;
}

/** What a server says first. */
export interface Welcome {
  readonly scene: string;
  readonly role: 'viewer' | 'controller';
  readonly codec: string;
  readonly strandCount: number;
  readonly vertexCount: number;
  readonly heads: readonly string[];
  readonly camera: Camera;
}

/** How the link is. After `ended` nothing more comes; in `waiting` the next attempt is `retryMs` away. */
export interface Link {
  readonly state: 'connecting' | 'open' | 'silent' | 'waiting' | 'ended';
  readonly reason: string;
  readonly retryMs: number;
}

/** The appearance, by the names of `Look` in the protocol. */
export type Look = Readonly<Record<string, unknown>>;

export interface Events {
  state: State;
  link: Link;
  welcome: Welcome;
  look: Look;
  /** Rest shape and head, as the protocol has them: before the first state of every link. */
  asset: ArrayBuffer;
  /** Answers and warnings of the server. */
  notice: { readonly isError: boolean; readonly text: string };
  status: { readonly isPaused: boolean; readonly realtimeFactor: number; readonly viewerCount: number };
}

export interface Options {
  token?: string;
  /** `viewer` asks for no right to steer; `controller` (the default) takes what the token allows. */
  role?: 'viewer' | 'controller';
  /** Which one of the server's heads. */
  head?: string;
  /** A codec to insist on. */
  codec?: string;
  /** As the server lists this session. */
  name?: string;
  /** False decodes on this thread; the default in a worker and in Node. */
  worker?: boolean;
  /** Where the package's worker and modules lie, if not beside its script. */
  files?: string | URL;
  /** Of a browser's kind, where there is none: Node before 22. */
  WebSocket?: unknown;
}

export interface Connection extends AsyncIterable<State> {
  /** Fails when the link ends before the server lets this session in. */
  readonly opened: Promise<Welcome>;
  /** The newest of each; undefined before the first. */
  readonly welcome?: Welcome;
  readonly link: Link;
  readonly look?: Look;
  readonly asset?: ArrayBuffer;
  /** Calls for each, and at once with the newest of what is kept above; returns what ends that. States that come while
   *  the listener works are passed over for the newest. */
  on<K extends keyof Events>(kind: K, listener: (event: Events[K]) => void): () => void;
  /** Changes a parameter, as `set('look.hair_color', 'red')`. This and the next four need the role `controller`. */
  set(path: string, value: string | number): void;
  pause(): void;
  resume(): void;
  step(): void;
  reset(): void;
  /** Where this viewer looks from. */
  setCamera(camera: Camera): void;
  close(): void;
}

/** `url`: ws: or wss:, or the server's page (http: or https:). Comes back by itself after a lost link. */
export function connect(url: string | URL, options?: Options): Connection;

/** A mesh in head space, m. */
export interface Mesh {
  readonly positions: Float32Array;
  readonly normals: Float32Array;
  readonly triangles: Uint32Array;
}
/** The head that a connection's `asset` holds. */
export function headOf(asset: ArrayBuffer, options?: Pick<Options, 'files'>): Promise<Mesh>;
