#!/usr/bin/env python3
"""Runs the commands of docs/use that stand below `<!-- run -->`, page by page, against one server on loopback.

usage: run_commands.py SOURCE_FOLDER PROGRAM_FOLDER
A command has to end with 0, and has to leave the files that it names for its output.
"""
import os
import re
import shlex
import socket
import subprocess
import sys
import tempfile
import time

source, programs = os.path.realpath(sys.argv[1]), os.path.realpath(sys.argv[2])
COMMAND_S = 60  # a command that takes longer is broken
OUTPUTS = {"--screenshot", "--report", "--junit", "--export", ">"}

MOTION = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Neck
  {
    OFFSET 0 60 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Head
    {
      OFFSET 0 12 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      End Site
      {
        OFFSET 0 18 0
      }
    }
  }
}
MOTION
Frames: 60
Frame Time: 0.033333
"""


def write_inputs():
    """A walk and a tuft of hair, made here: tests bring no data of others."""
    with open("walk.bvh", "w", encoding="utf-8") as file:
        file.write(MOTION)
        for i in range(60):
            file.write(f"0 {90 + 0.02 * i} {0.5 * i} 0 0 0 0 0 0 0 0 {0.1 * i}\n")
    roots = [(0.06 * (i % 5 - 2) / 2, 0.11, 0.06 * (i // 5 - 2) / 2) for i in range(25)]
    points = [f"({x * (1 + 0.3 * k)}, {y + 0.02 - 0.004 * k * k}, {z * (1 + 0.3 * k)})" for x, y, z in roots for k in range(6)]
    with open("hair.usda", "w", encoding="utf-8") as file:
        file.write('#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Y"\n)\n\ndef BasisCurves "hair"\n{\n'
                   '    uniform token type = "linear"\n'
                   f"    int[] curveVertexCounts = [{', '.join(['6'] * len(roots))}]\n"
                   f"    point3f[] points = [{', '.join(points)}]\n}}\n")


def pages():
    index = open(os.path.join(source, "docs/use/README.md"), encoding="utf-8").read()
    for page in re.findall(r"^\d+\. \[.*?\]\((\S+\.md)\)", index, re.M):
        text = open(os.path.join(source, "docs/use", page), encoding="utf-8").read()
        for block in re.findall(r"<!-- run -->\n\n((?:    .*\n?)+)", text):
            for line in block.splitlines():
                yield page, re.sub(r"\s+# .*$", "", line.strip())


def prepared(words, port, datagram_port):
    """The words of a command with this server's port and these programs."""
    address = f"127.0.0.1:{port}"
    words = [w.replace("127.0.0.1:PORT", address) for w in words]
    if words[0] in ("strandcast-ctl", "strandcast-view") and words[1] not in ("test", "fleet", "--diagnose"):
        words[1:1] = ["--connect", address] if not any(w.endswith(".mcap") for w in words) else []
    if "--as" in words and "--to" not in words:
        words += ["--to", f"127.0.0.1:{datagram_port}"]
    return [os.path.join(programs, words[0]), *words[1:]]


def run(page, line, port, datagram_port):
    words = shlex.split(line)
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


def main():
    commands = list(pages())
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        for folder in ("deploy", "proto", "docs"):
            os.symlink(os.path.join(source, folder), folder)
        os.mkdir("takes")
        os.environ["STRANDCAST_FLEET"] = os.path.join(work, "fleet")
        write_inputs()
        listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)  # takes what feed --as sends
        listener.bind(("127.0.0.1", 0))
        with open("server.log", "w", encoding="utf-8") as log:
            server = subprocess.Popen([os.path.join(programs, "strandcast-server"), "--port", "0", "--port-file", "port",
                                       "--set", "quality=fast", "--record-dir", "takes", "--seconds", "600"],
                                      stdout=log, stderr=log)
        try:
            for _ in range(600):
                if os.path.exists("port") and os.path.getsize("port") > 0:
                    break
                time.sleep(0.05)
            port = open("port", encoding="utf-8").read().strip()
            failed = sum(run(page, line, port, listener.getsockname()[1]) for page, line in commands)
            if server.poll() is not None:
                print("FAILED: the server ended\n" + open("server.log", encoding="utf-8").read()[-2000:])
                failed += 1
        finally:
            server.terminate()
            server.wait()
        os.chdir(source)
    print(f"{len(commands)} commands, {failed} failed")
    sys.exit(1 if failed or not commands else 0)


if __name__ == "__main__":
    main()
