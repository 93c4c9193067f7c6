#!/usr/bin/env python3
"""Writes what follows from the .proto files into the files that have it: the parts between "schema begin: NAME" and
"schema end". Comments, limits, names and first values come from the .proto files and their options (options.proto).

usage: schema.py [--check] SOURCE_FOLDER
Needs protoc (protobuf-compiler). Rewrites the parts that are others and prints their files; with --check it writes nothing,
and ends with 1 if there are any.
"""
import os
import re
import struct
import subprocess
import sys
import tempfile

FILES = ["options", "input", "scene", "session"]
WIDTH = 110        # of C++
PAGE_WIDTH = 120   # of scripts, shaders


# ---- descriptors: what protoc says of the files, decoded by their own descriptions (descriptor.proto)

DOUBLE, FLOAT, INT64, UINT64, INT32, FIXED64, FIXED32, BOOL, STRING, GROUP, MESSAGE, BYTES, UINT32, ENUM, SFIXED32, SFIXED64 = \
    range(1, 17)
SCALARS = {DOUBLE: "double", FLOAT: "float", UINT64: "uint64", UINT32: "uint32", FIXED32: "fixed32", SFIXED64: "sfixed64",
           BOOL: "bool", STRING: "string", ENUM: "enum"}


def varint(data, at):
    value = shift = 0
    while True:
        value |= (data[at] & 0x7f) << shift
        at, shift = at + 1, shift + 7
        if data[at - 1] < 0x80:
            return value, at


def read_fields(data):
    """Field number to the list of its values, as numbers or bytes."""
    fields, at = {}, 0
    while at < len(data):
        tag, at = varint(data, at)
        kind = tag & 7
        if kind == 0:
            value, at = varint(data, at)
        elif kind == 2:
            size, at = varint(data, at)
            value, at = data[at:at + size], at + size
        else:
            size = 8 if kind == 1 else 4
            value, at = data[at:at + size], at + size
        fields.setdefault(tag >> 3, []).append(value)
    return fields


def packed(data):
    numbers, at = [], 0
    while at < len(data):
        value, at = varint(data, at)
        numbers.append(value)
    return numbers


def text_of(fields, number):
    return fields[number][0].decode() if number in fields else ""


class Field:
    def __init__(self, data, comment):
        fields = read_fields(data)
        self.name = text_of(fields, 1)
        self.extended = text_of(fields, 2)
        self.number = fields[3][0]
        self.is_repeated = fields[4][0] == 3
        self.type = fields[5][0]
        self.type_name = text_of(fields, 6).rsplit(".", 1)[-1]
        self.options = fields.get(8, [b""])[0]
        self.comment = comment
        self.rule = {}

    def scalar(self):
        return SCALARS[self.type]


class Message:
    def __init__(self, data, comments, path):
        fields = read_fields(data)
        self.name = text_of(fields, 1)
        self.comment = comments.get(path, "")
        self.more = comments.get(path + ("more",), "")  # further paragraphs
        self.fields = [Field(one, comments.get(path + (2, i), "")) for i, one in enumerate(fields.get(2, []))]
        self.options = fields.get(7, [b""])[0]


class Enum:
    def __init__(self, data, comments, path):
        fields = read_fields(data)
        self.name = text_of(fields, 1)
        self.comment = comments.get(path, "")
        self.values = []
        prefix = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", self.name).upper() + "_"
        for i, one in enumerate(fields.get(2, [])):
            value = read_fields(one)
            self.values.append((text_of(value, 1).removeprefix(prefix), value.get(2, [0])[0], comments.get(path + (2, i), "")))
        self.options = fields.get(3, [b""])[0]


