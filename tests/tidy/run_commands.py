"""Runs the commands of docs/use, page by page, on loopback: all of our own programs, beside those of ELSEWHERE.

usage: run_commands.py SOURCE_FOLDER PROGRAM_FOLDER
A command has to end with 0, and has to leave the files that it names for its output. A server that a section starts serves
the commands below it; otherwise there is one for all pages. What takes long, or opens a window, is made short here.
"""
import contextlib
import io
import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

source, programs = os.path.realpath(sys.argv[1]), os.path.realpath(sys.argv[2])
COMMAND_S = 60  # a command that takes longer is broken
OUTPUTS = {"--screenshot", "--report", "--junit", "--export", "--trace", ">"}
# Commands for another machine, or for a server of their own, with the test that runs them.
ELSEWHERE = [(r"ctl fleet (tend|start|list|drain|stop)\b", "tests/fleet/check.py"), (r"wss://HOST(/s/)", "tests/fleet/check.py"),
             (r"ctl (grid)\b", "tests/tools/check_scripts.py"), (r"ctl (bundle)\b", "tests/web/page_bundle.mjs"),
             (r"ctl .* (sessions|kick|shutdown)\b", "tests/integration/secrets_test.cpp"),
             (r"ctl (camera) ", "tests/unit/ctl_options_test.cpp"),
             (r"ctl (mocap) ", "tests/integration/server_mocap_test.cpp"),
             (r"report (recommend) ", "tests/gl/recommend_test.cpp")]
# Of servers: they end by themselves.
ONCE = {"--check", "--explain", "--print-scene", "--list-solvers", "--replay", "--version"}
SHORTER = {"--size": "160x90", "--fps": "15", "--from": "0.1", "--to": "0.4", "--at": "0.3", "--viewers": "4", "--seconds": "1"}
FAST = ["--set", "quality=fast"]
SMALL = [*FAST, "--set", "groom.procedural.strand_count=200"]
RECORD_S = 2  # a server that records runs for so long

