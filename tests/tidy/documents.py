#!/usr/bin/env python3
"""Holds the documents: sizes, sentences, words, links, and that what they name exists.

usage: documents.py SOURCE_FOLDER PROGRAM_FOLDER
Prints a line per fault and ends with 1 if there are any. Then it plants a fault for each check, in memory, and ends
with 1 unless every check finds its own.
"""
import concurrent.futures
import fnmatch
import glob
import os
import re
import shlex
import subprocess
import sys

# Bytes at most: a document, or a folder's documents.
SIZES = {"README.md": 8000, "CONTRIBUTING.md": 8000, "ARCHITECTURE.md": 16000, "SECURITY.md": 16000,
         "CHANGELOG.md": 12000, "docs/use/*.md": 5000, "docs/internals/*.md": 8000}
ALL_BYTES = 170000
PLAIN = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"]
MEAN_WORDS = 15
LONG_WORDS, LONG_SENTENCES = 25, 15
FORMULA_WORDS = 40  # in WIRE.md, where a sentence may be a formula
WORDS = ["what is told", "whoever", "likewise", "so many", "as they are", "behind"]
MAX_INVARIANTS = 25
# What commands name besides our own programs and scripts.
OTHER_PROGRAMS = {"apt", "cd", "chmod", "cmake", "cpack", "ctest", "export", "npm", "openssl", "podman", "systemctl"}
SCRIPTS = ["deploy/run.sh", "deploy/fleet/strandcast-fleet", "deploy/fleet/strandcast-grid", "tests/nightly.sh"]
PROGRAMS = ["server", "view", "ctl", "report", "load", "chaos", "vopr"]
# Options in prose that are others' or a bench's own.
OTHER_OPTIONS = {"--help", "--install", "--prefix", "--match", "--relays", "--cpus-per-task", "--gres"}
COMMAND_DOCUMENTS = ["README.md", "CONTRIBUTING.md", "SECURITY.md", "docs/*/*.md", "examples/README.md"]


class Tree:
    """The source folder: documents as text (which a self-test changes), everything else as files."""

    def __init__(self, root, programs):
        self.root, self.programs = root, programs
        names = ["*.md", "docs/*.md", "docs/*/*.md", "proto/*.md", "shaders/*.md", "deploy/*.md", "deploy/*/*.md", "examples/*.md",
                 "client/*.md", "server/*.md", "common/*.md", "tests/*.md"]
        found = sorted({f for name in names for f in glob.glob(os.path.join(root, name))})
        self.documents = {os.path.relpath(f, root): open(f, encoding="utf-8").read() for f in found}
        self.tests = set()
        self.sources = {}  # of each source file that names a document: its lines that do
        for top in ("client", "cmake", "common", "deploy", "examples", "server", "shaders", "tests"):
            for folder, _, files in os.walk(os.path.join(root, top)):
                for file in files:
                    if file.endswith((".cpp", ".h", ".txt", ".cmake", ".sh", ".py", ".ts", ".comp", ".glsl", "-fleet", "-grid")):
                        self.read_source(os.path.join(folder, file))
        self.proto = open(os.path.join(root, "proto/strandcast/v1/scene.proto"), encoding="utf-8").read()
        self.helps = Helps(root, programs)
        self.helps.ask_ahead("\n".join(self.documents.values()))

    def read_source(self, file):
        if "/vectors/" in file or os.path.basename(file) == "documents.py":
            return
        text = open(file, encoding="utf-8").read()
        if file.endswith(".cpp"):
            self.tests.update(f"{a}.{b}" for a, b in re.findall(r"^TEST(?:_F|_P)?\((\w+),\s*(\w+)", text, re.M))
        if ".md" in text:
            self.sources[os.path.relpath(file, self.root)] = "\n".join(l for l in text.split("\n") if ".md" in l)

    def exists(self, path):
        return bool(glob.glob(os.path.join(self.root, path)))

    def matching(self, patterns):
        return [d for d in self.documents if any(fnmatch.fnmatch(d, p) for p in patterns)]


def commands_in(text):
    """Names of commands that a program lists in its --help."""
    part = text.split("\nSubcommands:\n")
    return re.findall(r"^  ([a-z-]+)", part[1], re.M) if len(part) > 1 else []


