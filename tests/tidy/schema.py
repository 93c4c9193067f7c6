#!/usr/bin/env python3
"""Holds that a message or a number of a look is declared once: parts made from the .proto files are as those say, and in a
scratch copy a new message and a new number take at most four files by hand, and compile.

usage: schema.py SOURCE_FOLDER [ignored]
Prints a line per fault and ends with 1 if there are any. Each check has a counter-example, which must be found.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

MOST_FILES = 4
TOPS = ("proto", "common", "client", "server", "shaders", "tests/support", "SECURITY.md")

MESSAGE = {
    "proto/strandcast/v1/session.proto": [
        ("message ClientMessage {",
         "// Asks for toys.\nmessage ToyRequest {\n  string what = 1 [(is).text = \"kMaxNameChars\"];  // by name\n"
         "  uint32 toy_count = 2 [(is).range = \"1..9 toys\", (is).init = \"2\"];  // at once\n}\n\nmessage ClientMessage {"),
        ("    RecordCommand record_command", "    ToyRequest toy_request = 60 [(is).from = \"steers\"];\n    RecordCommand record_command"),
    ],
    "server/app/session_manager.cpp": [
        ("                        [](const auto&) {}},",
         "                        [&](const ToyRequest& toy) { net_->send(session, Notice{toy.toy_count > 1, toy.what}); },\n"
         "                        [](const auto&) {}},"),
    ],
    "tests/support/sample_messages.h": [("          RecordCommand{true, \"take 5\", \"12A\", 3}", "          ToyRequest{\"bear\", 3}, RecordCommand{true, \"take 5\", \"12A\", 3}")],
}
MESSAGE_SHOWS = {
    "common/wire/messages.h": ["struct ToyRequest {", "std::string what = {};  // by name", "uint32_t toy_count = 2;  // at once"],
    "common/wire/message_fields_private.h": ['kKind<ToyRequest> = "toy_request"', 'v.text("what", m.what, kMaxNameChars);',
                                             'v.number("toy_count", m.toy_count, Range{1, 9, "toys"});'],
    "server/net/roles.cpp": ['{"ToyRequest", Sender::Steers},'],
    "client/web/page/wire.ts": ["ToyRequest = { what: [1, 'string'], toy_count: [2, 'uint32'] }", "toy_request: [60, ToyRequest]"],
    "proto/WIRE.md": [", 60 ToyRequest, 28 RecordCommand |"],
}
MESSAGE_COMPILES = ["server/app/session_manager.cpp", "toy.cpp"]
# That the fields are walked as declared: a writer that knows two kinds of call.
TOY = """#include "common/wire/message_fields_private.h"
#include "tests/support/sample_messages.h"
struct Walk {
  int calls = 0;
  void text(const char*, std::string&, size_t) { ++calls; }
  void number(const char*, uint32_t&, const strandcast::scene_fields::Range&) { ++calls; }
};
int main() {
  strandcast::ToyRequest toy;
  Walk walk;
  strandcast::wire_fields::visit(walk, toy);
  return walk.calls;
}
"""

LOOK = {
    "proto/strandcast/v1/scene.proto": [
        ("  // 0 dry .. 1 dripping", "  optional float toy_glow = 60 [(is).range = \"0..2\", (is).init = \"0.25f\","
         " (is).shown = {section: \"Shading\" label: \"glow\"}];  // from within\n  // 0 dry .. 1 dripping"),
    ],
    "shaders/lib/hair_light.glsl": [("  return clamp(color * vec3(", "  color += vec3(look.toy_glow);\n  return clamp(color * vec3(")],
    "tests/support/sample_look.h": [("  look.exposure = 1.25f;", "  look.exposure = 1.25f;\n  look.shading.toy_glow = 0.75f;")],
}
LOOK_SHOWS = {
    "common/scene/scene_desc.h": ["float toy_glow = 0.25f;  // from within"],
    "common/scene/scene_fields.h": ['v.number("toy_glow", m.toy_glow, Range{0, 2, ""});'],
    "shaders/lib/hair_light.glsl": ["  float toy_glow;  // from within"],
    "common/render/look_lights.cpp": ["n.toy_glow = s.toy_glow;"],
    "common/render/tiles/light_lookup.h": ["look.toy_glow = n.toy_glow;"],
    "common/render/gl_tiles/tile_block.cpp": ["= look.toy_glow;"],
    "client/web/strand_picture.h": ["float shading_toy_glow;"],
    "client/web/strand_picture.cpp": ["look.shading.toy_glow = n.shading_toy_glow;"],
    "client/web/page/picture.ts": ["shading.toy_glow"],
    "client/web/page/wire.ts": ["toy_glow: [60, 'float']"],
    "client/web/page/fields.ts": ["'look.shading.toy_glow': [0, 2, '', 2, 'glow', false]"],
    "client/app/look_form.cpp": ['Shown{"shading.toy_glow", "Shading", "glow"'],
}
LOOK_COMPILES = ["common/render/look_lights.cpp", "common/render/gl_tiles/tile_block.cpp", "common/render/tiles/strand_shading.cpp", "toy.cpp"]
LOOK_TOY = '#include "tests/support/sample_look.h"\nint main() { return strandcast::sample_look().shading.toy_glow > 0.5f ? 0 : 1; }\n'

# Edits of session.proto that the generator must refuse, and what it must say.
REFUSED = [
    (" [(is).from = \"steers\"];\n    RecordCommand", ";\n    RecordCommand", "who may send"),
    ("  // at once", "", "no comment says what toy_count of ToyRequest means"),
    ("string what = 1 [(is).text = \"kMaxNameChars\"];", "string what = 1;", "text without a limit"),
]


def generate(root, *options):
    return subprocess.run([sys.executable, "-B", os.path.join(root, "proto/schema.py"), *options, root], capture_output=True, text=True)


def edit(root, edits):
    for file, changes in edits.items():
        path = os.path.join(root, file)
        text = open(path, encoding="utf-8").read()
        for old, new in changes:
            if text.count(old) < 1:
                raise SystemExit(f"tests/tidy/schema.py: {file} has no {old!r} any more")
            text = text.replace(old, new, 1)
        open(path, "w", encoding="utf-8").write(text)


def texts_of(root):
    """Text of each file that is not only marked parts, without those parts."""
    texts = {}
    for folder, _, files in os.walk(root):
        for file in files:
            if file.endswith((".h", ".cpp", ".ts", ".glsl", ".md", ".proto")):
                path = os.path.join(folder, file)
                text = open(path, encoding="utf-8").read()
                texts[os.path.relpath(path, root)] = re.sub(r"schema begin: .*?schema end", "", text, flags=re.S)
    return texts


def compile_faults(root, files):
    """What the compiler says of these files, as one unit: they share most of what they include."""
    unit = os.path.join(root, "unit.cpp")
    open(unit, "w", encoding="utf-8").write("".join(f'#include "{file}"\n' for file in files))
    command = [os.environ.get("CXX", "c++"), "-std=c++20", "-fsyntax-only", "-Wno-psabi", f"-I{root}", f"-I{root}/shaders", unit]
    run = subprocess.run(command, stderr=subprocess.PIPE, text=True)
    if run.returncode != 0:
        yield f"{files} do not compile: {run.stderr[:1500]}"


def copy_of(source, root):
    for top in TOPS:
        if os.path.isdir(os.path.join(source, top)):
            shutil.copytree(os.path.join(source, top), os.path.join(root, top))
        else:
            shutil.copy(os.path.join(source, top), os.path.join(root, top))


def try_addition(root, what, edits, shows, compiles, toy):
    """Faults of adding a message or number by these edits to a copy, and of the counter-examples."""
    before = texts_of(root)
    edit(root, edits)
    if generate(root, "--check").returncode == 0:
        yield f"{what}: --check did not see that a .proto file has changed"
    if what == "a message":
        yield from refusal_faults(root)
    run = generate(root)
    if run.returncode != 0:
        yield f"{what}: {run.stdout}{run.stderr}"
        return
    after = texts_of(root)
    by_hand = sorted(file for file in after if after[file] != before[file])
    if by_hand != sorted(edits):
        yield f"{what}: changed outside of the marked parts are {by_hand}"
    if len(by_hand) > MOST_FILES:
        yield f"{what} takes {len(by_hand)} files, at most {MOST_FILES} may be: {by_hand}"
    for file, parts in shows.items():
        text = open(os.path.join(root, file), encoding="utf-8").read()
        yield from (f"{what}: {file} has no {part!r}" for part in parts if part not in text)
    open(os.path.join(root, "toy.cpp"), "w", encoding="utf-8").write(toy)
    yield from compile_faults(root, compiles)
    # A part changed by hand is found.
    file = next(iter(shows))
    path = os.path.join(root, file)
    text = open(path, encoding="utf-8").read()
    open(path, "w", encoding="utf-8").write(text.replace("toy_", "joy_"))
    if generate(root, "--check").returncode == 0:
        yield f"{what}: --check did not see a change by hand in {file}"
    open(path, "w", encoding="utf-8").write(text)


def refusal_faults(root):
    path = os.path.join(root, "proto/strandcast/v1/session.proto")
    good = open(path, encoding="utf-8").read()
    for old, new, said in REFUSED:
        if old not in good:
            yield f"counter-example {old!r} does not apply"
        open(path, "w", encoding="utf-8").write(good.replace(old, new, 1))
        run = generate(root, "--check")
        if run.returncode == 0 or said not in run.stderr:
            yield f"{new!r} was not refused by a word about {said!r}: {run.stderr[-300:]}"
    open(path, "w", encoding="utf-8").write(good)


def recipe_faults(source):
    """Recipes of CONTRIBUTING.md for these two list at most four files each."""
    text = open(os.path.join(source, "CONTRIBUTING.md"), encoding="utf-8").read()
    for title in ("A message", "A look field"):
        recipe = re.search(rf"^### {title}.*?(?=^###)", text, re.S | re.M)[0]
        items = "\n".join(line for line in recipe.split("\n") if line.startswith("- "))
        files = {name for name in re.findall(r"`([^`\s]+)`", items) if "." in name}
        if not 1 < len(files) <= MOST_FILES:
            yield f"CONTRIBUTING.md: the recipe '{title}' has {len(files)} files"


def main():
    if len(sys.argv) < 2:
        print(__doc__.strip(), file=sys.stderr)
        return 2
    source = sys.argv[1]
    run = generate(source, "--check")
    faults = [line for line in (run.stdout + run.stderr).splitlines()] if run.returncode != 0 else []
    faults += recipe_faults(source)
    with tempfile.TemporaryDirectory() as root:
        copy_of(source, root)
        faults += try_addition(root, "a message", MESSAGE, MESSAGE_SHOWS, MESSAGE_COMPILES, TOY)
        faults += try_addition(root, "a number of a look", LOOK, LOOK_SHOWS, LOOK_COMPILES, LOOK_TOY)
    for fault in faults:
        print(fault)
    print(f"{len(MESSAGE)} files for a message, {len(LOOK)} for a number of a look; {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
