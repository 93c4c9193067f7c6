#!/usr/bin/env node
// Joins a Strandcast server and prints where the tip of the first strand is, state by state.
//
//   node join.mjs [HOST [PORT [STATES]]]      a token, where one is needed, in the variable STRANDCAST_TOKEN
//
// Node alone (18 or later), by the words of proto/WIRE.md (sections in brackets below). It decodes the codec "raw":
//   strandcast-server --set stream.codec=raw
import { randomBytes } from 'node:crypto';
import { connect } from 'node:net';

const CONTROL = 0x01, KEYFRAME = 0x20, DELTA = 0x21; // [1] first byte of a message
const MAX_MESSAGE_BYTES = (64 << 20) + 32; // [4]

/** Bytes of a socket, as many at a time as are asked for. */
class Reader {
  constructor(socket) {
    this.chunks = socket[Symbol.asyncIterator]();
    this.rest = Buffer.alloc(0);
  }
  async more() {
    const { value, done } = await this.chunks.next();
    if (done) throw new Error('the server closed the connection');
    return value;
  }
  async read(count) {
    const parts = [this.rest];
    for (let have = this.rest.length; have < count; have += parts.at(-1).length) parts.push(await this.more());
    const all = Buffer.concat(parts);
    this.rest = all.subarray(count);
    return all.subarray(0, count);
  }
  /** Up to and with these words. */
  async until(words) {
    while (!this.rest.includes(words)) {
      if (this.rest.length > 16_384) throw new Error('no WebSocket here: an endless answer');
      this.rest = Buffer.concat([this.rest, await this.more()]);
    }
    return this.read(this.rest.indexOf(words) + words.length);
  }
}

/** Binary messages over a WebSocket (RFC 6455). */
class Connection {
  static async open(host, port) {
    const self = new Connection();
    self.socket = connect({ host, port });
    self.reader = new Reader(self.socket);
    self.socket.write(`GET /v1 HTTP/1.1\r\nHost: ${host}:${port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n` +
      `Sec-WebSocket-Key: ${randomBytes(16).toString('base64')}\r\nSec-WebSocket-Version: 13\r\n` +
      'Sec-WebSocket-Protocol: strandcast.v1\r\n\r\n');
    const answer = (await self.reader.until('\r\n\r\n')).toString();
    if (!answer.startsWith('HTTP/1.1 101 ')) throw new Error(`no WebSocket here: ${answer.split('\r\n')[0]}`);
    return self;
  }
  send(payload, kind = 2) {
    const size = payload.length < 126 ? [128 | payload.length] : [254, payload.length >> 8, payload.length & 255];
    const mask = randomBytes(4);
    this.socket.write(Buffer.from([128 | kind, ...size, ...mask, ...payload.map((b, i) => b ^ mask[i % 4])]));
  }
  /** The next message, whole. */
  async receive() {
    const parts = [];
    for (let bytes = 0; ;) {
      const [first, second] = await this.reader.read(2);
      let size = second;
      if (second === 126) size = (await this.reader.read(2)).readUInt16BE();
      if (second === 127) size = Number((await this.reader.read(8)).readBigUInt64BE());
      if ((bytes += size) > MAX_MESSAGE_BYTES) throw new Error(`a message of more than ${MAX_MESSAGE_BYTES} bytes`);
      const data = await this.reader.read(size);
      const kind = first & 15;
      if (kind === 9) this.send(data, 10); // ping
      if (kind === 8) throw new Error(`the server closed the connection: ${data.subarray(2)}`);
      if (kind === 0 || kind === 2) parts.push(data);
      if ((kind === 0 || kind === 2) && first & 128) return Buffer.concat(parts);
    }
  }
}

const varint = (value) => (value < 128 ? [value] : [(value & 127) | 128, ...varint(value >> 7)]);
/** A text or a message, as protobuf writes it. */
const field = (number, data) => [...varint((number << 3) | 2), ...varint(data.length), ...data];

/** What a protobuf message holds, by number: whole numbers, or bytes of anything else. */
function fields(data) {
  const found = {};
  let at = 0;
  const readVarint = () => {
    for (let value = 0, scale = 1; ; scale *= 128) {
      if (at >= data.length) throw new Error('a control message that ends too early');
      const byte = data[at++];
      value += (byte & 127) * scale;
      if (byte < 128) return value;
    }
  };
  while (at < data.length) {
    const key = readVarint();
    const number = Math.floor(key / 8);
    if (key % 8 === 0) {
      found[number] = readVarint();
      continue;
    }
    const size = { 1: 8, 5: 4 }[key % 8] ?? readVarint();
    found[number] = data.subarray(at, at + size);
    at += size;
  }
  return found;
}