class Helps:
    """What programs, scripts and their commands say to --help: asked when it is needed, since each start takes its time.

    Keys are ("strandcast-ctl", "mocap", "subject"); in: whether there is such a program or command.
    """

    def __init__(self, root, programs):
        self.root, self.programs = root, programs
        first = [(f"strandcast-{p}",) for p in PROGRAMS] + [(s,) for s in SCRIPTS]
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            self.texts = dict(pool.map(lambda key: (key, self.ask(key)), first))

    def ask(self, key):
        if key == ("tests/nightly.sh",):  # it has no --help
            return open(os.path.join(self.root, key[0]), encoding="utf-8").read()
        script = os.path.join(self.root, key[0])
        call = [os.path.join(self.programs, key[0])]
        if key[0] in SCRIPTS:
            call = ["bash", script] if script.endswith(".sh") else ["python3", "-B", script]
        return subprocess.run([*call, *key[1:], "--help"], capture_output=True, text=True, timeout=60).stdout

    def ask_ahead(self, text):
        """Asks several at a time for the commands that the text shows with options."""
        found = re.findall(r"^    (?:\S*/)?(strandcast-(?:ctl|report)) (?:--\S+ \S+ )*([a-z-]+) [^#\n]*--", text, re.M)
        keys = {key for key in found if key in self}
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            self.texts.update(pool.map(lambda key: (key, self.ask(key)), keys))

    def __contains__(self, key):
        if len(key) == 1:
            return key in self.texts
        if key[0] == "deploy/fleet/strandcast-fleet":
            return len(key) == 2 and key[1] in re.search(r"\{(.*?)\}", self[key[:1]]).group(1).split(",")
        return key[-1] in commands_in(self[key[:-1]])

    def __getitem__(self, key):
        if key not in self.texts:
            self.texts[key] = self.ask(key)
        return self.texts[key]


# ---- sentences

def sentences(text):
    """Sentences of the prose: no tables, headings, code blocks; a code span is a word."""
    lines, fenced = [], False
    for line in text.split("\n"):
        if line.startswith("```"):
            fenced = not fenced
        prose = not (fenced or line.startswith(("```", "    ", "|", "#", "<!--")))
        lines.append(line if prose else "")
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", "\n".join(lines))
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", re.sub(r"`[^`]*`", "code", text))
    for paragraph in re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) )", text):
        for sentence in re.split(r"(?<=[.!?])\s+", " ".join(paragraph.split())):
            words = [w for w in sentence.split() if re.search(r"\w", w)]
            if len(words) > 2:
                yield len(words), sentence


def check_sizes(tree):
    for pattern, most in SIZES.items():
        for name in tree.matching([pattern]):
            size = len(tree.documents[name].encode())
            if size > most:
                yield f"{name}: {size} bytes, {most} at most"
    total = sum(len(t.encode()) for t in tree.documents.values())
    if total > ALL_BYTES:
        yield f"all documents: {total} bytes, {ALL_BYTES} at most"


def check_means(tree):
    for name in PLAIN:
        counts = [n for n, _ in sentences(tree.documents[name])]
        if not counts or sum(counts) / len(counts) > MEAN_WORDS:
            yield f"{name}: {sum(counts) / max(1, len(counts)):.1f} words a sentence, {MEAN_WORDS} at most"


def long_sentences(tree):
    return [(n, name, s) for name, text in tree.documents.items() for n, s in sentences(text)
            if n > (FORMULA_WORDS if name == "proto/WIRE.md" else LONG_WORDS)]


def check_long_sentences(tree):
    long = long_sentences(tree)
    if len(long) > LONG_SENTENCES:
        for n, name, sentence in long:
            yield f"{name}: a sentence of {n} words: {sentence[:80]}"


def check_words(tree):
    for name, text in tree.documents.items():
        text = " ".join(re.sub(r"`[^`]*`", "", text).split()).lower()
        for word in WORDS:
            for match in re.finditer(rf"\b{word}\b", text):
                yield f"{name}: \"{word}\" in \"{text[max(0, match.start() - 30):match.end() + 30]}\""


# ---- what is named exists

def anchors(text):
    heads = re.findall(r"^#+ (.*)$", text, re.M)
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in heads}


def check_links(tree):
    for name, text in tree.documents.items():
        for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`]*`", "", text)):
            if re.match(r"[a-z]+:", target):
                continue
            path, _, anchor = target.partition("#")
            path = os.path.normpath(os.path.join(os.path.dirname(name), path)) if path else name
            if not (path in tree.documents or tree.exists(path)):
                yield f"{name}: no such file: {target}"
            elif anchor and anchor not in anchors(tree.documents.get(path, "")):
                yield f"{name}: no such heading: {target}"


