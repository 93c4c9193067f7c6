#!/usr/bin/env bash
# Installs what is missing, builds with warnings as errors and runs every test. Arguments go to ctest
# (for example: bash tests/run.sh -L unit). Ends with the slowest tests, what build and tests cost, and "N passed, N failed, N skipped".
# STRANDCAST_TEST_PAGE=off leaves the page for browsers out, and the compiler and browser that its tests need.
set -euo pipefail
cd "$(dirname "$0")/.."

# A quick linker; a display for the window test; checks of shaders; H.264, which only this build has (its x264 is GPL); what examples are
# written in; what leads viewers to sessions of a fleet.
bash deploy/install_deps.sh lld xvfb xauth glslang-tools glslc spirv-tools libavcodec-dev libavutil-dev python3 nodejs haproxy
page=OFF
if [ "${STRANDCAST_TEST_PAGE:-on}" != off ]; then
  if bash deploy/install_deps.sh emscripten esbuild dpkg-dev node-typescript chromium firefox-esr libjs-three && bash client/web/fetch_zstd.sh build/ci/web/zstd; then
    page=ON
  else
    echo "The page for browsers is left out, and its tests: what it is built with cannot be had"
  fi
fi
cost=$(mktemp)
(
  cmake --preset ci -DSTRANDCAST_WEB="$page" >/dev/null
  cmake --build --preset ci
  times >"$cost"
)
STRANDCAST_BUILD_PROCESSOR_S=$(awk -f tests/processor_s.awk "$cost")
export STRANDCAST_BUILD_PROCESSOR_S
rm -f "$cost"
echo "Grids of long tests: ${STRANDCAST_TEST_GRID:-small} (tests/support/test_grid.h)"
# A process of its own, whose children are the tests alone; four at once, since two of them have sockets and mostly wait.
bash tests/run_preset.sh ci build/ci 4 "$@"
