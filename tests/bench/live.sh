#!/usr/bin/env bash
# Prints CSV: what 1,000 packets of motion capture a second cost a server, and how many of them it read: packets sent and
# read, those lost on the way, the processor time of its threads in percent of one core, and how unevenly packets came.
# Processor time is worth something on a busy machine too; a lost packet may be the sender's there.
# usage: bash tests/bench/live.sh [--bin DIR] [--seconds N] [--rate N] [--as vmc|opentrack|freed] [server options]
set -euo pipefail

bin=build/release/bin; seconds=60; rate=1000; protocol=opentrack
while [ $# -gt 1 ]; do
  case "$1" in
    --bin) bin=$2 ;;
    --seconds) seconds=$2 ;;
    --rate) rate=$2 ;;
    --as) protocol=$2 ;;
    *) break ;;
  esac
  shift 2
done
work=$(mktemp -d)
port=$((20000 + $$ % 20000))

# Ticks of the threads of this name.
ticks() {
  local task sum=0
  for task in /proc/"$server"/task/*; do
    [ "$(cat "$task/comm")" = "$1" ] && sum=$((sum + $(sed 's/.*) //' "$task/stat" | awk '{print $12 + $13}')))
  done
  echo "$sum"
}
metric() {
  local answer
  exec 3<>"/dev/tcp/127.0.0.1/$(cat "$work/port")"
  printf 'GET /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n' >&3
  answer=$(cat <&3)
  exec 3>&-
  awk -v name="strandcast_$1{" 'index($0, name) == 1 {print $2}' <<<"$answer"
}

"$bin/strandcast-server" --port 0 --port-file "$work/port" --log-level warn --mocap "$protocol:$port" "$@" >/dev/null &
server=$!
trap 'kill "$server" 2>/dev/null; rm -rf "$work"' EXIT
for _ in $(seq 300); do [ -s "$work/port" ] && break; kill -0 "$server" || exit 2; sleep 0.1; done
before=$(ticks mocap)
"$bin/strandcast-ctl" feed --as "$protocol" --to "127.0.0.1:$port" --rate "$rate" --seconds "$seconds" --wind none >"$work/sent" 2>/dev/null
after=$(ticks mocap)
sent=$(sed -n 's/.*: \([0-9]*\) packets.*/\1/p' "$work/sent")
read=$(metric live_packets_total)
echo "packets_sent,packets_read,packets_lost,percent_of_a_core,jitter_ms,clamped,over_rate"
awk -v sent="$sent" -v read="$read" -v ticks=$((after - before)) -v seconds="$seconds" -v hz="$(getconf CLK_TCK)" \
  -v jitter="$(metric live_jitter_ms)" -v clamped="$(metric live_clamped_total)" -v over="$(metric live_over_rate_total)" \
  'BEGIN {printf "%d,%d,%d,%.2f,%.3f,%d,%d\n", sent, read, sent - read, 100 * ticks / hz / seconds, jitter, clamped, over}'
