#!/usr/bin/env bash
# Prints CSV: how many pictures a second a server without a GPU gives a viewer in frames mode, beside its running
# simulation, for as long as the machine allows: drawn, encoded, sent over loopback and decoded. With the processor time
# that the server takes, in total and per picture, the way from a motion sample to the decoded picture, and what each
# pass takes. Wall times are worth something on a quiet machine only; processor time always.
# usage: bash tests/bench/frames.sh [--bin DIR] [--size WxH] [--seconds N] [--pictures tiles|vp8|jpeg|h264] [server options]
set -euo pipefail

bin=build/release/bin; size=640x360; seconds=10; pictures=tiles
while [ $# -gt 1 ]; do
  case "$1" in
    --bin) bin=$2 ;;
    --size) size=$2 ;;
    --seconds) seconds=$2 ;;
    --pictures) pictures=$2 ;;
    *) break ;;
  esac
  shift 2
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
ticks() { awk '{print $14 + $15}' "/proc/$1/stat"; }  # user and system time, 1/100 s

"$bin/strandcast-server" --port 0 --port-file "$work/port" --log-level warn --renderer tiles --set stream.frame_rate_hz=60 \
  "$@" >/dev/null & server=$!
for _ in $(seq 300); do [ -s "$work/port" ] && break; kill -0 "$server" || exit 2; sleep 0.1; done
address=127.0.0.1:$(cat "$work/port")
"$bin/strandcast-ctl" feed --connect "$address" --motion builtin --loop >/dev/null 2>&1 & feed=$!
"$bin/strandcast-view" --connect "$address" --headless --mode frames --size "$size" --pictures "$pictures" \
  --seconds "$((seconds + 2))" --report "$work/report" >/dev/null & view=$!
sleep 2  # the first picture is there
begin=$(ticks "$server")
sleep "$((seconds - 1))"
used=$(($(ticks "$server") - begin))
curl -s "http://$address/metrics" >"$work/metrics" || true
wait "$view" || true
kill -TERM "$feed" "$server"; wait "$feed" "$server" || true

value() { sed -n "s/^$1=//p" "$work/report"; }
pass() { sed -n "s/^strandcast_pass_median_ms{pass=\"\(render\|encode\)\/\(.*\)\"} \(.*\)$/\1_\2_ms,\3/p" "$work/metrics"; }
rate=$(value frames_per_s)
echo "key,value"
echo "size,$size"
echo "pictures,$pictures"
echo "pictures_per_s,$rate"
for key in motion_to_decoded_ms_median motion_to_decoded_ms_p99 bytes_per_frame server_realtime_factor; do
  echo "$key,$(value "$key")"
done
awk -v used="$used" -v seconds="$((seconds - 1))" -v rate="$rate" 'BEGIN {
  printf "server_processors,%.2f\nserver_ms_per_picture,%.1f\n", used / seconds / 100, 10 * used / seconds / rate }'
pass | awk -F, '$2 > 0'
