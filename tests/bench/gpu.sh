#!/usr/bin/env bash
# Runs every bench that a GPU has a part in on a hardware GPU: simulation, volume, reading back, drawing. Prints a
# Markdown table with the bytes moved and the share of the memory's speed that is reached (gpu_bench), and leaves the
# other benches' CSV in the folder. Nothing here passes or fails, but that there is a GPU.
#   bash tests/bench/gpu.sh [--out DIR] [--software]      --software: few strands on Mesa's llvmpipe, to see that it runs
set -euo pipefail

out=out/gpu; device=hardware; sizes=(--strands 100000 --vertices 32); rounds=30; sets=(); picture=1920x1080
while [ $# -gt 0 ]; do
  case "$1" in
    --out) out="${2:?--out needs a folder}"; shift 2 ;;
    --software) device=software; sizes=(--strands 1000 --vertices 8); rounds=1; sets=(--set 242x8 --solver dftl); picture=320x180; shift ;;
    *) echo "gpu.sh: unknown option $1 (known: --out DIR, --software)" >&2; exit 2 ;;
  esac
done
mkdir -p "$out"
out="$(realpath "$out")"
cd "$(dirname "$0")/../.."
bin="${STRANDCAST_BENCH_BIN:-}"
if [ -z "$bin" ]; then
  bash deploy/install_deps.sh
  cmake --preset release -DBUILD_TESTING=ON >/dev/null
  cmake --build --preset release --target gpu_bench sim_bench volume_bench render_bench >"$out/build.log" 2>&1 ||
    { tail -30 "$out/build.log" >&2; exit 2; }
  bin=build/release/bin
fi

if ! "$bin/gpu_bench" --device "$device" "${sizes[@]}" --size "$picture" --rounds "$rounds" >"$out/gpu.md" 2>"$out/gpu.log"; then
  [ "$device" = software ] && hint= || hint=" (this needs a hardware GPU; --software shows on llvmpipe that it runs)"
  echo "$(tail -1 "$out/gpu.log")$hint" >&2
  exit 1
fi
cat "$out/gpu.md"
echo
echo "Models on OpenGL beside processors: $out/sim.csv"
"$bin/sim_bench" --device "$device" --csv "$out/sim.csv" "${sets[@]}" --steps "$((rounds + 1))" >"$out/sim.txt"
echo "Ways to get strands into a volume: $out/volume.csv"
"$bin/volume_bench" --strands "${sizes[1]}" --rounds "$rounds" >"$out/volume.csv"
echo "Methods of drawing: $out/render.csv"
"$bin/render_bench" --size "$picture" --rounds "$rounds" >"$out/render.csv"
