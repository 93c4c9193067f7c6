#!/usr/bin/env bash
# What a night is for: fuzzes every target, walks the whole grids of the long tests, runs the suite under the sanitizers,
# and looks at the programs as a whole.
#   bash tests/nightly.sh                      all of it, 60 s for each fuzzer
#   bash tests/nightly.sh --seconds 5 fuzz     the short form: only the fuzzers, 5 s each
# Parts: fuzz, grids (property, comparing, OpenGL and unit tests), dev (address and undefined behaviour, all tests), tsan (threads, all
# tests but those of grids), lto (do all files agree on every type, and does each include what it uses), arm (do the strand
# kernels compile for NEON), packages (as root: do the Debian packages install, run and go in a clean Debian 12, and does the
# container), fleet (sessions, relays and viewers with a Slurm and an HAProxy of their own: deploy/fleet/try.sh), wasm (does the strand core in WebAssembly decode what this one does, bit for bit, and does the page work in a browser),
# mutants (300 faults planted at random, by the date's seed: which of them does no test notice?), vopr (2,000 seeds of the whole system
# on simulated time, from the date's seed on), links (which class of strands viewer and page find over 36 links). A part that fails
# does not keep the others from running; a table of all stands at the end. A finding of a fuzzer stays under
# build/fuzz/findings.
set -euo pipefail
cd "$(dirname "$0")/.."

seconds=60
jobs=2
parts=()
while [ $# -gt 0 ]; do
  case "$1" in
    --seconds) seconds="${2:?--seconds needs a number}"; shift 2 ;;
    fuzz | grids | dev | tsan | lto | arm | packages | fleet | wasm | mutants | vopr | links) parts+=("$1"); shift ;;
    *) echo "unknown argument '$1' (known: --seconds N, fuzz, grids, dev, tsan, lto, arm, packages, fleet, wasm, mutants, vopr, links)" >&2; exit 2 ;;
  esac
done
[ ${#parts[@]} -gt 0 ] || parts=(fuzz grids dev tsan lto arm packages fleet wasm mutants vopr links)

bash deploy/install_deps.sh clang libclang-rt-14-dev xvfb xauth glslang-tools glslc spirv-tools
log="$(mktemp)"
trap 'rm -f "$log"' EXIT

# build PRESET [OPTION...]
build() {
  cmake --preset "$@" >/dev/null && cmake --build --preset "$1"
}

# Prints what the part says as it goes; its last line is the part's result.
run_part() {
  case "$1" in
    fuzz) build fuzz -DSTRANDCAST_FUZZ_SECONDS="$seconds" && bash tests/run_preset.sh nightly build/fuzz "$jobs" ;;
    grids) bash deploy/install_deps.sh libltc-dev; build ci && STRANDCAST_TEST_GRID=whole bash tests/run_preset.sh ci build/ci "$jobs" -L 'property|compare|gl|unit' ;;
    dev) build dev && bash tests/run_preset.sh dev build/dev "$jobs" ;;
    # The laws of solvers take most of an hour here and have one thread of ours.
    tsan) build tsan && bash tests/run_preset.sh tsan build/tsan "$jobs" -LE 'property|compare' ;;
    lto) build lto && echo "all files agree" ;;
    arm) bash tests/tools/compile_for_arm.sh ;;
    packages)
      bash deploy/install_deps.sh debootstrap lintian desktop-file-utils dpkg-dev file buildah python3 emscripten esbuild nodejs
      build release -DBUILD_TESTING=OFF -DSTRANDCAST_WEB=ON && (cd build/release && rm -f packages/*.deb && cpack -G DEB >/dev/null) &&
        bash tests/packages/clean_root.sh build/release/packages build/packages &&
        bash tests/packages/container.sh build/release/packages build/packages
      ;;
    fleet)
      bash deploy/install_deps.sh munge slurmctld slurmd slurm-client haproxy python3
      build ci && bash deploy/fleet/try.sh --bin build/ci/bin
      ;;
    wasm)
      bash deploy/install_deps.sh emscripten esbuild nodejs dpkg-dev node-typescript chromium firefox-esr libjs-three
      build ci -DSTRANDCAST_WEB=ON && STRANDCAST_SOAK_S=600 STRANDCAST_TEST_GRID=whole bash tests/run_preset.sh ci build/ci 1 -R '^web\.' &&
        for name in browser window; do STRANDCAST_BROWSER=firefox node tests/web/page_$name.mjs build/ci/bin/strandcast-server || exit 1; done &&
        cmake --preset ci -DSTRANDCAST_WEB=OFF >/dev/null
      ;;
    mutants) bash tests/mutants.sh --random 300 --seed "$(date +%Y%m%d)" --most 10 ;;
    links)
      bash deploy/install_deps.sh emscripten esbuild nodejs dpkg-dev node-typescript chromium
      build ci -DSTRANDCAST_WEB=ON || return
      local native=0
      build/ci/bin/strandcast-vopr --links whole || native=1
      node tests/web/page_links.mjs build/ci/bin/strandcast-server && [ "$native" = 0 ]
      ;;
    vopr) build ci && build/ci/bin/strandcast-vopr --seeds "$(date +%Y%m%d)0000..$(date +%Y%m%d)1999" ;;
  esac
}

table=""
number=0
outcome=0
for part in "${parts[@]}"; do
  number=$((number + 1))
  echo "== $part ($number of ${#parts[@]}), begun at $(date +%H:%M:%S)"
  begun=$SECONDS
  status=0
  run_part "$part" 2>&1 | tee "$log" || status=1
  word=passed
  [ "$status" -eq 0 ] || { word=FAILED; outcome=1; }
  table+="$(printf '%-8s  %-6s  %6d s  %s' "$part" "$word" $((SECONDS - begun)) "$(tail -n 1 "$log")")"$'\n'
done
echo "== results"
printf '%s' "$table"
exit "$outcome"
