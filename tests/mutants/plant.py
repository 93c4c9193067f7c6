"""Plants one-line faults in a C++ source, each with a number, so that the source is compiled once for all of them.

A fault replaces one statement, condition or returned value. The text that `planted` returns asks `mutant_is(N)` (switch.h) which
fault is on. Bodies of functions are planted; constexpr functions, templates' headers, preprocessor lines and statements that hold a
brace are left alone. Faults that do not compile are the caller's to leave out.
"""
import re

TOKEN = re.compile(r'''
    (?P<gap>\s+|//[^\n]*|/\*.*?\*/)
  | (?P<hash>^[ \t]*\#(?:[^\n]*\\\n)*[^\n]*)
  | (?P<text>(?:u8|[uUL])?R"(?P<mark>[^(\s]*)\(.*?\)(?P=mark)"|(?:u8|[uUL])?"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])+')
  | (?P<number>(?:\d|\.\d)(?:[eEpP][+-]|[\w.']|)*)
  | (?P<word>[A-Za-z_]\w*)
  | (?P<sign><=>|->\*|<<=|>>=|\.\.\.|::|->|\+\+|--|<<|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=|[-+*/%&|^~!<>=?:;,.(){}\[\]])
''', re.X | re.S | re.M)
# What stands instead of an operator that has a space on either side, as binary ones have.
OPERATORS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "&&": "||", "||": "&&", "+": "-", "-": "+",
             "*": "/", "/": "*", "%": "*", "+=": "-=", "-=": "+=", "*=": "/=", "/=": "*="}
WORDS = {"true": "false", "false": "true", "min": "max", "max": "min"}
LEFT_ALONE = {"using", "static_assert", "typedef", "break", "continue", "goto", "case", "default", "throw", "constexpr", "static",
              "template", "struct", "class", "enum", "delete", "co_return", "thread_local", "else", "do", "try", "extern"}
MOST_OF_A_STATEMENT = 8


class Fault:
    """A fault: its number, the line where it stands, what it does in words."""

    def __init__(self, number, line, sentence):
        self.number, self.line, self.sentence = number, line, sentence


class Token:
    """A piece of the source: kind, text, its place, and whether a gap stands before and after it."""

    def __init__(self, kind, text, begin, spaced):
        self.kind, self.text, self.begin, self.end, self.spaced_before, self.spaced_after = kind, text, begin, begin + len(text), spaced, False


def tokens_of(text):
    found, spaced, place = [], True, 0
    while place < len(text):
        match = TOKEN.match(text, place)
        if not match:
            place += 1
            continue
        kind = match.lastgroup if match.lastgroup != "mark" else "text"
        if kind == "gap":
            spaced = True
            if found:
                found[-1].spaced_after = True
        else:
            found.append(Token(kind, match.group(), place, spaced))
            spaced = False
        place = match.end()
    return found


def matching(tokens):
    """Index of the other bracket for each bracket of `tokens`."""
    pairs, open_ones = {}, []
    for index, token in enumerate(tokens):
        if token.kind != "sign":
            continue
        if token.text in "([{":
            open_ones.append(index)
        elif token.text in ")]}" and open_ones:
            pairs[index] = open_ones.pop()
            pairs[pairs[index]] = index
    return pairs


def joined(tokens):
    """The text of tokens in one line, without comments."""
    return "".join((" " if token.spaced_before and index else "") + token.text for index, token in enumerate(tokens))


def next_number(text):
    """A number a little off, or nothing for one that is no plain decimal."""
    plain = text.rstrip("fFuUlL") if not text.startswith("0x") else ""
    ending = text[len(plain):]
    if not re.fullmatch(r"[\d']+(\.\d*)?([eE][+-]?\d+)?|\.\d+", plain):
        return None
    value = plain.replace("'", "")
    if "." not in value and "e" not in value.lower():
        return str(int(value) + 1) + ending
    return (repr(float(value) * 2) if float(value) else "1.0") + ending


def swapped(tokens, pairs, index, base):
    """Tokens with the two arguments of the call whose bracket is at `index` swapped, or nothing."""
    close = pairs.get(base + index, -1) - base
    if index == 0 or close <= index or close > len(tokens) or tokens[index - 1].kind != "word" or tokens[index - 1].text in ("if", "while", "for", "return"):
        return None
    depth, commas = 0, []
    for place in range(index + 1, close):
        sign = tokens[place].text if tokens[place].kind == "sign" else ""
        depth += (sign in ("(", "[", "{")) - (sign in (")", "]", "}"))
        if sign == "," and depth == 0:
            commas.append(place)
    if len(commas) != 1 or commas[0] == index + 1:
        return None
    first, second = tokens[index + 1:commas[0]], tokens[commas[0] + 1:close]
    if joined(first).strip() == joined(second).strip():
        return None
    return f"{joined(tokens[:index + 1])}{joined(second)}, {joined(first)}{joined(tokens[close:])}"


