// PNG pictures of 8 bits, for tests: file or bytes -> { width, height, rgb }; and how alike two are.
import fs from 'node:fs';
import zlib from 'node:zlib';

export function readPng(from) {
  const bytes = typeof from === 'string' ? fs.readFileSync(from) : from;
  let [width, height, channels] = [0, 0, 0];
  const parts = [];
  for (let at = 8; at < bytes.length; ) {
    const size = bytes.readUInt32BE(at);
    const kind = bytes.toString('latin1', at + 4, at + 8);
    const data = bytes.subarray(at + 8, at + 8 + size);
    if (kind === 'IHDR') {
      [width, height] = [data.readUInt32BE(0), data.readUInt32BE(4)];
      channels = { 2: 3, 6: 4 }[data[9]];
      if (data[8] !== 8 || !channels || data[12]) throw new Error('a PNG of another kind');
    } else if (kind === 'IDAT') parts.push(data);
    at += 12 + size;
  }
  const raw = zlib.inflateSync(Buffer.concat(parts));
  const row = width * channels;
  const rgb = new Uint8Array(3 * width * height);
  let above = new Uint8Array(row);
  for (let y = 0; y < height; ++y) {
    const filter = raw[y * (row + 1)];
    const here = Uint8Array.from(raw.subarray(y * (row + 1) + 1, (y + 1) * (row + 1)));
    for (let i = 0; i < row; ++i) {
      const left = i < channels ? 0 : here[i - channels];
      const corner = i < channels ? 0 : above[i - channels];
      const guess = left + above[i] - corner; // Paeth
      const [a, b, c] = [Math.abs(guess - left), Math.abs(guess - above[i]), Math.abs(guess - corner)];
      const paeth = a <= b && a <= c ? left : b <= c ? above[i] : corner;
      here[i] += [0, left, above[i], (left + above[i]) >> 1, paeth][filter];
    }
    for (let x = 0; x < width; ++x) for (let c = 0; c < 3; ++c) rgb[3 * (y * width + x) + c] = here[channels * x + c];
    above = here;
  }
  return { width, height, rgb };
}

/** dB; Infinity for the same pixels. */
export function psnr(a, b) {
  if (a.width !== b.width || a.height !== b.height) throw new Error(`${a.width} x ${a.height} beside ${b.width} x ${b.height} pixels`);
  const sum = a.rgb.reduce((all, value, i) => all + (value - b.rgb[i]) ** 2, 0);
  return 10 * Math.log10((255 * 255 * a.rgb.length) / sum);
}