class Schema:
    """All messages and enums by name, in the order of their files."""

    def __init__(self, descriptor_set):
        self.messages, self.enums, self.limits = {}, {}, []
        extensions, file_options = [], []
        for data in read_fields(descriptor_set)[1]:
            fields = read_fields(data)
            if not text_of(fields, 1).startswith("strandcast/"):
                continue
            comments = read_comments(fields)
            for i, one in enumerate(fields.get(4, [])):
                message = Message(one, comments, (4, i))
                self.messages[message.name] = message
            for i, one in enumerate(fields.get(5, [])):
                enum = Enum(one, comments, (5, i))
                self.enums[enum.name] = enum
            extensions += [Field(one, "") for one in fields.get(7, [])]
            file_options += fields.get(8, [])
        for kind in ("FileOptions", "MessageOptions", "EnumOptions", "FieldOptions"):
            known = [one for one in extensions if one.extended.endswith(kind)]
            if kind == "FileOptions":
                for one in file_options:
                    self.limits += self.decode(one, known).get("limit", [])
            for message in self.messages.values():
                if kind == "MessageOptions":
                    message.options = self.decode(message.options, known)
                if kind == "FieldOptions":
                    for field in message.fields:
                        field.rule = self.decode(field.options, known).get("is", {})
            if kind == "EnumOptions":
                for enum in self.enums.values():
                    enum.options = self.decode(enum.options, known)

    def decode(self, data, known):
        """Options by name, nested ones too."""
        result, fields = {}, read_fields(data)
        for field in known:
            values = [self.value(field, one) for one in fields.get(field.number, [])]
            if not values:
                continue
            if field.is_repeated:
                result[field.name] = values
            elif field.type == MESSAGE:  # written option by option
                result[field.name] = {key: value for one in values for key, value in one.items()}
            else:
                result[field.name] = values[-1]
        return result

    def value(self, field, value):
        if field.type == MESSAGE:
            return self.decode(value, self.messages[field.type_name].fields)
        if field.type == STRING:
            return value.decode()
        if field.type == DOUBLE:
            return struct.unpack("<d", value)[0]
        return bool(value) if field.type == BOOL else value

    def cpp_name(self, message):
        return message.options.get("cpp", message.name)

    def sorted_fields(self, message):
        return sorted(message.fields, key=lambda field: field.rule.get("place", field.number)) \
            if any("place" in field.rule for field in message.fields) else message.fields

    def kinds(self, envelope):
        """Kinds of message of one side, with the field of each."""
        return [(field, self.messages[field.type_name]) for field in self.messages[envelope].fields]

    def parts(self, names):
        """Messages that these are made of and themselves, each after its own parts."""
        found = []
        def walk(name):
            if name in found:
                return
            for field in self.messages[name].fields:
                if field.type == MESSAGE and name != field.type_name:
                    walk(field.type_name)
            found.append(name)
        for name in names:
            walk(name)
        return [self.messages[name] for name in found]


def read_comments(file_fields):
    """Path of a declaration to its comment as one line: what follows it on its line, else what stands above."""
    comments = {}
    for info in file_fields.get(9, []):
        for location in read_fields(info).get(1, []):
            fields = read_fields(location)
            text = text_of(fields, 4) or text_of(fields, 3)
            if text:
                path = tuple(packed(fields[1][0]))
                paragraphs = re.split(r"\n *\n", text)
                comments[path] = " ".join(paragraphs[0].split())
                comments[path + ("more",)] = " ".join(" ".join(paragraphs[1:]).split())
    return comments


def load_schema(root):
    with tempfile.TemporaryDirectory() as folder:
        target = os.path.join(folder, "set")
        subprocess.run([os.environ.get("PROTOC", "protoc"), f"--proto_path={os.path.join(root, 'proto')}", "--include_source_info",
                        "--include_imports", f"--descriptor_set_out={target}"] +
                       [f"strandcast/v1/{name}.proto" for name in FILES], check=True)
        with open(target, "rb") as file:
            return Schema(file.read())


# ---- words

def pascal(words):
    return "".join(word.capitalize() for word in words.split("_"))


def camel(words):
    return words.lower() if "_" not in words else pascal(words)[0].lower() + pascal(words)[1:]


def number_text(value, type_name):
    if type_name == "double":
        text = f"{value:.1f}"
        return re.sub(r"(?<=\d)(?=(\d{3})+\.)", "'", text) if value >= 1e4 else text
    text = str(int(value))
    return re.sub(r"(?<=\d)(?=(\d{3})+$)", "'", text) if value >= 1e4 else text


