#!/usr/bin/env bash
# Builds and runs every bench and leaves CSV files: simulation (the seeds' test sets, every solver), the models beside
# Bullet's rope and in the form of the source documents' tables, strand codecs, picture codecs, methods of drawing, and whole streams (server, feeder and
# headless viewer on loopback). Nothing here passes or fails.
# usage: bash tests/bench/run.sh [--out DIR] [--groom FILE] [--motion FILE.bvh] [--mohawk Ratboy_mohawk.tfx]
set -euo pipefail

out=out/bench; groom=; motion=builtin; mohawk=
while [ $# -gt 0 ]; do
  case "$1" in
    --out) out=$2 ;;
    --groom) groom=$(realpath "$2") ;;
    --motion) motion=$(realpath "$2") ;;
    --mohawk) mohawk=$(realpath "$2") ;;
    *) echo "run.sh: unknown option $1 (known: --out DIR, --groom FILE, --motion FILE.bvh, --mohawk FILE.tfx)" >&2; exit 2 ;;
  esac
  shift 2
done
mkdir -p "$out"
out=$(realpath "$out")
cd "$(dirname "$0")/../.."
bash deploy/install_deps.sh
cmake --preset release -DBUILD_TESTING=ON >/dev/null
cmake --build --preset release --target sim_bench peers_bench codec_bench publish_bench replay_bench frame_bench render_bench stage_bench strandcast-server strandcast-view strandcast-ctl \
  >"$out/build.log" 2>&1 || { tail -30 "$out/build.log" >&2; exit 2; }
bin=build/release/bin

echo "== simulation: $out/sim.csv"
"$bin/sim_bench" --csv "$out/sim.csv" ${groom:+--groom "$groom"}
echo "== beside other programs: $out/peers.csv"
"$bin/peers_bench" --csv "$out/peers.csv" ${mohawk:+--mohawk "$mohawk"} | tee "$out/peers.txt"
echo "== publishing: $out/publish.csv"
"$bin/publish_bench" | tee "$out/publish.csv"
echo "== codecs: $out/codec.csv"
"$bin/codec_bench" | tee "$out/codec.csv"
echo "== between states: $out/replay.csv"
"$bin/replay_bench" | tee "$out/replay.csv"

echo "== pictures: $out/frame.csv"
"$bin/frame_bench" | tee "$out/frame.csv"

echo "== bytes of pictures beside the quads': $out/frame_beside.csv"
"$bin/frame_bench" --beside quads | tee "$out/frame_beside.csv"

echo "== frames mode without a GPU: $out/frames.csv"
bash tests/bench/frames.sh --bin "$bin" | tee "$out/frames.csv"

echo "== methods of drawing: $out/render.csv"
"$bin/render_bench" | tee "$out/render.csv"
echo "== stages of the tiles beside what the machine can do: $out/stages.csv"
"$bin/stage_bench" | tee "$out/stages.csv"

echo "== streams: $out/stream.csv"
echo "scene,key,value" >"$out/stream.csv"
stream() {  # stream NAME server-options...
  local name=$1; shift
  local port_file; port_file=$(mktemp); : >"$port_file"
  "$bin/strandcast-server" --port 0 --port-file "$port_file" --log-level warn "$@" & local server=$!
  for _ in $(seq 300); do [ -s "$port_file" ] && break; kill -0 "$server" || return 0; sleep 0.1; done
  local port; port=$(cat "$port_file")
  "$bin/strandcast-ctl" feed --connect "127.0.0.1:$port" --motion "$motion" --loop 2>/dev/null & local feed=$!
  "$bin/strandcast-view" --connect "127.0.0.1:$port" --headless --seconds 8 --report "$out/stream_$name.txt" || true
  kill -TERM "$feed" "$server"; wait "$feed" "$server" || true
  rm -f "$port_file"
  sed -n "s/^\([^=]*\)=\(.*\)$/$name,\1,\2/p" "$out/stream_$name.txt" >>"$out/stream.csv"
  rm -f "$out/stream_$name.txt"
}
stream built_in_2000x16
for scene in bench_242x8 bench_1kx16 bench_1kx32 bench_10kx16 bench_10kx32; do
  stream "$scene" --scene "deploy/scenes/$scene.textproto"
done
if [ -n "$groom" ]; then
  stream file --groom "$groom"
else
  stream mohawk_sized_2228x32 --set groom.procedural.strand_count=2228 --set groom.procedural.vertex_count=32
fi
