// A WebSocket of a browser's kind for Nodes that have none (before 22): ws: and binary messages, as tests need.
import { randomBytes } from 'node:crypto';
import { connect } from 'node:net';

export class NodeSocket {
  readyState = 0;
  parts = [];
  constructor(url, protocol) {
    const { hostname, port, pathname } = new URL(url);
    this.rest = Buffer.alloc(0);
    this.socket = connect({ host: hostname, port: Number(port) });
    this.socket.write(`GET ${pathname} HTTP/1.1\r\nHost: ${hostname}:${port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n` +
      `Sec-WebSocket-Key: ${randomBytes(16).toString('base64')}\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: ${protocol}\r\n\r\n`);
    this.socket.on('data', (part) => this.take(part));
    this.socket.on('error', (error) => this.onerror?.(error));
    this.socket.on('close', () => this.ended(1006, ''));
  }
  ended(code, reason) {
    if (this.readyState === 3) return;
    this.readyState = 3;
    this.socket.destroy();
    this.onclose?.({ code, reason });
  }
  take(part) {
    this.rest = Buffer.concat([this.rest, part]);
    if (this.readyState === 0) {
      const end = this.rest.indexOf('\r\n\r\n');
      if (end < 0) return;
      if (!this.rest.toString('latin1').startsWith('HTTP/1.1 101 ')) return this.ended(1006, '');
      this.rest = this.rest.subarray(end + 4);
      this.readyState = 1;
      this.onopen?.({});
    }
    for (let next; this.readyState === 1 && (next = this.next()); ) {
      const { kind, isLast, data } = next;
      if (kind === 8) this.ended(data.length ? data.readUInt16BE() : 1005, data.subarray(2).toString());
      else if (kind === 9) this.write(data, 10);
      else if (kind === 0 || kind === 2) {
        this.parts.push(data);
        if (isLast) this.onmessage?.({ data: Uint8Array.from(Buffer.concat(this.parts.splice(0))).buffer });
      }
    }
  }
  /** The next part that is there. */
  next() {
    if (this.rest.length < 2) return undefined;
    const short = this.rest[1];
    const begin = short < 126 ? 2 : short === 126 ? 4 : 10;
    if (this.rest.length < begin) return undefined;
    const size = short < 126 ? short : short === 126 ? this.rest.readUInt16BE(2) : Number(this.rest.readBigUInt64BE(2));
    if (this.rest.length < begin + size) return undefined;
    const part = { kind: this.rest[0] & 15, isLast: this.rest[0] >= 128, data: this.rest.subarray(begin, begin + size) };
    this.rest = this.rest.subarray(begin + size);
    return part;
  }
  write(data, kind) {
    const size = data.length < 126 ? [128 | data.length] : [254, data.length >> 8, data.length & 255];
    const mask = randomBytes(4);
    this.socket.write(Buffer.from([128 | kind, ...size, ...mask, ...data.map((byte, i) => byte ^ mask[i % 4])]));
  }
  send(data) {
    this.write(data, 2);
  }
  close(code = 1000) {
    if (this.readyState === 1) this.write(Buffer.from([code >> 8, code & 255]), 8);
    this.ended(code, '');
  }
}