def range_of(text):
    """("0", "kMaxBanS", "s") of "0..kMaxBanS s"; None for the name of a range."""
    match = re.fullmatch(r"(\S+?)\.\.(\S+)(?: (.+))?", text)
    return match and (match[1], match[2], match[3] or "")


def cpp_range(text, scope="scene_fields::"):
    parts = range_of(text)
    return f'Range{{{parts[0]}, {parts[1].replace("-1", " - 1")}, "{parts[2]}"}}' if parts else scope + text


def commented(code, comment, indent=2, mark="//"):
    """Code with its comment: on the same line where there is room, else above."""
    if not comment:
        return [code]
    if len(code) + len(comment) + 5 <= WIDTH:
        return [f"{code}  {mark} {comment}"]
    lines, line = [], " " * indent + mark
    for word in comment.split():
        if len(line) + 1 + len(word) > WIDTH:
            lines.append(line)
            line = " " * indent + mark
        line += " " + word
    return lines + [line, code]


def wrapped(items, indent, width, end="", separator=", "):
    """Items, separated, in as few lines as fit."""
    lines, line = [], indent
    for i, item in enumerate(items):
        part = item + (separator if i + 1 < len(items) else end)
        if len((line + part).rstrip()) > width and line != indent:
            lines.append(line.rstrip())
            line = indent
        line += part
    return lines + [line.rstrip()]


def hanging(items, head, end, width=WIDTH):
    """Items behind a head; further lines begin below the first item."""
    lines = wrapped(items, " " * len(head), width, end)
    return [head + lines[0].strip()] + lines[1:]


# ---- structs of C++

CPP_TYPES = {"double": ("double", "0.0"), "float": ("float", "0.0f"), "uint64": ("uint64_t", "0"), "uint32": ("uint32_t", "0"),
             "fixed32": ("uint32_t", "0"), "sfixed64": ("int64_t", "0"), "bool": ("bool", "false"), "string": ("std::string", "")}


def enumerators(enum):
    """Those that say something: names and numbers."""
    return [(name, number, comment) for name, number, comment in enum.values if name != "UNSPECIFIED"]


def member(schema, field):
    init = field.rule.get("init")
    if field.type == MESSAGE:
        kind = {"Vec3": "glm::vec3", "Color": "glm::vec3"}.get(field.type_name) or \
            schema.cpp_name(schema.messages[field.type_name])
        usual = "{0.0f}" if kind == "glm::vec3" else "{}" if kind == "Timecode" else ""
        kind = "std::optional<Timecode>" if kind == "Timecode" else kind
    elif field.type == ENUM:
        kind = field.type_name
        usual = f"{kind}::{init or pascal(enumerators(schema.enums[kind])[0][0])}"
        init = None
    else:
        kind, usual = CPP_TYPES[field.scalar()]
        kind = field.rule.get("as", kind)
    if field.is_repeated:
        return f"std::vector<{kind}> {field.name} = {{}};"
    value = init or usual
    if value.startswith("{"):
        return f"{kind} {field.name}{value};"
    if not value and kind == "std::string":
        value = "{}"
    return f"{kind} {field.name} = {value};" if value else f"{kind} {field.name};"


def struct_lines(schema, message, within=()):
    lines = commented(f"struct {schema.cpp_name(message)} {{", message.comment, 0, "///")
    if message.comment and len(lines) == 1:
        lines = [f"/// {message.comment}", f"struct {schema.cpp_name(message)} {{"]
    for inner in within:
        lines += ["  " + line for line in struct_lines(schema, inner)]
    for field in schema.sorted_fields(message):
        lines += commented("  " + member(schema, field), field.comment)
    if message.name == "Look":  # copied and taken apart in many files, which need no copy of that code
        lines += ["  LookDesc();", "  LookDesc(const LookDesc&);", "  LookDesc(LookDesc&&) noexcept;",
                  "  LookDesc& operator=(const LookDesc&);", "  LookDesc& operator=(LookDesc&&) noexcept;", "  ~LookDesc();",
                  "  bool operator==(const LookDesc&) const;"]
    else:
        lines.append(f"  bool operator==(const {schema.cpp_name(message)}&) const = default;")
    return lines + ["};"]


