#!/usr/bin/env python3
"""The fleet (deploy/fleet) with real servers, a real HAProxy and a Slurm that is none: check.py SOURCE BIN.
What a session goes through, and what is said where something is missing. nightly.sh fleet runs it with a real Slurm."""
import contextlib
import http.client
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path

source, programs = Path(sys.argv[1]), Path(sys.argv[2])
proxy_program = shutil.which("haproxy", path=os.environ["PATH"] + ":/usr/sbin")
if not proxy_program:
    print("skipped: needs haproxy")
    sys.exit(77)
work = Path(tempfile.mkdtemp())
environment = dict(os.environ, STRANDCAST_FLEET=str(work / "fleet"), FAKE_SLURM=str(work / "slurm"), FAKE_GPUS="2",
                   PATH=f"{source}/tests/fleet/slurm:{os.environ['PATH']}")
(work / "slurm").mkdir()
(work / "fleet").mkdir()
with contextlib.closing(socket.socket()) as probe:
    probe.bind(("127.0.0.1", 0))
    port = probe.getsockname()[1]
(work / "fleet/fleet.json").write_text(json.dumps({
    "haproxy_socket": str(work / "socket"), "haproxy_bind": f"127.0.0.1:{port}", "public": f"ws://127.0.0.1:{port}",
    "listen": "127.0.0.1", "server": str(programs / "strandcast-server"), "slots": 3, "quiet_s": 1.0}))
SMALL = ["--", "--set", "groom.procedural.strand_count=50", "--set", "groom.procedural.vertex_count=8", "--sim-device", "lanes"]
started = []


def fleet(*words, expect=0):
    done = subprocess.run([sys.executable, "-B", source / "deploy/fleet/strandcast-fleet", *words], env=environment,
                          capture_output=True, text=True, timeout=90, check=False)
    assert done.returncode == expect, f"{words}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def begin(command, log):
    with open(work / log, "w") as file:
        child = subprocess.Popen(command, env=environment, stdout=file, stderr=file)
    started.append(child)
    return child


def begin_proxy():
    child = begin([proxy_program, "-db", "-f", work / "haproxy.cfg"], "haproxy.log")
    until(lambda: (work / "socket").exists(), "HAProxy")
    return child


def until(is_so, what, seconds=90):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if is_so():
            return
        time.sleep(0.3)
    logs = "".join(f"== {one.name}\n{one.read_text(errors='replace')[-2000:]}" for one in work.glob("*.log"))
    raise AssertionError(f"it does not come to this: {what}\n{fleet('list', expect=0)}{logs}")


def get(path):
    """Status and text; status 0 where the connection ended without an answer, as when the server behind it has died."""
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{port}{path}", timeout=5) as reply:
            return reply.status, reply.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()
    except (OSError, http.client.HTTPException):
        return 0, ""


def row(name):
    return next((line for line in fleet("list").splitlines() if line.split()[0] == name), "")


def server_of(name):
    """Number of its process, below the job's own."""
    parent = (work / "slurm" / (work / f"fleet/sessions/{name}/server/job").read_text() / "pid").read_text()
    return int(Path(f"/proc/{parent}/task/{parent}/children").read_text().split()[0])


def stop(child):
    child.send_signal(signal.SIGTERM)
    child.wait(20)


