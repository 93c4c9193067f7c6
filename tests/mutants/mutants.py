#!/usr/bin/env python3
"""Plants one-line faults in product code and tells which of them no test notices.

usage: mutants.py --change [REVISION] | --random N [--seed N] [--under FOLDER,FOLDER] [--files N] [--labels L,L] [--entries REGEX]
                  [--seconds S] [--most PERCENT]

--change takes the lines that differ from REVISION (HEAD: what is not committed yet), --random lines of any source. A source is compiled
once with all its faults (plant.py), programs of tests are linked with it beside the others under BUILD/mutants, and each entry of ctest
runs once to see which faults it comes by. Then each fault is turned on by itself, and the entries that come by it run, quick ones
first, until one fails. Nothing in the source tree or in the build's own programs changes. Needs a finished build.
Prints each survivor with its line. Ends with 1 where more than PERCENT of the faults survive.
"""
import argparse
import concurrent.futures
import json
import os
import random
import re
import shlex
import subprocess
import sys
import time

import plant

TOPS = ("client", "common", "server")
# In this order: what lives nearest to the code first.
LABELS = ("unit", "conformance", "wire_bad", "compare", "property", "gl", "integration")
MOST_PER_LINE = 3
CLOSED_AT_TWICE = "network"  # entries with sockets may fail by themselves: they must fail twice


def output_of(command, **more):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", **more)


class Entry:
    """A ctest entry: its program, arguments, folder, environment, labels and, after a first run, its seconds and faults."""

    def __init__(self, test):
        properties = {p["name"]: p["value"] for p in test.get("properties", [])}
        self.name, self.command = test["name"], test["command"]
        self.program = os.path.basename(self.command[0])
        self.arguments = [a for a in self.command[1:] if not a.startswith("--gtest_output")]
        self.folder = properties.get("WORKING_DIRECTORY", ".")
        self.environment = dict(v.split("=", 1) for v in properties.get("ENVIRONMENT", []))
        self.labels = properties.get("LABELS", [])
        self.seconds, self.reached = 0.0, set()

    def rank(self):
        return min((LABELS.index(x) for x in self.labels if x in LABELS), default=len(LABELS))