def structs_of(schema, names):
    lines = []
    parts = schema.parts(names)
    for message in parts:
        if message.options.get("elsewhere") or message.options.get("inside"):
            continue
        lines += struct_lines(schema, message, [one for one in parts if one.options.get("inside") == message.name])
    return lines


def message_limits(schema):
    lines = []
    for limit in schema.limits:
        code = f"inline constexpr {limit['type']} {limit['name']} = {number_text(limit['value'], limit['type'])};"
        lines += commented(code, limit.get("note", ""), 0)
    return lines


SCENE_PARTS = {"Look", "Camera", "StrandStyle", "HairShading", "RenderMethods", "Vec3", "Color"}


def message_structs(schema):
    lines = []
    for enum in schema.enums.values():
        if not enum.options.get("is_elsewhere"):
            lines += hanging([pascal(name) for name, _, _ in enumerators(enum)], f"enum class {enum.name} {{ ", " };")
    for side in ("ClientMessage", "ServerMessage"):
        kinds = [message for _, message in schema.kinds(side)]
        parts = schema.parts([message.name for message in kinds])
        if side == "ServerMessage":
            parts = [message for message in parts if message.name != "CameraChange"]
        for message in parts:
            if message.name in SCENE_PARTS or message.options.get("elsewhere") or message.options.get("inside"):
                continue
            lines += struct_lines(schema, message, [one for one in parts if one.options.get("inside") == message.name])
        lines += [f"using {side} ="] + hanging([schema.cpp_name(message) for message in kinds], "    std::variant<", ">;")
    return lines


# ---- fields of C++: what readers and writers walk

def check_lines(field, owner, indent="  "):
    rule = field.rule.get("check")
    if not rule:
        return []
    function, sentence = rule.split(": ", 1)
    shown = sentence if re.fullmatch(r"k[A-Z]\w*", sentence) else f'"{sentence}"'
    return call_lines(f'v.require("{field.name}", {function}({owner}.{field.name}), {shown});', indent)


def call_lines(code, indent="  "):
    if len(indent + code) <= WIDTH:
        return [indent + code]
    head, rest = code.split("(", 1)
    return hanging(re.split(r', (?=v|m\.|one\.|part\.|k[A-Z]|[a-z_]+\(|"|Range)', rest[:-2]), indent + head + "(", ");")


def field_lines(schema, field, owner, scope, indent="  "):
    """The call of a visitor for one field of `owner`."""
    name, rule, place = field.name, field.rule, f"{owner}.{field.name}"
    quoted = f'"{name}"'
    if field.is_repeated and field.type == STRING:
        return call_lines(f"v.names({quoted}, {place}, {rule['count']}, {rule['each']});", indent)
    if field.is_repeated:
        inner = schema.messages[field.type_name]
        kind = (inner.options["inside"] + "::" if "inside" in inner.options else "") + schema.cpp_name(inner)
        element = "one" if owner == "m" else "part"
        lines = [f"{indent}v.repeated({quoted}, {place}, {rule['count']}, [&]({kind}& {element}) {{"]
        for part in schema.sorted_fields(inner):
            lines += field_lines(schema, part, element, scope, indent + "  ")
        return lines + [indent + "});"]
    if field.type == MESSAGE and field.type_name in ("Vec3", "Color"):
        kind = "vector" if field.type_name == "Vec3" else "color"
        return call_lines(f"v.{kind}({quoted}, {place}, {cpp_range(rule['range'], scope)});", indent) + \
            check_lines(field, owner, indent)
    if field.type == MESSAGE and field.type_name == "Timecode":
        return [f"{indent}v.timecode({quoted}, {place});"]
    if field.type == MESSAGE:
        inner = schema.messages[field.type_name]
        visit = {"Look": "visit_look", "Camera": "visit_camera", "StrandStyle": "visit_style", "HairShading": "visit_shading",
                 "RenderMethods": "visit_methods"}[inner.name]
        return [f"{indent}v.group({quoted}, [&] {{ {scope}{visit}(v, {place}); }});"]
    if field.type == ENUM:
        enum = schema.enums[field.type_name]
        known = enumerators(enum)
        last = rule.get("last", pascal(known[-1][0]))
        first = ", kBehindNone" if known[0][1] == 1 else ""
        return [f"{indent}v.choice({quoted}, {place}, {enum.name}::{last}{first});"]
    for kind in ("text", "exact", "secret"):
        if kind in rule:
            call = {"text": "text", "exact": "exact_text", "secret": "secret"}[kind]
            return call_lines(f"v.{call}({quoted}, {place}, {rule[kind]});", indent) + check_lines(field, owner, indent)
    if "range" in rule:
        return call_lines(f"v.number({quoted}, {place}, {cpp_range(rule['range'], scope)});", indent)
    if "side" in rule:
        return [f"{indent}v.side({quoted}, {place}, {scope}{rule['side']});"]
    if rule.get("measure"):
        return [f"{indent}v.measure({quoted}, {place});"]
    if field.type == STRING:
        raise SystemExit(f"schema.py: {name} is text without a limit")
    return [f"{indent}v.value({quoted}, {place});"]


