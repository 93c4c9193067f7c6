# Reads what from_help.sh collects, and calls for each part a function of the file behind this one:
#   on_command(words)  on_summary(text)  on_usage(text)  on_group(title)  on_entry(names, text)  on_end()
# An entry is an option, a positional or a sub-command; its text begins in column 31, or stands in the next line.

function entry_ends() {
  if (names != "") on_entry(names, text)
  names = text = ""
}

/^@ / { entry_ends(); on_command(substr($0, 3)); is_summary = 1; next }
/^Usage: / { entry_ends(); is_summary = 0; on_usage(substr($0, 8)); next }
is_summary { if ($0 != "") on_summary($0); next }
/^[A-Z].*:$/ { entry_ends(); on_group(substr($0, 1, length($0) - 1)); next }
/^  [^ ]/ {
  entry_ends()
  if (substr($0, 29, 2) == "  " && length($0) > 30) {
    names = substr($0, 3, 26)
    text = substr($0, 31)
  } else {
    names = substr($0, 3)
  }
  sub(/ +$/, "", names)
  next
}
/^ / { sub(/^ +/, ""); text = text (text == "" ? "" : " ") $0 }
END { entry_ends(); on_end() }
