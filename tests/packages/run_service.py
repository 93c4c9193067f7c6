"""Runs the packaged server in a root folder as its units would have systemd run it, and looks at what it tells.
usage: run_service.py ROOT service|socket PICTURE       as root; leaves a picture that the packaged viewer made"""
import os
import pathlib
import re
import shlex
import signal
import socket
import subprocess
import sys
import time
import urllib.request

NOBODY = 65534
STATE = "/var/lib/strandcast"
WATCHDOG_S = 2.0


def fail(sentence):
    sys.exit(f"FAILED: {sentence}")


def setting(root, unit, key):
    for line in (root / "usr/lib/systemd/system" / unit).read_text().splitlines():
        if line.startswith(key + "="):
            return line[len(key) + 1:]
    fail(f"{unit} has no {key}")


class Manager:
    """Hears what a service tells its manager."""

    def __init__(self, root):
        path = root / "run/manager"
        path.unlink(missing_ok=True)
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(path))
        path.chmod(0o777)
        self.told = []
        self.log = root / "tmp/server.log"

    def wait_for(self, word, seconds, process=None):
        end = time.monotonic() + seconds
        while not any(word in lines for _, lines in self.told):
            self.socket.settimeout(0.5)
            try:
                self.told.append((time.monotonic(), self.socket.recv(4096).decode().splitlines()))
            except TimeoutError:
                pass  # whether it is over is asked below, however often the server speaks
            if process is not None and process.poll() is not None:
                fail(f"the server has ended with {process.returncode}: {self.log.read_text()}")
            if time.monotonic() > end:
                fail(f"no {word} within {seconds} s, but {[lines for _, lines in self.told]}: {self.log.read_text()}")

    def beats(self):
        return [when for when, lines in self.told if "WATCHDOG=1" in lines]


def start(root, words, listener):
    """As nobody, in the root, with a state folder; file descriptor 3 is the listener where there is one."""
    state = root / STATE[1:]
    state.mkdir(parents=True, exist_ok=True)
    os.chown(state, NOBODY, NOBODY)
    state.chmod(0o700)
    script = 'export NOTIFY_SOCKET=/run/manager WATCHDOG_PID=$$ WATCHDOG_USEC=$1; shift; '
    if listener is not None:
        script += 'export LISTEN_PID=$$ LISTEN_FDS=1 LISTEN_FDNAMES=strandcast; exec 3<&"$1"; shift; '
    number = [str(listener.fileno())] if listener is not None else []
    command = ["chroot", f"--userspec={NOBODY}:{NOBODY}", str(root), "sh", "-c", script + 'exec "$@"', "-",
               str(int(1e6 * WATCHDOG_S)), *number, *words]
    return subprocess.Popen(command, pass_fds=[listener.fileno()] if listener is not None else [],
                            stdout=subprocess.DEVNULL, stderr=open(root / "tmp/server.log", "w"),
                            env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin"}, umask=0o077)


def in_root(root, *words):
    return subprocess.run(["chroot", str(root), *words], capture_output=True, text=True, timeout=300,
                          env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL": "C.UTF-8"})


def main(root, kind, picture):
    root = pathlib.Path(root)
    if setting(root, "strandcast-server.service", "Type") != "notify":
        fail("the unit does not wait for the server")
    # %S is where states are; the port is one of this machine that is free.
    words = shlex.split(setting(root, "strandcast-server.service", "ExecStart").replace("%S", "/var/lib"))
    listener = None
    if kind == "socket":
        if setting(root, "strandcast-server.socket", "FileDescriptorName") != "strandcast":
            fail("the socket has another name")
        listener = socket.create_server(("127.0.0.1", 0))
    words[words.index("--port") + 1] = "0"  # with a socket it must not matter
    words += ["--port-file", STATE + "/port"]
    manager = Manager(root)
    process = start(root, words, listener)
    try:
        manager.wait_for("READY=1", 120, process)
        port = int((root / STATE[1:] / "port").read_text())
        if listener is not None and port != listener.getsockname()[1]:
            fail(f"the server listens on port {port}, not on the socket that it was given")
        token_mode = (root / STATE[1:] / "tokens").stat().st_mode & 0o777
        if token_mode & 0o077:
            fail(f"others may read the tokens: {token_mode:o}")
        address, tokens = f"127.0.0.1:{port}", ["--token-file", STATE + "/tokens"]
        health = in_root(root, "strandcast-ctl", "health", "--connect", address)
        if health.returncode != 0:
            fail(f"health: {health.stdout}{health.stderr}")
        view = in_root(root, "strandcast-view", "--headless", "--connect", address, *tokens, "--size", "320x240",
                       "--after-frames", "5", "--seconds", "60", "--screenshot", "/tmp/picture.png")
        if view.returncode != 0:
            fail(f"the viewer: {view.stdout}{view.stderr}")
        data = (root / "tmp/picture.png").read_bytes()
        if data[:8] != b"\x89PNG\r\n\x1a\n" or len(data) < 10_000:
            fail(f"the viewer's picture has {len(data)} bytes, too few for hair")
        pathlib.Path(picture).write_bytes(data)
        page = urllib.request.urlopen(f"http://{address}/", timeout=10).read().decode()
        files = re.findall(r'(?:src|href)="([^":#]+\.(?:js|css|wasm))"', page)
        if not files:
            fail(f"the server has no page for browsers: {page[:200]}")
        for name in files:
            if len(urllib.request.urlopen(f"http://{address}/{name.lstrip('./')}", timeout=10).read()) < 1000:
                fail(f"{name} of the page is not whole")
        manager.wait_for("WATCHDOG=1", 3 * WATCHDOG_S, process)
        process.send_signal(signal.SIGTERM)
        manager.wait_for("STOPPING=1", 20)
        if process.wait(30) != 0:
            fail(f"stopped, the server leaves with {process.returncode}")
        status = [line for _, lines in manager.told for line in lines if line.startswith("STATUS=Serving")]
        print(f"{kind}: ready, {len(manager.beats())} heartbeats, stopped; {status[-1][7:]}; a picture of {len(data)} bytes")
    finally:
        process.kill()
        process.wait()


main(*sys.argv[1:])
