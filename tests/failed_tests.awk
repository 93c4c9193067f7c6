# Prints the tests of the label `network` that failed: reads test_lists/*.txt ("entry count labels"), then CTest's JUnit
# file.
FILENAME ~ /\.txt$/ {
  is_network[$1] = ("," $3 ",") ~ /,network,/
  next
}
/^\t<testcase / {
  split($0, parts, "\"")
  if (parts[2] in is_network && is_network[parts[2]] && $0 ~ / status="fail"/) print parts[2]
}
