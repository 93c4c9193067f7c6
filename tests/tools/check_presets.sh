#!/usr/bin/env bash
# Configures the presets that only nights build, in a folder of its own, and fails when CMake refuses one of them.
# usage: check_presets.sh SOURCE_FOLDER COMPILER
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$1"
for preset in dev tsan fuzz lto; do
  # The fuzzers' own compiler need not be there for this.
  if ! cmake --preset "$preset" -B "$folder/$preset" -DCMAKE_CXX_COMPILER="$2" >"$folder/log" 2>&1; then
    grep -m 1 -A 8 "CMake Error" "$folder/log" >&2 || cat "$folder/log" >&2
    echo "the preset $preset cannot be configured" >&2
    exit 1
  fi
done
