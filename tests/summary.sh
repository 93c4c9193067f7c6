#!/usr/bin/env bash
# What a run of the tests came to, from the files that it left in a build folder's test_results:
#   bash tests/summary.sh BUILD_FOLDER
# test_lists/*.txt says which tests there are ("entry count label,label"), test_results/*.xml what each did,
# test_results/first.junit and second.junit what CTest says of the programs, test_results/tried_first/*.xml what failed
# before a second try, test_results/processor_s.txt what build and tests cost together. Ends with "N passed, N failed, N skipped"; the exit status is 1 when anything failed or nothing ran.
set -euo pipefail
folder="${1:?usage: summary.sh BUILD_FOLDER}"
results="$folder/test_results"
shopt -s nullglob
lists=("$folder"/test_lists/*.txt)
ctest_logs=("$results"/first.junit "$results"/second.junit)
for log in "${ctest_logs[@]}"; do
  [ -e "$log" ] || ctest_logs=("${ctest_logs[@]/$log}")
done
exec awk -v results="$results" -f "$(dirname "$0")/summary.awk" "${lists[@]}" ${ctest_logs[@]}
