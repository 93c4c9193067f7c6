#!/usr/bin/env bash
# Prints what relays cost and save, on one machine: a server without and with relays, each with its viewers.
#   server_percent   processor time of the server, percent of one core
#   streams          sessions of strands that it serves
#   latency_ms       median, from the server's send time to a viewer's reading, at the server and behind 1 and 2 relays
#   keyframes        made by the server while so many viewers joined at the relays, and asked for by those
#   chain_errors     deltas that a viewer had no base for: 0
#   relay_rss_mb     memory of the largest relay
# usage: bash tests/bench/relay.sh [--bin DIR] [--relays N] [--viewers N] [--seconds N] [server options]
set -euo pipefail

bin=build/release/bin; relays=4; viewers=64; seconds=20
while [ $# -gt 1 ]; do
  case "$1" in
    --bin) bin=$2 ;;
    --relays) relays=$2 ;;
    --viewers) viewers=$2 ;;
    --seconds) seconds=$2 ;;
    *) break ;;
  esac
  shift 2
done
work=$(mktemp -d)
pids=()
trap 'for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done; rm -rf "$work"' EXIT

start() {  # NAME OPTIONS...
  local name=$1
  shift
  "$bin/strandcast-server" --port 0 --port-file "$work/$name.port" --log-level warn "$@" >/dev/null &
  pids+=($!)
  echo $! >"$work/$name.pid"
  for _ in $(seq 300); do [ -s "$work/$name.port" ] && ready "$name" && return; kill -0 "$!" || exit 2; sleep 0.1; done
  echo "relay.sh: $name does not come up" >&2
  exit 1
}
get() {  # NAME PATH
  exec 3<>"/dev/tcp/127.0.0.1/$(cat "$work/$1.port")"
  printf 'GET %s HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n' "$2" >&3
  cat <&3
  exec 3>&-
}
ready() { get "$1" /readyz | grep -q "200 OK"; }
metric() { get "$1" /metrics | awk -v name="strandcast_$2" '$1 == name {print $2}'; }
ticks() { sed 's/.*) //' "/proc/$(cat "$work/$1.pid")/stat" | awk '{print $12 + $13}'; }
rss_mb() { awk '/VmRSS/ {print $2 / 1024}' "/proc/$(cat "$work/$1.pid")/status"; }
percent() { awk -v ticks="$1" -v hz="$(getconf CLK_TCK)" -v s="$seconds" 'BEGIN {printf "%.1f", 100 * ticks / hz / s}'; }
load() {  # NAME VIEWERS OUT
  "$bin/strandcast-load" --connect "127.0.0.1:$(cat "$work/$1.port")" --viewers "$2" --seconds "$seconds" >"$3" 2>/dev/null
}
value() { sed -n "s/^$2=//p" "$1"; }

start root --set groom.procedural.strand_count=200 --set stream.codec=tangent "$@"
before=$(ticks root)
load root 1 "$work/direct"
alone=$(percent $(($(ticks root) - before)))

for i in $(seq "$relays"); do start "relay$i" --max-sessions-per-address 256 --upstream "127.0.0.1:$(cat "$work/root.port")"; done
start far --upstream "127.0.0.1:$(cat "$work/relay1.port")"
keyframes=$(metric root encode_keyframes_total)
asked=0
before=$(ticks root)
loads=()
for i in $(seq "$relays"); do load "relay$i" "$viewers" "$work/load$i" & loads+=($!); done
load far 1 "$work/far" & loads+=($!)
sleep 2
streams=$(metric root net_joined_sessions)
for pid in "${loads[@]}"; do wait "$pid"; done
with=$(percent $(($(ticks root) - before)))
largest=0
for i in $(seq "$relays"); do
  largest=$(awk -v a="$largest" -v b="$(rss_mb "relay$i")" 'BEGIN {printf "%.0f", (a > b ? a : b)}')
  asked=$((asked + $(metric "relay$i" relay_keyframes_asked_total | cut -d. -f1)))
done
echo "viewers_in_all=$((relays * viewers + 1))"
echo "server_percent_one_viewer=$alone"
echo "server_percent_with_relays=$with"
echo "server_sessions=$streams"
echo "latency_ms_direct=$(value "$work/direct" latency_ms_p50)"
echo "latency_ms_one_relay=$(value "$work/load1" latency_ms_p50)"
echo "latency_ms_two_relays=$(value "$work/far" latency_ms_p50)"
echo "chain_errors=$(cat "$work"/load* | awk -F= '$1 == "chain_errors" {sum += $2} END {print sum + 0}')"
echo "server_keyframes=$(($(metric root encode_keyframes_total | cut -d. -f1) - ${keyframes%.*}))"
echo "relay_keyframes_asked=$asked"
echo "relay_rss_mb=$largest"
