#!/usr/bin/env bash
# Installs what is missing, builds with warnings as errors and runs every test. Arguments go to ctest
# (for example: bash tests/run.sh -L unit).
set -euo pipefail
cd "$(dirname "$0")/.."

bash deploy/install_deps.sh xvfb xauth  # a display for the window test
cmake --preset ci >/dev/null
cmake --build --preset ci
# Tests with sockets and processes share a machine that may be busy: a failure is printed and tried once more.
ctest --preset ci -j2 --repeat until-pass:2 "$@"
