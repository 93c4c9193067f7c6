# Prints which of these tests failed: reads a file of their names, one on each line, then CTest's JUnit file.
NR == FNR {
  is_asked[$1] = 1
  next
}
/^\t<testcase / {
  split($0, parts, "\"")
  if (parts[2] in is_asked && $0 ~ / status="fail"/) print parts[2]
}
