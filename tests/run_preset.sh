#!/usr/bin/env bash
# Runs the tests of a folder that is built, tries once more what a busy machine may have spoilt, and sums up:
#   bash tests/run_preset.sh TEST_PRESET BUILD_FOLDER JOBS [arguments of ctest]
# Ends with "N passed, N failed, N skipped"; the exit status is 1 when anything failed.
set -euo pipefail
cd "$(dirname "$0")/.."
preset="${1:?usage: run_preset.sh TEST_PRESET BUILD_FOLDER JOBS}" folder="${2:?BUILD_FOLDER}" jobs="${3:?JOBS}"
shift 3

results="$PWD/$folder/test_results"
rm -rf "$results"
mkdir -p "$results/tried_first"
ctest --preset "$preset" -j"$jobs" --output-junit "$results/first.junit" "$@" || true

# Tests with sockets share a machine that may be busy: those that failed are tried once more, alone, and the summary
# names them.
ctest --preset "$preset" -N -L '^network$' | sed -n 's/^ *Test *#[0-9]*: //p' >"$results/network.names"
again=()
if [ -s "$results/network.names" ] && [ -e "$results/first.junit" ]; then
  mapfile -t again < <(awk -f tests/failed_tests.awk "$results/network.names" "$results/first.junit")
fi
if [ ${#again[@]} -gt 0 ]; then
  echo "Trying once more: ${again[*]}"
  pattern=""
  for entry in "${again[@]}"; do
    [ ! -e "$results/${entry//\//_}.xml" ] || mv "$results/${entry//\//_}.xml" "$results/tried_first/"
    pattern="$pattern${pattern:+|}${entry//./\\.}"
  done
  ctest --preset "$preset" -j1 --output-junit "$results/second.junit" -R "^($pattern)\$" || true
fi
# Processor time of what this shell has waited for; the build's is handed over by who built.
times >"$results/times.txt"
{
  if [ -n "${STRANDCAST_BUILD_PROCESSOR_S:-}" ]; then echo "build $STRANDCAST_BUILD_PROCESSOR_S"; fi
  echo "tests $(awk -f tests/processor_s.awk "$results/times.txt")"
} >"$results/processor_s.txt"
exec bash tests/summary.sh "$folder"
