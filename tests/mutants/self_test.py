#!/usr/bin/env python3
"""Holds the planter: a strong check notices every fault of a small source, a weak one leaves those that it cannot see.

usage: self_test.py   (the compiler is $CXX or c++)
"""
import os
import subprocess
import sys
import tempfile

import plant

SOURCE = """\
#include <algorithm>
namespace small {
constexpr int kMost = 4;  // 9 is no fault: constants are left alone
constexpr int half(int value) { return value / 2; }
int g_calls = 0;
void count() { g_calls += 1; }
int take(int wanted, int left) {
  count();
  if (wanted > left) return left;
  const int most = std::min(wanted, kMost);
  for (int i = 0; i < most; ++i) g_calls = g_calls + 0;
  return wanted + half(0);
}
}  // namespace small
"""
# What each place offers, by line: whoever reads the source by hand comes to the same.
EXPECTED = {6: {"`+=` is `-=`", "`1` is `2`", "the statement is left out"}, 8: {"the statement is left out"},
            9: {"`>` is `>=`", "the condition is turned around"}, 10: {"`min` is `max`", "the arguments of `min` are swapped"},
            11: {"`<` is `<=`", "`+` is `-`", "`0` is `1`", "the statement is left out"}, 12: {"`+` is `-`", "`0` is `1`"}}
WEAK = "int main() { return small::take(1, 5) == 1 ? 0 : 1; }\n"
STRONG = "int main() { return small::take(3, 2) == 2 && small::take(2, 9) == 2 && small::g_calls == 2 ? 0 : 1; }\n"
# No check can see these: they change nothing (equal values, `kMost` of nothing, arguments of a symmetric function).
EQUIVALENT = {(9, "`>` is `>=`"), (10, "`min` is `max`"), (10, "the arguments of `min` are swapped"), (11, "`<` is `<=`"),
              (11, "`+` is `-`"), (11, "the statement is left out"), (12, "`+` is `-`"), (12, "`0` is `1`")}
WEAK_SEES_NOT = EQUIVALENT | {(6, "`+=` is `-=`"), (6, "`1` is `2`"), (6, "the statement is left out"), (8, "the statement is left out"),
                              (9, "`>` is `>=`"), (11, "`0` is `1`")}


def survivors(check, folder, name):
    """The faults, as (line, sentence), that a program with this check does not notice."""
    places = plant.places_of(SOURCE)
    chosen = {(index, v) for index, place in enumerate(places) for v in range(len(place[4]))}
    text, faults, _ = plant.planted(SOURCE, chosen, 1)
    source, program = os.path.join(folder, f"{name}.cpp"), os.path.join(folder, name)
    with open(source, "w") as file:
        file.write(f'#include "{os.path.join(os.path.dirname(os.path.abspath(__file__)), "switch.h")}"\n{text}{check}')
    subprocess.run([os.environ.get("CXX", "c++"), "-std=c++20", source, "-o", program], check=True)
    assert subprocess.run([program]).returncode == 0, "the sample fails without a fault"
    return {(f.line, f.sentence.split(" in `")[0]) for f in faults
            if subprocess.run([program], env=dict(os.environ, STRANDCAST_MUTANT=str(f.number))).returncode == 0}


def main():
    found = {}
    for place in plant.places_of(SOURCE):
        found.setdefault(place[2], set()).update(sentence for _, sentence in place[4])
    assert found == EXPECTED, f"planted {found}, expected {EXPECTED}"
    with tempfile.TemporaryDirectory() as folder:
        for name, check, expected in (("weak", WEAK, WEAK_SEES_NOT), ("strong", STRONG, EQUIVALENT)):
            left = survivors(check, folder, name)
            assert left == expected, f"{name}: too many {left - expected}, too few {expected - left}"
    print("the planter plants what it should, and a strong check notices it")


if __name__ == "__main__":
    sys.exit(main())
