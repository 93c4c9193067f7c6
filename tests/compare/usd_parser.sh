#!/usr/bin/env bash
# Exported USD, read by a parser that shares no code with ours (tinyusdz, of npm), against the same strands as CSV:
#   bash tests/compare/usd_parser.sh WRITE_CURVES BUILD_FOLDER
set -euo pipefail
here="$(realpath "$(dirname "$0")")"
write_curves="$1" packages="$2/npm"
version=0.9.0-rc10
sum=3204e8a8422126861a4b8a1b0951cb9652a390c1a221042ac434bd04ee8676f5504692fa4d0ff4928c3848ea35cd00f036ff448d8709b4788faf9d3abfe5ce5e

skip() { echo "skipped: $1"; exit 77; }
node="$(command -v node || command -v nodejs)" || skip "needs nodejs"
command -v npm >/dev/null || skip "needs npm"
package="$packages/tinyusdz-$version"
if [ ! -e "$package/package/tinyusdz.mjs" ]; then
  mkdir -p "$package"
  (cd "$package" && timeout 60 npm pack --silent "tinyusdz@$version") >/dev/null || skip "the npm registry is out of reach"
  echo "$sum  $package/tinyusdz-$version.tgz" | sha512sum --check --quiet
  tar -xzf "$package/tinyusdz-$version.tgz" -C "$package"
  cp "$package/package/tinyusdz.js" "$package/package/tinyusdz.mjs"  # a module by its name for every Node
fi
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
"$write_curves" "$work"
"$node" "$here/usd_parser.mjs" "$package/package" "$work"
