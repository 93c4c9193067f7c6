#!/usr/bin/env bash
# Prints every figure that the page in the browser is held to, of one run: ratios of decoding (tests/bench/wasm.sh), then
# files, first pictures, the server's pictures and WebGL2 (tests/bench/page.mjs). Needs a build with -DSTRANDCAST_WEB=ON,
# nodejs and chromium.
# usage: bash tests/bench/page.sh [--build DIR] [--frames N]
set -euo pipefail
cd "$(dirname "$0")/../.."

build=build/release
for ((i = 1; i < $#; ++i)); do
  [ "${!i}" != --build ] || { next=$((i + 1)); build="${!next}"; }
done
bash tests/bench/wasm.sh "$@"
node tests/bench/page.mjs "$build/bin/strandcast-server" "$build/bin/strandcast-view" "$build/bin/strandcast-ctl"
node tests/bench/package.mjs "$build/bin/strandcast-server" "$(ls -t "$build"/web/npm/strandcast-*.tgz | head -n 1)"
