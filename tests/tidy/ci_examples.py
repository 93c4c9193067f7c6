#!/usr/bin/env python3
"""Holds that the examples for CI are what GitHub and GitLab take: every key and word is one that their schemas know, what a
job needs is there, the command's options exist, and what it writes is what is kept.

usage: ci_examples.py SOURCE_FOLDER PROGRAM_FOLDER
Prints a line per fault and ends with 1 if there are any. Each check has a counter-example, which must be found.
"""
import os
import re
import subprocess
import sys

# Keys by the published schemas (json.schemastore.org: github-workflow, gitlab-ci) as far as an example may use them. A dict
# has keys, a list has one kind of entries, a set the words that there are; None is any text.
ANY = {"*": None}
GITHUB = {
    "name": None, "on": [{"push", "pull_request", "workflow_dispatch", "schedule"}], "env": ANY, "permissions": ANY,
    "jobs": {"*": {
        "name": None, "needs": [None], "runs-on!": None, "env": ANY, "if": None, "timeout-minutes": None,
        "container": {"image!": None, "env": ANY, "options": None, "volumes": [None], "credentials": ANY},
        "steps!": [{"name": None, "id": None, "if": None, "uses": None, "run": None, "with": ANY, "env": ANY, "shell": None,
                    "working-directory": None, "continue-on-error": None, "timeout-minutes": None}]}}}
UPLOAD = {"name": None, "path!": None, "if-no-files-found": {"warn", "error", "ignore"}, "retention-days": None,
          "compression-level": None, "overwrite": None, "include-hidden-files": None}
GITLAB_JOB = {
    "image": {"name!": None, "entrypoint": [None], "pull_policy": None}, "stage": None, "script!": [None],
    "before_script": [None], "after_script": [None], "variables": ANY, "rules": [ANY], "tags": [None], "needs": [None],
    "timeout": None, "allow_failure": None,
    "artifacts": {"name": None, "paths": [None], "when": {"on_success", "on_failure", "always"}, "expire_in": None,
                  "untracked": None, "exclude": [None], "reports": {"junit": None, "dotenv": None, "coverage_report": ANY}}}
GITLAB = {"stages": [None], "default": ANY, "variables": ANY, "workflow": ANY, "*": GITLAB_JOB}


def read_yaml(text):
    """The part of YAML that examples are written in: maps, lists, [a, b], texts and | blocks."""
    lines = [line.split(" #")[0].rstrip() for line in text.splitlines() if not line.lstrip().startswith("#")]
    lines = [line for line in lines if line.strip()]

    def scalar(word):
        word = word.strip()
        if word.startswith("[") and word.endswith("]"):
            return [part.strip().strip("'\"") for part in word[1:-1].split(",")]
        return word.strip("'\"")

    def depth(at):
        return len(lines[at]) - len(lines[at].lstrip()) if at < len(lines) else -1

    def block(at, indent):
        is_list = lines[at].lstrip().startswith("- ")
        found = [] if is_list else {}
        while at < len(lines) and depth(at) == indent:
            line = lines[at].strip()
            if is_list != line.startswith("- "):
                raise ValueError(f"'{line}' is neither list nor map")
            if is_list:
                if re.match(r"- [\w-]+:( |$)", line):
                    lines[at] = " " * (indent + 2) + line[2:]
                    value, at = block(at, indent + 2)
                else:
                    value, at = scalar(line[2:]), at + 1
                found.append(value)
                continue
            match = re.match(r"([\w.-]+):(?: (.*))?$", line)
            if not match:
                raise ValueError(f"'{line}' is no key and value")
            key, rest = match[1], match[2] or ""
            if key in found:
                raise ValueError(f"{key} comes twice")
            at += 1
            if rest == "|":
                begin = at
                while depth(at) > indent:
                    at += 1
                found[key] = "\n".join(line.strip() for line in lines[begin:at])
            elif rest:
                found[key] = scalar(rest)
            elif depth(at) > indent or (depth(at) == indent and lines[at].lstrip().startswith("- ")):
                found[key], at = block(at, depth(at))
            else:
                found[key] = ""
        if depth(at) > indent:
            raise ValueError(f"'{lines[at].strip()}' stands too far to the right")
        return found, at

    return block(0, 0)[0]


