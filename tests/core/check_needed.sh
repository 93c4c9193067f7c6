#!/usr/bin/env bash
# Fails when a program needs a shared library besides the ones that the core of strands may use.
# usage: check_needed.sh PROGRAM
set -euo pipefail

allowed='^(libstdc\+\+|libm|libgcc_s|libc|ld-linux[a-z0-9_-]*|libzstd|libfmt)\.so'
needed=$(readelf --wide --dynamic "$1" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p')
[ -n "$needed" ] || { echo "$1: readelf lists no libraries" >&2; exit 1; }
if others=$(grep -vE "$allowed" <<<"$needed"); then
  echo "$1 needs what the core may not use: $others" >&2
  exit 1
fi
