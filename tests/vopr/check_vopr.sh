#!/usr/bin/env bash
# Whether a seed is the same run every time, and whether the rules find each planted fault, by its own sentence.
#   check_vopr.sh PROGRAM
set -euo pipefail
vopr=$1

digest_of() {
  "$vopr" --seed "$1" --simulate 10 | grep -o 'digest [0-9a-f]*'
}

# finds PLANT SENTENCE [FIRST SEED]
finds() {
  local seed output="" first=${3:-1}
  for ((seed = first; seed < first + 6; ++seed)); do
    output=$("$vopr" --seed "$seed" --simulate 15 --plant "$1") || break
    output=""
  done
  if ! grep -qE "^seed [0-9]+: .*$2" <<<"$output"; then
    tail -n 5 <<<"$output" >&2
    echo "seeds $first to $((first + 5)) do not find the plant $1 by '$2'" >&2
    exit 1
  fi
  if ! grep -q 'again: strandcast-vopr --seed' <<<"$output"; then
    echo "nothing says how to run the seed again" >&2
    exit 1
  fi
}

first=$(digest_of 5)
# Some containers forbid what keeps addresses the same.
if setarch --addr-no-randomize true; then
  [ "$first" = "$(digest_of 5)" ] || { echo "seed 5 is another run the second time" >&2; exit 1; }
fi
[ "$first" != "$(digest_of 6)" ] || { echo "seeds 5 and 6 are one run" >&2; exit 1; }

# From the seeds that found them last.
finds wrong-hash 'has another state' 2
finds stays-away 'has seen nothing new for' 4
finds done-twice 'twice' 2
finds token-in-log 'a token stands in the log'
finds deaf 'has had no answer for' 2
finds relay-ends 'has seen nothing new for' 4
finds first-is-final 'has seen nothing new for'
finds feeder-ends 'feeder has seen nothing new for'
finds one-queue '(was refused|has had no answer)'
finds long-command '(has seen nothing new|has had no answer)'
finds report-forgets 'reports [0-9]+ frames'
finds lost-bytes 'recording' 5
echo "a seed is one run, and every planted fault is found"
