#!/usr/bin/env bash
# Whether a library of others reads our recordings: the file of a server that was killed as a stream, and by its index
# what strandcast-ctl makes of it. Needs Node and, once, a registry.
#   bash tests/record/read_by_others.sh BUILD_FOLDER
set -euo pipefail
build="$(realpath "${1:?usage: read_by_others.sh BUILD_FOLDER}")"
here="$(realpath "$(dirname "$0")")"
node="$(command -v node || command -v nodejs || true)"
[ -n "$node" ] && command -v npm >/dev/null || { echo "skipped: needs Node with npm (nodejs, npm)"; exit 77; }

# The packages stay in the build folder, in the versions that the lock file names.
packages="$build/recording_proof"
mkdir -p "$packages"
cp "$here/package.json" "$here/package-lock.json" "$here/read_mcap.mjs" "$packages"
if ! cmp -s "$here/package-lock.json" "$packages/installed.json"; then
  (cd "$packages" && timeout 120 npm ci --ignore-scripts --no-audit --no-fund >npm.log 2>&1) ||
    { tail -3 "$packages/npm.log"; echo "skipped: the packages cannot be had from a registry"; exit 77; }
  cp "$here/package-lock.json" "$packages/installed.json"
fi

work="$(mktemp -d)"
server=""
trap '[ -z "$server" ] || kill -9 "$server" 2>/dev/null || true; rm -rf "$work"' EXIT
"$build/bin/strandcast-server" --port 0 --port-file "$work/port" --sim-device lanes --record "$work/run.mcap" \
  --set groom.procedural.strand_count=100 >"$work/log" 2>&1 &
server=$!
for _ in $(seq 100); do [ -s "$work/port" ] && break; sleep 0.1; done
"$build/bin/strandcast-ctl" --connect "127.0.0.1:$(cat "$work/port")" feed --seconds 2.5 >>"$work/log" 2>&1
kill -9 "$server"
wait "$server" 2>/dev/null || true
server=""

said() { "$node" "$packages/read_mcap.mjs" "$@"; }
holds() {  # FILE WHAT EXPRESSION: of the JSON `it`
  "$node" -e "const it = JSON.parse(require('fs').readFileSync(process.argv[1])); if (!(${3})) { console.error(process.argv[2], it); process.exit(1); }" "$1" "$2"
}
said stream "$work/run.mcap" >"$work/stream.json"
holds "$work/stream.json" "the killed server's file as a stream" \
  "!it.isDone && it.isOrdered && it.states > 60 && it.firstFrame === 0x20 &&
   ['/recording', '/asset', '/steps', '/input/motion', '/input/wind', '/strands/keyframes', '/strands/deltas', '/look', '/status']
     .every((topic) => it.topics[topic] > 0)"
if said index "$work/run.mcap" >"$work/no.json" 2>&1; then echo "a file without its end was read by its index"; exit 1; fi

"$build/bin/strandcast-ctl" recover "$work/run.mcap" "$work/whole.mcap" >"$work/recover.log" || { cat "$work/recover.log"; exit 1; }
said index "$work/whole.mcap" >"$work/index.json"
said stream "$work/whole.mcap" >"$work/whole.json"
holds "$work/whole.json" "the recovered file as a stream" "it.isDone && it.bytesLeft === 0"
holds "$work/index.json" "the recovered file by its index" \
  "it.profile === 'strandcast' && Object.entries(it.messages).every(([topic, count]) => it.counted[topic] === count)"
cat "$work/stream.json" "$work/index.json" | "$node" -e "
  const [stream, index] = require('fs').readFileSync(0, 'utf8').trim().split('\n').map(JSON.parse);
  // A whole file says twice what it is of.
  for (const topic of ['/recording', '/asset']) stream.topics[topic] += 1;
  const same = JSON.stringify(Object.entries(stream.topics).sort()) === JSON.stringify(Object.entries(index.topics).sort());
  if (!same) { console.error('the two readers see different messages', stream.topics, index.topics); process.exit(1); }
  console.log('both readers see', index.states, 'states and', index.topics['/strands/deltas'] + index.topics['/strands/keyframes'], 'frames');"
