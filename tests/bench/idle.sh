#!/usr/bin/env bash
# Prints CSV: the processor time of a whole server, thread by thread (by their names, with how often they went to sleep),
# in percent of one core: with nobody there, with nobody but a source of motion, and with one viewer of strands besides.
# Processor time is worth something on a busy machine too.
# usage: bash tests/bench/idle.sh [--bin DIR] [--seconds N] [server options]
set -euo pipefail

bin=build/release/bin; seconds=10
while [ $# -gt 1 ]; do
  case "$1" in
    --bin) bin=$2 ;;
    --seconds) seconds=$2 ;;
    *) break ;;
  esac
  shift 2
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# NAME TICKS SLEEPS of every thread
threads() {
  local task
  for task in /proc/"$1"/task/*; do
    awk -v name="$(tr ' ' '_' <"$task/comm")" -v sleeps="$(awk '/^voluntary/ {print $2}' "$task/status")" '
      {sub(/.*\) /, ""); print name, $12 + $13, sleeps}' "$task/stat"
  done 2>/dev/null
}
measure() {  # measure SITUATION
  threads "$server" >"$work/before"
  sleep "$seconds"
  threads "$server" >"$work/after"
  awk -v situation="$1" -v seconds="$seconds" '
    NR == FNR {ticks[$1] -= $2; sleeps[$1] -= $3; next}
    {ticks[$1] += $2; sleeps[$1] += $3}
    END {
      for (name in ticks) {
        if (name ~ /llvmpipe/) {ticks["llvmpipe"] += ticks[name]; sleeps["llvmpipe"] += sleeps[name]}
      }
      for (name in ticks) {
        if (name ~ /llvmpipe-/) continue
        all += ticks[name]
        if (ticks[name] + sleeps[name] > 0) printf "%s,%s,%.1f,%.0f\n", situation, name, ticks[name] / seconds, sleeps[name] / seconds
      }
      printf "%s,all,%.1f,\n", situation, all / seconds
    }' "$work/before" "$work/after" | sort
}

"$bin/strandcast-server" --port 0 --port-file "$work/port" --log-level warn "$@" >/dev/null & server=$!
for _ in $(seq 300); do [ -s "$work/port" ] && break; kill -0 "$server" || exit 2; sleep 0.1; done
address=127.0.0.1:$(cat "$work/port")
echo "situation,thread,percent_of_a_core,sleeps_per_s"
sleep 2
measure nobody
"$bin/strandcast-ctl" feed --connect "$address" --motion builtin --loop >/dev/null 2>&1 & feed=$!
sleep 1
measure source
"$bin/strandcast-view" --connect "$address" --headless --mode strands --seconds "$((seconds + 4))" --report "$work/report" >/dev/null & view=$!
sleep 2
measure viewer
wait "$view" || true
curl -s "http://$address/metrics" >"$work/metrics" || true
kill -TERM "$feed" "$server"; wait "$feed" "$server" || true
sed -n 's/^\(frames_per_s\|bytes_per_frame\|server_realtime_factor\)=/report,\1,/p' "$work/report"
sed -n 's/^strandcast_pass_median_ms{pass="\(.*\)"} \(.*\)$/median_ms,\1,\2/p' "$work/metrics" | awk -F, '$3 > 0'
