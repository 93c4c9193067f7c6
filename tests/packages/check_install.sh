#!/usr/bin/env bash
# Installs the build into a folder and looks at it as people meet it: what lies where, manual pages, completion, the
# unit, the desktop entry, and a project of somebody else's that finds the strand core.
# usage: check_install.sh BUILD_FOLDER VERSION CXX_COMPILER
set -euo pipefail
build="$(realpath "$1")" version="$2" compiler="$3"
here="$(realpath "$(dirname "$0")")"

fail() { echo "FAILED: $1" >&2; exit 1; }
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
root="$work/usr"
for component in server viewer tools doc dev; do
  cmake --install "$build" --prefix "$root" --component "$component" >/dev/null
done

for file in share/strandcast/scenes/default.textproto share/strandcast/scenarios/shake.textproto \
  share/doc/strandcast-doc/README.md share/doc/strandcast-doc/docs/use/try-it.md share/doc/strandcast-doc/proto/WIRE.md \
  share/doc/strandcast-doc/examples/python/join.py share/doc/strandcast-doc/conformance/vectors/asset_1.txt \
  share/doc/strandcast-doc/proto/strandcast/v1/session.proto \
  share/strandcast/proto/strandcast/v1/session.proto share/icons/hicolor/scalable/apps/strandcast.svg \
  share/strandcast/truth/cycles.py lib/strandcast/strandcast-fleet share/mime/packages/strandcast.xml lib/systemd/system/strandcast-server.socket; do
  [ -s "$root/$file" ] || fail "$file is not installed"
done
for program in server view ctl report load; do
  name="strandcast-$program"
  "$root/bin/$name" --help >"$work/help" || fail "$name does not run where it was installed"
  # Every option that the program knows is in its page and its completion.
  zcat "$root/share/man/man1/$name.1.gz" | sed 's/\\-/-/g' >"$work/page"
  bash -n "$root/share/bash-completion/completions/$name"
  for option in $(sed -n 's/^  \(-[a-z],\)\?\(--[a-z-]*\).*/\2/p' "$work/help"); do
    grep -q -- "$option" "$work/page" || fail "$option is not in the manual page of $name"
    grep -q -- "$option" "$root/share/bash-completion/completions/$name" || fail "bash does not complete $option of $name"
  done
  grep -q "Strandcast $version" "$work/page" || fail "the manual page of $name is of another version"
done
# Commands within commands, and the values of an option.
completions() {
  bash -c '. "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); "_${1//-/_}"; echo "${COMPREPLY[*]}"' - \
    "$root/share/bash-completion/completions/$1" "$@"
}
[ "$(completions strandcast-server --sim-device "")" = "auto gl lanes" ] || fail "bash completes no values"
[ "$(completions strandcast-ctl mocap c)" = calibrate ] || fail "bash completes no command of a command"
[[ " $(completions strandcast-ctl feed --) " == *" --loop "*" --connect "* ]] || fail "bash completes no options of a command"
zcat "$root/share/man/man1/strandcast-ctl.1.gz" | grep -q '^\.SS "strandcast\\-ctl feed' || fail "commands are not in the manual page"

grep -q "^ExecStart=strandcast-server " "$root/lib/systemd/system/strandcast-server.service" || fail "the unit starts no server"
grep -q '^ListenStream=127.0.0.1:7878$' "$root/lib/systemd/system/strandcast-server.socket" || fail "the socket is another one"
if command -v desktop-file-validate >/dev/null; then
  desktop-file-validate "$root/share/applications/strandcast-view.desktop"
else
  echo "the desktop entry is not looked at: desktop-file-validate (desktop-file-utils) is not installed"
fi

cmake -S "$here/consumer" -B "$work/consumer" -DCMAKE_PREFIX_PATH="$root" -DCMAKE_CXX_COMPILER="$compiler" >"$work/log" 2>&1 ||
  { head -30 "$work/log" >&2; fail "find_package(Strandcast)"; }
cmake --build "$work/consumer" >"$work/log" 2>&1 || { head -30 "$work/log" >&2; fail "a project over Strandcast::core does not build"; }
[ "$("$work/consumer/consumer")" = "$version" ] || fail "the strand core is of another version"
echo "installed and found: $(find "$root" -type f | wc -l) files"
