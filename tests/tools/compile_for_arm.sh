#!/usr/bin/env bash
# Compiles every variant of the strand kernels for ARM with NEON, and the codecs that run them, by a cross compiler that is
# installed for it: the lanes use nothing that only x86 has. Says how many were compiled.
set -euo pipefail
cd "$(dirname "$0")/../.."
bash deploy/install_deps.sh g++-aarch64-linux-gnu
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
cmake -S . -B "$folder/build" -DCMAKE_BUILD_TYPE=Release -DBUILD_TESTING=OFF >/dev/null
cmake --build "$folder/build" --target strandcast_lane_texts >/dev/null
lanes="$folder/build/common/kernels/lanes"
count=0
for source in "$lanes"/lane_kernel_*_plain.cpp; do
  sed 's/^#define KERNEL_SET .*/#define KERNEL_SET 0/' "$source" >"$folder/kernel.cpp"
  aarch64-linux-gnu-g++ -std=c++20 -O1 -Wall -Wextra -Werror -Wno-psabi -ffp-contract=off -DSTRANDCAST_LANE_COUNT=4 -I"$lanes" \
    -Ishaders -I. -c "$folder/kernel.cpp" -o "$folder/kernel.o"
  count=$((count + 1))
done
[ "$count" -gt 0 ] || { echo "no kernel was found"; exit 1; }
files=0
for source in common/kernels/*.cpp common/strands/*.cpp common/strands/step/*.cpp common/strands/tangent/*.cpp; do
  aarch64-linux-gnu-g++ -std=c++20 -O1 -Wall -Wextra -Werror -Wno-psabi -ffp-contract=off -Ishaders -I. \
    -idirafter /usr/include -DFMT_HEADER_ONLY -c "$source" -o "$folder/file.o"
  files=$((files + 1))
done
echo "$count kernels and $files files of the codecs compile for NEON"
