#!/usr/bin/env bash
# Builds deploy/Containerfile and runs what comes out, without a registry: the base image is a clean Debian 12, the
# first stage's packages are those of PACKAGES_FOLDER (which are built by the same lines). With buildah where it works,
# else the second stage's steps are replayed in a root folder, and that is said.
#   bash tests/packages/container.sh PACKAGES_FOLDER WORK_FOLDER       as root
set -euo pipefail
here="$(realpath "$(dirname "$0")")"
source="$(realpath "$here/../..")" packages="$(realpath "$1")" work="$2"
fail() { echo "FAILED: $1" >&2; exit 1; }
[ "$(id -u)" -eq 0 ] || fail "images are made by root alone here"
mkdir -p "$work"
work="$(realpath "$work")"
bash "$here/make_base.sh" "$work/base.tar"

# The second stage alone, with the packages where the first one leaves them.
context="$work/context"
rm -rf "$context"
mkdir -p "$context/packages"
cp "$packages"/*.deb "$context/packages/"
file="$work/Containerfile"
awk '/^FROM/ { stage++ } stage != 1' "$source/deploy/Containerfile" |
  sed 's|^COPY --from=build [^ ]* |COPY packages/*.deb |' >"$file"
grep -q '^COPY packages/' "$file" && grep -q '^HEALTHCHECK' "$file" || fail "the second stage is not where it was in deploy/Containerfile"

# The words of an ENTRYPOINT or a CMD behind a HEALTHCHECK.
words_of() { sed -n "s/^$1.*\[\(.*\)\]\$/\1/p" "$file" | tr -d '",' ; }
root="$work/container"
clean_up() {
  [ -z "${server:-}" ] || kill "$server" 2>/dev/null || true
  [ -z "${container:-}" ] || buildah "${storage[@]}" rm "$container" >/dev/null 2>&1 || true
  umount "$root/proc" 2>/dev/null || true
  rm -rf --one-file-system "$root" "$context" "$work/storage" "$work/run"
}
trap clean_up EXIT
storage=(--root "$work/storage" --runroot "$work/run" --storage-driver vfs)

make_by_buildah() {
  command -v buildah >/dev/null || return 1
  buildah "${storage[@]}" from --name base scratch >/dev/null && buildah "${storage[@]}" add -q base "$work/base.tar" / >/dev/null &&
    buildah "${storage[@]}" commit -q base strandcast-base >/dev/null && buildah "${storage[@]}" rm base >/dev/null &&
    buildah "${storage[@]}" build -q --isolation chroot --format docker --pull=never --build-arg BASE=localhost/strandcast-base \
      -t strandcast -f "$file" "$context" >/dev/null || return 1
  container="$(buildah "${storage[@]}" from --pull=never localhost/strandcast)"
  mkdir -p "$root"
  mount="$(buildah "${storage[@]}" mount "$container")"
  rmdir "$root"
  cp -a "$mount" "$root"
}
replay() {
  mkdir -p "$root/packages"
  tar -xpf "$work/base.tar" -C "$root"
  cp "$packages"/*.deb "$root/packages/"
  mount -t proc proc "$root/proc"
  # The RUN of the file, its lines joined.
  sed -n '/^RUN/,/[^\\]$/p' "$file" | sed 's/^RUN //; s/\\$//' | tr -d '\n' |
    chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive sh -e
  umount "$root/proc"
}
if make_by_buildah 2>"$work/buildah.log"; then
  echo "image made by buildah: $(buildah "${storage[@]}" inspect --format '{{.Docker.Config.User}} {{.Docker.Config.Entrypoint}}' strandcast)"
  [ "$(buildah "${storage[@]}" inspect --format '{{.Docker.Config.User}}' strandcast)" = strandcast ] || fail "the image runs as root"
else
  echo "no image by buildah ($(tail -1 "$work/buildah.log" 2>/dev/null || true)): the steps are replayed in a root folder"
  replay
fi

# As a container would run it: by its user, with its entry point, looked at by its health check.
mount -t proc proc "$root/proc"
as_user() { chroot --userspec=strandcast:strandcast "$root" env -i PATH=/usr/bin:/bin "$@"; }
port="$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')"
chroot --userspec=strandcast:strandcast "$root" env -i PATH=/usr/bin:/bin $(words_of ENTRYPOINT) --port "$port" \
  --seconds 120 >"$work/server.log" 2>&1 & server=$!
for _ in $(seq 300); do
  as_user $(words_of HEALTHCHECK) --connect "127.0.0.1:$port" >"$work/health.log" 2>&1 && break
  kill -0 "$server" 2>/dev/null || { cat "$work/server.log" >&2; fail "the server of the image has ended"; }
  sleep 0.2
done
as_user $(words_of HEALTHCHECK) --connect "127.0.0.1:$port" || fail "the health check: $(cat "$work/health.log")"
[ "$(stat -c %u "/proc/$server")" -ne 0 ] || fail "the server runs as root"
kill -TERM "$server"
wait "$server" || fail "the server of the image does not stop cleanly: $(tail -3 "$work/server.log")"
server=
if as_user $(words_of HEALTHCHECK) --connect "127.0.0.1:$port" >/dev/null 2>&1; then fail "the health check is content with no server"; fi
echo "the container's server runs as its user, is healthy and stops"
