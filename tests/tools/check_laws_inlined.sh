#!/usr/bin/env bash
# check_laws_inlined.sh LIBRARY: fails when a law of shaders/lib is a function of its own in the library. Kernels for
# wider registers would call it with arguments where it does not look for them (common/simd/variants.h).
set -euo pipefail
symbols="$(nm -C "$1" 2>/dev/null)"
grep -q 'strandcast::' <<<"$symbols" || { echo "$1 has no symbols to look at"; exit 1; }
if found="$(grep ' strandcast::law::' <<<"$symbols")"; then
  echo "not inlined:"
  echo "$found"
  exit 1
fi
echo "all laws are inlined"