def message_fields(schema):
    lines, done = [], set()
    for side in ("ClientMessage", "ServerMessage"):
        for kind, message in schema.kinds(side):
            if message.name in done:
                continue
            done.add(message.name)
            name = schema.cpp_name(message)
            lines += ["template <>", f'inline constexpr const char* kKind<{name}> = "{kind.name}";']
            if message.options.get("elsewhere"):
                continue
            is_empty = not message.fields
            lines += ["template <class Visitor>", f"void visit(Visitor&{'' if is_empty else ' v'}, {name}&{'' if is_empty else ' m'}) {{"]
            for field in schema.sorted_fields(message):
                lines += field_lines(schema, field, "m", "scene_fields::")
            lines.append("}")
    return lines


def look_fields(schema):
    lines = []
    for name, visit in (("StrandStyle", "visit_style"), ("HairShading", "visit_shading"), ("Look", "visit_look"),
                        ("Camera", "visit_camera")):
        message = schema.messages[name]
        lines += ["template <class Visitor>", f"void {visit}(Visitor& v, {schema.cpp_name(message)}& m) {{"]
        for field in schema.sorted_fields(message):
            lines += field_lines(schema, field, "m", "")
        lines.append("}")
    return lines


def sender_table(schema):
    names = {"first": "First", "anyone": "Anyone", "watches": "Watches", "steers": "Steers", "feeds": "Feeds", "admin": "Admin"}
    for field, message in schema.kinds("ClientMessage"):
        if field.rule.get("from") not in names:
            raise SystemExit(f"schema.py: {message.name} does not say who may send it: (is).from")
    rows = [f'    {{"{message.name}", Sender::{names[field.rule["from"]]}}},' for field, message in schema.kinds("ClientMessage")]
    return ["constexpr Kind kKinds[] = {"] + rows + ["};"]


def enum_names(schema):
    lines = []
    for enum in schema.enums.values():
        if not enum.options.get("has_names"):
            continue
        lines += [f"const char* to_string({enum.name} value) {{", "  switch (value) {"]
        for name, _, _ in enumerators(enum):
            lines += [f"    case {enum.name}::{pascal(name)}:", f'      return "{name.lower()}";']
        lines += ["  }", '  return "unknown";', "}"]
    return lines


# ---- the page

