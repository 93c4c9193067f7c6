#!/usr/bin/env bash
# Fetches the source of Debian's zstd (by its BSD licence) for what is compiled for browsers, and leaves it in a folder,
# unless it is there:
#   bash client/web/fetch_zstd.sh FOLDER
set -euo pipefail
folder="${1:?usage: fetch_zstd.sh FOLDER}"
if [ -e "$folder/lib/zstd.h" ]; then exit 0; fi
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/lists/partial"
echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian $(. /etc/os-release && echo "$VERSION_CODENAME") main" >"$work/sources.list"
lists=(-o Dir::Etc::sourcelist="$work/sources.list" -o Dir::Etc::sourceparts=- -o Dir::State::lists="$work/lists"
  -o APT::Sandbox::User= -qq)
(
  cd "$work"
  apt-get "${lists[@]}" update
  apt-get "${lists[@]}" source --download-only libzstd
)
rm -rf "$folder"
mkdir -p "$folder"
tar -xf "$(ls "$work"/libzstd_*.orig.tar.* | grep -v asc\$)" -C "$folder" --strip-components=1