def variants(tokens, pairs, base):
    """(text, sentence) for each way in which an expression can be a little wrong."""
    for index, token in enumerate(tokens):
        before, after = joined(tokens[:index]), joined(tokens[index + 1:])
        space, gap = (" " if token.spaced_before and index else ""), (" " if token.spaced_after else "")
        instead = None
        if token.kind == "sign" and token.spaced_before and token.spaced_after and 0 < index < len(tokens) - 1:
            instead = OPERATORS.get(token.text)
        elif token.kind == "word":
            instead = WORDS.get(token.text)
        elif token.kind == "number":
            instead = next_number(token.text)
        if instead:
            yield f"{before}{space}{instead}{gap}{after}", f"`{token.text}` is `{instead}`"
        if token.kind == "sign" and token.text == "(":
            other = swapped(tokens, pairs, index, base)
            if other:
                yield other, f"the arguments of `{tokens[index - 1].text}` are swapped"


class Planter:
    """Reads one source and collects what to replace: (begin, end, head, [(fault text, sentence)], tail)."""

    def __init__(self, text):
        self.text = text
        self.tokens = tokens_of(text)
        self.pairs = matching(self.tokens)
        self.places = []

    def line_of(self, index):
        return self.text.count("\n", 0, self.tokens[index].begin) + 1

    def expression(self, begin, end, extra=()):
        """Plants in tokens [begin, end), an expression with a value."""
        tokens = self.tokens[begin:end]
        if not tokens or any(t.kind == "hash" or (t.kind == "sign" and t.text in ("{", "}", ";")) for t in tokens):
            return
        if any(t.text == "[" and (i == 0 or tokens[i - 1].kind == "sign" and tokens[i - 1].text not in (")", "]")) for i, t in enumerate(tokens)):
            return
        found = list(variants(tokens, self.pairs, begin))[:MOST_OF_A_STATEMENT] + list(extra)
        if found:
            self.places.append((tokens[0].begin, tokens[-1].end, self.line_of(begin), "value", found, joined(tokens)))

    def condition(self, begin, end):
        """Plants in the tokens of a condition; one that declares something is left alone."""
        tokens = self.tokens[begin:end]
        if any(t.kind == "sign" and t.text in (";", "=") for t in tokens):
            return
        self.expression(begin, end, [(f"!({joined(tokens)})", "the condition is turned around")])

    def statement(self, begin, end):
        """Plants in the statement of tokens [begin, end), without its semicolon."""
        tokens = self.tokens[begin:end]
        if not tokens or tokens[0].text in LEFT_ALONE or any(t.kind == "hash" for t in tokens):
            return
        if tokens[0].text == "return":
            self.expression(begin + 1, end)
            return
        depth, equals = 0, None
        for index, token in enumerate(tokens):
            if token.kind == "sign":
                depth += (token.text in ("(", "[")) - (token.text in (")", "]"))
                if token.text == "=" and depth == 0:
                    equals = index
                    break
        if equals and equals >= 2 and tokens[equals - 1].kind == "word" and (tokens[equals - 2].kind == "word" or tokens[equals - 2].text in (">", "&", "*")):
            if "constexpr" not in {t.text for t in tokens[:equals]}:
                self.expression(begin + equals + 1, end)
            return
        if len(tokens) > 1 and tokens[0].kind == "word" and tokens[1].kind == "word" or tokens[0].text in ("const", "auto"):
            return
        if any(t.text in ("{", "}") for t in tokens) or not any(t.kind == "sign" for t in tokens):
            return
        # `Type name(arguments)` and `Type<T> name` declare; what is left calls or assigns.
        if re.match(r"[\w:]+(<.*>)?[&*]? +[&*]?\w+ *(\(|$|\[)", joined(tokens)):
            return
        found = list(variants(tokens, self.pairs, begin))[:MOST_OF_A_STATEMENT] + [("", "the statement is left out")]
        self.places.append((tokens[0].begin, self.tokens[end].end, self.line_of(begin), "statement", found, joined(tokens)))

    def is_body(self, index, start):
        """Whether the brace at `index`, in a declaration that begins at `start`, opens the body of a function that can be planted."""
        header = self.tokens[start:index]
        words = {t.text for t in header}
        return any(t.text == "(" for t in header) and not words & {"constexpr", "consteval", "namespace", "=", "enum"}

    def kind_of_brace(self, index, start, outer):
        before = self.tokens[index - 1] if index else None
        header = {t.text for t in self.tokens[start:index]}
        if outer in ("space", "type"):
            if "namespace" in header or "extern" in header:
                return "space"
            if header & {"class", "struct", "union"} and "(" not in header:
                return "type"
            return "body" if self.is_body(index, start) else "other"
        if outer == "other":
            return "other"
        if index == start or (before and before.text in ("else", "do", "try")):
            return "body"
        if before and before.text == ")" and index - 1 in self.pairs:
            ahead = self.tokens[self.pairs[index - 1] - 1]
            if ahead.text in ("if", "while", "for", "switch", "catch", "constexpr"):
                return "body"
            if ahead.text == "]":
                return "lambda"
        return "lambda" if before and before.text == "]" else "other"

    def walk(self):
        """Finds every statement and condition of every body."""
        frames = [["space", 0, False]]  # what it is, where its current statement begins, whether that holds a brace
        index = 0
        while index < len(self.tokens):
            token = self.tokens[index]
            kind = frames[-1][0]
            inside = kind in ("body", "lambda")
            if token.kind == "hash":
                frames[-1][1] = index + 1
            elif token.kind == "word" and inside and token.text in ("if", "while", "for", "switch") and self.tokens[index + 1].text == "(":
                close = self.pairs.get(index + 1)
                if close is None:
                    return
                if not self.holds_brace(index + 1, close):
                    self.bracket(token.text, index + 2, close)
                    index = close
                    frames[-1][1], frames[-1][2] = index + 1, False
            elif token.kind == "word" and inside and token.text in ("else", "do"):
                frames[-1][1] = index + 1
            elif token.kind == "sign" and token.text == "{":
                frames.append([self.kind_of_brace(index, frames[-1][1], kind), index + 1, False])
            elif token.kind == "sign" and token.text == "}":
                closed = frames.pop() if len(frames) > 1 else frames[0]
                if closed[0] in ("lambda", "other"):
                    frames[-1][2] = True
                else:
                    frames[-1][1], frames[-1][2] = index + 1, False
            elif token.kind == "sign" and token.text == ":" and inside and self.tokens[frames[-1][1]].text in ("case", "default"):
                frames[-1][1] = index + 1
            elif token.kind == "sign" and token.text == ";" and not (inside and self.in_bracket(frames[-1][1], index)):
                if inside and not frames[-1][2]:
                    self.statement(frames[-1][1], index)
                frames[-1][1], frames[-1][2] = index + 1, False
            index += 1

    def holds_brace(self, begin, end):
        return any(t.kind == "sign" and t.text == "{" for t in self.tokens[begin:end])

    def in_bracket(self, begin, index):
        return sum((t.text == "(") - (t.text == ")") for t in self.tokens[begin:index] if t.kind == "sign") > 0

    def bracket(self, word, begin, end):
        """Plants in what stands in the bracket after `if`, `while`, `for` or `switch`."""
        if word in ("if", "while"):
            self.condition(begin, end)
        elif word == "for":
            parts = [i for i in range(begin, end) if self.tokens[i].kind == "sign" and self.tokens[i].text == ";"]
            if len(parts) == 2:
                self.expression(parts[0] + 1, parts[1])