def page_tables(schema):
    """Messages that a page sends or gets: not those that only a source sends."""
    kinds = [field for field in schema.messages["ClientMessage"].fields if field.rule.get("from") != "feeds"]
    parts = schema.parts([field.type_name for field in kinds] + ["ServerMessage"])
    lines, names = [], []
    def table(name, fields):
        entries = []
        for field in fields:
            kind = field.type_name if field.type == MESSAGE else f"'{field.scalar()}'"
            entries.append(f"{field.name}: [{field.number}, {kind}{', ' + chr(39) + 'repeated' + chr(39) if field.is_repeated else ''}]")
        names.append(name)
        one = f"export const {name} = {{ {', '.join(entries)} }} as const;"
        if len(one) <= PAGE_WIDTH:
            lines.append(one if entries else f"export const {name} = {{}} as const;")
        else:
            lines.extend([f"export const {name} = {{"] + wrapped(entries, "  ", PAGE_WIDTH, ",") + ["} as const;"])
    for message in parts:
        if message.name == "ServerMessage":
            table("ClientMessage", kinds)
        table(message.name, message.fields)
    lines += ["/** By the names of the .proto files, for the test. */", "export const schemas: { readonly [name: string]: Schema } = {"]
    lines += wrapped(names, "  ", PAGE_WIDTH, ",") + ["};"]
    for enum in schema.enums.values():
        if enum.options.get("script"):
            values = ", ".join(f"{camel(name)}: {number}" for name, number, _ in enumerators(enum))
            lines.append(f"export const {enum.options['script']} = {{ {values} }} as const;")
    return lines


# ---- the look: one block of numbers for C++, shaders and the page's module

def look_numbers(schema):
    """(path, parts, field) of every number of a look in the order of the page's block: by number, groups in their place."""
    numbers = []
    look = schema.messages["Look"]
    for field in sorted(look.fields, key=lambda one: one.type == MESSAGE and one.type_name not in ("Vec3", "Color")):
        if field.type == MESSAGE and field.type_name in ("Vec3", "Color"):
            numbers.append((field.name, 3, field))
        elif field.type in (FLOAT, UINT32):
            numbers.append((field.name, 1, field))
        elif field.type == MESSAGE and not schema.messages[field.type_name].options.get("elsewhere"):
            numbers += [(f"{field.name}.{part.name}", 1, part) for part in schema.messages[field.type_name].fields]
    return numbers


def block_struct(schema):
    """StrandPictureLook."""
    numbers, lines, at = look_numbers(schema), [], 0
    for path, parts, _ in numbers:
        lines.append(f"  float {path.replace('.', '_')}{'[3]' if parts == 3 else ''};  // {at}")
        at += parts
    return ["struct StrandPictureLook {"] + lines + ["};", f"static_assert(sizeof(StrandPictureLook) == {at} * sizeof(float));"]


def block_reader(schema):
    """LookDesc from the numbers of a StrandPictureLook."""
    lines = ["/// Sets the numbers of a look. Counts that are no numbers within their limits become the nearest limit.",
             "void set_numbers(LookDesc& look, const StrandPictureLook& n) {"]
    for path, parts, field in look_numbers(schema):
        source = "n." + path.replace(".", "_")
        if parts == 3:
            lines.append(f"  look.{path} = {{{source}[0], {source}[1], {source}[2]}};")
        elif field.type == UINT32:
            low, high, _ = range_of(field.rule["range"])
            lines.append(f"  look.{path} = count({source}, {low}, {high});")
        else:
            lines.append(f"  look.{path} = {source};")
    return lines + ["}"]


def block_writer(schema):
    """The page's numbers of a look."""
    entries, count = [], 0
    for path, parts, field in look_numbers(schema):
        value = f"look.{path}" if "." not in path else path
        entries.append(f"...{'rgb' if field.type_name == 'Color' else 'xyz'}(look.{path})" if parts == 3 else value)
        count += parts
    return [f"const LOOK_FLOATS = {count};", "type Style = Message<typeof StrandStyle>;", "type Shading = Message<typeof HairShading>;",
            "function numbersOf(look: LookMessage, style: Style, shading: Shading): number[] {", "  return ["] + wrapped(entries, "    ", PAGE_WIDTH, ",") + ["  ];", "}"]


def law_numbers(schema):
    """(name in shaders, name in ShadingNumbers, name in HairShading, is an angle) of each number of the shading."""
    for field in schema.messages["HairShading"].fields:
        law = field.rule.get("law", field.name)
        is_angle = field.name.endswith("_deg")
        yield law, law + ("_rad" if is_angle else ""), field.name, is_angle, field.comment


