// Tiles out of the planes of a joined JPEG picture: the colours that the desktop viewer's decoder makes of them. A
// browser would smooth halved chroma, from one tile into the next.
const TILE = 64;

/** Planes of a picture of 64 x (64 n) pixels, one behind the other; chroma is halved both ways or not at all. */
export interface Planes {
  data: Uint8Array;
  places: readonly { offset: number; stride: number }[]; // Y, Cb, Cr
  isHalved: boolean;
}

// ITU-T T.871, 7, in 16 bits behind the point, as libjpeg rounds.
const BITS = 16;
const HALF = 1 << (BITS - 1);
const table = (weight: number, plus: number): Int32Array =>
  Int32Array.from({ length: 256 }, (_, value) => Math.round(weight * (1 << BITS)) * (value - 128) + plus);
const RED_OF_CR = table(1.402, HALF).map((sum) => sum >> BITS);
const BLUE_OF_CB = table(1.772, HALF).map((sum) => sum >> BITS);
const GREEN_OF_CB = table(-0.34414, HALF);
const GREEN_OF_CR = table(-0.71414, 0);
const LEAST = 256;
const CLAMPED = Uint8ClampedArray.from({ length: 3 * LEAST }, (_, at) => at - LEAST);

/** The tile that is number `tile` from above: RGBA in the order of its bytes. */
export function rgbaOfTile(planes: Planes, tile: number, out: Uint32Array): void {
  const [luma, blue, red] = planes.places as [Planes['places'][0], Planes['places'][0], Planes['places'][0]];
  const half = planes.isHalved ? 1 : 0;
  const { data } = planes;
  for (let y = 0, to = 0; y < TILE; ++y) {
    const row = tile * TILE + y;
    let at = luma.offset + row * luma.stride;
    const blueAt = blue.offset + (row >> half) * blue.stride;
    const redAt = red.offset + (row >> half) * red.stride;
    for (let x = 0; x < TILE; ++x) {
      const light = data[at++]! + LEAST;
      const cb = data[blueAt + (x >> half)]!;
      const cr = data[redAt + (x >> half)]!;
      const green = (GREEN_OF_CB[cb]! + GREEN_OF_CR[cr]!) >> BITS;
      out[to++] = 0xff000000 | (CLAMPED[light + BLUE_OF_CB[cb]!]! << 16) | (CLAMPED[light + green]! << 8) |
        CLAMPED[light + RED_OF_CR[cr]!]!;
    }
  }
}

/** Nothing where this browser decodes to something else. */
export async function planesOf(jpeg: Uint8Array): Promise<Planes | undefined> {
  try {
    const decoder = new ImageDecoder({ type: 'image/jpeg', data: jpeg });
    const { image } = await decoder.decode();
    let planes: Planes | undefined;
    if ((image.format === 'I420' || image.format === 'I444') && image.colorSpace.fullRange && image.colorSpace.matrix === 'smpte170m') {
      const data = new Uint8Array(image.allocationSize());
      planes = { data, places: await image.copyTo(data), isHalved: image.format === 'I420' };
    }
    image.close();
    decoder.close();
    return planes;
  } catch {
    return undefined;
  }
}
