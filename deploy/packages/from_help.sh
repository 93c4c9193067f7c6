#!/usr/bin/env bash
# Makes a manual page and bash's completion of what a program and its sub-commands say to --help:
#   from_help.sh PROGRAM FOLDER VERSION       leaves FOLDER/NAME.1.gz and FOLDER/completions/NAME
set -euo pipefail
program="$1" folder="$2" version="$3"
here="$(dirname "$0")"
name="$(basename "$program")"

# The help of a command and of those below it, each behind a line "@ WORDS".
print_help() {
  local help
  help="$("$program" "$@" --help)"
  printf '@ %s\n%s\n' "$name${*:+ $*}" "$help"
  local command
  for command in $(awk '/^Subcommands:/ { inside = 1; next } /^[^ ]/ { inside = 0 } inside && /^  [a-z]/ { print $1 }' <<<"$help"); do
    print_help "$@" "$command"
  done
}

mkdir -p "$folder/completions"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
print_help >"$work/help"
awk -v version="$version" -f "$here/help_lines.awk" -f "$here/man_page.awk" "$work/help" | gzip -9n >"$work/page"
awk -f "$here/help_lines.awk" -f "$here/completion.awk" "$work/help" >"$work/completion"
mv "$work/page" "$folder/$name.1.gz"
mv "$work/completion" "$folder/completions/$name"