/** [6] FNV-1a over words of 64 bits. */
function stateHash(parts) {
  const PRIME = 0x100000001b3n;
  let value = 0xcbf29ce484222325n;
  const take = (word) => { value = BigInt.asUintN(64, (value ^ word) * PRIME); };
  for (const part of parts) {
    let at = 0;
    for (; at + 8 <= part.length; at += 8) {
      take(part.readBigUInt64LE(at));
      value ^= value >> 32n;
    }
    for (; at < part.length; ++at) take(BigInt(part[at]));
  }
  return value;
}

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** A point turned by a unit quaternion. */
function turned(w, axis, point) {
  const t = cross(axis, point).map((c) => 2 * c);
  const u = cross(axis, t);
  return point.map((p, i) => p + w * t[i] + u[i]);
}

const hex = (value) => value.toString(16).padStart(16, '0');

/** [4, 6] Tick, hash and place of the tip of a strand in the world, of a whole state by the codec "raw". */
function tipOf(message, strand) {
  const simTime = message.subarray(16, 24), fixed = message.subarray(32, 128), lattice = message.subarray(128);
  if (fixed.length < 96) throw new Error('a frame that is too short');
  const strands = fixed.readUInt32LE(8), vertices = fixed.readUInt32LE(12), tick = fixed.readBigUInt64LE(16);
  if (fixed[0] !== 0 || strands < 1 || strands > 200_000 || lattice.length !== 12 * strands * vertices)
    throw new Error('a frame that is none of the codec raw');
  const part = (from, to) => fixed.subarray(from, to);
  // The parts: tick, time, pose, strand_count, vertex_count, quantum_m, lattice.
  const state = stateHash([part(16, 24), simTime, part(32, 88), part(8, 12), part(12, 16), part(4, 8), lattice]);
  const told = fixed.readBigUInt64LE(88);
  if (state !== told) throw new Error(`tick ${tick}: state ${hex(state)} instead of ${hex(told)}`);
  const index = (vertices - 1) * strands + strand;
  const inHead = [0, 1, 2].map((axis) =>
    fixed.readFloatLE(4) * lattice.readInt32LE(4 * (axis * strands * vertices + index)));
  const [x, y, z, w, ...axis] = [...Array(7).keys()].map((i) => fixed.readDoubleLE(32 + 8 * i));
  return { tick, state, tip: turned(w, axis, inHead).map((p, i) => [x, y, z][i] + p) };
}

async function main(host = '127.0.0.1', port = '7878', states = '10') {
  const server = await Connection.open(host, Number(port));
  // [3] Hello: a viewer (role 0) of strands (mode 0), its name, its token, the codec that it insists on.
  const text = (words) => Buffer.from(words);
  const hello = [...field(3, text('join.mjs')), ...field(4, text(process.env.STRANDCAST_TOKEN ?? '')),
    ...field(11, text('raw'))];
  server.send(Buffer.from([CONTROL, ...field(1, hello)]));
  for (let left = Number(states); left > 0;) {
    const message = await server.receive();
    if (message[0] === CONTROL) {
      const told = fields(message.subarray(1));
      if (told[1] && String(fields(told[1])[6]) !== 'raw') // Welcome
        throw new Error('this server streams by another codec than raw: start it with --set stream.codec=raw');
      if (told[4]) throw new Error(String(fields(told[4])[1])); // Goodbye
    } else if (message[0] === KEYFRAME || message[0] === DELTA) {
      const { tick, state, tip } = tipOf(message, 0);
      console.log(`tick ${tick}: tip of strand 0 at ${tip.map((x) => x.toFixed(4)).join(' ')} m, state ${hex(state)}`);
      --left;
    }
  }
  server.socket.destroy();
}

// Who reads what is printed may have had enough.
process.stdout.on('error', (error) => process.exit(error.code === 'EPIPE' ? 0 : 1));
main(...process.argv.slice(2)).catch((error) => {
  console.error(`join.mjs: ${error.message}`);
  process.exitCode = 1;
  process.exit();
});
