#!/usr/bin/env bash
# Installs what is missing, builds with warnings as errors and runs every test. Arguments go to ctest
# (for example: bash tests/run.sh -L unit). Ends with the slowest tests, what build and tests cost, and "N passed, N failed, N skipped".
# STRANDCAST_TEST_PAGE=off leaves the page for browsers out, and the compiler and browser that its tests need.
set -euo pipefail
cd "$(dirname "$0")/.."

# What the build takes: a quick linker; H.264, which only this build has (its x264 is GPL); what makes the page.
to_build=(lld libavcodec-dev libavutil-dev python3)
page_on="${STRANDCAST_TEST_PAGE:-on}"
page=OFF
if [ "$page_on" != off ] && bash deploy/install_deps.sh "${to_build[@]}" emscripten esbuild dpkg-dev && bash client/web/fetch_zstd.sh build/ci/web/zstd; then
  page=ON
else
  [ "$page_on" = off ] || echo "The page for browsers is left out, and its tests: what it is built with cannot be had"
  bash deploy/install_deps.sh "${to_build[@]}"
fi
# What only tests take comes while the build runs: a display for the window test; checks of shaders; what examples are
# written in; what leads viewers to sessions of a fleet; browsers.
(
  bash deploy/install_deps.sh xvfb xauth glslang-tools glslc spirv-tools nodejs haproxy
  [ "$page" = OFF ] || bash deploy/install_deps.sh node-typescript chromium firefox-esr libjs-three ||
    echo "Tests of the page are skipped: the browsers that they need cannot be had"
) &
installing=$!
trap 'wait "$installing" || true' EXIT  # an installation is not broken off
cost=$(mktemp)
(
  cmake --preset ci -DSTRANDCAST_WEB="$page" >/dev/null
  cmake --build --preset ci
  times >"$cost"
)
STRANDCAST_BUILD_PROCESSOR_S=$(awk -f tests/processor_s.awk "$cost")
export STRANDCAST_BUILD_PROCESSOR_S
rm -f "$cost"
wait "$installing" || { echo "What the tests need cannot be installed: the lines above say why" >&2; exit 1; }
echo "Grids of long tests: ${STRANDCAST_TEST_GRID:-small} (tests/support/test_grid.h)"
# A process of its own, whose children are the tests alone; four at once, since two of them have sockets and mostly wait.
bash tests/run_preset.sh ci build/ci 4 "$@"
