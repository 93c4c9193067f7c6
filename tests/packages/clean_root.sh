#!/usr/bin/env bash
# Debian packages as a person gets them: lintian, then a clean Debian 12 in a folder (debootstrap) in which apt installs
# them, the server runs as its units say, the viewer draws, the examples are built, and a purge leaves nothing.
#   bash tests/packages/clean_root.sh PACKAGES_FOLDER WORK_FOLDER        as root; WORK_FOLDER keeps base.tar for the next time
set -euo pipefail
here="$(realpath "$(dirname "$0")")"
packages="$(realpath "$1")" work="$2"
fail() { echo "FAILED: $1" >&2; exit 1; }
[ "$(id -u)" -eq 0 ] || fail "a root folder can be made by root alone"
mkdir -p "$work"
work="$(realpath "$work")"
root="$work/root"

clean_up() { umount "$root/proc" 2>/dev/null || true; rm -rf --one-file-system "$root"; }
trap clean_up EXIT
clean_up

echo "== lintian"
lintian --allow-root --fail-on error "$packages"/*.deb

bash "$here/make_base.sh" "$work/base.tar"
mkdir -p "$root"
tar -xpf "$work/base.tar" -C "$root"
mount -t proc proc "$root/proc"
mkdir -p "$root/packages"
cp "$packages"/*.deb "$root/packages/"
in_root() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
install() { in_root apt-get install -y -qq --no-install-recommends "$@" >"$work/apt.log" 2>&1 || { tail -20 "$work/apt.log" >&2; fail "apt does not install $*"; }; }
in_root apt-get update -qq

echo "== server, viewer and tools"
install $(cd "$root" && ls packages/strandcast-{server,viewer,tools}_*.deb | sed 's|^|/|')
[ ! -e "$root/var/lib/strandcast/tokens" ] || fail "installing has started the server"
python3 -B "$here/run_service.py" "$root" service "$work/service.png"
python3 -B "$here/run_service.py" "$root" socket "$work/socket.png"

echo "== examples, over the installed core"
install $(cd "$root" && ls packages/{libstrandcast-dev,strandcast-doc}_*.deb | sed 's|^|/|') \
  g++ cmake make libboost-dev libprotobuf-dev protobuf-compiler python3-minimal
in_root sh -c 'cmake -S /usr/share/doc/strandcast-doc/examples/cpp -B /tmp/join >/tmp/join.log && cmake --build /tmp/join >>/tmp/join.log' ||
  { tail -20 "$root/tmp/join.log" >&2; fail "the example does not build over libstrandcast-dev"; }
in_root sh -c 'strandcast-server --port 0 --port-file /tmp/port --set stream.codec=raw --set groom.procedural.strand_count=50 2>/tmp/server.log &
  for i in $(seq 300); do [ -s /tmp/port ] && break; sleep 0.1; done
  /tmp/join/join 127.0.0.1 $(cat /tmp/port) 5 && python3 /usr/share/doc/strandcast-doc/examples/python/join.py 127.0.0.1 $(cat /tmp/port) 5
  outcome=$?; kill $!; wait; exit $outcome' || fail "the examples do not join a server"

echo "== purged"
in_root apt-get purge -y -qq strandcast-server strandcast-viewer strandcast-tools strandcast-doc libstrandcast-dev >"$work/apt.log" 2>&1 ||
  fail "apt does not purge: $(tail -3 "$work/apt.log")"
left="$(find "$root/usr" "$root/etc" "$root/var/lib/strandcast" -iname '*strandcast*' 2>/dev/null || true)"
[ -z "$left" ] || fail "a purge leaves: $left"
echo "packages install, run and go"