def check(value, shape, place, faults):
    if isinstance(shape, list):
        for entry in value if isinstance(value, list) else [value]:
            check(entry, shape[0], place, faults)
    elif isinstance(shape, set):
        if value not in shape:
            faults.append(f"{place}: '{value}' is none of {', '.join(sorted(shape))}")
    elif shape is None:
        if isinstance(value, dict):
            faults.append(f"{place}: a text was expected")
    elif not isinstance(value, dict):
        faults.append(f"{place}: keys were expected")
    else:
        known = {key.rstrip("!"): inner for key, inner in shape.items()}
        for key, inner in value.items():
            if key not in known and "*" not in known:
                faults.append(f"{place}: there is no key '{key}'")
            else:
                check(inner, known.get(key, known.get("*")), f"{place}.{key}", faults)
        faults += [f"{place}: '{key[:-1]}' is missing" for key in shape if key.endswith("!") and key[:-1] not in value]


def faults_of(name, text, options):
    faults, scripts, kept = [], [], ""
    try:
        file = read_yaml(text)
    except ValueError as error:
        return [f"{name}: {error}"]
    check(file, GITHUB if name == "github.yml" else GITLAB, name, faults)
    if faults:
        return faults
    if name == "github.yml":
        for step in (step for job in file["jobs"].values() for step in job["steps"]):
            if ("uses" in step) == ("run" in step):
                faults.append(f"{name}: a step has either uses or run")
            if step.get("uses", "").startswith("actions/upload-artifact@"):
                check(step.get("with", {}), UPLOAD, f"{name}: upload-artifact", faults)
                kept += step.get("with", {}).get("path", "")
            scripts.append(step.get("run", ""))
    else:
        for job in (job for job in file.values() if isinstance(job, dict) and "script" in job):
            scripts += job["script"]
            kept += " ".join(job.get("artifacts", {}).get("paths", []))
            if not any(job.get("artifacts", {}).get("reports", {}).get("junit", "-") in script for script in job["script"]):
                faults.append(f"{name}: the report that GitLab reads is written by no command")
    commands = [script for script in scripts if script.startswith("strandcast-ctl test ")]
    if not commands:
        faults.append(f"{name}: no command runs scenarios")
    for command in commands:
        faults += [f"{name}: strandcast-ctl test has no {word}" for word in re.findall(r"--[\w-]+", command) if word not in options]
        for option in ("--junit", "--out"):
            written = re.search(option + r" (\S+)", command)
            if not written or written[1] not in kept:
                faults.append(f"{name}: what {option} writes is not kept")
    return faults


def main():
    folder = os.path.join(sys.argv[1], "examples", "ci")
    program = os.path.join(sys.argv[2], "strandcast-ctl")
    said = subprocess.run([program, "test", "--help"], capture_output=True, text=True, check=True).stdout
    options = set(re.findall(r"--[\w-]+", said))
    faults = []
    for name in ("github.yml", "gitlab.yml"):
        with open(os.path.join(folder, name), encoding="utf-8") as file:
            text = file.read()
        faults += faults_of(name, text, options)
        wrong = {"github.yml": [("runs-on", "runs_on"), ("if-no-files-found: ignore", "if-no-files-found: hide"),
                                ("      - run: ", "      - uses: a/b@v1\n        run: "), ("            failed\n", "")],
                 "gitlab.yml": [("script:", "scripts:"), ("when: always", "when: ever"), ("entrypoint", "entry_point"),
                                ("junit: results.xml", "junit: other.xml"), (", failed]", "]")]}[name]
        for right, bad in wrong + [("--junit", "--junits")]:
            if right not in text or not faults_of(name, text.replace(right, bad), options):
                faults.append(f"{name}: a counter-example was not found: {bad}")
    print("\n".join(faults), end="\n" if faults else "")
    return 1 if faults else 0


sys.exit(main())
