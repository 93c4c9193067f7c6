#!/usr/bin/env bash
# check_shader_costs.sh BUILD: a change of one kernel's shader rebuilds the lane kernels made of it, and no other.
set -euo pipefail
build="$1"
# The objects of lane kernels and what each was compiled from, as Ninja recorded it.
objects="$(ninja -C "$build" -t deps | awk '
  /^[^ ].*: #deps/ { object = ""; if ($1 ~ /lanes\/lane_kernel_.*\.o:$/) { object = $1; ++count } }
  /^ / && object != "" && $1 ~ /sim\/volume_forces\.comp$/ { print object }
  END { if (count < 50) print "too few lane kernels: " count + 0 }')"
wrong="$(grep -v 'lane_kernel_volume_forces_' <<<"$objects" || true)"
[ -z "$wrong" ] || { echo "volume_forces.comp costs more than its kernels:"; echo "$wrong"; exit 1; }
[ -n "$objects" ] || { echo "no kernel is made of volume_forces.comp"; exit 1; }
# Nor does any of them wait for it as an input that is listed by hand.
for object in $(ninja -C "$build" -t targets all | sed -n 's/^\(.*lanes\/lane_kernel_dftl_.*\.o\): .*/\1/p'); do
  if ninja -C "$build" -t query "$object" | grep -vF '||' | grep -q 'sim/volume_forces\.comp'; then
    echo "$object lists volume_forces.comp as an input"
    exit 1
  fi
done
echo "a shader costs its own kernels: $(wc -l <<<"$objects") for volume_forces.comp"
