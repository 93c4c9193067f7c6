#!/usr/bin/env bash
# A whole fleet on this machine: Slurm with two pretended GPUs, HAProxy, two sessions of two relays each, a third session
# that waits for a GPU, and many viewers; stops all of it in the end. Needs munge, slurmctld, slurmd, haproxy and the built
# programs. Nothing of it touches a Slurm or HAProxy that this machine may have.
#   bash deploy/fleet/try.sh [--bin FOLDER] [--viewers N] [--seconds S] [--keep]     --keep: waits for Enter before it stops
set -euo pipefail
cd "$(dirname "$0")/../.."
bin=; viewers=100; seconds=10; keep=
while [ $# -gt 0 ]; do
  case "$1" in
    --bin) bin=$2; shift ;;
    --viewers) viewers=$2; shift ;;
    --seconds) seconds=$2; shift ;;
    --keep) keep=1 ;;
    *) echo "usage: try.sh [--bin FOLDER] [--viewers N] [--seconds S] [--keep]" >&2; exit 2 ;;
  esac
  shift
done
if [ -z "$bin" ]; then  # without a build, the programs of the packages
  bin=build/release/bin
  [ -d "$bin" ] || ! installed=$(command -v strandcast-load) || bin=$(dirname "$installed")
fi
bin=$(realpath -m "$bin")
export PATH=$PATH:/usr/sbin:/sbin
for program in munged slurmctld slurmd sbatch haproxy python3; do
  command -v $program > /dev/null || { echo "try.sh: $program is not installed: apt-get install munge slurmctld slurmd slurm-client haproxy python3" >&2; exit 2; }
done
for program in strandcast-server strandcast-ctl strandcast-load strandcast-view; do
  [ -x "$bin/$program" ] || { echo "try.sh: no $program in $bin: build it, or say --bin FOLDER" >&2; exit 2; }
done

