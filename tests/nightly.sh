#!/usr/bin/env bash
# What a night is for: fuzzes every target, and runs the whole suite under the sanitizers.
#   bash tests/nightly.sh                      all of it, 60 s for each fuzzer
#   bash tests/nightly.sh --seconds 5 fuzz     the short form: only the fuzzers, 5 s each
# Parts: fuzz, dev (address and undefined behaviour), tsan (threads). A finding stays under build/fuzz/findings.
set -euo pipefail
cd "$(dirname "$0")/.."

seconds=60
parts=()
while [ $# -gt 0 ]; do
  case "$1" in
    --seconds) seconds="${2:?--seconds needs a number}"; shift 2 ;;
    fuzz | dev | tsan) parts+=("$1"); shift ;;
    *) echo "unknown argument '$1' (known: --seconds N, fuzz, dev, tsan)" >&2; exit 2 ;;
  esac
done
[ ${#parts[@]} -gt 0 ] || parts=(fuzz dev tsan)

export STRANDCAST_TEST_GRID=whole  # tests/support/test_grid.h
bash deploy/install_deps.sh clang libclang-rt-14-dev xvfb xauth
failed=()
for part in "${parts[@]}"; do
  test_preset="$part"
  options=()
  if [ "$part" = fuzz ]; then
    test_preset=nightly
    options=(-DSTRANDCAST_FUZZ_SECONDS="$seconds")
  fi
  cmake --preset "$part" "${options[@]}" >/dev/null
  cmake --build --preset "$part"
  ctest --preset "$test_preset" -j1 || failed+=("$part")
done
if [ ${#failed[@]} -gt 0 ]; then
  echo "failed: ${failed[*]}" >&2
  exit 1
fi
