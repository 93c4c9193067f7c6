#!/usr/bin/env bash
# Prints, per stream, the median processor milliseconds of decoding a frame natively (one thread) and in WebAssembly
# (Node), of one run, and what the page's files take. Needs a build with -DSTRANDCAST_WEB=ON.
# usage: bash tests/bench/wasm.sh [--build DIR] [--frames N]
set -euo pipefail
cd "$(dirname "$0")/../.."

build=build/release; frames=180
while [ $# -gt 1 ]; do
  case "$1" in
    --build) build=$2 ;;
    --frames) frames=$2 ;;
    *) echo "unknown argument '$1' (known: --build DIR, --frames N)" >&2; exit 2 ;;
  esac
  shift 2
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

for module in "$build"/web/bin/strand_*.wasm "$build"/web/page/*.js; do
  echo "$(basename "$module"): $(stat -c %s "$module") bytes, $(gzip -9 -c "$module" | wc -c) compressed"
done
for stream in "dftl step 2000x16" "dftl step 10000x16" "direct_rod step 2000x16" "direct_rod step 10000x16" \
  "dftl tangent 2000x16" "dftl tangent 10000x16"; do
  # shellcheck disable=SC2086
  "$build/bin/record_tapes" stream "$work/tape" $stream "$frames"
  module=strand_core
  [ "${stream% *}" != "dftl step" ] || module=strand_step
  [ "${stream% *}" != "dftl tangent" ] || module=strand_page
  node tests/web/play.mjs "$build/web/bin/$module.wasm" --rounds 3 "$work/tape" | head -n 1
done