def check_references(tree):
    """Comments and messages of the code name documents that exist; a bare name lies at the top, or beside the file."""
    for file, text in tree.sources.items():
        for name in re.findall(r"(?<![\w/*.-])((?:docs|proto|shaders|deploy)/[\w/-]+\.md|[A-Z]{4,}\.md)", text):
            beside = os.path.join(os.path.dirname(file), name)
            known = (name, beside, f"proto/{name}")
            if name != "ORIGINS.md" and not any(n in tree.documents for n in known):  # it lies beside the tests' data
                yield f"{file}: no such document: {name}"


def check_paths(tree):
    """A code span that looks like a path of ours is one; without an ending, a header or source of that name."""
    tops = ("server/", "client/", "common/", "shaders/", "tests/", "deploy/", "proto/", "cmake/", "examples/", "docs/")
    short = {"proto": ("proto/",), "shaders": ("shaders/",)}
    for name, text in tree.documents.items():
        if name.startswith("CHANGELOG"):
            continue
        for span in re.findall(r"`([^`\s]+)`", text):
            if not span.startswith(tops) or re.search(r"[<>{}]|NAME|\.{3}", span):
                continue
            span = span.rstrip("/")
            if not any(tree.exists(span + end) for end in ("", ".h", ".cpp", ".*", "_*")):
                yield f"{name}: no such file: {span}"


def check_recipes(tree):
    text = tree.documents["CONTRIBUTING.md"]
    recipes = re.split(r"^### ", text[text.index("## Recipes"):text.index("## Commit")], flags=re.M)[1:]
    if len(recipes) != 7:
        yield f"CONTRIBUTING.md: {len(recipes)} recipes, not seven"
    for recipe in recipes:
        title = recipe.split("\n")[0]
        example = re.search(r"NAME = (\w+)", title)
        files = [s for s in re.findall(r"`([^`\s]+)`", recipe) if "." in s]
        if len(files) < 4:
            yield f"CONTRIBUTING.md, {title}: names {len(files)} files"
        for file in files:
            if not tree.exists(file.replace("NAME", example.group(1)) if example else file):
                yield f"CONTRIBUTING.md, {title}: no such file: {file}"


def named_tests(text):
    """Suite.Test, Suite.Test... (its beginning), Suite.* and .Test (of the suite before)."""
    suite = ""
    for line in text.split("\n"):
        for span in re.findall(r"`([^`\s]+)`", line):
            match = re.fullmatch(r"([A-Z]\w+)?\.([A-Z]\w+(?:\.\.\.)?|\*)", span)
            if match and not span.endswith((".h", ".cpp")):
                suite = match.group(1) or suite
                yield span, f"{suite}.{match.group(2)}".replace("...", "*")


def check_tests(tree):
    for name in tree.matching(["ARCHITECTURE.md", "SECURITY.md", "docs/internals/*.md"]):
        for span, pattern in named_tests(tree.documents[name]):
            if not fnmatch.filter(tree.tests, pattern):
                yield f"{name}: no such test: {span}"
    text = tree.documents["ARCHITECTURE.md"]
    text = text[text.index("## Invariants"):text.index("## Errors")]
    rows = re.split(r"^\d+\. ", text, flags=re.M)[1:]
    if not 0 < len(rows) <= MAX_INVARIANTS:
        yield f"ARCHITECTURE.md: {len(rows)} invariants, {MAX_INVARIANTS} at most"
    for row in rows:
        if not re.match(r"\*\*.+?\*\*", row) or not list(named_tests(row)):
            yield f"ARCHITECTURE.md: an invariant without name or test: {row[:60].strip()}"


def check_code_map(tree):
    text = tree.documents["ARCHITECTURE.md"]
    text = text[text.index("## Code map"):text.index("## Who may include whom")]
    for title, base in (("common", "common"), ("server", "server"), ("client", "client")):
        part = re.search(rf"^### {title}\b.*?\n(.*?)(?=^### )", text, re.M | re.S).group(1)
        listed = set(re.findall(r"^\| `(\w+)` \|", part, re.M))
        there = {d for d in os.listdir(os.path.join(tree.root, base)) if os.path.isdir(os.path.join(tree.root, base, d))}
        for room in sorted(listed ^ there):
            yield f"ARCHITECTURE.md: {base}/{room} is " + ("no room" if room in listed else "not in the code map")


# ---- commands

