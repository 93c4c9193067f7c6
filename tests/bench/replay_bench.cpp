// Prints what a picture between states takes before it is drawn (processor time of one thread), as CSV: the
// line between two states and the cubic through four on every instruction set, and what making the positions
// of one state takes, which comes once for each state. Ways take turns, so that their ratios hold on a busy
// machine.
// usage: replay_bench [--rounds N]
#include <fmt/format.h>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <string>

#include "common/base/quantile.h"
#include "common/replay/interpolation.h"
#include "common/replay/strand_replay.h"
#include "tests/support/hair_motion.h"

namespace strandcast {
namespace {

constexpr int64_t kStepNs = 33'333'333;

struct Way {
  std::string name;
  std::string set;
  std::function<void()> make;
  std::vector<double> ms;
};

double cpu_ms() {
  return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void run(uint32_t strand_count, uint32_t vertex_count, int rounds) {
  HairMotion hair({.strand_count = strand_count, .vertex_count = vertex_count});
  StrandFill fill;
  std::vector<Snapshot> snapshots;
  std::vector<PosedStrands> states;
  for (int i = 0; i < 4; ++i) {
    hair.step();
    snapshots.push_back(hair.snapshot(1e-4f));
    states.push_back(posed_strands_of(snapshots.back(), fill));
  }
  const CubicTerms terms = cubic_terms({0, kStepNs, 2 * kStepNs, 3 * kStepNs}, kStepNs + kStepNs / 3);
  PosedStrands shown;
  std::vector<Way> ways;
  ways.push_back({"state", "-", [&] { shown = posed_strands_of(snapshots[0], fill); }, {}});
  for (const simd::InstructionSet set : simd::instruction_sets()) {
    ways.push_back(
        {"line", to_string(set), [&, set] { shown = blend(states[1], states[2], terms.blend, set); }, {}});
    ways.push_back({"cubic",
                    to_string(set),
                    [&, set] {
                      shown = blend({&states[0], &states[1], &states[2], &states[3]}, terms, set);
                    },
                    {}});
  }
  for (int round = 0; round <= rounds; ++round)
    for (Way& way : ways) {
      const double begin_ms = cpu_ms();
      way.make();
      if (round > 0) way.ms.push_back(cpu_ms() - begin_ms);  // the first one allocates
    }
  const double vertices = static_cast<double>(strand_count) * vertex_count;
  double line_ms = 0.0;
  for (const Way& way : ways) {
    const double ms = median(way.ms);
    if (way.name == "line") line_ms = ms;
    const std::string of_line = line_ms > 0.0 ? fmt::format("{:.2f}", ms / line_ms) : "-";
    fmt::print("{},{},{},{},{:.3f},{:.2f},{}\n", strand_count, vertex_count, way.name, way.set, ms,
               1e6 * ms / vertices, of_line);
  }
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  int rounds = 200;
  if (argc == 3 && std::strcmp(argv[1], "--rounds") == 0) rounds = std::atoi(argv[2]);
  if ((argc != 1 && argc != 3) || rounds < 1) {
    fmt::print(stderr, "usage: replay_bench [--rounds N]\n");
    return 2;
  }
  fmt::print("strands,vertices,way,instruction_set,ms,ns_per_vertex,of_line\n");
  strandcast::run(2'000, 16, rounds);
  strandcast::run(10'000, 16, rounds);
}
