#!/usr/bin/env python3
"""Holds docs/internals/walks.md: its files exist, each is linked with those before it, and no walk grows.

usage: walks.py SOURCE_FOLDER [ignored]
A file is linked with one of the few before it where either includes the other's header, or names what few files but the other
declare. A header counts with the source of its name. Prints a line per fault and ends with 1 if there are any. Then it plants a fault for each
check, in memory, and ends with 1 unless every check finds its own.
"""
import os
import re
import sys

PAGE = "docs/internals/walks.md"
# Files that a walk has at most. A shorter walk lowers its number here and in the page.
MOST = {"Head pose": 37, "Vertex": 27, "Mode": 20, "Look": 21, "Recording": 19}
MOST_WORDS, LEAST_WORDS = 8, 3
TOPS = ("client", "common", "proto", "server", "shaders")
ENDINGS = (".cpp", ".h", ".ts", ".comp", ".glsl", ".frag", ".vert", ".proto")
LEAST_NAME = 6  # shorter names are everywhere
LOOK_BACK = 4  # a call returns, and its caller calls the next
MOST_OWNERS = 3  # a name that more units declare links nobody
DECLARED = [r"\b(?:class|struct|union|enum class) (\w+)\b(?!;)", r"^[\w:<>,*&\[\] ]+?\b\w+::(\w+)\(", r"^ *(?:[\w:<>,*&]+ )+?[*&]?(\w+)\(",
            r"\busing ([A-Z]\w+) =", r"\bconstexpr [\w:<>]+ (k\w+)"]


class Unit:
    """A source with its header: texts without comments, the headers that they include, names that they declare."""

    def __init__(self, path, texts):
        self.path, self.texts, self.stem = path, texts, re.sub(r"\.\w+$", "", os.path.basename(path))
        code = re.sub(r"//.*", "", "\n".join(texts.values()))
        self.includes = set(re.findall(r'#include "([^"]+)"', code))
        self.words = set(re.findall(r"\w+", code))
        self.strings = set(re.findall(r'"([^"\n]+)"', code))
        found = {n for pattern in DECLARED for n in re.findall(pattern, code, re.M)}
        self.declared = {n for n in found if len(n) >= LEAST_NAME and re.search(r"^[A-Z]|_\w|[a-z][A-Z]", n)}


def unit_of(path):
    """Path without ending; `_private` belongs to the header of a source."""
    return re.sub(r"(_private)?\.\w+$", "", path) if path.endswith((".h", ".cpp")) else path


class Tree:
    def __init__(self, root):
        texts = {}
        for top in TOPS:
            for folder, _, files in os.walk(os.path.join(root, top)):
                for file in files:
                    if file.endswith(ENDINGS):
                        path = os.path.relpath(os.path.join(folder, file), root)
                        texts.setdefault(unit_of(path), {})[path] = open(os.path.join(root, path), encoding="utf-8").read()
        self.units = {name: Unit(name, files) for name, files in texts.items()}
        self.files = {path for files in texts.values() for path in files}
        self.owners = {}
        for unit in self.units.values():
            for name in unit.declared:
                self.owners[name] = self.owners.get(name, 0) + 1
        self.page = open(os.path.join(root, PAGE), encoding="utf-8").read()

    def link(self, a, b):
        """What links two units; None where nothing does."""
        for one, other in ((a, b), (b, a)):
            for path in other.texts:
                below = path.removeprefix("shaders/")  # as shaders and those who run them name it
                if {path, below} & (one.includes | one.strings) or (below != path and other.stem in one.strings):
                    return path
            for name in sorted(one.words & other.declared - one.declared):
                if self.owners[name] <= MOST_OWNERS:
                    return name
        return None


def walks_of(page):
    """Title to (file, what the page says of it) of each walk; a part of another walk stands for its files."""
    walks, title = {}, None
    for line in page.split("\n"):
        if line.startswith("## "):
            title = line[3:].split(":")[0]
            walks[title] = []
        room = re.match(r"- ([\w/]+): (.*)", line)
        part = re.match(r"- then \*(\w+)\* from `([^`]+)` to `([^`]+)`", line)
        for item in room[2].split("; ") if title and room else []:
            name, text = re.match(r"`([^`]+)` ?(.*)", item).groups()
            walks[title].append((f"{room[1]}/{name}{'' if '.' in name else '.cpp'}", text))
        if title and part:
            walks[title].append(part.groups())
    for title, items in walks.items():
        walks[title] = [file for item in items for file in ([item] if len(item) == 2 else part_of(walks, *item))]
    return walks