def main():
    # Nothing is there yet.
    assert "HAProxy does not answer" in fleet("list", expect=2)
    (work / "slurm/down").touch()
    assert "Slurm refuses (squeue): error: Unable to contact slurm controller" in fleet("list", expect=2)
    (work / "slurm/down").unlink()
    (work / "haproxy.cfg").write_text(fleet("proxy-config"))
    proxy = begin_proxy()
    assert get("/s/early/")[0] == 503, "a proxy that knows no session yet cannot say that there is none"
    assert "run strandcast-ctl fleet tend" in fleet("start", "early", *SMALL, expect=2)
    fleet("stop", "early")
    tender = begin([sys.executable, "-B", source / "deploy/fleet/strandcast-fleet", "tend"], "tend.log")
    until(lambda: "tending" in (work / "tend.log").read_text(), "one tends")
    assert "tended already" in fleet("tend", expect=2)

    # A session comes, and is where its name leads.
    said = fleet("start", "one", *SMALL)
    assert "one is ready after" in said, said
    assert get("/s/one/readyz") == (200, "ready\n")
    tokens = (work / "fleet/sessions/one/tokens").read_text().split()[1::2]
    assert len(tokens) == 4 and not any(token in said for token in tokens), "tokens are in files alone"
    token_file = work / "fleet/sessions/one/viewer_token"
    assert f"--token-file {token_file}" in said and token_file.stat().st_mode & 0o077 == 0, said
    looked = subprocess.run([programs / "strandcast-ctl", "--connect", f"ws://127.0.0.1:{port}/s/one", "--token-file", token_file,
                             "check", "--frames", "20"], capture_output=True, text=True, timeout=60, check=False)
    assert looked.returncode == 0, looked.stdout + looked.stderr
    assert get("/s/other/")[0] == 404 and get("/")[0] == 404

    # What is refused.
    assert "there is a session called one already" in fleet("start", "one", expect=2)
    assert "is no name of a session" in fleet("start", "../one", expect=2)
    assert "there is no session called two" in fleet("stop", "two", expect=2)
    said = fleet("start", "wrong", "--", "--set", "nonsense=1", expect=2)
    assert "strandcast-fleet: strandcast-server: --set nonsense=1: a scene has no field" in said, said
    assert not row("wrong"), "nothing was queued"
    said = fleet("start", "wrong", "--unchecked", "--", "--set", "nonsense=1", expect=2)
    assert "wrong failed: strandcast-server: --set nonsense=1: a scene has no field" in said, said
    assert "failed:" in row("wrong") and "(exit code 2)" in row("wrong"), row("wrong")
    until(lambda: get("/s/wrong/")[0] == 404, "nobody waits for it")
    fleet("stop", "wrong")

    # The third waits for a GPU and gets it.
    fleet("start", "two", *SMALL)
    assert "three waits for a GPU" in fleet("start", "three", "--wait", "1", *SMALL)
    assert row("three").endswith("waits for a GPU")
    assert "all 3 places" in fleet("start", "four", *SMALL, expect=2)
    fleet("stop", "two")
    until(lambda: row("three").endswith("ready"), "the third has its GPU")
    until(lambda: get("/s/two/")[0] == 404, "the second is gone")
    until(lambda: get("/s/three/readyz")[0] == 200, "the third is found")

    # HAProxy is started again and knows nothing: it is told.
    stop(proxy)
    assert "HAProxy does not answer" in fleet("list", expect=2)
    (work / "socket").unlink(missing_ok=True)
    proxy = begin_proxy()
    until(lambda: get("/s/one/readyz")[0] == 200, "it is told again")

    # A relay comes, takes over from the server, and is replaced when it dies.
    fleet("stop", "three")
    fleet("start", "three", "--relays", "1", *SMALL)
    until(lambda: row("three").split()[2] == "1", "its relay")
    relay = next((work / "fleet/sessions/three/relays").iterdir())
    job = (work / "slurm" / (relay / "job").read_text() / "pid").read_text()
    os.killpg(int(job), signal.SIGKILL)
    until(lambda: row("three").split()[2] == "1" and not relay.exists(), "another relay")
    until(lambda: get("/s/three/readyz")[0] == 200, "it answers")

    # A server that crashes is started again where it was, and its relay finds it; a job that is lost is submitted again.
    crashed = server_of("three")
    os.kill(crashed, signal.SIGSEGV)
    until(lambda: "ready, started again 1 time: killed by SIGSEGV" in row("three"), "it is back")
    until(lambda: row("three").split()[2] == "1", "its relay too")
    assert server_of("three") != crashed
    lost = (work / "fleet/sessions/one/server/job").read_text()
    os.killpg(int((work / "slurm" / lost / "pid").read_text()), signal.SIGKILL)
    until(lambda: "ready, started again 1 time: its job was lost" in row("one"), "another job")
    assert (work / "fleet/sessions/one/server/job").read_text() != lost
    until(lambda: get("/s/one/readyz")[0] == 200, "it is led to")

    # Drained: nobody is in it, so it goes.
    fleet("drain", "three")
    until(lambda: not row("three"), "it is drained")
    fleet("stop", "one")
    until(lambda: fleet("list").count("\n") == 1, "nothing is left")
    stop(tender)
    stop(proxy)
    print("the fleet does what it says")


try:
    main()
finally:
    for child in started:
        if child.poll() is None:
            child.kill()
            child.wait()
    for pid in (work / "slurm").glob("*/pid"):
        with contextlib.suppress(OSError, ValueError):
            if int(pid.read_text()) > 1:
                os.killpg(int(pid.read_text()), signal.SIGKILL)
    shutil.rmtree(work, ignore_errors=True)
