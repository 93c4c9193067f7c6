// Tiles of pictures (proto/WIRE.md, section 7): what a message holds, and scans of one quality and chroma as one
// JPEG picture, one below the other, with restart markers between them.
export interface Tile {
  index: number;
  quality: number;
  chroma: number; // 0: 4:2:0, 1: 4:4:4
  scan: Uint8Array;
}

const FIXED_BYTES = 8;
const HEADER_BYTES = 6;
const TILE = 64;
const MOST_TILES = 1000; // in one JPEG picture: 64,000 rows

export function parseTiles(payload: Uint8Array): { width: number; height: number; tiles: Tile[] } {
  const view = new DataView(payload.buffer, payload.byteOffset, payload.length);
  if (payload.length < FIXED_BYTES) throw new Error('tiles are cut off');
  const width = view.getUint16(0, true);
  const height = view.getUint16(2, true);
  const count = view.getUint16(4, true);
  if (width < 16 || height < 16 || width > 3840 || height > 2160) throw new Error(`tiles of ${width} x ${height} pixels`);
  const most = Math.ceil(width / TILE) * Math.ceil(height / TILE);
  const tiles: Tile[] = [];
  let at = FIXED_BYTES;
  for (let i = 0; i < count; ++i) {
    if (at + HEADER_BYTES > payload.length) throw new Error('tiles are cut off');
    const tile = { index: view.getUint16(at, true), quality: view.getUint8(at + 2), chroma: view.getUint8(at + 3) };
    const bytes = view.getUint16(at + 4, true);
    at += HEADER_BYTES;
    if (tile.index >= most || tile.quality < 1 || tile.quality > 100 || tile.chroma > 1 || at + bytes > payload.length)
      throw new Error(`tile ${tile.index} does not fit`);
    tiles.push({ ...tile, scan: payload.subarray(at, at + bytes) });
    at += bytes;
  }
  if (at !== payload.length) throw new Error('there is more than the tiles say');
  return { width, height, tiles };
}

// ITU-T T.81, K.1 to K.6.
const ZIGZAG = [
  0, 1, 8, 16, 9, 2, 3, 10, 17, 24, 32, 25, 18, 11, 4, 5, 12, 19, 26, 33, 40, 48, 41, 34, 27, 20, 13, 6, 7, 14, 21, 28,
  35, 42, 49, 56, 57, 50, 43, 36, 29, 22, 15, 23, 30, 37, 44, 51, 58, 59, 52, 45, 38, 31, 39, 46, 53, 60, 61, 54, 47, 55,
  62, 63,
];
const LUMA = [
  16, 11, 10, 16, 24, 40, 51, 61, 12, 12, 14, 19, 26, 58, 60, 55, 14, 13, 16, 24, 40, 57, 69, 56, 14, 17, 22, 29, 51, 87,
  80, 62, 18, 22, 37, 56, 68, 109, 103, 77, 24, 35, 55, 64, 81, 104, 113, 92, 49, 64, 78, 87, 103, 121, 120, 101, 72, 92,
  95, 98, 112, 100, 103, 99,
];
const CHROMA = [
  17, 18, 24, 47, 99, 99, 99, 99, 18, 21, 26, 66, 99, 99, 99, 99, 24, 26, 56, 99, 99, 99, 99, 99, 47, 66, 99, 99, 99, 99,
  99, 99, ...new Array<number>(32).fill(99),
];
const DC_VALUES = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];
const DC_LUMA_BITS = [0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0];
const DC_CHROMA_BITS = [0, 3, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0];
const AC_LUMA_BITS = [0, 2, 1, 3, 3, 2, 4, 3, 5, 5, 4, 4, 0, 0, 1, 125];
const AC_CHROMA_BITS = [0, 2, 1, 2, 4, 4, 3, 4, 7, 5, 4, 4, 0, 1, 2, 119];
const hex = (text: string): number[] => text.match(/../g)!.map((two) => parseInt(two, 16));
const AC_LUMA_VALUES = hex(
  '01020300041105122131410613516107227114328191a1082342b1c11552d1f02433627282090a161718191a25262728292a3435363738393a' +
  '434445464748494a535455565758595a636465666768696a737475767778797a838485868788898a92939495969798999aa2a3a4a5a6a7a8a9' +
  'aab2b3b4b5b6b7b8b9bac2c3c4c5c6c7c8c9cad2d3d4d5d6d7d8d9dae1e2e3e4e5e6e7e8e9eaf1f2f3f4f5f6f7f8f9fa');
const AC_CHROMA_VALUES = hex(
  '000102031104052131061241510761711322328108144291a1b1c109233352f0156272d10a162434e125f11718191a262728292a35363738' +
  '393a434445464748494a535455565758595a636465666768696a737475767778797a82838485868788898a92939495969798999aa2a3a4a5a6' +
  'a7a8a9aab2b3b4b5b6b7b8b9bac2c3c4c5c6c7c8c9cad2d3d4d5d6d7d8d9dae2e3e4e5e6e7e8e9eaf2f3f4f5f6f7f8f9fa');

function quantisation(base: number[], quality: number): number[] {
  const scale = quality < 50 ? Math.floor(5000 / quality) : 200 - 2 * quality;
  return ZIGZAG.map((at) => Math.min(255, Math.max(1, Math.floor((base[at]! * scale + 50) / 100))));
}

/** A baseline JPEG picture, 64 pixels wide, of tiles of the same quality and chroma. */
export function jpegOfScans(tiles: readonly Tile[]): Uint8Array {
  const first = tiles[0]!;
  if (tiles.length > MOST_TILES) throw new Error(`${tiles.length} tiles in one picture`);
  const bytes: number[] = [0xff, 0xd8];
  const segment = (marker: number, body: number[]): void => {
    bytes.push(0xff, marker, (body.length + 2) >> 8, (body.length + 2) & 255, ...body);
  };
  const word = (value: number): number[] => [value >> 8, value & 255];
  // Says that there are colours, and which.
  segment(0xe0, [0x4a, 0x46, 0x49, 0x46, 0, 1, 1, 0, 0, 1, 0, 1, 0, 0]);
  segment(0xdb, [0, ...quantisation(LUMA, first.quality), 1, ...quantisation(CHROMA, first.quality)]);
  const sampling = first.chroma === 0 ? 0x22 : 0x11;
  segment(0xc0, [8, ...word(TILE * tiles.length), ...word(TILE), 3, 1, sampling, 0, 2, 0x11, 1, 3, 0x11, 1]);
  segment(0xc4, [
    0x00, ...DC_LUMA_BITS, ...DC_VALUES, 0x10, ...AC_LUMA_BITS, ...AC_LUMA_VALUES,
    0x01, ...DC_CHROMA_BITS, ...DC_VALUES, 0x11, ...AC_CHROMA_BITS, ...AC_CHROMA_VALUES,
  ]);
  segment(0xdd, word(first.chroma === 0 ? 16 : 64)); // blocks of a tile
  segment(0xda, [3, 1, 0x00, 2, 0x11, 3, 0x11, 0, 63, 0]);
  const size = tiles.reduce((sum, tile) => sum + tile.scan.length + 2, bytes.length);
  const out = new Uint8Array(size);
  out.set(bytes);
  let at = bytes.length;
  tiles.forEach((tile, i) => {
    out.set(tile.scan, at);
    at += tile.scan.length;
    out[at++] = 0xff;
    out[at++] = i + 1 === tiles.length ? 0xd9 : 0xd0 + (i % 8);
  });
  return out;
}
