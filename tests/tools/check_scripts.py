#!/usr/bin/env python3
"""Every option of deploy/run.sh, strandcast-fleet and strandcast-grid: what it changes of the calls to other programs,
and that it changes nothing else. Those programs only write down how they were called: check_scripts.py SOURCE."""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import SimpleNamespace

source = Path(sys.argv[1]).resolve()
work = Path(tempfile.mkdtemp()).resolve()
NOTE = '#!/bin/bash\nprintf "%s\\n" "$(basename "$0")" "$@" "" >> "$CALLS/$(basename "$0")"\n'
STUBS = {
    "cmake": "",
    "install_deps.sh": "",
    "strandcast-view": "",
    "strandcast-ctl": 'echo "feeding nobody"\nexec sleep 60\n',
    # --list-solvers of a grid, a session of a fleet that ends at once, and the server of run.sh.
    "strandcast-server": 'while [ $# -gt 0 ]; do [ "$1" != --port-file ] || file=$2; [ "$1" != --list-solvers ] || printf "pbd\\n  a line\\ndftl\\n"; '
                         'shift; done\n[ -z "$file" ] || { echo 81 > "$file"; [ -n "$FLEET_ENDS" ] || exec sleep 60; }\n',
    "sbatch": "echo 7\n",
    "squeue": 'echo "7|PENDING|(Resources)"\n',
    "scancel": "",
}
BIN = ("strandcast-view", "strandcast-ctl", "strandcast-server")


def place(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)


def calls_in(folder, here):
    """program -> the arguments of its calls; `here` is the folder that it was called in"""
    return {one.name: [call.replace(str(here), "HERE").split("\n")[1:] for call in one.read_text().split("\n\n") if call]
            for one in folder.iterdir()}


def pairs(arguments):
    """Options with their values; words that belong to none stand alone."""
    found = []
    for word in arguments:
        if found and found[-1][0].startswith("-") and len(found[-1]) == 1 and not word.startswith("--") and "=" not in found[-1][0]:
            found[-1] = (found[-1][0], word)
        else:
            found.append((word,))
    return [one if one[0] != "--port-file" else ("--port-file", "a new one") for one in found]


def difference(before, after):
    """program -> (what is no longer said, what is said instead)"""
    changed = {}
    for program in sorted({*before, *after}):
        old, new = ([pair for call in calls.get(program, []) for pair in pairs(call)] for calls in (before, after))
        gone, come = [one for one in old if one not in new], [one for one in new if one not in old]
        if gone or come:
            changed[program] = (gone, come)
    return changed


def must(is_so, what):
    if not is_so:
        raise AssertionError(what)


def check_rows(run, rows, known, what):
    """rows: option -> its words, and what changes. `run` gives the calls of a command line."""
    must(set(rows) == known, f"{what}: options without a row, or rows without an option: {set(rows) ^ known}")
    with ThreadPoolExecutor(max_workers=6) as pool:
        usual = pool.submit(run, [])
        runs = {option: pool.submit(run, words) for option, (words, _) in rows.items()}
        for option, (_, changed) in rows.items():
            seen = difference(usual.result(), runs[option].result())
            must(seen == changed, f"{what} {option} changes\n{seen}\ninstead of\n{changed}")


# ---- deploy/run.sh ----

root = work / "clone"
for name, text in STUBS.items():
    place(work / "path" / name, NOTE + text)
    if name in BIN:
        place(root / "build/release/bin" / name, NOTE + text)
place(root / "deploy/install_deps.sh", NOTE)
shutil.copy(source / "deploy/run.sh", root / "deploy/run.sh")
FILES = ("a.tfx", "b.tfx", "a.bvh", "a.csv", "a.textproto")


def call(command, number=[0], **variables):
    number[0] += 1
    folder, here = work / f"calls{number[0]}", work / f"here{number[0]}"
    folder.mkdir()
    for name in FILES:
        place(here / name, "")
    environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment.update(variables, CALLS=str(folder), PATH=f"{work / 'path'}:{os.environ['PATH']}")
    done = subprocess.run(command, env=environment, cwd=here, capture_output=True, text=True, timeout=60, check=False)
    return done, calls_in(folder, here)


def run_script(words):
    done, calls = call(["bash", root / "deploy/run.sh", *words])
    must(done.returncode == 0, f"run.sh {words}: {done.returncode}\n{done.stdout}{done.stderr}")
    return calls


def server(*added):
    return {"strandcast-server": ([], list(added))}


