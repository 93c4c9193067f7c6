#!/usr/bin/env bash
# What recording costs and what a recording is good for: processor time of the recorder's threads and of the whole server
# with and without them, bytes of the file against those of the stream that a viewer gets, a replay three times, and how
# long it takes to show any second. Prints; decides nothing.
# usage: bash tests/bench/record.sh [--bin DIR] [--seconds N] [--scrub-seconds N] [--keep FOLDER] [server options]
set -euo pipefail

bin=build/release/bin; seconds=60; scrub_seconds=600; keep=""
while [ $# -gt 1 ]; do
  case "$1" in
    --bin) bin=$2 ;;
    --seconds) seconds=$2 ;;
    --scrub-seconds) scrub_seconds=$2 ;;
    --keep) keep=$2 ;;
    *) break ;;
  esac
  shift 2
done
work=${keep:-$(mktemp -d)}
mkdir -p "$work"
server=""; others=""
finish() {
  # shellcheck disable=SC2086
  kill $others $server 2>/dev/null || true
  [ -n "$keep" ] || rm -rf "$work"
}
trap finish EXIT

# Hundredths of a second that threads of a name have taken; all of them without one.
ticks() {
  local task
  for task in /proc/"$server"/task/*; do
    case "$(cat "$task/comm")" in ${1:-*}) sed 's/.*) //' "$task/stat" | awk '{print $12 + $13}' ;; esac
  done 2>/dev/null | awk '{sum += $1} END {print sum + 0}'
}
metric() { curl -s "http://$address/metrics" | awk -v name="strandcast_$1" '$1 == name {print $2}'; }
serve() {  # serve [options]: with a source and a viewer of strands
  rm -f "$work/port"
  "$bin/strandcast-server" --port 0 --port-file "$work/port" --log-level warn "$@" >/dev/null & server=$!
  for _ in $(seq 300); do [ -s "$work/port" ] && break; kill -0 "$server" || exit 2; sleep 0.1; done
  address=127.0.0.1:$(cat "$work/port")
  "$bin/strandcast-ctl" feed --connect "$address" --loop >/dev/null 2>&1 & others=$!
  "$bin/strandcast-view" --connect "$address" --headless --mode strands --seconds 100000 >/dev/null 2>&1 & others="$others $!"
  sleep 3
}
halt() {
  # shellcheck disable=SC2086
  kill $others; kill -TERM "$server"
  # shellcheck disable=SC2086
  wait $others "$server" 2>/dev/null || true
  others=""; server=""
}
measure() {  # measure NAME: the server over so many seconds
  local all record
  all=$(ticks); record=$(ticks 'record*')
  sleep "$seconds"
  awk -v name="$1" -v all=$(($(ticks) - all)) -v record=$(($(ticks 'record*') - record)) -v s="$seconds" \
    'BEGIN {printf "%s: the server takes %.1f %% of a core, the recorder %.2f %% of it\n", name, all / s, record / s}'
}

serve "$@"
measure "without --record"
halt
serve --record "$work/run.mcap" --record-replace "$@"
measure "with --record"
deltas=$(metric encode_delta_bytes_total); strands=$(metric record_strand_bytes_total); written=$(metric record_bytes_total)
echo "lost: $(metric record_lost_frames_total) frames, $(metric record_lost_messages_total) messages; real time x $(metric sim_realtime_factor)"
halt
"$bin/strandcast-ctl" info "$work/run.mcap" | tee "$work/info"
# A viewer that joined at the start gets the asset, a keyframe and every delta; only what was written by then counts.
awk -v deltas="$deltas" -v strands="$strands" -v written="$written" '
  $2 == "MB" && $3 ~ /^\// {mb[$3] = $1; items[$3] = $4}
  END {
    keyframe = mb["/strands/keyframes"] / items["/strands/keyframes"]
    viewer = deltas / 1e6 + mb["/asset"] + keyframe
    printf "file %.2f MB: %.3f times the %.2f MB of a viewer (asset %.2f, a keyframe %.2f, deltas %.2f)\n",
      written / 1e6, written / 1e6 / viewer, viewer, mb["/asset"], keyframe, deltas / 1e6
    printf "  without the asset %.3f times; against its deltas alone %.3f times\n",
      (written / 1e6 - mb["/asset"]) / (viewer - mb["/asset"]), written / deltas
    for (topic in mb) printf "  %6.3f of the viewer: %s\n", mb[topic] / viewer, topic | "sort -r"
  }' "$work/info"
"$bin/strandcast-ctl" check "$work/run.mcap"
for _ in 1 2 3; do "$bin/strandcast-server" --log-level warn --replay "$work/run.mcap" 2>/dev/null; done
[ "$scrub_seconds" -gt 0 ] || exit 0
"$bin/strandcast-server" --port 0 --port-file "$work/port" --log-level warn --seconds "$scrub_seconds" \
  --record "$work/long.mcap" --record-replace "$@" >/dev/null & server=$!
sleep 2
"$bin/strandcast-ctl" feed --connect "127.0.0.1:$(cat "$work/port")" --loop >/dev/null 2>&1 & others=$!
wait "$server" || true
"$bin/scrub_bench" "$work/long.mcap"