work=$(mktemp -d); chmod 755 "$work"
export STRANDCAST_FLEET=$work/fleet SLURM_CONF=$work/slurm.conf
fleet() { python3 deploy/fleet/strandcast-fleet "$@"; }
pids=()
stop_all() {
  trap - EXIT INT TERM
  # Those that somebody started by hand meanwhile too.
  for folder in "$STRANDCAST_FLEET"/sessions/*/; do fleet stop "$(basename "$folder")" > /dev/null 2>&1 || true; done
  # Slurm ends jobs; without it their last steps would wait for it.
  for _ in $(seq 150); do [ -n "$(squeue --noheader 2> /dev/null)" ] || break; sleep 0.1; done
  for ((i = ${#pids[@]} - 1; i >= 0; --i)); do kill "${pids[i]}" 2> /dev/null || true; done
  for pid in "${pids[@]}"; do for _ in $(seq 100); do kill -0 "$pid" 2> /dev/null || break; sleep 0.1; done; done
  rm -rf "$work"
  echo "stopped; nothing is left"
}
trap stop_all EXIT
trap 'exit 1' INT TERM
free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }
wait_for() {  # WHAT COMMAND...
  local what=$1; shift
  for _ in $(seq 150); do "$@" > /dev/null 2>&1 && return; sleep 0.1; done
  echo "try.sh: $what does not come up:" >&2
  tail -n 5 "$work"/*.log >&2
  exit 1
}

# Its programs talk through a key of this run.
mkdir "$work/munge" "$work/ctld" "$work/node" "$work/fleet"
chmod 700 "$work/munge"
dd if=/dev/urandom of="$work/munge/key" bs=1024 count=1 status=none
chmod 400 "$work/munge/key"
munged --foreground --force --socket="$work/munge/socket" --key-file="$work/munge/key" --pid-file="$work/munge/pid" \
  --log-file="$work/munge/log" --seed-file="$work/munge/seed" --num-threads=2 > "$work/munged.log" 2>&1 &
pids+=($!)
wait_for munged test -S "$work/munge/socket"

host=$(hostname -s)
cat > "$SLURM_CONF" <<CONF
ClusterName=try
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CredType=cred/munge
StateSaveLocation=$work/ctld
SlurmdSpoolDir=$work/node
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_min_interval=100000,batch_sched_delay=0
KillWait=10
GresTypes=gpu
SlurmdParameters=config_overrides
NodeName=$host NodeAddr=127.0.0.1 CPUs=64 Gres=gpu:2 State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
printf 'NodeName=%s Name=gpu File=/dev/%s\n' "$host" null "$host" zero > "$work/gres.conf"
echo "CgroupPlugin=cgroup/v1" > "$work/cgroup.conf"
slurmctld -D > "$work/slurmctld.log" 2>&1 &
pids+=($!)
slurmd -D > "$work/slurmd.log" 2>&1 &
pids+=($!)
wait_for Slurm sh -c 'sinfo --noheader --format=%T | grep -qx idle'
echo "Slurm is up, with two pretended GPUs"

web=$(free_port)
cat > "$work/fleet/fleet.json" <<CONF
{"haproxy_socket": "$work/haproxy.sock", "haproxy_bind": "127.0.0.1:$web", "public": "ws://127.0.0.1:$web",
 "listen": "127.0.0.1", "server": "$bin/strandcast-server", "slots": 4}
CONF
fleet proxy-config > "$work/haproxy.cfg"
haproxy -db -f "$work/haproxy.cfg" > "$work/haproxy.log" 2>&1 &
pids+=($!)
wait_for HAProxy test -S "$work/haproxy.sock"
python3 deploy/fleet/strandcast-fleet tend > "$work/tend.log" 2>&1 &
pids+=($!)

small=(--set groom.procedural.strand_count=500)
for name in one two; do fleet start $name --relays 2 -- "${small[@]}"; done
fleet start three --wait 2 -- "${small[@]}"
for _ in $(seq 100); do [ "$(fleet list | grep -c ' 2  .* ready$')" = 2 ] && break; sleep 0.2; done
fleet list
loads=()
for name in one two; do
  "$bin/strandcast-load" --connect "ws://127.0.0.1:$web/s/$name" --token-file "$STRANDCAST_FLEET/sessions/$name/viewer_token" \
    --viewers $((viewers / 2)) --seconds "$seconds" > "$work/load_$name.log" 2>&1 &
  loads+=($!)
done
sleep $((seconds / 2 + 2))
fleet list
failed=
for pid in "${loads[@]}"; do wait "$pid" || failed=1; done
for name in one two; do echo "session $name:"; grep -v '^server_' "$work/load_$name.log" || true; done
echo "a relay of session two is killed, and its viewers come back by the other:"
watches=()
for number in 1 2; do
  "$bin/strandcast-view" --connect "ws://127.0.0.1:$web/s/two" --token-file "$STRANDCAST_FLEET/sessions/two/viewer_token" \
    --headless --mode strands --seconds 10 --trace "$work/seen_$number.csv" > "$work/view_$number.log" 2>&1 &
  watches+=($!)
done
sleep 4
scancel --full --signal=KILL "$(cat "$STRANDCAST_FLEET/sessions/two/relays/001/job")"
for pid in "${watches[@]}"; do wait "$pid" || failed=1; done
python3 - "$work"/seen_*.csv << 'PYTHON' || failed=1
import csv, sys
for path in sys.argv[1:]:
    received = [int(row["received_ns"]) for row in csv.DictReader(open(path))]
    waits = [(b - a) * 1e-9 for a, b in zip(received, received[1:])]
    print(f"  {len(received)} frames of strands, at most {max(waits):.2f} s without one")
PYTHON
echo "one is stopped, and the third gets its GPU:"
fleet stop one
for _ in $(seq 100); do fleet list | grep -q '^three .*ready$' && break; sleep 0.2; done
fleet list
fleet list | grep -q '^three .*ready$' || failed=1
[ -z "$keep" ] || { echo "strandcast-fleet: export STRANDCAST_FLEET=$STRANDCAST_FLEET SLURM_CONF=$SLURM_CONF; Enter stops it"; read -r; }
[ -z "$failed" ] || { tail -n 5 "$work"/*.log; exit 1; }