class Bench:
    """Sources with faults, and the programs of tests that are linked with them."""

    def __init__(self, options):
        self.options = options
        self.root = os.path.abspath(options.source)
        self.build = os.path.abspath(options.build)
        self.out = os.path.join(self.build, "mutants")
        os.makedirs(os.path.join(self.out, "bin"), exist_ok=True)
        self.units = self.find_units()
        self.faults = {}  # number -> (path, fault)
        self.objects = {}  # object in the build -> object with faults

    def find_units(self):
        """For each source the compile commands that read it."""
        units = {}
        with open(os.path.join(self.build, "compile_commands.json")) as file:
            for entry in json.load(file):
                sources = [entry["file"]]
                if "/Unity/" in entry["file"] and os.path.exists(entry["file"]):
                    with open(entry["file"]) as unity:
                        sources = re.findall(r'#include "([^"]+\.cpp)"', unity.read())
                for source in sources:
                    units.setdefault(os.path.relpath(source, self.root), []).append(entry)
        return {path: found for path, found in units.items() if path.startswith(TOPS)}

    def changed_lines(self):
        diff = output_of(["git", "diff", "-U0", self.options.change, "--", *TOPS], cwd=self.root).stdout
        lines, path = {}, None
        for line in diff.splitlines():
            if line.startswith("+++ "):
                path = line[6:] if line.startswith("+++ b/") else None
            hunk = re.match(r"@@ -\S+ \+(\d+)(?:,(\d+))? @@", line)
            if hunk and path in self.units:
                first, count = int(hunk[1]), int(hunk[2] or 1)
                lines.setdefault(path, set()).update(range(first, first + count))
        return lines

    def choose(self):
        """For each path the (place, variant) pairs to plant."""
        everything, chance = [], random.Random(self.options.seed)
        lines = self.changed_lines() if self.options.change else None
        paths = [p for p in sorted(lines if lines is not None else self.units)
                 if p.startswith(tuple(self.options.under.split(","))) and not p.endswith("_main.cpp")]
        all_places = {}
        for path in paths:
            with open(os.path.join(self.root, path)) as file:
                all_places[path] = plant.places_of(file.read())
        if self.options.files:  # each drawn by its number of places, so that a line of a long source is as likely as one of a short
            paths = sorted(sorted(paths, key=lambda p: -(chance.random() ** (1 / max(len(all_places[p]), 0.01))))[:self.options.files])
        for path in paths:
            places = all_places[path]
            for index, place in enumerate(places):
                if lines is None or place[2] in lines[path]:
                    variants = list(range(len(place[4])))
                    chance.shuffle(variants)
                    everything += [(path, index, v) for v in sorted(variants[:MOST_PER_LINE])]
        if self.options.random and len(everything) > self.options.random:
            everything = sorted(chance.sample(everything, self.options.random))
        chosen = {}
        for path, index, variant in everything:
            chosen.setdefault(path, set()).add((index, variant))
        return chosen

    def plant_source(self, path, chosen, first):
        """Writes the source with its faults; those that do not compile are left out. Returns its faults."""
        with open(os.path.join(self.root, path)) as file:
            text = file.read()
        there = os.path.join(self.out, "src", path)
        os.makedirs(os.path.dirname(there), exist_ok=True)
        entry = self.units[path][0]
        for _ in range(6):
            made, faults, lines = plant.planted(text, chosen, first)
            with open(there, "w") as file:
                file.write(f'#include "{os.path.join(self.root, "tests/mutants/switch.h")}"\n{made}')
            result = self.compile(entry, there, None)
            if result.returncode == 0:
                return faults
            bad = {int(n) - 1 for n in re.findall(re.escape(there) + r":(\d+):\d+: (?:error|.*required from)", result.stdout)}
            gone = {lines[n] for n in bad if n in lines}
            if bad and not gone:  # the statement as a whole does not compile: all faults before that line, up to the next other text
                gone = {lines[n] for b in bad for n in range(b, b - MOST_PER_LINE - 2, -1) if n in lines}
            if not gone:
                break
            numbers = [f.number for f in faults]
            kept = [pair for pair, number in zip(self.in_order(text, chosen), numbers) if number not in gone]
            chosen = set(kept)
        print(f"{path}: left out, its faults do not compile")
        return []

    @staticmethod
    def in_order(text, chosen):
        """The chosen pairs in the order in which plant.planted numbers them."""
        done, out = 0, []
        for index, place in enumerate(plant.places_of(text)):
            mine = sorted(pair for pair in chosen if pair[0] == index)
            if mine and place[0] >= done:
                out += mine
                done = place[1]
        return out

    def compile(self, entry, source, target):
        """Compiles in the way of `entry`; without a target it only checks."""
        words = shlex.split(entry["command"])
        if words[0].endswith("ccache"):
            words = words[1:]
        place = words.index("-o")
        del words[place:place + 2]
        words = [w for w in words if w not in ("-Werror", "-c", entry["file"])]
        words += ["-w", "-fmax-errors=0"] + (["-c", source, "-o", target] if target else ["-fsyntax-only", source])
        return output_of(words, cwd=entry["directory"])

    def compile_units(self, paths):
        """Compiles each unit that holds a planted source."""
        wanted = {}
        for path in paths:
            for entry in self.units[path]:
                wanted.setdefault(entry["file"] + " " + entry["output"] if "output" in entry else entry["command"], (entry, []))[1].append(path)

        def one(item):
            number, (entry, inside) = item
            source = os.path.join(self.out, "src", inside[0])
            if "/Unity/" in entry["file"]:
                with open(entry["file"]) as file:
                    text = file.read()
                for path in inside:
                    text = text.replace(f'"{os.path.join(self.root, path)}"', f'"{os.path.join(self.out, "src", path)}"')
                source = os.path.join(self.out, f"unity_{number}.cxx")
                with open(source, "w") as file:
                    file.write(text)
            words = shlex.split(entry["command"])
            built, target = words[words.index("-o") + 1], os.path.join(self.out, f"unit_{number}.o")
            result = self.compile(entry, source, target)
            if result.returncode:
                print(f"{', '.join(inside)}: left out, does not compile together: {result.stdout[:300]}")
                return None
            return built, target

        with concurrent.futures.ThreadPoolExecutor(self.options.jobs) as pool:
            self.objects = dict(found for found in pool.map(one, enumerate(wanted.values())) if found)

    def link(self, program):
        """Links a program of tests with the objects that have faults. Returns whether it has any of them."""
        commands = output_of(["ninja", "-t", "commands", f"bin/{program}"], cwd=self.build).stdout.strip().splitlines()
        pieces = [p for p in commands[-1].split(" && ") if f"-o bin/{program}" in p]
        if not pieces:
            return False
        words, used = shlex.split(pieces[0]), []
        for built, target in self.objects.items():
            library = f"lib{built.split('CMakeFiles/')[1].split('.dir/')[0]}.a"
            if built in words:
                words[words.index(built)] = target
                used.append(target)
            elif any(os.path.basename(w) == library for w in words):
                words.insert(words.index("-o"), target)
                used.append(target)
        if not used:
            return False
        words[words.index("-o") + 1] = os.path.join(self.out, "bin", program)
        result = output_of(words, cwd=self.build)
        if result.returncode:
            print(f"{program}: left out, does not link: {result.stdout[-300:]}")
        return result.returncode == 0

    def entries(self):
        """The entries of ctest whose programs have faults."""
        listed = json.loads(output_of(["ctest", "--show-only=json-v1"], cwd=self.build).stdout)["tests"]
        labels = set(self.options.labels.split(",")) if self.options.labels else set(LABELS)
        entries = [Entry(t) for t in listed if "command" in t]
        entries = [e for e in entries if set(e.labels) & labels and re.search(self.options.entries, e.name) and os.path.dirname(e.command[0]) == os.path.join(self.build, "bin")]
        for name in os.listdir(os.path.join(self.build, "bin")):  # programs that tests start stand beside them
            there = os.path.join(self.out, "bin", name)
            if os.path.lexists(there):
                os.remove(there)
            os.symlink(os.path.join(self.build, "bin", name), there)
        programs = sorted({e.program for e in entries})
        for program in programs:
            os.remove(os.path.join(self.out, "bin", program))
        with concurrent.futures.ThreadPoolExecutor(self.options.jobs) as pool:
            linked = dict(zip(programs, pool.map(self.link, programs)))
        return [e for e in entries if linked[e.program]]

    def run(self, entry, number):
        """Runs an entry with a fault, or with none (0), which also finds what the entry comes by. Returns whether it passed.

        A fault that never ends is noticed by the processor time that it takes: the clock goes on where others work too."""
        processor_s = int(4 * entry.seconds * self.options.jobs + 10) if number else 600
        timeout = 10 * entry.seconds + 60 if number else 600
        environment = dict(os.environ, **entry.environment)
        reached = os.path.join(self.out, f"reached_{re.sub(r'[^A-Za-z0-9_]', '_', entry.name)}")
        if number:
            environment["STRANDCAST_MUTANT"] = str(number)
        else:
            environment["STRANDCAST_MUTANTS_REACHED"] = reached
        begun = time.monotonic()
        try:
            limited = ["sh", "-c", f'ulimit -t {processor_s}; exec "$0" "$@"', os.path.join(self.out, "bin", entry.program)]
            done = subprocess.run([*limited, *entry.arguments], cwd=entry.folder, env=environment,
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=timeout)
            passed = done.returncode == 0
        except subprocess.TimeoutExpired:
            passed = False
        if not number:
            entry.seconds = time.monotonic() - begun
            if os.path.exists(reached):
                with open(reached) as file:
                    entry.reached = {int(line) for line in file}
                os.remove(reached)
        return passed

    def judge(self, number, entries):
        """Which entry notices the fault, "" for none, and the number of those that come by it."""
        mine, spent = [e for e in entries if number in e.reached], 0.0
        for entry in sorted(mine, key=lambda e: (e.rank(), e.seconds)):
            if spent > self.options.seconds:
                break
            spent += entry.seconds
            passed = self.run(entry, number)
            if not passed and CLOSED_AT_TWICE in entry.labels:
                passed = self.run(entry, number)
            if not passed:
                return entry.name, len(mine)
        return "", len(mine)

    def plant_all(self):
        first, planted = 1, []
        chosen = self.choose()
        for index, (path, pairs) in enumerate(chosen.items()):
            faults = self.plant_source(path, pairs, first)
            print(f"planted {path} ({index + 1} of {len(chosen)}): {len(faults)} faults", flush=True)
            if faults:
                planted.append(path)
                self.faults.update({f.number: (path, f) for f in faults})
                first = faults[-1].number + 1
        self.compile_units(planted)
        return bool(self.objects)


