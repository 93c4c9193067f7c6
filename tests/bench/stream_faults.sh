#!/usr/bin/env bash
# Measures streams under load and over bad links: many viewers, a stalled one, slow and far links, motion to decoded
# frame, viewers that come and go. Everything runs on this machine, loopback, so the viewers take processor time too.
# Nothing here passes or fails.
# usage: bash tests/bench/stream_faults.sh [--out DIR] [--bin DIR] [--seconds N] [--soak N] [--viewers N] [--suspend N]
set -euo pipefail

out=out/bench; bin=; seconds=8; soak=60; viewers=64; suspend=0
while [ $# -gt 0 ]; do
  case "$1" in
    --out) out=$2 ;;
    --bin) bin=$(realpath "$2") ;;
    --seconds) seconds=$2 ;;
    --soak) soak=$2 ;;
    --viewers) viewers=$2 ;;
    --suspend) suspend=$2 ;;
    *) echo "stream_faults.sh: unknown option $1 (known: --out, --bin, --seconds, --soak, --viewers, --suspend)" >&2; exit 2 ;;
  esac
  shift 2
done
mkdir -p "$out"
out=$(realpath "$out")
cd "$(dirname "$0")/../.."
if [ -z "$bin" ]; then
  bash deploy/install_deps.sh
  cmake --preset release -DBUILD_TESTING=ON >/dev/null
  cmake --build --preset release --target strandcast-server strandcast-view strandcast-ctl strandcast-load \
    strandcast-chaos >"$out/build.log" 2>&1 || { tail -30 "$out/build.log" >&2; exit 2; }
  bin=$PWD/build/release/bin
fi
work=$(mktemp -d)
server=; feed=; helpers=()
cleanup() { for process in ${helpers[@]+"${helpers[@]}"} $feed $server; do kill "$process" 2>/dev/null || true; done; wait; rm -rf "$work"; }
trap cleanup EXIT

wait_for() { for _ in $(seq 300); do [ -s "$1" ] && return 0; sleep 0.1; done; echo "nothing in $1" >&2; exit 1; }
start_server() {
  rm -f "$work/port"
  "$bin/strandcast-server" --port 0 --port-file "$work/port" --log-level info "$@" >"$work/server.log" 2>&1 & server=$!
  wait_for "$work/port"; port=$(cat "$work/port")
}
stop_server() { kill -TERM "$server"; wait "$server" || true; server=; }
# chaos OPTIONS...: a relay to the server; its port in $relay_port
chaos() {
  : >"$work/chaos.log"
  "$bin/strandcast-chaos" --listen 127.0.0.1:0 --to "127.0.0.1:$port" "$@" >"$work/chaos.log" 2>&1 & helpers+=($!)
  wait_for "$work/chaos.log"; relay_port=$(sed -n 's/^relaying .*:\([0-9]*\) to .*/\1/p' "$work/chaos.log")
}
stop_helpers() { for process in ${helpers[@]+"${helpers[@]}"}; do kill "$process" 2>/dev/null || true; wait "$process" || true; done; helpers=(); }
# Viewers are other machines: theirs must not be time that the server lacks.
load() { local name=$1; shift; nice -n 10 "$bin/strandcast-load" "$@" >"$out/load_$name.txt" || true; }
value() { sed -n "s/^$2=//p" "$out/load_$1.txt" | head -1; }
row() { printf '%-34s %s\n' "$1" "$2"; }
title() { echo "== $1 (load $(cut -d' ' -f1 /proc/loadavg))"; }

