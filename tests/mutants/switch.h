// Which planted fault is on (plant.py): STRANDCAST_MUTANT names its number. With STRANDCAST_MUTANTS_REACHED
// the process writes the numbers that it came by to that file when it ends, a line each. Any thread may ask.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace strandcast_mutants {

inline constexpr int kMost = 1 << 14;

struct Switch {
  int on = std::getenv("STRANDCAST_MUTANT") ? std::atoi(std::getenv("STRANDCAST_MUTANT")) : 0;
  const char* reached_path = std::getenv("STRANDCAST_MUTANTS_REACHED");
  volatile char reached[kMost] = {};

  ~Switch() {
    std::FILE* file = reached_path ? std::fopen(reached_path, "a") : nullptr;
    if (!file) return;
    for (int number = 0; number < kMost; ++number)
      if (reached[number]) std::fprintf(file, "%d\n", number);
    std::fclose(file);
  }
};

inline Switch g_switch;

inline bool mutant_is(int number) {
  if (g_switch.reached_path) g_switch.reached[number] = 1;
  return g_switch.on == number;
}

}  // namespace strandcast_mutants