def places_of(text):
    """What can be planted in a source, in the order of its lines."""
    planter = Planter(text)
    planter.walk()
    return sorted(planter.places)


def planted(text, chosen, first_number):
    """The source with `chosen` faults planted, each {(place index, variant index)}. Returns (text, faults, {line of the new text: number})."""
    places = places_of(text)
    out, done, faults, lines, number = [], 0, [], {}, first_number
    for index, (begin, end, line, kind, found, plain) in enumerate(places):
        mine = [v for v in range(len(found)) if (index, v) in chosen]
        if not mine or begin < done:
            continue
        out.append(text[done:begin])
        pieces = []
        for v in mine:
            faults.append(Fault(number, line, f"{found[v][1]} in `{plain}`"))
            if kind == "value":
                pieces.append((number, f"mutant_is({number}) ? ({found[v][0]}) :"))
            else:
                pieces.append((number, f"if (::strandcast_mutants::mutant_is({number})) {{ {found[v][0]}; }} else"))
            number += 1
        out.append("(\n" if kind == "value" else "{\n")
        for piece_number, piece in pieces:
            lines["".join(out).count("\n") + 1] = piece_number
            out.append(piece.replace("mutant_is", "::strandcast_mutants::mutant_is", 1) + "\n" if kind == "value" else piece + "\n")
        out.append(f"({plain}))" if kind == "value" else f"{{ {plain}; }} }}")
        done = end
    out.append(text[done:])
    return "".join(out), faults, lines
