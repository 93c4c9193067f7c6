#!/usr/bin/env bash
# The summary of tests/run.sh, fed with files as GoogleTest and CTest write them.
set -euo pipefail
tests="$(cd "$(dirname "$0")/.." && pwd)"
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
mkdir -p "$folder/test_lists" "$folder/test_results/tried_first"

die() {
  echo "$1" >&2
  cat "$folder/out" >&2
  exit 1
}
# expect STATUS LINE...: the summary ends with this exit status and holds these lines.
expect() {
  local wanted="$1" status=0
  shift
  bash "$tests/summary.sh" "$folder" >"$folder/out" || status=$?
  [ "$status" -eq "$wanted" ] || die "exit status $status instead of $wanted"
  for line in "$@"; do
    grep -qxF -- "$line" "$folder/out" || die "no line '$line'"
  done
}
# results FILE NAME:RESULT...: GoogleTest's file of a suite `Laws`; RESULT is ok, bad, skip, or data: skipped without it.
results() {
  local file="$1" name
  shift
  {
    echo '<testsuites tests="1" name="AllTests" processor_s="0.5">'
    for name in "$@"; do
      echo "    <testcase name=\"${name%:*}\" status=\"run\" result=\"$([[ "${name#*:}" =~ ^(skip|data)$ ]] && echo skipped ||
        echo completed)\" time=\"0.25\" classname=\"Laws\">"
      [ "${name#*:}" != bad ] || printf '%s\n' '      <failure message="a.cpp:3&#x0A;1 &lt; 0" type=""><![CDATA[a.cpp:3' \
        '<failure message="part of a text">' '1 < 0]]></failure>'
      [ "${name#*:}" != skip ] || echo '      <skipped message="a.cpp:9&#x0A;no display"><![CDATA[no display]]></skipped>'
      [ "${name#*:}" != data ] || echo '      <skipped message="a.cpp:7&#x0A;needs ../shared/data: there is no b"></skipped>'
      echo '    </testcase>'
    done
    echo '</testsuites>'
  } >"$folder/test_results/$file"
}
# ctest_log FILE NAME:STATUS[:TEXT]...: what CTest says of the programs.
ctest_log() {
  local file="$1" entry status text
  shift
  {
    echo '<testsuite name="Linux">'
    for argument in "$@"; do
      IFS=: read -r entry status text <<<"$argument"
      printf '\t<testcase name="%s" classname="%s" time="2.5" status="%s">\n' "$entry" "$entry" "$status"
      printf '\t\t<system-out>Running main()\n%s\n</system-out>\n\t</testcase>\n' "$text"
    done
    echo '</testsuite>'
  } >"$folder/test_results/$file"
}

cat >"$folder/test_lists/a.txt" <<'LIST'
a.Laws 3 unit
a.Kinds/Laws 2 property
LIST
echo 'net.Laws.Holds 1 integration,network' >"$folder/test_lists/net.txt"

# Everything holds; what is no GoogleTest program counts as one test.
results a.Laws.xml One:ok Two:ok Three:skip
results a.Kinds_Laws.xml One/0:ok One/1:ok
results net.Laws.Holds.xml Holds:ok
ctest_log first.junit a.Laws:run a.Kinds/Laws:run net.Laws.Holds:run hardening:run
expect 0 '6 passed, 0 failed, 1 skipped' '  a.Laws.Three: a.cpp:9: no display' '      0.25 s  a.Laws.One' \
  '       2.5 s      0.5 s      2.0 s  property         2 tests' '       2.5 s      0.5 s      2.0 s  network          1 tests'
if grep -q 'Processor seconds' "$folder/out"; then die 'nobody measured the run'; fi

# What build and tests cost is said where it was measured.
printf '%s\n' 'build 812.5' 'tests 300' >"$folder/test_results/processor_s.txt"
expect 0 'Processor seconds (user + system): build 812.5, tests 300.0'

# What is skipped because the shared data is not there is counted by itself as well.
if grep -q 'shared/data' "$folder/out"; then die 'nothing was skipped for want of data'; fi
results a.Laws.xml One:data Two:data Three:skip
expect 0 '4 passed, 0 failed, 3 skipped' '2 of them for want of ../shared/data' \
  '  a.Laws.One: a.cpp:7: needs ../shared/data: there is no b'

# A failure counts once and is named with its first reason.
results a.Laws.xml One:ok Two:bad Three:skip
ctest_log first.junit a.Laws:fail a.Kinds/Laws:run net.Laws.Holds:run hardening:run
expect 1 '5 passed, 1 failed, 1 skipped' '  a.Laws.Two: a.cpp:3: 1 < 0'

# A program that ends before its time fails with all its tests, and one that fails at its end fails too.
rm "$folder/test_results/a.Laws.xml"
ctest_log first.junit 'a.Laws:fail:[ RUN      ] Laws.Two' a.Kinds/Laws:fail net.Laws.Holds:run hardening:notrun
expect 1 '3 passed, 5 failed, 0 skipped' '  hardening' \
  '  a.Laws: 3 of its tests gave no result, the program ended in Laws.Two' \
  '  a.Kinds/Laws: its program failed after its tests'

# So does one that ran fewer tests than it has.
results a.Laws.xml One:ok Two:ok
ctest_log first.junit a.Laws:run
expect 1 '2 passed, 1 failed, 0 skipped' '  a.Laws: 1 of its tests gave no result'

# Only tests with sockets are tried again, and a second try is counted and named.
results a.Laws.xml One:ok Two:ok Three:ok
results net.Laws.Holds.xml Holds:bad
ctest_log first.junit a.Laws:fail a.Kinds/Laws:run net.Laws.Holds:fail
printf '%s\n' net.Laws.Holds web.page >"$folder/network.names"
again="$(awk -f "$tests/failed_tests.awk" "$folder/network.names" "$folder/test_results/first.junit")"
[ "$again" = net.Laws.Holds ] || die "to be tried again: '$again'"
mv "$folder/test_results/net.Laws.Holds.xml" "$folder/test_results/tried_first/"
results net.Laws.Holds.xml Holds:ok
ctest_log first.junit a.Laws:run a.Kinds/Laws:run net.Laws.Holds:fail
ctest_log second.junit net.Laws.Holds:run
expect 0 '6 passed, 0 failed, 0 skipped (1 tried twice)' \
  '  net.Laws.Holds: failed, then passed; first with a.cpp:3: 1 < 0'
results net.Laws.Holds.xml Holds:bad
ctest_log second.junit net.Laws.Holds:fail
expect 1 '5 passed, 1 failed, 0 skipped (1 tried twice)' \
  '  net.Laws.Holds: failed, then failed again; first with a.cpp:3: 1 < 0'

# A run without tests is no success.
rm "$folder"/test_results/*.junit
ctest_log first.junit
expect 1 '0 passed, 0 failed, 0 skipped'