def glsl_look(schema):
    lines = ["struct HairLook {", "  vec3 root_color;", "  vec3 tip_color;"]
    for law, _, _, is_angle, comment in law_numbers(schema):
        note = ", ".join(filter(None, [comment, "rad" if is_angle else ""]))
        lines.append(f"  float {law};" + (f"  // {note}" if note else ""))
    return lines + ["};"]


def block_places(schema):
    """Number of vectors, and the place of each number in them."""
    laws = list(law_numbers(schema))
    return (len(laws) + 3) // 4, [f"[{i // 4}].{'xyzw'[i % 4]}" for i in range(len(laws))]


def glsl_block(schema):
    count, _ = block_places(schema)
    return [f"  vec4 shading[{count}];     // numbers of HairLook in their order, from diffuse on"]


def glsl_frame_look(schema):
    _, places = block_places(schema)
    items = ["u_frame.root_color.rgb", "u_frame.tip_color.rgb"] + [f"u_frame.shading{place}" for place in places]
    return ["HairLook frame_look() {"] + hanging(items, "  return HairLook(", ");", PAGE_WIDTH) + ["}"]


def cpp_shading_numbers(schema):
    return [f"  float {name} = 0.0f;" for _, name, _, _, _ in law_numbers(schema)]


def cpp_shading_block(schema):
    count, _ = block_places(schema)
    return [f"  glm::vec4 shading[{count}];"]


def cpp_set_shading(schema):
    return [f"  n.{name} = " + (f"glm::radians(s.{field});" if is_angle else f"s.{field};")
            for _, name, field, is_angle, _ in law_numbers(schema)]


def cpp_hair_look(schema):
    return [f"  look.{law} = n.{name};" for law, name, _, _, _ in law_numbers(schema)]


def cpp_fill_block(schema):
    _, places = block_places(schema)
    return [f"  block.shading{place} = look.{name};" for place, (_, name, _, _, _) in zip(places, law_numbers(schema))]


def shown_table(schema):
    rows = []
    for prefix, message in (("", "Look"), ("style.", "StrandStyle"), ("shading.", "HairShading")):
        for field in schema.sorted_fields(schema.messages[message]):
            shown = field.rule.get("shown")
            if shown:
                items = [f'"{prefix}{field.name}"', f'"{shown["section"]}"', f'"{shown.get("label", "")}"',
                         repr(shown.get("handy", 0.0))] + ([f'"{shown["help"]}"'] if "help" in shown else [])
                rows += hanging(items, "    Shown{", "},")
    return ["constexpr std::array kShown{"] + rows + ["};"]


def main_only(schema):
    """Paths of the fields of a look that only the main method of drawing knows."""
    paths = []
    for field in schema.sorted_fields(schema.messages["Look"]):
        inner = schema.messages[field.type_name].fields if field.type == MESSAGE and field.type_name not in ("Vec3", "Color") else []
        paths += [f"{field.name}.{part.name}" for part in inner if field.rule.get("main_only") or part.rule.get("main_only")]
        if not inner and field.rule.get("main_only"):
            paths.append(field.name)
    return hanging([f'"{path}"' for path in paths], f"constexpr std::array<std::string_view, {len(paths)}> kMainOnly{{", "};")


def page_ranges(schema):
    """[least, most, unit, most that a slider reaches, label] of each number of a look, by its path."""
    lines = []
    for prefix, message in (("", "Look"), ("style.", "StrandStyle"), ("shading.", "HairShading")):
        for field in schema.sorted_fields(schema.messages[message]):
            if field.type not in (FLOAT, UINT32):
                continue
            low, high, unit = range_of(field.rule["range"])
            shown = field.rule.get("shown", {})
            label = shown.get("label") or re.sub(r"_(m|deg|rad)$", "", field.name).replace("_", " ")
            handy = f"{shown['handy']:g}" if "handy" in shown else high
            is_whole = "true" if field.type == UINT32 else "false"
            lines.append(f"  'look.{prefix}{field.name}': [{low}, {high}, '{unit}', {handy}, '{label}', {is_whole}],")
    return ["const lookNumbers: { readonly [path: string]: readonly [number, number, string, number, string, boolean] } = {"] + \
        lines + ["};"]


