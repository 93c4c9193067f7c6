#!/usr/bin/env python3
"""The grid of a report as an array of jobs (deploy/fleet/strandcast-grid): check_grid.py SOURCE SERVER. Its report is a
script that writes what strandcast-report would, and its Slurm runs nothing: what it was asked for is carried out here."""
import csv
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

source, server = Path(sys.argv[1]), sys.argv[2]
work = Path(tempfile.mkdtemp())
slurm = work / "bin"
slurm.mkdir()
(slurm / "sbatch").write_text(f'#!/bin/sh\nfor word in "$@"; do printf "%s\\n" "$word"; done >> {work}/asked\necho 7\n')
report = slurm / "report"
# Of this model the part fails.
report.write_text("""#!/bin/sh
for word in "$@"; do case "$before" in --solver) model=$word ;; --out) out=$word ;; esac; before=$word; done
[ "$model" != pbd ] || { echo "no device for pbd"; exit 1; }
mkdir -p "$out"
printf 'test,solver,us_per_strand_frame,error\\r\\n"swing, long",%s,2.5,0.01\\r\\n"swing, long",%s,,nan\\r\\n' $model $model > "$out/work_precision.csv"
printf '<html><body>\\n<h1>one</h1>\\n<p>of %s</p></body></html>\\n' $model > "$out/work_precision.html"
""")
for one in slurm.iterdir():
    one.chmod(0o755)
environment = dict(os.environ, PATH=f"{slurm}:{os.environ['PATH']}")


def grid(*words, expect=0):
    done = subprocess.run([sys.executable, "-B", source / "deploy/fleet/strandcast-grid", *words], env=environment,
                          capture_output=True, text=True, timeout=30, check=False)
    assert done.returncode == expect, f"{words}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


try:
    out = work / "out"
    submit = ["work-precision", "--out", str(out), "--program", str(report), "--server", server, "--sbatch=--gres=gpu:1"]
    said = grid(*submit, "--", "--quick")
    assert "parts in job 7" in said, said
    assert "holds a grid already" in grid(*submit, expect=2)
    models = (out / "grid.txt").read_text().split()[1:]
    assert "dftl" in models and "pbd" in models and len(models) > 5, models
    asked = (work / "asked").read_text().splitlines()
    assert f"--array=0-{len(models) - 1}" in asked and "--gres=gpu:1" in asked and "--dependency=afterany:7" in asked, asked
    wrapped = [line.removeprefix("--wrap=") for line in asked if line.startswith("--wrap=")]
    assert wrapped[0].endswith(" --quick"), wrapped
    assert "no part" in grid("merge", str(out), expect=2)
    for number in range(len(models)):
        with open(out / f"parts/{number}.log", "w") as log:
            subprocess.run(["sh", "-c", wrapped[0]], env=dict(environment, SLURM_ARRAY_TASK_ID=str(number)), stdout=log,
                           stderr=log, timeout=30, check=False)
    subprocess.run(["sh", "-c", wrapped[1]], env=environment, timeout=30, check=False, capture_output=True)
    page = (out / "work_precision.html").read_text()
    assert "pbd: no device for pbd" in page and "<p>of dftl</p>" in page and "<h1>one" not in page
    assert page.count("<circle") == 2 * (len(models) - 1), "a point and a key of each model that ran"
    with open(out / "work_precision.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * (len(models) - 1) and rows[0]["test"] == "swing, long"
    print("a grid is one page")
finally:
    shutil.rmtree(work, ignore_errors=True)
