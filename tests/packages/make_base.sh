#!/usr/bin/env bash
# A clean Debian 12 as a tar file, from Debian's mirror; kept for a week.
#   bash tests/packages/make_base.sh FILE.tar
set -euo pipefail
file="$1"
if [ -n "$(find "$file" -mtime -7 2>/dev/null)" ]; then exit 0; fi
folder="$(mktemp -d)"
trap 'rm -rf --one-file-system "$folder"' EXIT
chmod 755 "$folder"  # what is no root's must get in, too
echo "Making a clean Debian 12 ..."
debootstrap --variant=minbase bookworm "$folder" "${STRANDCAST_DEBIAN_MIRROR:-http://deb.debian.org/debian}" >"$file.log" 2>&1 ||
  { tail -20 "$file.log" >&2; exit 1; }
tar -cpf "$file.new" -C "$folder" --exclude='./var/cache/apt/archives/*.deb' .
mv "$file.new" "$file"
