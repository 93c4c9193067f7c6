// Prints what publishing a state takes (processor time of all threads), as CSV, beside what this machine can
// do: operations and bytes counted by hand, peaks measured in the same run.
// usage: publish_bench [--rounds N]
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "common/base/quantile.h"
#include "server/publish/publisher.h"

namespace strandcast {
namespace {

/// Keeps strands in blocks and does nothing else.
class BlockSolver final : public Solver {
 public:
  explicit BlockSolver(const Groom& groom)
      : strand_count_(groom.strand_count()),
        position_m_(strand_count_, groom.uniform_vertex_count()),
        velocity_mps_(strand_count_, groom.uniform_vertex_count()) {
    std::vector<glm::vec3> points;
    for (uint32_t vertex = 0; vertex < groom.uniform_vertex_count(); ++vertex)
      for (uint32_t strand = 0; strand < strand_count_; ++strand)
        points.push_back(groom.rest_position_m[groom.offset[strand] + vertex]);
    pack_blocks(std::span<const glm::vec3>(points), position_m_);
  }
  Status load(const Groom&, const glm::dquat&) override { return {}; }
  void substep(const StepInput&) override {}
  void read(SolverState&) override {}
  SolverBlocks read_blocks() override { return {position_m_.view(), velocity_mps_.view()}; }
  void write(const SolverState&) override {}
  void rebase(const glm::dquat&) override {}
  uint32_t strand_count() const override { return strand_count_; }
  uint64_t memory_bytes() const override { return 0; }

 private:
  uint32_t strand_count_;
  StrandBlocks position_m_;
  StrandBlocks velocity_mps_;
};

Groom straight_groom(uint32_t strand_count, uint32_t vertex_count) {
  Groom groom;
  groom.offset = {0};
  for (uint32_t strand = 0; strand < strand_count; ++strand) {
    for (uint32_t vertex = 0; vertex < vertex_count; ++vertex)
      groom.rest_position_m.emplace_back(1e-5f * static_cast<float>(strand), 0.1f,
                                         0.02f * static_cast<float>(vertex));
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  groom.pinned.assign(groom.rest_position_m.size(), 0);
  return groom;
}

double cpu_ms() {
  return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

template <class Work>
double median_ms(int rounds, Work work) {
  std::vector<double> ms;
  for (int i = 0; i <= rounds; ++i) {
    const double begin_ms = cpu_ms();
    work();
    if (i > 0) ms.push_back(cpu_ms() - begin_ms);  // the first one allocates
  }
  return median(std::move(ms));
}

// ---- what the machine can do

using Wide = double __attribute__((vector_size(64)));
using Narrow = double __attribute__((vector_size(32)));  // wider ones go through memory on most sets

struct PeakArguments {
  uint64_t turns = 0;
  bool is_wide = false;
  double* sum = nullptr;
};

constexpr int kChains = 8;
template <class Doubles>
STRANDCAST_LANES void multiply_and_add(const PeakArguments& a) {
  Doubles chain[kChains];
  for (int i = 0; i < kChains; ++i) chain[i] = Doubles{} + 0.001 * i;
  for (uint64_t turn = 0; turn < a.turns; ++turn)
    for (int i = 0; i < kChains; ++i) chain[i] = chain[i] * 0.999 + 0.001;
  for (int i = 0; i < kChains; ++i) *a.sum += chain[i][0];
}
STRANDCAST_LANES void multiply_and_add_lanes(const PeakArguments& a) {
  a.is_wide ? multiply_and_add<Wide>(a) : multiply_and_add<Narrow>(a);
}
STRANDCAST_KERNEL(multiply_and_add, PeakArguments);

/// Of doubles, per millisecond of one thread.
double peak_operations(simd::InstructionSet set) {
  constexpr uint64_t kTurns = 1'000'000;
  double best = 0.0;
  for (const bool is_wide : {false, true}) {
    double sum = 0.0;
    const double ms = median_ms(5, [&] { multiply_and_add(set, {kTurns, is_wide, &sum}); });
    const double doubles = (is_wide ? sizeof(Wide) : sizeof(Narrow)) / sizeof(double);
    best = std::max(best, 2.0 * kChains * doubles * static_cast<double>(kTurns) / ms);
  }
  return best;
}

/// Read or written per millisecond of one thread, as much at a time as a state of that size has.
double peak_bytes(size_t state_bytes) {
  std::vector<char> from(state_bytes / 2, 1), to(state_bytes / 2);
  constexpr int kTimes = 50;
  const double ms = median_ms(5, [&] {
    for (int i = 0; i < kTimes; ++i) {
      from[static_cast<size_t>(i)] = static_cast<char>(i);
      std::memcpy(to.data(), from.data(), from.size());
    }
  });
  return kTimes * static_cast<double>(state_bytes) / ms;
}

// Per vertex. Three conversions to double and back, nine products and six sums of the turn, product, two
// limits and two sums per axis to the lattice, its conversion; of floats (half as much) two comparisons per
// axis, and the squared length of a segment.
constexpr double kOperations = 9.0 + 15.0 + 3.0 * 6.0 + 0.5 * (4.0 * 3.0 + 9.0);
// Three floats of position and of velocity, the longest segment, three lattice values, which are fetched
// before they are written.
constexpr double kBytes = 4.0 * (3.0 + 3.0 + 1.0 + 2.0 * 3.0);

void run(uint32_t strand_count, uint32_t vertex_count, int rounds) {
  const Groom groom = straight_groom(strand_count, vertex_count);
  BlockSolver solver(groom);
  const double vertices = static_cast<double>(strand_count) * vertex_count;
  const double bytes_ms = kBytes * vertices / peak_bytes(static_cast<size_t>(kBytes * vertices));
  PublishInput input;
  input.world_from_head.rotation = glm::angleAxis(1.0, glm::normalize(glm::dvec3(1.0, 2.0, 0.5)));
  for (const simd::InstructionSet set : simd::instruction_sets()) {
    Publisher publisher(groom, 4e-7f, {&shared_workers(), set});
    publisher.watch_stretch(0.2);
    const double ms = median_ms(rounds, [&] { publisher.publish(solver, input); });
    const double operations_ms = kOperations * vertices / peak_operations(set);
    fmt::print("{},{},{},{:.3f},{:.2f},{:.3f},{:.3f},{:.1f}\n", strand_count, vertex_count, to_string(set),
               ms, 1e6 * ms / vertices, operations_ms, bytes_ms, ms / std::max(operations_ms, bytes_ms));
  }
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  int rounds = 200;
  if (argc == 3 && std::strcmp(argv[1], "--rounds") == 0) {
    rounds = std::max(1, std::atoi(argv[2]));
  } else if (argc != 1) {
    fmt::print(stderr, "usage: publish_bench [--rounds N]\n");
    return 2;
  }
  fmt::print("strands,vertices,set,ms,ns_per_vertex,floor_by_operations_ms,floor_by_bytes_ms,times_floor\n");
  strandcast::run(2'000, 16, rounds);
  strandcast::run(10'000, 16, rounds);
}