def command_lines(text):
    """Commands of indented blocks, joined where a line ends in a backslash."""
    fenced = False
    blocks = re.sub(r"\\\n\s+", " ", text).split("\n")
    for i, line in enumerate(blocks):
        if line.startswith("```"):
            fenced = not fenced
        if not fenced and line.startswith("    ") and line.strip():
            yield re.sub(r"(^|\s)#( .*|$)", "", line).strip()


def options_of(*helps):
    return {o for text in helps for o in re.findall(r"(?<![\w-])(--?[a-z][a-z0-9-]*)", text)}


def field_exists(proto, path):
    """Whether scene.proto has such a field, down from Scene."""
    message, parts = "Scene", [p for p in path.split(".") if not p.isdigit()]
    for i, part in enumerate(parts):
        body = re.search(rf"^message {message} \{{(.*?)^\}}", proto, re.M | re.S)
        if not body:
            return False
        field = re.search(rf"^\s+(?:optional |repeated )?([\w.<>, ]+?) {part} = ", body.group(1), re.M)
        if not field:
            return False
        if field.group(1).startswith("map<") or (message.startswith("Solver") and part == "parameters"):
            return True
        message = field.group(1).split(".")[-1]
    return True


def faults_of_command(tree, words):
    program = words[0]
    if re.match(r"build/(ci|release)/bin/", program):
        program = os.path.basename(program)
        if not os.path.exists(os.path.join(tree.programs, program)):
            yield f"no such program: {program}"
    for word in words[1:]:
        if word.startswith("--gtest_filter=") and not fnmatch.filter(tree.tests, word.split("=")[1]):
            yield f"no such test: {word}"
        if word.startswith("deploy/") and not tree.exists(word):
            yield f"no such file: {word}"
    if program == "bash":
        if not tree.exists(words[1]):
            yield f"no such script: {words[1]}"
        if (words[1],) in tree.helps:
            known = options_of(tree.helps[(words[1],)])
            yield from (f"{words[1]} has no {w}" for w in words[2:] if w.startswith("--") and w not in known)
        return
    if program == "cmake":
        presets = re.findall(r'"name": "(\w+)"', open(os.path.join(tree.root, "CMakePresets.json"), encoding="utf-8").read())
        lists = open(os.path.join(tree.root, "CMakeLists.txt"), encoding="utf-8").read()
        for i, word in enumerate(words):
            if word == "--preset" and words[i + 1] not in presets:
                yield f"no such preset: {words[i + 1]}"
            if word.startswith("-DSTRANDCAST") and word[2:].split("=")[0] not in lists:
                yield f"no such variable: {word}"
        return
    if not program.startswith("strandcast-"):
        if program not in OTHER_PROGRAMS and not os.path.exists(os.path.join(tree.programs, program)):
            yield f"unknown program: {program}"
        return
    if (program,) not in tree.helps:
        yield f"no such program: {program}"
        return
    keys = [(program,)]
    for word in words[1:]:
        if word == "--":
            keys.append(("strandcast-server",))
            break
        if word in ("fleet", "grid") and keys == [("strandcast-ctl",)]:
            keys.append((f"deploy/fleet/strandcast-{word}",))
        elif re.fullmatch(r"[a-z-]+", word) and not word.startswith("-") and (*keys[-1], word) in tree.helps:
            keys.append((*keys[-1], word))
    key = keys[-1]
    if program in ("strandcast-ctl", "strandcast-report") and len(keys) == 1:
        yield f"{program}: no command in: {' '.join(words)}"
    given = [w.split("=")[0] for w in words[1:] if re.match(r"--[a-z]", w)]
    options = options_of(*(tree.helps[k] for k in keys)) if given else set()
    yield from (f"{' '.join(key)} has no {option}" for option in given if option not in options)
    for i, word in enumerate(words[1:], 1):
        if "=" in word and words[i - 1] in ("--set", "set") and not field_exists(tree.proto, word.split("=")[0]):
            yield f"a scene has no {word.split('=')[0]}"


def check_commands(tree):
    for name in tree.matching(COMMAND_DOCUMENTS):
        for line in command_lines(tree.documents[name]):
            for part in re.split(r"&&|\|\||[;|](?![^'\"]*['\"])", line):
                words = shlex.split(part)
                if words:
                    yield from (f"{name}: {fault}" for fault in faults_of_command(tree, words))


def check_options_in_prose(tree):
    known = options_of(*tree.helps.texts.values()) | OTHER_OPTIONS  # of all commands that documents show with options
    for name in tree.matching(COMMAND_DOCUMENTS + ["ARCHITECTURE.md", "CHANGELOG.md", "proto/*.md"]):
        for span in re.findall(r"`([^`\n]+)`", tree.documents[name]):
            for option in re.findall(r"(?:^|[\s|\[])(--[a-z][a-z-]*)", span):
                if option not in known:
                    yield f"{name}: no program has {option} (in `{span}`)"


