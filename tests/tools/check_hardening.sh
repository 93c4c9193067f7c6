#!/usr/bin/env bash
# Looks into programs for what makes attacks on them harder; says what is missing and fails.
# usage: check_hardening.sh PROGRAM...
set -euo pipefail

missing=0
need() { # PROGRAM WHAT PATTERN TEXT
  if ! grep -qE -- "$3" <<<"$4"; then
    echo "$1: lacks $2" >&2
    missing=1
  fi
}
for program in "$@"; do
  header=$(readelf --wide --file-header "$program")
  segments=$(readelf --wide --program-headers "$program")
  dynamic=$(readelf --wide --dynamic "$program")
  imports=$(readelf --wide --dyn-syms "$program")
  need "$program" "position independence (PIE)" 'Type: +DYN' "$header"
  need "$program" "read-only relocations (RELRO)" 'GNU_RELRO' "$segments"
  need "$program" "binding at the start (NOW)" 'FLAGS.*NOW' "$dynamic"
  need "$program" "a stack that cannot be executed" 'GNU_STACK.* RW ' "$segments"
  need "$program" "stack protectors" '__stack_chk_fail' "$imports"
  need "$program" "checked library calls (FORTIFY)" '__[a-z]+_chk' "$imports"
done
exit $missing
