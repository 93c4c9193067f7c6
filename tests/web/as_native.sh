#!/usr/bin/env bash
# Whether the strand core in WebAssembly does what this build's does, bit for bit: lanes at the edges of numbers, kept
# streams, hostile messages, kernels on tiny strands, streams of the server's own solvers, and strands that the server
# shares with its viewers (all sizes, and ten minutes of these, where STRANDCAST_TEST_GRID is `whole`).
#   bash tests/web/as_native.sh BUILD_FOLDER     with record_tapes and lane_check in bin, modules in web/bin
set -euo pipefail
build="$(realpath "${1:?usage: as_native.sh BUILD_FOLDER}")"
here="$(realpath "$(dirname "$0")")"
modules="$build/web/bin"
node="$(command -v node || command -v nodejs || true)"
[ -n "$node" ] || { echo "skipped: needs Node (nodejs) to run WebAssembly"; exit 77; }
[ -e "$modules/strand_core.wasm" ] || { echo "skipped: needs a strand core built by emscripten in $modules"; exit 77; }

work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
"$build/bin/lane_check" >"$work/lanes"
"$node" "$here/lanes.mjs" "$modules/lane_check.wasm" | diff "$work/lanes" - || { echo "lanes differ"; exit 1; }
echo "$(wc -l <"$work/lanes") functions of lanes as native"

for tape in kept hostile tiny full; do
  "$build/bin/record_tapes" "$tape" "$work/$tape.tape"
done
sizes=(600x16); rounds=1; exact="300x16 150"; frames=60
[ "${STRANDCAST_TEST_GRID:-small}" != whole ] || { sizes=(2000x16 10000x16); rounds=3; exact="1100x16 36000"; frames=300; }
for quality in fast full; do
  # shellcheck disable=SC2086
  "$build/bin/record_tapes" exact "$work/exact_$quality.tape" $quality $exact
done
for size in "${sizes[@]}"; do
  for stream in "dftl step" "direct_rod step" "dftl tangent"; do
    # shellcheck disable=SC2086
    "$build/bin/record_tapes" stream "$work/${stream// /_}_$size.tape" $stream "$size" "$frames"
  done
done
"$node" "$here/play.mjs" "$modules/strand_core.wasm" --rounds "$rounds" "$work"/*.tape

size=${sizes[0]/x/ x }
# What the page begins with, and what takes steps for it.
"$node" "$here/play.mjs" "$modules/strand_page.wasm" --only "dftl tangent $size" "$work"/*.tape
for only in "tiny sim/dftl.comp" "full from 0" "full from 22" "dftl step $size" "dftl tangent $size"; do
  "$node" "$here/play.mjs" "$modules/strand_step.wasm" --only "$only" "$work"/*.tape
done
