# Completion for bash. Behind help_lines.awk.

function on_command(words) {
  command = words
  if (program == "") program = words
  commands[++command_count] = words
}
function on_summary(text) {}
function on_usage(text) {}
function on_group(title) { group = title }

function on_entry(names, text, parts, set, i, option) {
  split(names, parts, " ")
  if (group == "Subcommands") {
    below[command] = below[command] " " parts[1]
    return
  }
  option = parts[1]
  sub(/^-[a-z],/, "", option)
  if (option !~ /^--/ || (option == "--help" && command != program)) return
  options[command] = options[command] " " option
  if (parts[2] == "" || parts[2] ~ /:$/) return  # it takes no value
  if (match(parts[2], /\{[^}]*\}/)) {
    set = substr(parts[2], RSTART + 1, RLENGTH - 2)
    gsub(/,/, " ", set)
  }
  # Options of the program may stand behind its commands too.
  valued[++valued_count] = (command == program ? "\"" program "\"*\" " : "\"" command " ") option "\""
  values[valued_count] = set
}

function on_end(i, j, words, name, known) {
  name = program
  gsub(/-/, "_", name)
  printf "# Completion for %s, made from what it says to --help.\n_%s() {\n", program, name
  print "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} command=" program " i words="
  if (command_count > 1) {
    print "  for ((i = 1; i < COMP_CWORD; ++i)); do\n    case \"$command ${COMP_WORDS[i]}\" in"
    for (i = 2; i <= command_count; ++i) known = known (i > 2 ? " | " : "      ") "'" commands[i] "'"
    print known ") command+=\" ${COMP_WORDS[i]}\" ;;\n    esac\n  done"
  }
  print "  case \"$command $before\" in"
  for (i = valued_count; i > 0; --i) {
    # Without words of its own an option takes a file, a number or a name: bash completes files.
    printf "    %s) COMPREPLY=(%s); return ;;\n", valued[i], values[i] == "" ? "" : "$(compgen -W '" values[i] "' -- \"$word\")"
  }
  print "  esac\n  case \"$command\" in"
  for (i = 1; i <= command_count; ++i) {
    words = options[commands[i]] below[commands[i]] (i > 1 ? options[program] : "")
    printf "    '%s') words='%s' ;;\n", commands[i], substr(words, 2)
  }
  print "  esac\n  COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n}"
  printf "complete -o default -F _%s %s\n", name, program
}