{
start_server
"$bin/strandcast-ctl" feed --connect "127.0.0.1:$port" --seconds 100000 >/dev/null 2>&1 & feed=$!
title "$viewers viewers at 60 Hz, viewers and server on the same $(nproc) cores"
# In turn, so that what else the machine does falls on both.
for round in 1 2 3; do
  load few --connect "127.0.0.1:$port" --viewers 1 --seconds "$seconds" --server-pid "$server"
  load many --connect "127.0.0.1:$port" --viewers "$viewers" --seconds "$seconds" --server-pid "$server"
  row "simulation step, 1 viewer, $viewers" "$(value few server_sim_step_median_ms), $(value many server_sim_step_median_ms) ms (load $(cut -d' ' -f1 /proc/loadavg))"
done
row "simulation, real time" "x$(value many server_sim_realtime_factor)"
row "frames per second and viewer" "$(value many frames_per_s_and_viewer)"
row "interval p50, p99, max" "$(value many interval_ms_p50), $(value many interval_ms_p99), $(value many interval_ms_max) ms"
row "latency p50, p99" "$(value many latency_ms_p50), $(value many latency_ms_p99) ms"
row "encodes, published states" "$(value many server_encode_frames_total), $(value many server_publish_snapshots_total)"
row "chain errors" "$(value many chain_errors)"

title "one of 16 viewers stalls"
# The machine alone moves a p99 by more than the 2 ms in question: pairs in turn, and the median of what they differ by.
differences=()
for round in 1 2 3 4 5 6 7; do
  load calm --connect "127.0.0.1:$port" --viewers 15 --seconds "$seconds" --server-pid "$server"
  load stalled --connect "127.0.0.1:$port" --viewers 15 --stalled-viewers 1 --warm-up 0.5 --seconds "$seconds" \
    --server-pid "$server"
  row "interval p99 without, with" "$(value calm interval_ms_p99), $(value stalled interval_ms_p99) ms"
  differences+=("$(awk "BEGIN { print $(value stalled interval_ms_p99) - $(value calm interval_ms_p99) }")")
done
row "median of the differences" "$(printf '%s\n' "${differences[@]}" | sort -g | sed -n 4p) ms"
row "server memory first, most" "$(value stalled server_rss_mib_first), $(value stalled server_rss_mib_most) MiB"
row "stalled viewers dropped" "$(value stalled server_net_stalled_total)"

for mbit in 2 5 10; do
  chaos --rate-mbit "$mbit" --delay-ms 10 --jitter-ms 5 --queue-kb 4000
  load "rate_$mbit" --connect "127.0.0.1:$relay_port" --viewers 1 --warm-up 6 --seconds "$seconds"
  stop_helpers
  title "$mbit Mbit/s, round trip 20 to 30 ms, a queue of 4 MB to fill"
  row "rate, Mbit/s" "$(value "rate_$mbit" frames_per_s_and_viewer) Hz, $(value "rate_$mbit" mbit_per_s)"
  row "strands, every, within" "$(value "rate_$mbit" newest_strand_share), $(value "rate_$mbit" newest_rate_divisor) steps, $(value "rate_$mbit" newest_bound_mm) mm; $(value "rate_$mbit" newest_quality_after_ms) ms after the first frame"
  row "send to arrival p50, p99, max" "$(value "rate_$mbit" latency_ms_p50), $(value "rate_$mbit" latency_ms_p99), $(value "rate_$mbit" latency_ms_max) ms"
done

title "far away, fast"
for trip in 20 150 300; do
  chaos --delay-ms $((trip / 2)) --jitter-ms 10
  load "trip_$trip" --connect "127.0.0.1:$relay_port" --viewers 1 --warm-up 4 --seconds "$seconds"
  stop_helpers
  row "round trip $trip ms + 0..20" "$(value "trip_$trip" frames_per_s_and_viewer) Hz, arrival p99 $(value "trip_$trip" latency_ms_p99) ms"
done

title "motion sample at the server to decoded frame"
"$bin/strandcast-view" --connect "127.0.0.1:$port" --headless --seconds "$seconds" --report "$out/motion.txt" >/dev/null
row "median, p99" "$(sed -n 's/^motion_to_decoded_ms_median=//p' "$out/motion.txt"), $(sed -n 's/^motion_to_decoded_ms_p99=//p' "$out/motion.txt") ms"
stop_helpers

title "soak: 32 viewers, one leaves and one joins every 100 ms, $soak s"
load soak --connect "127.0.0.1:$port" --viewers 32 --churn-ms 100 --warm-up 10 --seconds "$soak" --server-pid "$server"
row "joined, chain errors" "$(value soak joined), $(value soak chain_errors)"
row "memory first, most, last" "$(value soak server_rss_mib_first), $(value soak server_rss_mib_most), $(value soak server_rss_mib_last) MiB"
row "descriptors first, most, last" "$(value soak server_descriptors_first), $(value soak server_descriptors_most), $(value soak server_descriptors_last)"

if [ "$suspend" -gt 0 ]; then
  title "a viewer suspended for $suspend s"
  "$bin/strandcast-view" --connect "127.0.0.1:$port" --headless --seconds $((suspend + 6)) >"$work/view.txt" 2>&1 & viewer=$!
  sleep 3; kill -STOP "$viewer"; sleep "$suspend"; kill -CONT "$viewer"
  wait "$viewer" && row "came back" yes || row "came back" no
  row "sessions joined" "$(grep -c 'strandcast-view.*' "$work/server.log" || true)"
fi

kill "$feed"; wait "$feed" || true; feed=
title "the end, with $viewers viewers"
load "end" --connect "127.0.0.1:$port" --viewers "$viewers" --warm-up 1 --seconds 60 & watcher=$!
sleep 4
begin=$(date +%s%N); stop_server; end=$(date +%s%N)
wait "$watcher"
row "server ended after" "$(((end - begin) / 1000000)) ms"
row "closed with 1001" "$(value end close_1001)"
} | tee "$out/stream_faults.txt"
