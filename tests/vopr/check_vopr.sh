#!/usr/bin/env bash
# Whether a seed is the same run every time, and whether the rules find each planted fault, by its own sentence.
#   check_vopr.sh PROGRAM
set -euo pipefail
vopr=$1

digest_of() {
  "$vopr" --seed "$1" --simulate 30 | grep -o 'digest [0-9a-f]*'
}

# finds PLANT SENTENCE
finds() {
  if output=$("$vopr" --seeds 1..3 --plant "$1"); then
    echo "no seed of 1..3 finds the plant $1" >&2
    exit 1
  fi
  if ! grep -qE "^seed [0-9]+: .*$2" <<<"$output"; then
    tail -n 5 <<<"$output" >&2
    echo "the plant $1 is found for another reason than '$2'" >&2
    exit 1
  fi
  if ! grep -q 'again: strandcast-vopr --seed' <<<"$output"; then
    echo "nothing says how to run the seed again" >&2
    exit 1
  fi
}

first=$(digest_of 5)
[ "$first" = "$(digest_of 5)" ] || { echo "seed 5 is another run the second time" >&2; exit 1; }
[ "$first" != "$(digest_of 6)" ] || { echo "seeds 5 and 6 are one run" >&2; exit 1; }

finds wrong-hash 'has another state'
finds stays-away 'has seen nothing new for'
finds done-twice 'twice'
finds token-in-log 'a token stands in the log'
finds deaf 'has had no answer for'
echo "a seed is one run, and every planted fault is found"
