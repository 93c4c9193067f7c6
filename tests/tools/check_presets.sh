#!/usr/bin/env bash
# Configures the presets that only nights build, in a folder of its own, and fails when CMake refuses one of them.
# usage: check_presets.sh SOURCE_FOLDER COMPILER
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
touch "$folder/known.cmake"
cd "$1"
for preset in dev tsan fuzz lto; do
  # The fuzzers' own compiler need not be there for this.
  if ! cmake -C "$folder/known.cmake" --preset "$preset" -B "$folder/$preset" -DCMAKE_CXX_COMPILER="$2" >"$folder/log" 2>&1; then
    grep -m 1 -A 8 "CMake Error" "$folder/log" >&2 || cat "$folder/log" >&2
    echo "the preset $preset cannot be configured" >&2
    exit 1
  fi
  # What the first one found out about the machine's libraries is not asked for again: it takes half of the time.
  [ -s "$folder/known.cmake" ] || sed -nE '/^(CMAKE|STRANDCAST|strandcast)/d
    s/^([A-Za-z0-9_]+):(INTERNAL|FILEPATH)=(.*)$/set(\1 "\3" CACHE \2 "")/p' "$folder/$preset/CMakeCache.txt" >"$folder/known.cmake"
done
