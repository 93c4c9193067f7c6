# A manual page. Behind help_lines.awk; `version` is that of the program.

# As roff takes it for text.
function plain(words) {
  gsub(/\\/, "\\e", words)
  gsub(/-/, "\\-", words)
  if (words ~ /^[.']/) words = "\\&" words
  return words
}

# "--set TEXT Needs: --x": the words of options bold, what they take in italics.
function marked(names, parts, count, i, line) {
  count = split(names, parts, " ")
  for (i = 1; i <= count; ++i) line = line (i > 1 ? " " : "") (parts[i] ~ /^-/ ? "\\fB" : "\\fI") plain(parts[i]) "\\fR"
  return line
}

function on_command(words) {
  command = words
  if (program != "") return
  program = words
  title = toupper(words)
  printf ".TH \"%s\" 1 \"\" \"Strandcast %s\" \"Strandcast\"\n.SH NAME\n", plain(title), plain(version)
}

function on_summary(text) {
  if (command != program) {
    summary = text
    return
  }
  printf "%s \\- %s\n", plain(program), plain(substr(text, 1, length(text) - (text ~ /\.$/)))
}

function on_usage(text) {
  if (command == program) {
    printf ".SH SYNOPSIS\n%s\n", plain(text)
    return
  }
  if (!has_commands++) print ".SH COMMANDS"
  printf ".SS \"%s\"\n%s.\n", plain(text), plain(summary)
}

function on_group(title) {
  group = title
  if (command == program && title != "Subcommands") printf ".SH \"%s\"\n", plain(toupper(title))
}

function on_entry(names, text) {
  # Each command has a part of its own, and --help as the program has.
  if (group == "Subcommands" || (command != program && names ~ /--help$/)) return
  printf ".TP\n%s\n%s\n", marked(names), plain(text)
}

function on_end() {
  print ".SH \"SEE ALSO\""
  print "Documents of Strandcast: /usr/share/doc/strandcast\\-doc"
}
