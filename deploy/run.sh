#!/usr/bin/env bash
# One command from a clone to moving hair: installs what is missing, builds, starts the server, feeds it head motion
# and wind as network streams, and opens the viewer. Without a display it leaves a picture, a clip and a report.
set -euo pipefail

usage() {
  cat <<'TEXT'
usage: bash deploy/run.sh [options]

  --groom FILE         hair to simulate: TressFX .tfx, .hair, .ply, .usd, .abc (default: grown on the spot);
                       hair in several files: the option repeated, or FILE,FILE
  --motion FILE        head motion to feed: BVH, or .abc of --groom that moves  (default: built in)
  --motion-unit M      metres per unit of the BVH                               (default: from the body's height)
  --motion-fps N       frames per second of a BVH that states none
  --motion-up y|z      up axis of the BVH                                       (default: guessed from the rest pose)
  --joint NAME         head joint of the BVH                                    (default: found by its name)
  --filter-glitches    take steps out of the BVH that are faster than any head moves
  --mocap PROTOCOL     head motion from a stage instead: vmc, opentrack, freed, livelinkface, opentrackio, vrchat, mvn (PROTOCOL:PORT),
                       natnet://HOST, vrpn://HOST
  --wind FILE          wind to feed: CSV                                        (default: built-in gusts)
  --record FILE        records the run as MCAP, into a new file: strandcast-view FILE plays it
  --scene FILE         scene as protobuf text, see deploy/scenes
  --quality NAME       auto, fast or full: how hair is simulated               (default: auto)
  --set PATH=VALUE     overrides one field of the scene; may be repeated
  --seconds N          stop after N seconds; headless, what came is drawn then  (default: 6 headless, else never)
  --out DIR            where picture, clip, report and logs go                  (default: out)
  --headless           no window, even where there is a display
  --web                builds the page for browsers too, prints its link and opens it where there is a display
  --help
TEXT
}

fail() { echo "run.sh: $1" >&2; exit 2; }

motion=builtin; wind=gusts; motion_options=(); server_options=(); seconds=; out=out; headless=; web=
need_file() { [ -f "$2" ] || fail "$1: no such file: $2"; }
while [ $# -gt 0 ]; do
  case "$1" in
    --help|-h) usage; exit 0 ;;
    --headless) headless=1; shift; continue ;;
    --web) web=1; shift; continue ;;
    --filter-glitches) motion_options+=(--filter-glitches); shift; continue ;;
    --groom|--motion|--mocap|--motion-unit|--motion-up|--motion-fps|--joint|--wind|--record|--scene|--quality|--set|--seconds|--out) ;;
    *) usage >&2; fail "unknown option: $1" ;;
  esac
  [ $# -ge 2 ] || fail "$1 needs a value"
  case "$1" in
    --groom)
      if [ -f "$2" ]; then files=("$2"); else IFS=, read -r -a files <<<"$2"; fi
      for file in "${files[@]}"; do need_file "$1" "$file"; server_options+=(--groom "$(realpath "$file")"); done ;;
    --scene) need_file "$1" "$2"; server_options+=(--scene "$(realpath "$2")") ;;
    --quality) server_options+=(--set "quality=$2") ;;
    --set) server_options+=(--set "$2") ;;
    --motion) need_file "$1" "$2"; motion=$(realpath "$2") ;;
    --mocap) motion=none; server_options+=(--mocap "$2") ;;
    --record) server_options+=(--record "$(realpath -m "$2")") ;;
    --motion-unit) motion_options+=(--unit "$2") ;;
    --motion-up) motion_options+=(--up "$2") ;;
    --motion-fps) motion_options+=(--fps "$2") ;;
    --joint) motion_options+=(--joint "$2") ;;
    --wind) need_file "$1" "$2"; wind=$(realpath "$2") ;;
    --seconds) [[ "$2" =~ ^[0-9]+(\.[0-9]+)?$ ]] || fail "--seconds: not a number: $2"; seconds=$2 ;;
    --out) out=$2 ;;
  esac
  shift 2