def show(survivors, count):
    for path, fault, seen in survivors:
        why = f"{seen} entries come by it" if seen else "no entry comes by it"
        print(f"SURVIVED {path}:{fault.line}: {fault.sentence} ({why})")
    print(f"{count - len(survivors)} of {count} faults were noticed, {len(survivors)} survived ({100 * len(survivors) / max(count, 1):.1f} %)")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--source", default=os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
    parser.add_argument("--build", default="build/ci")
    parser.add_argument("--change", nargs="?", const="HEAD", metavar="REVISION")
    parser.add_argument("--random", type=int, metavar="N")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--under", default="", metavar="FOLDER,FOLDER")
    parser.add_argument("--files", type=int, metavar="N", help="from so many sources, drawn by chance: quicker to compile")
    parser.add_argument("--labels", metavar="L,L", help="entries with one of these labels alone")
    parser.add_argument("--entries", default="", metavar="REGEX", help="entries whose names match alone")
    parser.add_argument("--seconds", type=float, default=60, help="of tests for each fault")
    parser.add_argument("--most", type=float, default=100, metavar="PERCENT")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    if bool(options.change) == bool(options.random):
        parser.error("one of --change and --random is needed")
    bench = Bench(options)
    if not bench.plant_all():
        print("nothing to plant")
        return 0
    entries = bench.entries()
    print(f"{len(bench.faults)} faults, {len(entries)} entries of tests: a first run without a fault", flush=True)
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        passed = list(pool.map(lambda e: bench.run(e, 0), entries))
        entries = [e for e, ok in zip(entries, passed) if ok]
        print(f"{len(entries)} of them pass", flush=True)
        numbers = sorted(bench.faults)
        verdicts = pool.map(lambda n: bench.judge(n, entries), numbers)
        survivors = []
        for number, (by, seen) in zip(numbers, verdicts):
            path, fault = bench.faults[number]
            if by:
                print(f"noticed {path}:{fault.line}: {fault.sentence} by {by}", flush=True)
            else:
                print(f"not noticed {path}:{fault.line}: {fault.sentence} ({seen} entries come by it)", flush=True)
                survivors.append((path, fault, seen))
    show(survivors, len(numbers))
    return 1 if len(survivors) * 100 > options.most * len(numbers) else 0


if __name__ == "__main__":
    sys.exit(main())
