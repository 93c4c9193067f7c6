// Pictures of the server in a worker: VP8 and H.264 by WebCodecs, JPEG by the browser's own decoder, tiles by
// joining their scans to pictures that it knows. One after the other, in order of arrival.
import { jpegOfScans, parseTiles, type Tile } from './jpeg_tiles';
import { planesOf, rgbaOfTile, type Planes } from './tile_planes';
import { FrameHeader, kFrameHeaderBytes, Opcode, PictureCodec } from './wire';

// Sent colours are BT.601 in studio range, of sRGB values; decoders would guess BT.709.
const COLORS: VideoColorSpaceInit = { primaries: 'bt709', transfer: 'iec61966-2-1', matrix: 'smpte170m', fullRange: false };
const H264 = 'avc1.42E02A';
const TILE = 64;

export type Decoded = VideoFrame | ImageBitmap;

function configOf(codec: string): VideoDecoderConfig {
  return { codec, colorSpace: COLORS, optimizeForLatency: true };
}

/** Bits of PictureCodec that this browser decodes here. */
export async function decodablePictures(): Promise<number> {
  let bits = typeof OffscreenCanvas === 'undefined' ? 0 : 1 << PictureCodec.jpegTiles;
  if (typeof VideoDecoder === 'undefined') return bits;
  const can = async (codec: string): Promise<boolean> => {
    try {
      return (await VideoDecoder.isConfigSupported(configOf(codec))).supported === true;
    } catch {
      return false;
    }
  };
  if (await can('vp8')) bits |= 1 << PictureCodec.vp8;
  if (await can(H264)) bits |= 1 << PictureCodec.h264;
  return bits;
}

class VideoPictures {
  private decoder: VideoDecoder;
  private waiting: { resolve: (frame: VideoFrame) => void; reject: (error: Error) => void }[] = [];
  private stamp = 0;
  constructor(readonly opcode: number) {
    this.decoder = new VideoDecoder({
      output: (frame) => {
        const one = this.waiting.shift();
        if (one) one.resolve(frame);
        else frame.close();
      },
      error: (error) => this.fail(new Error(error.message)),
    });
    this.decoder.configure(configOf(opcode === Opcode.vp8Frame ? 'vp8' : H264));
  }
  private fail(error: Error): void {
    for (const one of this.waiting.splice(0)) one.reject(error);
  }
  decode(header: FrameHeader, payload: Uint8Array): Promise<VideoFrame> {
    return new Promise((resolve, reject) => {
      // A decoder that keeps frames back is as good as none: better ask for a whole picture again.
      const timer = setTimeout(() => this.fail(new Error('the decoder gives nothing back')), 2000);
      this.waiting.push({
        resolve: (frame) => (clearTimeout(timer), resolve(frame)),
        reject: (error) => (clearTimeout(timer), reject(error)),
      });
      try {
        this.decoder.decode(new EncodedVideoChunk({
          type: header.baseSequence === 0 ? 'key' : 'delta', timestamp: (this.stamp += 1000), data: payload,
        }));
      } catch (error) {
        this.fail(error as Error);
      }
    });
  }
  close(): void {
    if (this.decoder.state !== 'closed') this.decoder.close();
    this.fail(new Error('other pictures came'));
  }
}

export class PictureDecoder {
  private video?: VideoPictures;
  private canvas?: OffscreenCanvas; // what tiles are put together on
  private readonly tile = new ImageData(TILE, TILE);
  private readonly pixels = new Uint32Array(this.tile.data.buffer);
  private givesPlanes = typeof ImageDecoder !== 'undefined';
  private last?: { streamId: number; opcode: number; sequence: number };

  close(): void {
    this.video?.close();
    this.video = undefined;
    this.last = undefined;
  }

  /** Throws where a picture cannot be used, or its base is missing. */
  async decode(header: FrameHeader, message: Uint8Array): Promise<Decoded> {
    const payload = message.subarray(kFrameHeaderBytes);
    const last = this.last;
    if (header.baseSequence !== 0 && !(last && last.opcode === header.opcode && last.streamId === header.streamId &&
        last.sequence === header.baseSequence))
      throw new Error(`picture ${header.sequence} continues ${header.baseSequence}, which is not here`);
    this.last = undefined;
    const picture = await this.decodePayload(header, payload);
    this.last = { streamId: header.streamId, opcode: header.opcode, sequence: header.sequence };
    return picture;
  }

  private async decodePayload(header: FrameHeader, payload: Uint8Array): Promise<Decoded> {
    if (header.opcode === Opcode.vp8Frame || header.opcode === Opcode.h264Frame) {
      if (this.video && (this.video.opcode !== header.opcode || header.baseSequence === 0)) {
        this.video.close();
        this.video = undefined;
      }
      this.video ??= new VideoPictures(header.opcode);
      try {
        return await this.video.decode(header, payload);
      } catch (error) {
        this.close();
        throw error;
      }
    }
    if (header.opcode === Opcode.jpegFrame) return createImageBitmap(new Blob([payload], { type: 'image/jpeg' }));
    return this.decodeTiles(header, payload);
  }

  private async decodeTiles(header: FrameHeader, payload: Uint8Array): Promise<ImageBitmap> {
    const { width, height, tiles } = parseTiles(payload);
    if (!this.canvas || this.canvas.width !== width || this.canvas.height !== height) {
      if (header.baseSequence !== 0) throw new Error('tiles of another size than their base');
      this.canvas = new OffscreenCanvas(width, height);
    }
    const classes = new Map<string, Tile[]>();
    for (const tile of tiles) {
      const name = `${tile.quality} ${tile.chroma}`;
      classes.set(name, [...(classes.get(name) ?? []), tile]);
    }
    const columns = Math.ceil(width / TILE);
    const drawing = this.canvas.getContext('2d', { alpha: false, willReadFrequently: true })!;
    // All of them are there before the first is drawn: one that fails leaves the picture as it was.
    const joined = await Promise.all([...classes.values()].map((alike) => this.decodeJoined(jpegOfScans(alike))));
    [...classes.values()].forEach((alike, k) => {
      const picture = joined[k]!;
      alike.forEach((tile, i) => {
        const x = (tile.index % columns) * TILE;
        const y = Math.floor(tile.index / columns) * TILE;
        if (picture instanceof ImageBitmap) {
          drawing.drawImage(picture, 0, i * TILE, TILE, TILE, x, y, TILE, TILE);
        } else {
          rgbaOfTile(picture, i, this.pixels);
          drawing.putImageData(this.tile, x, y);
        }
      });
      if (picture instanceof ImageBitmap) picture.close();
    });
    return createImageBitmap(this.canvas as unknown as ImageBitmapSource);
  }
  /** Its planes where this browser gives them: that takes a fifth of the time, for a Blob goes through other processes. */
  private async decodeJoined(jpeg: Uint8Array): Promise<Planes | ImageBitmap> {
    const planes = this.givesPlanes ? await planesOf(jpeg) : undefined;
    if (planes) return planes;
    this.givesPlanes = false;
    return createImageBitmap(new Blob([jpeg], { type: 'image/jpeg' }));
  }
}