# ---- documents

def check_words(schema, message):
    """Refuses a field that neither its own comment nor that of its message explains."""
    said = " ".join(part.comment + " " + part.more for part in schema.parts([message.name]))
    for part in schema.parts([message.name]):
        for field in part.fields:
            if part.name not in SCENE_PARTS and not field.comment and not re.search(rf"\b{field.name}\b", said):
                raise SystemExit(f"schema.py: no comment says what {field.name} of {part.name} means")


def wire_list(schema):
    """Number and name of each kind of message by who sends it; what a field means stands beside it in its .proto file."""
    senders = {}
    for envelope in ("ClientMessage", "ServerMessage"):
        for field, message in schema.kinds(envelope):
            check_words(schema, message)
            sender = field.rule.get("from", "") if envelope == "ClientMessage" else "the server"
            senders.setdefault(sender, []).append(f"{field.number} {message.name}")
    return ["| from | messages, with their numbers in the envelope |", "|---|---|"] + \
        [f"| {sender} | {', '.join(kinds)} |" for sender, kinds in senders.items()]


# Name of a part to what makes it.
PARTS = {
    "limits": message_limits, "messages": message_structs, "message fields": message_fields, "senders": sender_table,
    "names": enum_names, "page tables": page_tables,
    "look": lambda schema: structs_of(schema, ["Look"]), "camera": lambda schema: structs_of(schema, ["Camera"]),
    "look fields": look_fields, "look form": shown_table, "page ranges": page_ranges, "main only": main_only,
    "messages by sender": wire_list,
    "look block": block_struct, "look block reader": block_reader, "look block writer": block_writer,
    "shader look": glsl_look, "shader block": glsl_block, "shader block reader": glsl_frame_look,
    "shading numbers": cpp_shading_numbers, "shading block": cpp_shading_block, "set shading": cpp_set_shading,
    "hair look": cpp_hair_look, "fill block": cpp_fill_block,
}
MARKED = ("proto", "common", "client", "server", "shaders", "SECURITY.md")
ENDINGS = (".h", ".cpp", ".ts", ".glsl", ".md")


def marked_files(root):
    for top in MARKED:
        path = os.path.join(root, top)
        if os.path.isfile(path):
            yield path
        for folder, _, files in os.walk(path):
            for file in sorted(files):
                if file.endswith(ENDINGS):
                    yield os.path.join(folder, file)


def renewed(schema, path, text, used):
    """The text with its parts as the schema has them."""
    def replace(match):
        name = match[2]
        if name not in PARTS:
            raise SystemExit(f"schema.py: {path} has a part '{name}', which nothing makes")
        used.add(name)
        return match[1] + "\n".join(PARTS[name](schema)) + "\n" + match[3]
    mark = r"((?://|<!--) schema begin: ([\w ]+?)(?: -->)?\n(?:[ \t]*// clang-format off\n)?).*?((?:[ \t]*// clang-format on\n)?[ \t]*(?://|<!--) schema end)"
    return re.sub(mark, replace, text, flags=re.S)


def main():
    arguments = sys.argv[1:]
    is_check = arguments[:1] == ["--check"]
    if len(arguments) != 1 + is_check:
        print(__doc__.strip(), file=sys.stderr)
        return 2
    root = arguments[-1]
    schema, others, used = load_schema(root), [], set()
    for path in marked_files(root):
        with open(path, encoding="utf-8") as file:
            text = file.read()
        if "schema begin: " not in text:
            continue
        new = renewed(schema, path, text, used)
        if new == text:
            continue
        others.append(os.path.relpath(path, root))
        if not is_check:
            with open(path, "w", encoding="utf-8") as file:
                file.write(new)
    for name in sorted(set(PARTS) - used):
        print(f"schema.py: no file has the part '{name}'")
    for path in others:
        print(f"{path}: {'is not as the .proto files say: python3 proto/schema.py .' if is_check else 'renewed'}")
    return 1 if used != set(PARTS) or (is_check and others) else 0


if __name__ == "__main__":
    sys.exit(main())
