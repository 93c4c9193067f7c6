# Adds up what summary.sh hands over. Plain awk: mawk has no more.

# The value of an attribute of the XML element in `text`.
function attribute(text, name,    start, rest) {
  start = index(text, " " name "=\"")
  if (start == 0) return ""
  rest = substr(text, start + length(name) + 3)
  return substr(rest, 1, index(rest, "\"") - 1)
}

function plain(text) {
  gsub(/&#x0A;|&#10;/, " ", text)
  gsub(/&lt;/, "<", text)
  gsub(/&gt;/, ">", text)
  gsub(/&quot;/, "\"", text)
  gsub(/&apos;/, "'", text)
  gsub(/&amp;/, "\\&", text)
  return text
}

# A failure or skip says where it stands in its first line.
function reason_of(line,    text) {
  text = attribute(line, "message")
  sub(/&#x0A;/, ": ", text)
  text = plain(text)
  return length(text) > 200 ? substr(text, 1, 200) "..." : text
}

function file_of(entry) {
  gsub("/", "_", entry)
  return entry ".xml"
}

# Reads what one program said of its tests into seen[] = "passed", "failed" or "skipped" and why[], by name.
function read_results(path, entry,    line, name, count, in_text) {
  split("", seen)
  count = 0
  while ((getline line < path) > 0) {
    if (in_text) {
      if (index(line, "]]>")) in_text = 0
      continue
    }
    if (line ~ /^ *<testsuites / && attribute(line, "processor_s") != "") {
      processor_s[entry] = attribute(line, "processor_s") + 0
    } else if (line ~ /^ *<testcase /) {
      name = plain(binary_of(entry) "." attribute(line, "classname") "." attribute(line, "name"))
      seen[name] = attribute(line, "result") == "skipped" ? "skipped" : "passed"
      took[name] = attribute(line, "time") + 0
      ++count
    } else if (line ~ /^ *<failure /) {
      if (seen[name] != "failed") why[name] = reason_of(line)
      seen[name] = "failed"
    } else if (line ~ /^ *<skipped /) {
      why[name] = reason_of(line)
    }
    if (index(line, "<![CDATA[") && !index(line, "]]>")) in_text = 1
  }
  close(path)
  return count
}

function binary_of(entry) {
  sub(/\..*/, "", entry)
  return entry
}

function add(list, line) {
  return list "  " line "\n"
}

FILENAME ~ /\.txt$/ {
  expected[$1] = $2
  labels[$1] = $3
  next
}

/^\t<testcase / {
  entry = plain(attribute($0, "name"))
  if (!(entry in status)) entries[++entry_count] = entry
  else ++tries[entry]
  status[entry] = attribute($0, "status")
  seconds[entry] = attribute($0, "time") + 0
  last_begun[entry] = ""
  in_entry = 1
}
# What a program of no GoogleTest says before it ends with its status for a skip.
in_entry && /^\t\t<skipped / { skip_said[entry] = "skipped" }
in_entry && /skipped: / {
  text = $0
  sub(/.*skipped: /, "", text)
  skip_said[entry] = plain(text)
}
in_entry && /^\[ RUN      \] / { last_begun[entry] = plain(substr($0, 14)) }
in_entry && /^(<system-out>)?\[       OK \] / { last_begun[entry] = "" }
/^\t<\/testcase>/ { in_entry = 0 }

END {
  passed = failed = skipped = without_data = second_tries = 0
  failures = skips = retries = ""
  for (i = 1; i <= entry_count; ++i) {
    entry = entries[i]
    label_count = split(entry in labels ? labels[entry] : "other", names, ",")
    for (k = 1; k <= label_count; ++k) {
      label_seconds[names[k]] += seconds[entry]
      label_tests[names[k]] += entry in expected ? expected[entry] : 1
    }
    if (entry in expected) known = read_results(results "/" file_of(entry), entry)
    for (k = 1; k <= label_count; ++k) {
      if (!(entry in processor_s)) continue
      label_processor_s[names[k]] += processor_s[entry]
      if (seconds[entry] > processor_s[entry]) label_waits_s[names[k]] += seconds[entry] - processor_s[entry]
    }
    before = failed
    if (!(entry in expected)) {
      took[entry] = seconds[entry]
      if (status[entry] == "run") {
        ++passed
        all[++all_count] = entry
      } else if (status[entry] == "notrun" && entry in skip_said) {
        ++skipped
        skips = add(skips, entry ": " skip_said[entry])
      } else if (status[entry] == "disabled") {
        ++skipped
        skips = add(skips, entry ": disabled")
      } else {
        ++failed
        failures = add(failures, entry)
      }
    } else {
      for (name in seen) {
        all[++all_count] = name
        if (seen[name] == "passed") ++passed
        if (seen[name] == "skipped") {
          ++skipped
          if (index(why[name], "needs ../shared/data")) ++without_data
          skips = add(skips, name ": " why[name])
        }
        if (seen[name] == "failed") {
          ++failed
          failures = add(failures, name ": " why[name])
        }
      }
      missing = expected[entry] - known
      if (missing > 0) {
        failed += missing
        failures = add(failures, entry ": " missing " of its tests gave no result" \
          (last_begun[entry] == "" ? "" : ", the program ended in " last_begun[entry]))
      }
      if (status[entry] != "run" && status[entry] != "notrun" && failed == before) {
        ++failed
        failures = add(failures, entry ": its program failed after its tests")
      }
    }
    if (entry in tries) {
      ++second_tries
      first_why = ""
      if (read_results(results "/tried_first/" file_of(entry), entry) > 0)
        for (name in seen) if (seen[name] == "failed") first_why = why[name]
      retries = add(retries, entry ": failed, then " (failed == before ? "passed" : "failed again") \
        (first_why == "" ? "" : "; first with " first_why))
    }
  }

  print "\nSlowest tests"
  for (n = 1; n <= 10 && n <= all_count; ++n) {
    best = n
    for (k = n + 1; k <= all_count; ++k) if (took[all[k]] > took[all[best]]) best = k
    swap = all[n]
    all[n] = all[best]
    all[best] = swap
    printf "  %8.2f s  %s\n", took[all[n]], all[n]
  }
  print "Seconds by label: from begin to end, of the processor, and waiting (what GoogleTest's programs say of themselves)"
  fflush()
  for (label in label_seconds) {
    sorter = "sort -k7,7"
    printf "  %8.1f s %8.1f s %8.1f s  %-12s %5d tests\n", label_seconds[label], label_processor_s[label], \
      label_waits_s[label], label, label_tests[label] | sorter
  }
  if (sorter != "") close(sorter)
  costs = ""
  while ((getline line < (results "/processor_s.txt")) > 0) {
    split(line, words, " ")
    costs = costs (costs == "" ? "" : ", ") sprintf("%s %.1f", words[1], words[2])
  }
  if (costs != "") print "Processor seconds (user + system): " costs
  if (retries != "") printf "Tried twice\n%s", retries
  if (skips != "") printf "Skipped\n%s", skips
  if (without_data > 0) printf "%d of them for want of ../shared/data\n", without_data
  if (failures != "") printf "Failed\n%s", failures
  tail = second_tries > 0 ? sprintf(" (%d tried twice)", second_tries) : ""
  printf "%d passed, %d failed, %d skipped%s\n", passed, failed, skipped, tail
  exit failed > 0 || passed == 0 ? 1 : 0
}
