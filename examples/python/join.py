#!/usr/bin/env python3
"""Joins a Strandcast server and prints where the tip of the first strand is, state by state.

    python3 join.py [HOST [PORT [STATES]]]        a token, where one is needed, in the variable STRANDCAST_TOKEN

Python 3 alone, by the words of proto/WIRE.md (sections in brackets below). It decodes the codec "raw":
    strandcast-server --set stream.codec=raw
"""
import base64
import os
import socket
import struct
import sys

CONTROL, KEYFRAME, DELTA = 0x01, 0x20, 0x21  # [1] first byte of a message
MAX_MESSAGE_BYTES = (64 << 20) + 32  # [4]


class Connection:
    """Binary messages over a WebSocket (RFC 6455)."""

    def __init__(self, host, port):
        self.file = socket.create_connection((host, port), timeout=15).makefile("rwb")
        key = base64.b64encode(os.urandom(16)).decode()
        self.file.write(f"GET /v1 HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                        f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
                        "Sec-WebSocket-Protocol: strandcast.v1\r\n\r\n".encode())
        self.file.flush()
        lines = list(iter(lambda: self.file.readline(4096).strip(), b""))
        if not lines or b" 101 " not in lines[0]:
            raise ConnectionError(f"no WebSocket here: {lines[0].decode() if lines else 'the connection was closed'}")

    def send(self, payload, kind=2):
        size = struct.pack(">B", 128 | len(payload)) if len(payload) < 126 else struct.pack(">BH", 254, len(payload))
        mask = os.urandom(4)
        self.file.write(bytes([128 | kind]) + size + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload)))
        self.file.flush()

    def read(self, count):
        data = self.file.read(count)
        if len(data) < count:
            raise ConnectionError("the server closed the connection")
        return data

    def receive(self):
        """The next message, whole."""
        message = b""
        while True:
            first, size = self.read(2)
            if size >= 126:
                size, = struct.unpack(">H" if size == 126 else ">Q", self.read(2 if size == 126 else 8))
            if len(message) + size > MAX_MESSAGE_BYTES:
                raise ConnectionError(f"a message of more than {MAX_MESSAGE_BYTES} bytes")
            data = self.read(size)
            kind = first & 15
            if kind == 9:  # ping
                self.send(data, kind=10)
            elif kind == 8:
                raise ConnectionError(f"the server closed the connection: {data[2:].decode(errors='replace')}")
            elif kind in (0, 2):
                message += data
                if first & 128:
                    return message


def varint(value):
    return bytes([value]) if value < 128 else bytes([value & 127 | 128]) + varint(value >> 7)


def field(number, data):
    """A text or a message, as protobuf writes it."""
    return varint(number << 3 | 2) + varint(len(data)) + data


def fields(data):
    """What a protobuf message holds, by number: whole numbers, or bytes of anything else."""
    found, at = {}, 0

    def read_varint():
        nonlocal at
        value = shift = 0
        while True:
            byte = data[at]
            at, value, shift = at + 1, value | (byte & 127) << shift, shift + 7
            if byte < 128:
                return value

    while at < len(data):
        key = read_varint()
        if key & 7 == 0:
            found[key >> 3] = read_varint()
            continue
        size = {1: 8, 5: 4}.get(key & 7) or read_varint()
        found[key >> 3] = data[at:at + size]
        at += size
    return found


def state_hash(parts):
    """[6] FNV-1a over words of 64 bits."""
    value, prime = 0xCBF29CE484222325, 0x100000001B3
    for part in parts:
        whole = len(part) // 8
        for word in struct.unpack_from(f"<{whole}Q", part):
            value = (value ^ word) * prime & 0xFFFFFFFFFFFFFFFF
            value ^= value >> 32
        for byte in part[whole * 8:]:
            value = (value ^ byte) * prime & 0xFFFFFFFFFFFFFFFF
    return value


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def turned(w, axis, point):
    """A point turned by a unit quaternion."""
    t = [2 * c for c in cross(axis, point)]
    return [p + w * a + b for p, a, b in zip(point, t, cross(axis, t))]


def tip_of(message, strand):
    """[4, 6] Tick, hash and place of the tip of a strand in the world, of a whole state by the codec "raw"."""
    sim_time = message[16:24]
    fixed, lattice = message[32:128], message[128:]
    codec, quantum_m, strands, vertices, tick = struct.unpack_from("<B3xfIIQ", fixed)
    told, = struct.unpack_from("<Q", fixed, 88)
    if codec != 0 or not 1 <= strands <= 200_000 or len(lattice) != 12 * strands * vertices:
        raise ValueError("a frame that is none of the codec raw")
    # The parts: tick, time, pose, strand_count, vertex_count, quantum_m, lattice.
    computed = state_hash([fixed[16:24], sim_time, fixed[32:88], fixed[8:12], fixed[12:16], fixed[4:8], lattice])
    if computed != told:
        raise ValueError(f"tick {tick}: state {computed:016x} instead of {told:016x}")
    index = (vertices - 1) * strands + strand
    in_head = [quantum_m * struct.unpack_from("<i", lattice, 4 * (axis * strands * vertices + index))[0]
               for axis in range(3)]
    *head, w, x, y, z = struct.unpack_from("<7d", fixed, 32)
    return tick, told, [h + p for h, p in zip(head, turned(w, [x, y, z], in_head))]


def main(host="127.0.0.1", port="7878", states="10"):
    server = Connection(host, int(port))
    # [3] Hello: a viewer (role 0) of strands (mode 0), its name, its token, the codec that it insists on.
    hello = field(3, b"join.py") + field(4, os.environ.get("STRANDCAST_TOKEN", "").encode()) + field(11, b"raw")
    server.send(bytes([CONTROL]) + field(1, hello))
    left = int(states)
    while left > 0:
        message = server.receive()
        if message[0] == CONTROL:
            told = fields(message[1:])
            if 1 in told and fields(told[1]).get(6) != b"raw":  # Welcome
                raise ValueError("this server streams by another codec than raw: start it with --set stream.codec=raw")
            if 4 in told:  # Goodbye
                raise ConnectionError(fields(told[4]).get(1, b"").decode(errors="replace"))
        elif message[0] in (KEYFRAME, DELTA):
            tick, state, tip = tip_of(message, strand=0)
            line = "tick {}: tip of strand 0 at {:.4f} {:.4f} {:.4f} m, state {:016x}"
            try:
                print(line.format(tick, *tip, state), flush=True)
            except BrokenPipeError:  # who reads this has had enough
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
                return
            left -= 1


if __name__ == "__main__":
    try:
        main(*sys.argv[1:4])
    except (OSError, ValueError, IndexError, struct.error) as error:
        sys.exit(f"join.py: {error}")