done
if [ -z "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]; then headless=1; fi
mkdir -p "$out"
out=$(realpath "$out")

root=$(realpath "$(dirname "$0")/..")
cd "$root"
bash deploy/install_deps.sh ${web:+emscripten esbuild nodejs dpkg-dev}
echo "Building (the first time takes a few minutes) ..."
# From here on everything that takes time runs beside this shell, in a process group of its own, so that Ctrl-C or a
# signal to this shell alone ends all of it at once.
set -m
groups=()
stop_all() {
  trap - EXIT INT TERM
  for group in "${groups[@]}"; do kill -TERM -- "-$group" 2>/dev/null || true; done
  for _ in 1 2 3 4 5 6 7 8; do
    living=
    for group in "${groups[@]}"; do kill -0 -- "-$group" 2>/dev/null && living=1; done
    [ -n "$living" ] || break
    sleep 0.1
  done
  for group in "${groups[@]}"; do kill -KILL -- "-$group" 2>/dev/null || true; done
  wait 2>/dev/null || true
}
trap stop_all EXIT
trap 'stop_all; exit 0' INT TERM
# Runs a command to its end, as the shell would; a signal is acted on meanwhile.
run() { "$@" & groups+=("$!"); wait "$!"; }

build() {
  cmake --preset release -DBUILD_TESTING=OFF -DSTRANDCAST_INSTRUCTION_SETS=native ${web:+-DSTRANDCAST_WEB=ON} >/dev/null \
    && cmake --build --preset release --target strandcast-server strandcast-view strandcast-ctl
}
run build >"$out/build.log" 2>&1 \
  || { tail -30 "$out/build.log" >&2; fail "the build failed; its whole output is in $out/build.log"; }
bin=$root/build/release/bin

port_file=$(mktemp)
: >"$port_file"
"$bin/strandcast-server" --port 0 --port-file "$port_file" "${server_options[@]}" 2>"$out/server.log" &
server=$!
groups+=("$server")
for _ in $(seq 600); do
  [ -s "$port_file" ] && break
  kill -0 "$server" 2>/dev/null || { cat "$out/server.log" >&2; exit 2; }
  sleep 0.1
done
[ -s "$port_file" ] || fail "the server did not start within 60 s; see $out/server.log"
port=$(cat "$port_file")
rm -f "$port_file"
echo "Server on 127.0.0.1:$port (log: $out/server.log)"
sed -n 's/^[^ ]* info \[scene\] //p' "$out/server.log"  # how files were read: turned, scaled, which head
sed -n 's/^[^ ]* info \[mocap\] /Waiting for head motion: /p' "$out/server.log"
grep -i ' warning ' "$out/server.log" >&2 || true

: >"$out/feed.log"  # that of a run before says "feeding" too
"$bin/strandcast-ctl" feed --connect "127.0.0.1:$port" --motion "$motion" --wind "$wind" --loop "${motion_options[@]}" \
  >"$out/feed.log" 2>&1 &
feed=$!
groups+=("$feed")
# What was assumed about a person's files stands in front of this line.
until grep -q '^feeding ' "$out/feed.log"; do
  kill -0 "$feed" 2>/dev/null || { cat "$out/feed.log" >&2; exit 2; }
  sleep 0.1
done
sed -e '/^feeding /d' -e 's/\([( ]\)--\(unit\|up\)\b/\1--motion-\2/' "$out/feed.log"  # by the names of options here

if [ -n "$web" ]; then
  link="http://127.0.0.1:$port/"
  echo "Page:    $link"
  if [ -z "$headless" ]; then
    command -v xdg-open >/dev/null && xdg-open "$link" >/dev/null 2>&1 || echo "Open it in a browser."
  fi
  echo "Ctrl-C stops everything."
  run sleep "${seconds:-infinity}"
elif [ -n "$headless" ]; then
  run "$bin/strandcast-view" --connect "127.0.0.1:$port" --headless --size 1280x720 --seconds "${seconds:-6}" \
    --screenshot "$out/hair.png" --clip "$out/hair.webp" --clip-size 640x360 --report "$out/report.txt"
  echo
  echo "Picture: $out/hair.png"
  echo "Clip:    $out/hair.webp (any browser plays it)"
  echo "Report:  $out/report.txt"
else
  echo "Opening the viewer: drag to orbit, wheel to zoom, H for help, Esc to leave."
  run "$bin/strandcast-view" --connect "127.0.0.1:$port" ${seconds:+--seconds "$seconds"}
fi