def feed(*added, gone=()):
    return {"strandcast-ctl": (list(gone), list(added))}


def of_view(folder):
    return [(f"--{option}", f"HERE/{folder}/{name}") for option, name in (("screenshot", "hair.png"), ("clip", "hair.webp"), ("report", "report.txt"))]


def check_run():
    usage, _ = call(["bash", root / "deploy/run.sh", "--help"])
    known = set(re.findall(r"^  (--[a-z-]+)", usage.stdout, re.M)) - {"--help", "--headless", "--web"}
    builtin, gusts = ("--motion", "builtin"), ("--wind", "gusts")
    check_rows(run_script, {
        "--groom": (["--groom", "a.tfx,b.tfx"], server(("--groom", "HERE/a.tfx"), ("--groom", "HERE/b.tfx"))),
        "--scene": (["--scene", "a.textproto"], server(("--scene", "HERE/a.textproto"))),
        "--set": (["--set", "a=1", "--set", "b=2"], server(("--set", "a=1"), ("--set", "b=2"))),
        "--quality": (["--quality", "full"], server(("--set", "quality=full"))),
        "--record": (["--record", "a.mcap"], server(("--record", "HERE/a.mcap"))),
        "--mocap": (["--mocap", "vmc"], {**server(("--mocap", "vmc")), **feed(("--motion", "none"), gone=[builtin])}),
        "--motion": (["--motion", "a.bvh"], feed(("--motion", "HERE/a.bvh"), gone=[builtin])),
        "--motion-unit": (["--motion-unit", "0.5"], feed(("--unit", "0.5"))),
        "--motion-up": (["--motion-up", "z"], feed(("--up", "z"))),
        "--motion-fps": (["--motion-fps", "25"], feed(("--fps", "25"))),
        "--joint": (["--joint", "Skull"], feed(("--joint", "Skull"))),
        "--filter-glitches": (["--filter-glitches"], feed(("--filter-glitches",))),
        "--wind": (["--wind", "a.csv"], feed(("--wind", "HERE/a.csv"), gone=[gusts])),
        "--seconds": (["--seconds", "2.5"], {"strandcast-view": ([("--seconds", "6")], [("--seconds", "2.5")])}),
        "--out": (["--out", "other"], {"strandcast-view": (of_view("out"), of_view("other"))}),
    }, known, "run.sh")
    # Where there is a display, and where there is a browser.
    done, window = call(["bash", root / "deploy/run.sh", "--seconds", "2"], DISPLAY=":9")
    must(done.returncode == 0 and pairs(window["strandcast-view"][0]) == [("--connect", "127.0.0.1:81"), ("--seconds", "2")], window)
    _, headless = call(["bash", root / "deploy/run.sh", "--seconds", "2", "--headless"], DISPLAY=":9")
    must(("--headless",) in pairs(headless["strandcast-view"][0]), headless)
    web = run_script(["--web", "--seconds", "0.1"])
    must("strandcast-view" not in web and "emscripten" in web["install_deps.sh"][0] and "-DSTRANDCAST_WEB=ON" in web["cmake"][0], web)
    must("-DSTRANDCAST_WEB=ON" not in headless["cmake"][0] and headless["install_deps.sh"] == [[]], headless)
    must("--loop" in headless["strandcast-ctl"][0], "motion and wind go on")
    for words, said in ((["--nonsense"], "unknown option: --nonsense"), (["--set"], "--set needs a value"),
                        (["--seconds", "soon"], "not a number: soon"), (["--motion", "no.bvh"], "no such file: no.bvh")):
        done, calls = call(["bash", root / "deploy/run.sh", *words])
        must(done.returncode == 2 and said in done.stderr and not calls, f"{words}: {done.stderr}")


# ---- strandcast-fleet and strandcast-grid ----

def options_of(script, command):
    done, _ = call([sys.executable, "-B", source / "deploy/fleet" / script, command, "--help"])
    return set(re.findall(r"^  (--[a-z-]+)", done.stdout, re.M))


