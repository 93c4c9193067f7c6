"""A server that plays one kept stream of tests/conformance/vectors to whoever connects: what a client decodes can be
compared with the hashes in the file. It shares no code with the examples or the product."""
import base64
import hashlib
import socket
import struct
import threading

CONTROL, ASSET = 0x01, 0x10


class Stream:
    """A file of tests/conformance/vectors; its form stands in tests/conformance/stored_stream.h."""

    def __init__(self, path):
        self.steps = []  # (hash of the state, frame, keyframe or nothing)
        for line in path.read_text().splitlines():
            word, *rest = line.split()
            if word == "codec":
                self.codec, self.number = rest[0], int(rest[1])
            elif word == "size":
                self.strands, self.vertices = int(rest[0]), int(rest[1])
            elif word == "rest":
                self.rest = rest
            elif word == "step":
                frames = [bytes.fromhex(digits) for digits in rest[2:]]
                self.steps.append((rest[1], frames[0], frames[1] if len(frames) > 1 else b""))

    def has_whole_rest(self):
        """Large shapes are not written out."""
        return self.rest[0] != "made"

    def messages(self, first):
        """Of who joins at a step: its keyframe where one is kept, and all frames from there on."""
        _, frame, keyframe = self.steps[first]
        return [keyframe if first > 0 else frame] + [frame for _, frame, _ in self.steps[first + 1:]]


def varint(value):
    return bytes([value]) if value < 128 else bytes([value & 127 | 128]) + varint(value >> 7)


def welcome(stream):
    text = stream.codec.encode()
    body = (b"\x32" + varint(len(text)) + text + b"\x38" + varint(stream.strands) + b"\x40" + varint(stream.vertices) +
            b"\x4d" + struct.pack("<f", 1e-4))
    return bytes([CONTROL]) + b"\x0a" + varint(len(body)) + body


def asset(stream):
    """The rest shape, in a zstd frame whose one block is stored as it is."""
    rest = bytes.fromhex(stream.rest[0])
    assert len(rest) == 12 * stream.strands * stream.vertices < 1 << 17
    # In the file vertex by vertex as points; so it is in the asset.
    packed = b"\x28\xb5\x2f\xfd\xa0" + struct.pack("<I", len(rest)) + struct.pack("<I", len(rest) << 3 | 1)[:3] + rest
    payload = struct.pack("<6I", 1, stream.strands, stream.vertices, 0, 0, 0) + packed
    return struct.pack("<BBHIIIqq", ASSET, 0, 0, 1, 0, len(payload), 0, 0) + payload


def framed(message):
    """As one WebSocket message in two fragments with a ping between them: what a client has to put together."""
    def piece(first, data):
        if len(data) < 126:
            size = bytes([len(data)])
        else:
            size = struct.pack(">BH", 126, len(data)) if len(data) < 1 << 16 else struct.pack(">BQ", 127, len(data))
        return bytes([first]) + size + data
    half = len(message) // 2
    return piece(0x02, message[:half]) + piece(0x89, b"are you there?") + piece(0x80, message[half:])


def play(connection, messages):
    with connection, connection.makefile("rwb") as file:
        lines = [line.decode() for line in iter(lambda: file.readline(4096).strip(), b"")]
        key = next(line.split(": ")[1] for line in lines if line.lower().startswith("sec-websocket-key"))
        accept = base64.b64encode(hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest())
        file.write(b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                   b"Sec-WebSocket-Protocol: strandcast.v1\r\nSec-WebSocket-Accept: " + accept + b"\r\n\r\n")
        file.flush()
        hello = file.read(2)
        assert hello[0] == 0x82 and hello[1] & 128, "a client sends its Hello as one masked binary message"
        for message in messages:
            file.write(framed(message))
        file.write(b"\x88\x02\x03\xe8")  # closed: what is not here must not be waited for
        file.flush()
        connection.settimeout(10)
        while file.read(1):  # what the client says, until it leaves
            pass


class Player:
    """Plays to one client, on a thread; .port."""

    def __init__(self, stream, first=0, spoil=None):
        messages = stream.messages(first)
        if spoil is not None:
            broken = bytearray(messages[spoil])
            broken[-1] ^= 1
            messages[spoil] = bytes(broken)
        head = [welcome(stream)] + ([asset(stream)] if stream.rest[0] != "none" else [])
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.socket.settimeout(20)
        self.port = self.socket.getsockname()[1]
        self.thread = threading.Thread(target=self.run, args=(head + messages,), daemon=True)
        self.thread.start()

    def run(self, messages):
        with self.socket:
            connection, _ = self.socket.accept()
        try:
            play(connection, messages)
        except OSError:  # the client has seen enough, or left
            pass
