#!/usr/bin/env bash
# Installs what is missing, builds with warnings as errors and runs every test. Arguments go to ctest
# (for example: bash tests/run.sh -L unit). Ends with the slowest tests and "N passed, N failed, N skipped".
set -euo pipefail
cd "$(dirname "$0")/.."

bash deploy/install_deps.sh xvfb xauth glslang-tools spirv-tools  # a display for the window test; checks of shaders
cmake --preset ci >/dev/null
cmake --build --preset ci

echo "Grids of long tests: ${STRANDCAST_TEST_GRID:-small} (tests/support/test_grid.h)"
results=build/ci/test_results
rm -rf "$results"
mkdir -p "$results/tried_first"
ctest --preset ci -j2 --output-junit "$PWD/$results/first.junit" "$@" || true

# Tests with sockets share a machine that may be busy: those that failed are tried once more, alone, and the summary
# names them.
mapfile -t again < <(awk -f tests/failed_tests.awk build/ci/test_lists/*.txt "$results/first.junit")
if [ ${#again[@]} -gt 0 ]; then
  echo "Trying once more: ${again[*]}"
  pattern=""
  for entry in "${again[@]}"; do
    [ -e "$results/${entry//\//_}.xml" ] && mv "$results/${entry//\//_}.xml" "$results/tried_first/"
    pattern="$pattern${pattern:+|}${entry//./\\.}"
  done
  ctest --preset ci -j1 --output-junit "$PWD/$results/second.junit" -R "^($pattern)\$" || true
fi
exec bash tests/summary.sh build/ci
