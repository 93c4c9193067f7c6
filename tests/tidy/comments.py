#!/usr/bin/env python3
"""Holds the comments that open headers and those of their declarations: plain words, a noun or verb first, short sentences.

usage: comments.py SOURCE_FOLDER [ignored]
Prints a line per fault and ends with 1 if there are any. Then it plants a fault for each check, in memory, and ends
with 1 unless every check finds its own.
"""
import os
import re
import sys

TOPS = ("common", "server", "client")
# Words that a reader has to guess at: they point at a neighbour or stand for a noun.
WORDS = ["as it is", "as they are", "as they were", "is told", "likewise", "so many", "so much", "the same for who",
         "to be had", "what is told", "who asks", "whoever", "whom", "with whom"]
# A comment that begins like this has no subject of its own.
BEGINNINGS = ["After that", "As before", "But", "By", "It", "Like", "Of", "So", "That", "Their", "There", "These", "They",
              "This", "Those", "To", "Who", "Whose", "With", "Without"]
MOST_WORDS = 40


class Comment:
    """A run of comment lines as one text; paragraphs are separated by newlines."""

    def __init__(self, file, line, lines):
        self.file, self.line = file, line
        paragraphs = "\n".join(re.sub(r"^ *//+ ?", "", l) for l in lines)
        self.text = re.sub(r"\n(?!\n|\* |  )", " ", paragraphs).strip()

    def fault(self, what):
        return f"{self.file}:{self.line}: {what} in \"{self.text[:60]}\""


def comments_of(file, text):
    """The opening comment and the /// comments of a header."""
    run, begin, opening = [], 0, True
    for number, line in enumerate(text.split("\n") + [""], 1):
        is_comment = re.match(r" *///( |$)", line) or (opening and re.match(r"//( |$)", line))
        if is_comment and not run:
            begin = number
        if is_comment:
            run.append(line)
            continue
        opening = False
        if run:
            yield Comment(file, begin, run)
        run = []


def read_headers(root):
    """Path to text of each header that keeps the rules."""
    headers = {}
    for top in TOPS:
        for folder, _, files in os.walk(os.path.join(root, top)):
            for file in sorted(files):
                path = os.path.relpath(os.path.join(folder, file), root)
                if file.endswith(".h"):
                    headers[path] = open(os.path.join(root, path), encoding="utf-8").read()
    return headers


def plain(text):
    """The text without code spans and quoted examples."""
    return re.sub(r"`[^`]*`|\"[^\"]*\"", "code", text)


def check_words(comment):
    text = plain(comment.text).lower()
    for word in WORDS:
        if re.search(rf"\b{word}\b", text):
            yield comment.fault(f"\"{word}\"")


def check_beginning(comment):
    for word in BEGINNINGS:
        if re.match(rf"{word}\b", comment.text):
            yield comment.fault(f"begins with \"{word}\"")


def check_sentences(comment):
    for paragraph in comment.text.split("\n"):
        for sentence in re.split(r"(?<=[.!?:;])\s+", plain(paragraph)):
            count = sum(bool(re.search(r"\w", w)) for w in sentence.split())
            if count > MOST_WORDS:
                yield comment.fault(f"a sentence of {count} words")


CHECKS = [check_words, check_beginning, check_sentences]
PLANTED = [
    (check_words, "/// Returns the frames of whoever asks."),
    (check_words, "/// Number of strands, likewise."),
    (check_beginning, "/// Of the newest."),
    (check_beginning, "/// Those that were not taken yet."),
    (check_sentences, "/// Returns " + "a word and " * 14 + "another."),
]


def faults_in(headers):
    return [fault for file, text in headers.items() for comment in comments_of(file, text)
            for check in CHECKS for fault in check(comment)]


def self_test(headers):
    """A planted comment in a real header is found by its check."""
    file = "common/base/hash.h"
    missed = 0
    for check, line in PLANTED:
        spoilt = headers[file].replace("///", f"{line}\n#\n///", 1)
        found = [f for c in comments_of(file, spoilt) for f in check(c)]
        if not found or [f for c in comments_of(file, headers[file]) for f in check(c)]:
            print(f"{check.__name__} does not find {line!r}")
            missed += 1
    for check in set(CHECKS) - {p[0] for p in PLANTED}:
        print(f"no fault is planted for {check.__name__}")
        missed += 1
    print(f"{len(PLANTED)} faults planted, {missed} not found")
    return missed


def main():
    headers = read_headers(sys.argv[1])
    faults = faults_in(headers)
    print("\n".join(faults))
    count = sum(1 for file, text in headers.items() for _ in comments_of(file, text))
    print(f"{len(headers)} headers, {count} comments; {len(faults)} faults")
    sys.exit(1 if self_test(headers) or faults or count < 1000 else 0)


if __name__ == "__main__":
    main()
