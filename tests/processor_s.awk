# Seconds of processor time, user and system, of all children of the shell whose `times` this reads.
NR == 2 {
  for (i = 1; i <= 2; ++i) {
    split($i, part, /[ms]/)
    sum += 60 * part[1] + part[2]
  }
  printf "%.1f\n", sum
}