def part_of(walks, title, first, last):
    """The files of another walk from one to another; a file of its own name where there is no such part."""
    paths = [item[0] for item in walks.get(title, [])]
    if first in paths and last in paths[paths.index(first):]:
        return walks[title][paths.index(first):paths.index(last) + 1]
    return [(f"{title} from {first} to {last}", "no such part there")]


def check_files(tree):
    for title, files in walks_of(tree.page).items():
        for path, _ in files:
            if path not in tree.files:
                yield f"{title}: no such file: {path}"


def check_links(tree):
    for title, files in walks_of(tree.page).items():
        units = [tree.units[unit_of(path)] for path, _ in files if unit_of(path) in tree.units]
        for i, unit in enumerate(units[1:], 1):
            before = units[max(0, i - LOOK_BACK):i]
            if not any(tree.link(other, unit) for other in before):
                yield f"{title}: nothing links {unit.path} to the files before it: name the one between"


def check_counts(tree):
    walks = walks_of(tree.page)
    for title in sorted(set(walks) ^ set(MOST)):
        yield f"a walk that is in one place only: {title}"
    for title, files in walks.items():
        count, most = len({unit_of(path) for path, _ in files}), MOST.get(title, 0)
        if count > most:
            yield f"{title}: {count} files, {most} at most"
        row = re.search(rf"^\| {title} \| (\d+) \|", tree.page, re.M)
        if not row or int(row.group(1)) != count:
            yield f"{title}: has {count} files, and the page's table says otherwise"


def check_words(tree):
    for title, files in walks_of(tree.page).items():
        for path, text in files:
            if not LEAST_WORDS <= len(text.split()) <= MOST_WORDS:
                yield f"{title}: {len(text.split())} words of {path}, {LEAST_WORDS} to {MOST_WORDS} are wanted"


CHECKS = [check_files, check_links, check_counts, check_words]


def planted(page):
    """A fault for each check: what a careless hand makes of the page."""
    first = re.search(r"^- [\w/]+: `(\w+)` [^;\n]+", page, re.M)
    yield check_files, page.replace(f"`{first[1]}`", f"`{first[1]}_gone`", 1)
    yield check_files, page.replace("- then *Vertex* from `", "- then *Vertex* from `no/", 1)
    yield check_links, page.replace(first[0], "- client/web/page: `wire.ts` is far from it\n" + first[0], 1)
    yield check_counts, page.replace(first[0], first[0] + "\n- server/net: `ip_address` is one too many", 1)
    yield check_counts, re.sub(r"^(\| Look \|) \d+", r"\1 1", page, flags=re.M)
    yield check_counts, re.sub(r"^## Look:", "## Sight:", page, flags=re.M)
    yield check_words, page.replace(first[0], first[0] + " and much more that nobody will ever want to read", 1)


def self_test(tree):
    missed, page = 0, tree.page
    faults = list(planted(page))
    for check, wrong in faults:
        tree.page = page
        before = set(check(tree))
        tree.page = wrong
        if wrong == page or not set(check(tree)) - before:
            print(f"{check.__name__} does not find its fault")
            missed += 1
    tree.page = page
    for check in set(CHECKS) - {c for c, _ in faults}:
        print(f"no fault is planted for {check.__name__}")
        missed += 1
    print(f"{len(faults)} faults planted, {missed} not found")
    return missed


def main():
    tree = Tree(sys.argv[1])
    faults = [fault for check in CHECKS for fault in check(tree)]
    print("\n".join(faults))
    print(", ".join(f"{title} {len({unit_of(path) for path, _ in files})}" for title, files in walks_of(tree.page).items()) + f"; {len(faults)} faults")
    sys.exit(1 if self_test(tree) or faults else 0)


if __name__ == "__main__":
    main()
