"""Runs an example client against kept streams, hash for hash, and against a real server.
usage: check.py python|javascript|cpp SOURCE_FOLDER SERVER_PROGRAM [JOIN_PROGRAM]"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

from play_stream import Player, Stream

LINE = re.compile(r"tick (\d+): tip of strand 0 at (-?\d+\.\d{4} ){3}m, state ([0-9a-f]{16})")


def fail(sentence):
    sys.exit(f"FAILED: {sentence}")


class Client:
    def __init__(self, language, source, join):
        node = shutil.which("node") or shutil.which("nodejs")
        if language == "javascript" and node is None:
            print("skipped: needs nodejs")
            sys.exit(77)
        self.language = language
        self.command = {"python": [sys.executable, source / "examples/python/join.py"],
                        "javascript": [node, source / "examples/javascript/join.mjs"],
                        "cpp": [join]}[language]

    def run(self, port, states):
        words = [*map(str, self.command), "127.0.0.1", str(port), str(states)]
        return subprocess.run(words, capture_output=True, text=True, timeout=60)

    def trouble_without_reader(self, port):
        """What it says when nobody reads its lines any more."""
        words = [*map(str, self.command), "127.0.0.1", str(port), "200"]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        process.stdout.readline()
        process.stdout.close()
        trouble = process.stderr.read()
        process.wait(60)
        return trouble

    def states(self, port, count):
        """(tick, hash) of so many states."""
        ended = self.run(port, count)
        found = [match for match in map(LINE.fullmatch, ended.stdout.splitlines()) if match]
        if ended.returncode != 0 or len(found) != count:
            fail(f"{len(found)} of {count} states, exit code {ended.returncode}: {ended.stdout[-300:]}{ended.stderr}")
        return [(int(match[1]), match[3]) for match in found]

    def decodes(self, stream):
        return stream.codec == "raw" or self.language == "cpp" and stream.has_whole_rest()


class Server:
    """A small real one, ended with the block."""

    def __init__(self, program, *options):
        self.folder = tempfile.TemporaryDirectory()
        self.port_path = pathlib.Path(self.folder.name) / "port"
        self.log = open(pathlib.Path(self.folder.name) / "log", "w+")
        self.process = subprocess.Popen(
            [program, "--port", "0", "--port-file", self.port_path, "--sim-device", "lanes", "--renderer", "tiles",
             "--set", "groom.procedural.strand_count=50", *options], stdout=self.log, stderr=self.log)

    def __enter__(self):
        for _ in range(600):
            if self.port_path.exists() and self.port_path.read_text().endswith("\n"):
                return int(self.port_path.read_text())
            if self.process.poll() is not None:
                break
            time.sleep(0.1)
        self.log.seek(0)
        fail(f"the server did not start: {self.log.read()}")

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(20)
        self.folder.cleanup()


def check_kept_streams(client, source):
    streams = 0
    kept = {path: Stream(path) for path in sorted((source / "tests/conformance/vectors").glob("strands_*.txt"))}
    newest = {}  # numbers of codecs; older ones are no longer spoken
    for stream in kept.values():
        newest[stream.codec] = max(stream.number, newest.get(stream.codec, 0))
    for path, stream in kept.items():
        if stream.number != newest[stream.codec] or not client.decodes(stream):
            continue
        joins = [i for i, (_, _, keyframe) in enumerate(stream.steps) if keyframe and i > 0]
        for first in [0, *joins[:1]]:
            told = [state for state, _, _ in stream.steps[first:]]
            found = [state for _, state in client.states(Player(stream, first).port, len(told))]
            if found != told:
                fail(f"{path.name} from step {first}: {found} instead of {told}")
            streams += 1
    if streams < (2 if client.language != "cpp" else 10):
        fail(f"only {streams} kept streams were played")
    print(f"{streams} kept streams, every state with its hash")


def check_a_spoilt_frame(client, source):
    stream = Stream(source / "tests/conformance/vectors/strands_raw_0_whole.txt")
    ended = client.run(Player(stream, spoil=1).port, len(stream.steps))
    if ended.returncode == 0 or not ended.stderr or stream.steps[1][0] in ended.stdout:
        fail(f"a frame with one wrong bit was taken: exit code {ended.returncode}, {ended.stdout}{ended.stderr}")
    print("a frame with one wrong bit is refused:", ended.stderr.strip())


def check_a_real_server(client, program):
    with Server(program, "--set", "stream.codec=raw") as port:
        states = client.states(port, 5)
        if any(a >= b for (a, _), (b, _) in zip(states, states[1:])):
            fail(f"ticks do not rise: {states}")
        if trouble := client.trouble_without_reader(port):
            fail(f"nobody reads what it prints: {trouble}")
    print("5 states of a real server, and a quiet end with who reads them")
    with Server(program, "--set", "stream.codec=tangent") as port:
        if client.language == "cpp":
            client.states(port, 5)
            return
        ended = client.run(port, 1)
        if ended.returncode == 0 or "--set stream.codec=raw" not in ended.stderr:
            fail(f"a codec that it has not: exit code {ended.returncode}, {ended.stderr}")
    print("a server of another codec:", ended.stderr.strip())


def main(language, source, program, join=None):
    client = Client(language, pathlib.Path(source), join)
    check_kept_streams(client, pathlib.Path(source))
    check_a_spoilt_frame(client, pathlib.Path(source))
    check_a_real_server(client, program)


main(*sys.argv[1:])
