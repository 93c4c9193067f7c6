#!/usr/bin/env bash
# check_lane_kernels.sh SOURCE COMPILER [LIBRARY]: what shaders/README.md says of the GLSL of strand kernels. A kernel that
# branches on what differs between strands does not compile, and the message names its line and what to use; every
# uniform and buffer of shaders/sim is translated; in the LIBRARY of kernels no function is shared with other files, which
# may be compiled for other instruction sets (common/kernels/lane_kernel.h).
set -euo pipefail
source_folder="$1"
compiler="$2"
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
mkdir -p "$folder/shaders/sim" "$folder/lanes/sim"
cp "$source_folder"/shaders/sim/* "$folder/shaders/sim/"

# translate NAME: makes C++ of a file of shaders/sim.
translate() {
  cmake -DROOT="$folder/shaders" -DFILE="sim/$1" -DOUTPUT="$folder/lanes/sim/$1" -P "$source_folder/shaders/lanes.cmake"
}
for file in "$folder"/shaders/sim/*.glsl; do
  translate "$(basename "$file")"
done
# What every kernel begins with is parsed once.
options=(-std=c++20 -Wno-psabi "-I$folder/lanes" "-I$source_folder/shaders" "-I$source_folder")
printf '%s\n' '#define STRANDCAST_LANE_COUNT 4' '#include "common/kernels/lane_kernel_headers_private.h"' >"$folder/head.h"
"$compiler" "${options[@]}" -x c++-header "$folder/head.h"

# try STATEMENTS: the compiler's message for a kernel with them, on its third line.
try() {
  printf '#include "sim/follow.glsl"\nvoid main() {\n  %s\n}\n' "$1" >"$folder/shaders/sim/bad.comp"
  translate bad.comp
  printf '%s\n' '#include "head.h"' '#define HAS_PINNED_TAIL 0' '#define KERNEL_FILE "sim/bad.comp"' \
    '#define KERNEL_NAME bad' '#define KERNEL_VARIANT ""' '#define KERNEL_SET 0' '#define KERNEL_PARTS 1' \
    '#include "common/kernels/lane_kernel_private.h"' >"$folder/bad.cpp"
  "$compiler" "${options[@]}" -fsyntax-only "$folder/bad.cpp" 2>&1 || true
}
# refused STATEMENTS WORDS: it does not compile, and the message has the line and the words.
refused() {
  local message
  message="$(try "$1")"
  grep -q "shaders/sim/bad.comp:3:" <<<"$message" || { echo "no line of the kernel is named for: $1"; echo "$message"; exit 1; }
  grep -q "$2" <<<"$message" || { echo "'$2' is not said for: $1"; echo "$message"; exit 1; }
}

good='const vec4 state = texelFetch(u_position, 0); b_position.position[0] = select(state.x > 0.0, state, -state);'
message="$(try "$good")"
[ -z "$message" ] || { echo "a good kernel does not compile:"; echo "$message"; exit 1; }
refused 'if (texelFetch(u_rest, 0).x > 0.0) return;' 'cannot steer if'
refused 'const float a = texelFetch(u_rest, 0).x; const float b = a > 0.0 ? a : 1.0;' 'cannot steer if'
refused 'while (texelFetch(u_rest, 0).x > 0.0) {}' 'cannot steer if'
refused 'const bool is_up = texelFetch(u_rest, 0).x > 0.0;' 'cannot steer if'
refused 'barrier();' 'barrier'

if [ $# -gt 2 ]; then
  shared="$(nm -C "$3" 2>/dev/null | grep -E ' [WVu] ' || true)"
  [ -z "$shared" ] || { echo "shared with files of other instruction sets:"; echo "$shared"; exit 1; }
fi
echo "kernels say what they may not"