def fleet(words, config=None, number=[0]):
    """Its calls, and what it leaves of a session, in a folder of its own."""
    number[0] += 1
    folder = work / f"fleet{number[0]}"
    session = folder / "sessions/one"
    (session / "server").mkdir(parents=True) if words[0].startswith("run-") else folder.mkdir()
    (folder / "fleet.json").write_text(json.dumps({"listen": "127.0.0.1", **(config or {})}))
    done, calls = call([sys.executable, "-B", source / "deploy/fleet/strandcast-fleet", *[word.replace("FOLDER", str(session)) for word in words]],
                       STRANDCAST_FLEET=str(folder), FLEET_ENDS="1")
    must(done.returncode == 0, f"fleet {words}: {done.returncode}\n{done.stdout}{done.stderr}")
    said = {"said": [[line] for line in done.stdout.splitlines() if "tokens are in" not in line]}
    if (session / "session.json").exists():
        said["session"] = [[f"{name}={value}" for name, value in json.loads((session / "session.json").read_text()).items()]]
    return {program: [[word.replace(str(folder), "FLEET") for word in one] for one in each] for program, each in {**calls, **said}.items()}


def check_fleet():
    begin = ["start", "one"]
    check_rows(lambda words: fleet([*begin, "--wait", "0", *words]), {
        "--relays": (["--relays", "3"], {"session": ([("relays=0",)], [("relays=3",)])}),
        "--unchecked": (["--unchecked"], {"strandcast-server": ([("--print-scene",)], [])}),
        "--wait": (["--wait", "0.3"], {"said": ([], [("one waits for a GPU",)])}),
    }, options_of("strandcast-fleet", "start"), "fleet start")
    plain, given = fleet([*begin, "--wait", "0"]), fleet([*begin, "--wait", "0", "--", "--set", "a=1"])
    must(given["strandcast-server"] == [["--set", "a=1", "--print-scene"]], given)
    must(given["session"][0][2] == "options=['--set', 'a=1']" and plain["session"][0][2] == "options=[]", given)
    wrap = given["sbatch"][0][-1]
    must(wrap.endswith("run-server FLEET/sessions/one/server strandcast-server -- --set a=1") and wrap.startswith("--wrap=exec "), wrap)
    # Settings, by the commands that they change: all at once, each seen where it belongs.
    other = {"public": "wss://hair", "session_job": ["--mine"], "server": "strandcast-view", "haproxy_bind": ":9", "haproxy_socket": "/run/h",
             "slots": 65}
    started, proxied = ([str(fleet(words, config)) for config in (None, other)] for words in ([*begin, "--wait", "0"], ["proxy-config"]))
    for (before, after), gone, come in (
            (started, "ws://127.0.0.1:7880/s/one", "wss://hair/s/one"), (started, "--gres=gpu:1", "--mine"),
            (started, "server strandcast-server --", "server strandcast-view --"), (proxied, "bind 127.0.0.1:7880", "bind :9'"),
            (proxied, "stats socket FLEET/haproxy.sock", "stats socket /run/h"), (proxied, "", "backend slot65")):
        must(gone in before and come in after and come not in before, f"{come}: {after[:2000]}")
    # Inside of a job.
    run = ["run-server", "FOLDER/server", "strandcast-server", "--", "--set", "a=1"]
    plain = pairs(fleet(run)["strandcast-server"][0])
    must(plain == [("--set", "a=1"), ("--port", "0"), ("--port-file", "a new one"), ("--listen", "127.0.0.1"),
                   ("--token-file", "FLEET/sessions/one/tokens"), ("--trusted-proxy", "127.0.0.1")], plain)
    told = pairs(fleet(run, {"proxies": ["10.0.0.1", "10.0.0.2"], "hosts": ["hair"], "listen": "127.0.0.2"})["strandcast-server"][0])
    must(told[3:] == [("--listen", "127.0.0.2"), plain[4], ("--trusted-proxy", "10.0.0.1"), ("--trusted-proxy", "10.0.0.2"),
                      ("--allow-host", "hair")], told)
    relay = pairs(fleet(["run-relay", "FOLDER/relays/001", "machine:81", "strandcast-server"], {"relay_options": ["--max-sessions", "9"]})
                  ["strandcast-server"][0])
    must(relay[:3] == [("--upstream", "ws://machine:81"), ("--upstream-token-file", "FLEET/sessions/one/viewer_token"),
                       ("--max-sessions", "9")] and relay[3:] == plain[1:], relay)


