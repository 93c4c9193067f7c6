// Of WebCodecs and OffscreenCanvas what the page uses: the compiler's own declarations do not have it.
interface VideoDecoderConfig {
  codec: string;
  codedWidth?: number;
  codedHeight?: number;
  colorSpace?: VideoColorSpaceInit;
  optimizeForLatency?: boolean;
  hardwareAcceleration?: string;
}
interface VideoFrame {
  readonly visibleRect: DOMRectReadOnly | null;
  readonly displayWidth: number;
  readonly displayHeight: number;
  readonly timestamp: number;
  readonly format: string | null;
  readonly colorSpace: { readonly matrix: string | null; readonly fullRange: boolean | null };
  allocationSize(): number;
  copyTo(destination: Uint8Array): Promise<{ offset: number; stride: number }[]>;
  close(): void;
}
declare class ImageDecoder {
  constructor(init: { type: string; data: BufferSource });
  decode(): Promise<{ image: VideoFrame }>;
  close(): void;
}
declare class EncodedVideoChunk {
  constructor(init: { type: 'key' | 'delta'; timestamp: number; data: BufferSource });
}
declare class VideoDecoder {
  constructor(init: { output: (frame: VideoFrame) => void; error: (error: DOMException) => void });
  readonly state: 'unconfigured' | 'configured' | 'closed';
  readonly decodeQueueSize: number;
  configure(config: VideoDecoderConfig): void;
  decode(chunk: EncodedVideoChunk): void;
  close(): void;
  static isConfigSupported(config: VideoDecoderConfig): Promise<{ supported?: boolean }>;
}
interface OffscreenCanvas extends EventTarget {
  width: number;
  height: number;
  getContext(kind: 'webgl2', options?: WebGLContextAttributes): WebGL2RenderingContext | null;
  getContext(kind: '2d', options?: { alpha?: boolean; willReadFrequently?: boolean }): OffscreenCanvasRenderingContext2D | null;
  convertToBlob(options?: { type?: string }): Promise<Blob>;
  transferToImageBitmap(): ImageBitmap;
}
declare var OffscreenCanvas: { new (width: number, height: number): OffscreenCanvas };
interface OffscreenCanvasRenderingContext2D extends CanvasDrawImage, CanvasImageData, CanvasRect {
  imageSmoothingEnabled: boolean;
}
interface HTMLCanvasElement {
  transferControlToOffscreen(): OffscreenCanvas;
}
/** The global object of a worker, as far as it is another one than a window's. */
interface WorkerScope {
  postMessage(message: unknown, transfer?: Transferable[]): void;
}
declare module '*.glsl' {
  const text: string;
  export default text;
}
declare module '*.vert' {
  const text: string;
  export default text;
}
declare module '*.frag' {
  const text: string;
  export default text;
}
declare module '*.h' {
  const text: string;
  export default text;
}