CHECKS = [check_sizes, check_means, check_long_sentences, check_words, check_links, check_references, check_paths, check_recipes, check_tests,
          check_code_map, check_commands, check_options_in_prose]

# A fault for each check: document, text that is there, and what a careless hand makes of it.
PLANTED = [
    (check_sizes, "README.md", "# Strandcast\n", "# Strandcast\n" + "A plain word. " * 600),
    (check_means, "README.md", "## Start\n", "## Start\n\n" + "word and " * 400 + "end.\n"),
    (check_long_sentences, "STYLE.md", "# Style", ("\n\n" + "word " * 26 + "end.") * 16 + "\n\n# Style"),
    (check_words, "README.md", "## Start\n", "## Start\n\nWhoever reads this.\n"),
    (check_links, "README.md", "(SECURITY.md)", "(SAFETY.md)"),
    (check_links, "README.md", "(SECURITY.md)", "(SECURITY.md#no-such-heading)"),
    (check_references, "client/app/view_options.cpp", "docs/use/try-it.md", "docs/use/tried-it.md"),
    (check_paths, "ARCHITECTURE.md", "`server/stream/stream_hub.h`", "`server/stream/stream_hubs.h`"),
    (check_recipes, "CONTRIBUTING.md", "`shaders/sim/NAME.comp`", "`shaders/sims/NAME.comp`"),
    (check_tests, "ARCHITECTURE.md", "`Roles.EveryMessageAndRole`", "`Roles.EveryMessageAndRoles`"),
    (check_tests, "ARCHITECTURE.md", "`Roles.EveryMessageAndRole`", ""),
    (check_tests, "SECURITY.md", "`ServerLimits.SessionsInAll`", "`ServerLimits.SessionsInSome`"),
    (check_code_map, "ARCHITECTURE.md", "| `chaos` |", "| `order` |"),
    (check_commands, "README.md", "deploy/run.sh --web", "deploy/run.sh --wed"),
    (check_commands, "README.md", "bash tests/run.sh", "bash tests/walk.sh"),
    (check_commands, "README.md", "set look.hair_color=red", "set look.hare_color=red"),
    (check_commands, "docs/use/try-it.md", "strandcast-ctl resume", "strandcast-ctl resurrect"),
    (check_commands, "docs/use/try-it.md", "feed --seconds 1 ", "feed --minutes 1 "),
    (check_commands, "docs/use/try-it.md", "    strandcast-view  ", "    strandcast-viewer  "),
    (check_commands, "CONTRIBUTING.md", "cmake --preset release", "cmake --preset fast"),
    (check_options_in_prose, "docs/use/try-it.md", "`--mode auto`", "`--mood auto`"),
]


def self_test(tree):
    missed = 0
    before = {}
    for check, name, right, wrong in PLANTED:
        texts = tree.documents if name in tree.documents else tree.sources
        kept = texts.get(name, "")
        if right not in kept:
            print(f"self-test: {name} no longer has {right!r}")
            missed += 1
            continue
        before.setdefault(check, set(check(tree)))
        texts[name] = kept.replace(right, wrong, 1)
        if not set(check(tree)) - before[check]:
            print(f"{check.__name__} does not find {wrong[:60]!r} in {name}")
            missed += 1
        texts[name] = kept
    for check in set(CHECKS) - {p[0] for p in PLANTED}:
        print(f"no fault is planted for {check.__name__}")
        missed += 1
    print(f"{len(PLANTED)} faults planted, {missed} not found")
    return missed


def main():
    tree = Tree(sys.argv[1], sys.argv[2])
    faults = [fault for check in CHECKS for fault in check(tree)]
    print("\n".join(faults))
    total = sum(len(t.encode()) for t in tree.documents.values())
    long = len(long_sentences(tree))
    means = ", ".join(f"{n} {sum(c) / len(c):.1f}" for n in PLAIN for c in [[k for k, _ in sentences(tree.documents[n])]])
    print(f"{len(tree.documents)} documents, {total} bytes; words a sentence: {means}; {long} over {LONG_WORDS} words (WIRE.md {FORMULA_WORDS}); {len(faults)} faults")
    sys.exit(1 if self_test(tree) or faults else 0)


if __name__ == "__main__":
    main()