def loaded_fleet():
    os.environ["STRANDCAST_FLEET"] = str(work / "tended")
    loader = SourceFileLoader("strandcast_fleet", str(source / "deploy/fleet/strandcast-fleet"))
    module = module_from_spec(spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


def check_tender():
    """How many relays a session gets and loses, and what HAProxy is told."""
    fleet, ended = loaded_fleet(), []
    job = lambda name, address="": SimpleNamespace(folder=work / name, state="RUNNING", address=address, end=lambda: ended.append(name))  # noqa: E731
    config = {**fleet.SETTINGS, "quiet_s": 0.0}
    # viewers, relays wished for, those that there are -> those that are begun; 64 viewers each, 16 relays at most
    for viewers, least, there, expected in ((0, 0, 0, 0), (48, 0, 0, 0), (49, 0, 0, 1), (64, 0, 0, 1), (65, 0, 0, 2), (65, 0, 1, 1), (1024, 0, 0, 16),
                                            (5000, 0, 0, 16), (0, 3, 1, 2), (0, 20, 0, 16), (0, 0, 1, 0)):
        begun = []
        fleet.add_relay = lambda _, session: begun.append(session)
        one = SimpleNamespace(name="one", folder=work / "none", least_relays=least, relays=[job(f"relay{i}") for i in range(there)])
        fleet.Tender().scale(config, one, viewers)
        must(len(begun) == expected, f"{viewers} viewers, {least} relays wished for, {there} there: {len(begun)} begun, not {expected}")
    quiet, patient = fleet.Tender(), fleet.Tender()
    one = SimpleNamespace(name="one", folder=work / "none", least_relays=1, relays=[job("a"), job("b"), job("c")])
    for turn in range(3):
        quiet.scale(config, one, 0)
        patient.scale({**config, "quiet_s": 60.0}, one, 0)
        must(ended == ["c"] * turn, f"after {turn + 1} turns: {ended}")
    # The server serves where no relay answers; who is no longer there is forgotten.
    told, one.relays = [], [job("001", "host:2"), job("002")]
    one.slot, one.root, one.is_draining = "slot1", job("server", "host:1"), False
    proxy = fleet.Proxy.__new__(fleet.Proxy)
    proxy.config, proxy.servers, proxy.viewers, proxy.map = config, {("slot1", "relay009"): "host:9"}, {}, {"gone": "slot2"}
    proxy.tell = lambda *commands: told.extend(commands)
    fleet.Proxy, fleet.sessions, fleet.jobs, fleet.trouble_of = lambda _: proxy, lambda _: [one], dict, lambda _: ""
    fleet.haproxy = lambda _, command: told.append(command)
    fleet.Tender().turn(config)
    added = {words[2]: (words[3], words[-1]) for words in map(str.split, told) if words[0] == "add" and words[1] == "server"}
    must(added == {"slot1/server": ("host:1", "backup"), "slot1/relay001": ("host:2", "1")}, added)
    for said in ("del server slot1/relay009", "sessions.map gone", "sessions.map one slot1", f"sessions.map {fleet.FILLED} yes"):
        must(any(command.endswith(said) for command in told), f"{said}: {told}")


def grid(words, number=[0]):
    number[0] += 1
    out = work / f"grid{number[0]}"
    done, calls = call([sys.executable, "-B", source / "deploy/fleet/strandcast-grid", words[0], "--out", str(out), *words[1:]])
    must(done.returncode == 0, f"grid {words}: {done.returncode}\n{done.stdout}{done.stderr}")
    return {program: [[word.replace(str(out), "OUT") for word in one] for one in each] for program, each in calls.items()}


def check_grid():
    part = '--wrap={} {} --solver $(sed -n "$((SLURM_ARRAY_TASK_ID + 2))p" OUT/grid.txt) --out OUT/parts/$(sed -n "$((SLURM_ARRAY_TASK_ID + 2))p" OUT/grid.txt) '
    for report in ("work-precision", "stability"):
        usual, other = ((part.format(program, report),) for program in ("strandcast-report", "mine"))
        check_rows(lambda words, report=report: grid([report, *words]), {
            "--out": ([], {}),  # what stands in its place is part of all rows
            "--program": (["--program", "mine"], {"sbatch": ([usual], [other])}),
            "--server": (["--server", str(root / "build/release/bin/strandcast-server")], {}),
            "--sbatch": (["--sbatch=--a", "--sbatch=--b"], {"sbatch": ([], [("--a",), ("--b",)])}),
        }, options_of("strandcast-grid", report), f"grid {report}")
        behind = grid([report, "--", "--quick"])["sbatch"]
        must(behind[0][-1] == usual[0] + "--quick" and "--array=0-1" in behind[0] and len(behind) == 2, behind)


try:
    check_run()
    check_fleet()
    check_tender()
    check_grid()
    print("every option does what it says")
finally:
    shutil.rmtree(work, ignore_errors=True)
