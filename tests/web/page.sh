#!/usr/bin/env bash
# The sources of the page and of the npm package: strictly typed, and the page's parts as tests/web/page.test.mjs says.
#   bash tests/web/page.sh
set -euo pipefail
here="$(realpath "$(dirname "$0")")"
node="$(command -v node || command -v nodejs || true)"
for tool in "$node" esbuild tsc; do
  command -v "$tool" >/dev/null || { echo "skipped: needs nodejs, esbuild and node-typescript"; exit 77; }
done
for part in page package; do tsc --project "$here/../../client/web/$part"; done
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
NODE_PATH="$here/../.." esbuild "$here/page_parts.ts" --bundle --format=esm --target=es2022 --loader:.glsl=text --loader:.h=text \
  --log-level=warning --outfile="$work/page.mjs"
"$node" "$here/page.test.mjs" "$work/page.mjs"