def write_inputs():
    """The walk that comes with the source, tufts of hair and a head made here: tests bring no data of others."""
    shutil.copy(os.path.join(source, "examples/files/walk.bvh"), "walk.bvh")
    roots = [(0.06 * (i % 5 - 2) / 2, 0.11, 0.06 * (i // 5 - 2) / 2) for i in range(25)]
    points = [f"({x * (1 + 0.3 * k)}, {y + 0.02 - 0.004 * k * k}, {z * (1 + 0.3 * k)})" for x, y, z in roots for k in range(6)]
    with open("hair.usda", "w", encoding="utf-8") as file:
        file.write('#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Y"\n)\n\ndef BasisCurves "hair"\n{\n'
                   '    uniform token type = "linear"\n'
                   f"    int[] curveVertexCounts = [{', '.join(['6'] * len(roots))}]\n"
                   f"    point3f[] points = [{', '.join(points)}]\n}}\n")
    with open("hair.ply", "w", encoding="utf-8") as file:
        file.write(f"ply\nformat ascii 1.0\nelement vertex {100 * len(roots)}\n" + "".join(f"property float {a}\n" for a in "xyz") +
                   "end_header\n" + "".join(f"{x * (1 + 0.01 * k)} {y + 0.02 - 1e-5 * k * k} {z * (1 + 0.01 * k)}\n"
                                            for x, y, z in roots for k in range(100)))
    for name, size in (("bust.obj", 0.09), ("eyes.obj", 0.01)):
        with open(name, "w", encoding="utf-8") as file:
            file.write("".join(f"v {a} {b} {c}\n" for a, b, c in ((size, 0, 0), (-size, 0, 0), (0, 0, size), (0, size, 0))) +
                       "f 1 3 4\nf 3 2 4\nf 2 1 4\nf 1 2 3\n")


def pages():
    """(page, commands of our programs) of each section with some, of each page of the index."""
    index = open(os.path.join(source, "docs/use/README.md"), encoding="utf-8").read()
    for page in re.findall(r"^\d+\. \[.*?\]\((\S+\.md)\)", index, re.M):
        text = re.sub(r"^```.*?^```", "", open(os.path.join(source, "docs/use", page), encoding="utf-8").read(), flags=re.M | re.S)
        for section in text.split("\n## "):
            yield page, [re.sub(r"\s+# .*$", "", line.strip()) for line in re.findall(r"^    strandcast-.*$", section, re.M)]


class Server:
    """A server of a page, or the one of all pages: its first port, and whether it ended well."""
    count = 0

    def __init__(self, words):
        Server.count += 1
        self.files = [words[i + 1] for i, w in enumerate(words[:-1]) if w in ("--record", "--trace")]
        port_file, self.log = f"port{Server.count}", f"server{Server.count}.log"
        self.begin, self.records = time.monotonic(), "--record" in words
        with open(self.log, "w", encoding="utf-8") as log:
            self.process = subprocess.Popen([os.path.join(programs, words[0]), *words[1:], "--port", "0", "--port-file", port_file,
                                             "--seconds", "600"], stdout=log, stderr=log)
        while not (os.path.exists(port_file) and os.path.getsize(port_file) > 0):
            if self.process.poll() is not None or time.monotonic() > self.begin + COMMAND_S:
                break
            time.sleep(0.05)
        self.port = open(port_file, encoding="utf-8").read().strip() if os.path.exists(port_file) else "0"

    def end(self):
        """Stops it: the number of faults."""
        if self.process.poll() is None:
            time.sleep(RECORD_S if self.records else 0)
            self.process.send_signal(signal.SIGTERM)
        code = self.process.wait()
        missing = [f for f in self.files if not os.path.exists(f)]
        if code == 0 and not missing:
            return 0
        print(f"FAILED: a server ended with {code}, leaves no {missing}:\n" + open(self.log, encoding="utf-8").read()[-2000:])
        return 1


def shortened(words):
    """The words of a command with small numbers, without a window, and ending soon."""
    words = [SHORTER.get(words[i - 1], w) if i > 0 and words[i - 1] in SHORTER else w for i, w in enumerate(words)]
    if words[0] == "strandcast-view" and not {"--headless", "--diagnose", "--export"} & set(words):
        is_played = any(w.endswith(".mcap") for w in words)
        words += ["--export", "played.webm", "--to", "0.1", "--size", "160x90"] if is_played else ["--headless", "--after-frames", "3"]
    if words[0] == "strandcast-ctl" and {"feed", "monitor"} & set(words) and "--seconds" not in words:
        words += ["--seconds", "1"]
    if words[0] == "strandcast-server" and "--explain" in words and "--groom" not in words:
        words += SMALL
    if words[:2] == ["strandcast-ctl", "bake"]:
        words += [*FAST, "--to", "0.2"]
    return words


def prepared(words, port, datagram_port):
    """The words of a command with this server's port and these programs."""
    address = f"127.0.0.1:{port}"
    words = [w.replace("127.0.0.1:PORT", address) for w in shortened(words)]
    if "--connect" in words:
        words[words.index("--connect") + 1] = address
    elif words[0] in ("strandcast-ctl", "strandcast-view") and words[1:2] not in (["test"], ["fleet"], ["--diagnose"]):
        words[1:1] = ["--connect", address] if not any(w.endswith(".mcap") for w in words) else []
    if "--as" in words and "--to" not in words:
        words += ["--to", f"127.0.0.1:{datagram_port}"]
    return [os.path.join(programs, words[0]), *words[1:]]


def run(page, line, port, datagram_port):
    words = shlex.split(line)
    for name in (w for w in words if re.fullmatch(r"[a-z]\.mcap", w)):
        shutil.copy("run.mcap", name)
    out = words.index(">") if ">" in words else None
    outputs = [words[i + 1] for i, w in enumerate(words[:-1]) if w in OUTPUTS or w == "save"]
    call = prepared(words[:out], port, datagram_port)
    begin = time.monotonic()
    done = subprocess.run(call, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=COMMAND_S)
    if out is not None:
        with open(words[out + 1], "w", encoding="utf-8") as file:
            file.write(done.stdout)
    print(f"{time.monotonic() - begin:5.1f} s  {page}: {line}", flush=True)
    missing = [o for o in outputs if not os.path.exists(o) or os.path.getsize(o) == 0]
    if done.returncode != 0 or missing:
        print(f"FAILED with {done.returncode}{', leaves no ' + ' '.join(missing) if missing else ''}:\n{done.stdout[-2000:]}")
        return 1
    return 0


def begin_server(page, line, main):
    """A server that a page starts, on a port of its own."""
    words = shlex.split(line.replace("quality=full", "quality=fast").replace("HOST:7878", f"127.0.0.1:{main.port}"))
    if "--port" in words:
        del words[words.index("--port"):words.index("--port") + 2]
    words[1:1] = FAST if "--groom" in words else SMALL if "--upstream" not in words else []
    words += [] if {"--record", "--record-dir", "--upstream"} & set(words) else ["--record-dir", "takes"]
    server = Server(words)
    print(f"{time.monotonic() - server.begin:5.1f} s  {page}: {line}", flush=True)
    return server


def run_through_chaos(words, port):
    """A program that passes connections on: started, and stopped."""
    words[words.index("--to") + 1] = f"127.0.0.1:{port}"
    process = subprocess.Popen([os.path.join(programs, words[0]), *words[1:]], stdout=subprocess.DEVNULL)
    time.sleep(0.5)
    failed = process.poll() is not None
    process.terminate()
    process.wait()
    return failed


def run_section(page, lines, main, datagram_port):
    """Commands that failed."""
    failed, server = 0, None
    for line in lines:
        known = next(((re.search(p, line), test) for p, test in ELSEWHERE if re.search(p, line)), None)
        words = shlex.split(line)
        if known:
            text = open(os.path.join(source, known[1]), encoding="utf-8").read()
            if known[0][1] not in text:
                print(f"FAILED: {known[1]} has no {known[0][1]} any more ({page}: {line})")
                failed += 1
        elif words[0] == "strandcast-server" and not ONCE & set(words):
            failed += server.end() if server else 0
            server = begin_server(page, line, main)
        elif words[0] == "strandcast-chaos":
            failed += run_through_chaos(words, (server or main).port)
        else:
            failed += run(page, line, (server or main).port, datagram_port)
    return failed + (server.end() if server else 0)


def main():
    count = failed = 0
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        for folder in ("deploy", "proto", "docs"):
            os.symlink(os.path.join(source, folder), folder)
        os.mkdir("takes")
        os.environ["STRANDCAST_FLEET"] = os.path.join(work, "fleet")
        write_inputs()
        listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)  # takes what feed --as sends
        listener.bind(("127.0.0.1", 0))
        server = Server(["strandcast-server", *SMALL, "--record-dir", "takes"])
        try:
            for page, lines in pages():
                count += len(lines)
                failed += run_section(page, lines, server, listener.getsockname()[1])
            with contextlib.redirect_stdout(io.StringIO()):
                wrong = [run("none", line, server.port, 0) for line in ("strandcast-ctl set look.hare_color=red", "strandcast-server --version --trace absent.csv")]
            failed += wrong != [1, 1]
        finally:
            failed += server.end()
        os.chdir(source)
    print(f"{count} commands, {failed} failed; {sum(wrong)} of 2 wrong ones found")
    sys.exit(1 if failed or not count else 0)


if __name__ == "__main__":
    main()
