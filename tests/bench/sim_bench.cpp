// Times every solver of the table on the sets of the source documents and on a mohawk: milliseconds per step,
// against the same algorithm in plain float C++ and against the double reference, and against the floor that
// the memory sets.
//
// Work per free vertex of the serial kernel, counted from shaders/sim: about 110 floating-point operations
// without colliders (turn 15, prediction 35, placement 25, velocity 15, correction and limits 20), 8 more per
// collider tested and about 90 per collider hit. Memory: 48 bytes read (rest, position, velocity) and 32
// written. The floor printed is 80 bytes per vertex at the machine's own copy speed, measured at the start on
// as many threads as it has.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/base/profile.h"
#include "common/groom/groom_file.h"
#include "server/sim/executor/executor.h"
#include "server/sim/solver_registry.h"
#include "server/sim/strand_parameters.h"
#include "tests/bench/float_strands.h"
#include "tests/support/sim_scene.h"

namespace strandcast {
namespace {

constexpr double kSubstepS = 1.0 / 60.0;
constexpr double kBytesPerVertex = 80.0;
constexpr int kFlopsPerVertex = 110;

struct Options {
  int steps = 100;
  int warm_up = 20;
  std::string csv_path;
  std::string groom_path;
  ExecutorConfig device = {"gl", "auto", {}};
  std::string solver;  // empty = all
};

struct BenchSet {
  std::string name;
  Groom groom;
};

struct Sample {
  double median_ms = 0.0;
  double minimum_ms = 0.0;
};

/// Median and minimum over options.steps steps of the same motion, after a warm-up.
Sample time_steps(Executor& executor, Solver& solver, const Options& options, int steps, bool has_colliders) {
  std::vector<double> samples_ms;
  for (int step = 1; step <= options.warm_up + steps; ++step) {
    StepInput input = moving_input(step, kSubstepS);
    input.gusts.clear();
    if (!has_colliders) input.colliders.clear();
    const double ms = timed_ms(executor, [&] { solver.substep(input); });
    if (step > options.warm_up) samples_ms.push_back(ms);
  }
  std::sort(samples_ms.begin(), samples_ms.end());
  return {samples_ms[samples_ms.size() / 2], samples_ms.front()};
}

/// What holding the roots adds to a step: two solvers of a row side by side, step by step, so that both meet
/// the same machine. Minima.
struct Held {
  double free_ms = 0.0;
  double held_ms = 0.0;
};
Held time_held(Executor& executor, Solver& free, Solver& held, const Options& options, bool has_colliders) {
  constexpr double kLimitRad = 20.0 * 3.14159265358979 / 180.0;
  Held best{1e9, 1e9};
  for (int step = 1; step <= options.warm_up + options.steps; ++step) {
    StepInput input = moving_input(step, kSubstepS);
    input.gusts.clear();
    if (!has_colliders) input.colliders.clear();
    for (const bool is_held : {false, true}) {
      input.follicle_limit_rad = is_held ? kLimitRad : kFreeFollicleRad;
      const double ms = timed_ms(executor, [&] { (is_held ? held : free).substep(input); });
      double& least_ms = is_held ? best.held_ms : best.free_ms;
      if (step > options.warm_up) least_ms = std::min(least_ms, ms);
    }
  }
  return best;
}

/// Bytes per second of a large copy on all threads, reads and writes counted.
double measure_copy_speed() {
  constexpr size_t kBytes = 64u << 20;
  const unsigned thread_count = std::max(1u, std::thread::hardware_concurrency());
  std::vector<std::vector<char>> sources(thread_count, std::vector<char>(kBytes, 1));
  std::vector<std::vector<char>> targets(thread_count, std::vector<char>(kBytes, 2));
  double best = 0.0;
  for (int round = 0; round < 5; ++round) {
    const int64_t begin_ns = now_ns();
    std::vector<std::thread> threads;
    for (unsigned i = 0; i < thread_count; ++i) {
      threads.emplace_back([&, i] { std::memcpy(targets[i].data(), sources[i].data(), kBytes); });
    }
    for (std::thread& thread : threads) thread.join();
    best = std::max(best, 2.0 * kBytes * thread_count / (static_cast<double>(now_ns() - begin_ns) * 1e-9));
  }
  return best;
}

std::optional<std::vector<BenchSet>> make_sets(const Options& options) {
  std::vector<BenchSet> sets;
  const uint32_t sizes[][2] = {{242, 8}, {1000, 16}, {1000, 32}, {10'000, 16}, {10'000, 32}};
  for (const auto& [strand_count, vertex_count] : sizes) {
    TestGroomDesc desc;
    desc.strand_count = strand_count;
    desc.vertex_count = vertex_count;
    sets.push_back({fmt::format("{}x{}", strand_count, vertex_count), make_test_groom(desc)});
  }
  if (options.groom_path.empty()) {
    TestGroomDesc desc;
    desc.strand_count = 2228;
    desc.vertex_count = 32;
    sets.push_back({"mohawk-like 2228x32", make_test_groom(desc)});
    return sets;
  }
  GroomFileOptions file;
  file.path = options.groom_path;
  auto groom = load_groom(file);
  if (!groom) {
    fmt::print(stderr, "{}\n", groom.error().to_string());
    return std::nullopt;
  }
  const std::string name = fmt::format("{} {}x{}", file.path.stem().string(), groom->strand_count(),
                                       groom->uniform_vertex_count());
  sets.push_back({name, std::move(groom).value()});
  return sets;
}

struct Row {
  std::string executor;
  std::string set;
  std::string solver;
  bool has_colliders = false;
  uint64_t vertices = 0;
  Sample kernel;
  double cpu_ms = 0.0;        // float, one thread; 0 = none for this solver
  double reference_ms = 0.0;  // double, one thread
  double floor_ms = 0.0;
  uint64_t memory_bytes = 0;
  Held held;
};

const char* kCsvHeader =
    "executor,set,solver,colliders,vertices,kernel_median_ms,kernel_minimum_ms,vertices_per_s,cpu_float_ms,"
    "reference_ms,"
    "floor_ms,"
    "memory_bytes,held_over_free\n";

std::string to_csv(const Row& row) {
  return fmt::format("{},{},{},{},{},{:.4f},{:.4f},{:.0f},{:.4f},{:.4f},{:.4f},{},{:.3f}\n", row.executor,
                     row.set, row.solver, row.has_colliders ? 2 : 0, row.vertices, row.kernel.median_ms,
                     row.kernel.minimum_ms, static_cast<double>(row.vertices) / (row.kernel.median_ms * 1e-3),
                     row.cpu_ms, row.reference_ms, row.floor_ms, row.memory_bytes,
                     row.held.held_ms / row.held.free_ms);
}

void print(const Row& row) {
  const double rate = static_cast<double>(row.vertices) / (row.kernel.median_ms * 1e-3) * 1e-6;
  fmt::print("{:22} {:14} {:>9} {:9.3f} {:9.3f} {:8.1f} {:>9} {:9.2f} {:8.1f} {:9.3f} {:8.1f} {:8.3f}\n",
             row.set, row.solver, row.has_colliders ? "2 spheres" : "-", row.kernel.median_ms,
             row.kernel.minimum_ms, rate, row.cpu_ms > 0.0 ? fmt::format("{:.3f}", row.cpu_ms) : "-",
             row.reference_ms, row.reference_ms / row.kernel.median_ms, row.floor_ms,
             row.kernel.median_ms / row.floor_ms, row.held.held_ms / row.held.free_ms);
}

class Bench {
 public:
  Bench(const Options& options, Executor& executor)
      : options_(options), executor_(executor), copy_speed_(measure_copy_speed()) {}

  void print_head() const {
    fmt::print(
        "{}; {} threads; copy {:.1f} GB/s; {} steps after {} to warm up; other programs may share the "
        "machine:\n"
        "the minimum is nearer to a quiet machine than the median\n"
        "x held: a step with roots held at 20 degrees over one without, side by side\n"
        "per free vertex: about {} flop + 8 per collider, {} bytes; floor = those bytes at the copy "
        "speed\n\n",
        executor_.info().name, std::thread::hardware_concurrency(), copy_speed_ * 1e-9, options_.steps,
        options_.warm_up, kFlopsPerVertex, kBytesPerVertex);
    fmt::print("{:22} {:14} {:>9} {:>9} {:>9} {:>8} {:>9} {:>9} {:>8} {:>9} {:>8} {:>8}\n", "set", "solver",
               "colliders", "median ms", "min ms", "Mvert/s", "float ms", "double ms", "x double", "floor ms",
               "x floor", "x held");
  }

  /// False when a solver cannot be made; the error is printed.
  bool run(const BenchSet& set, const SolverRow& solver_row, bool has_colliders, std::string& csv) {
    const auto parameters = complete_parameters(solver_row, {});
    SceneFeatures features;
    features.has_colliders = has_colliders;
    auto kernel = solver_row.make(*parameters, {&executor_, features});
    const Status loaded = kernel ? (*kernel)->load(set.groom, {1.0, 0.0, 0.0, 0.0}) : Status(kernel.error());
    if (!loaded) {
      fmt::print(stderr, "{}: {}\n", solver_row.name, loaded.error().to_string());
      return false;
    }
    Row row;
    row.executor = to_string(executor_.info().device);
    row.set = set.name;
    row.solver = solver_row.name;
    row.has_colliders = has_colliders;
    row.vertices = set.groom.rest_position_m.size();
    features.has_follicle_limit = true;
    auto held = solver_row.make(*parameters, {&executor_, features});
    if (held && (*held)->load(set.groom, {1.0, 0.0, 0.0, 0.0}))
      row.held = time_held(executor_, **kernel, **held, options_, has_colliders);
    row.kernel = time_steps(executor_, **kernel, options_, options_.steps, has_colliders);
    row.memory_bytes = (*kernel)->memory_bytes();
    row.floor_ms = static_cast<double>(row.vertices) * kBytesPerVertex / copy_speed_ * 1e3;
    const int few_steps = std::max(3, options_.steps / 10);
    const auto reference = solver_row.make_reference(*parameters);
    if (reference->load(set.groom, {1.0, 0.0, 0.0, 0.0})) {
      Options short_options = options_;
      short_options.warm_up = 1;
      row.reference_ms =
          time_steps(executor_, *reference, short_options, few_steps, has_colliders).minimum_ms;
    }
    if (solver_row.name == "dftl") {
      FloatStrands plain(read_strand_parameters(*parameters));
      if (plain.load(set.groom, {1.0, 0.0, 0.0, 0.0})) {
        row.cpu_ms = time_steps(executor_, plain, options_, options_.steps, has_colliders).minimum_ms;
      }
    }
    print(row);
    std::fflush(stdout);
    csv += to_csv(row);
    return true;
  }

 private:
  Options options_;
  Executor& executor_;
  double copy_speed_;
};

std::optional<Options> parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    const std::string value = i + 1 < argc ? argv[i + 1] : "";
    if (name == "--steps" && std::atoi(value.c_str()) > 0) {
      options.steps = std::atoi(value.c_str());
    } else if (name == "--csv" && !value.empty()) {
      options.csv_path = value;
    } else if (name == "--groom" && !value.empty()) {
      options.groom_path = value;
    } else if (name == "--solver" && find_solver(value)) {
      options.solver = value;
    } else if (name == "--device" && !value.empty()) {
      options.device.gl_device = value;
    } else if (name == "--sim-device" && is_sim_device_name(value)) {
      options.device.sim_device = value;
    } else {
      fmt::print(stderr,
                 "usage: sim_bench [--steps N] [--csv FILE] [--groom FILE.tfx|FILE.hair] [--device auto] "
                 "[--sim-device gl|lanes|auto] [--solver dftl|dftl_parallel]\n");
      return std::nullopt;
    }
    ++i;
  }
  return options;
}

int run_bench(const Options& options) {
  const auto executor = open_executor(options.device);
  if (!executor) {
    fmt::print(stderr, "{}\n", executor.error().to_string());
    return 2;
  }
  const auto sets = make_sets(options);
  if (!sets) return 2;
  Bench bench(options, **executor);
  bench.print_head();
  std::string csv = kCsvHeader;
  for (const BenchSet& set : *sets) {
    for (const SolverRow& row : solver_table()) {
      if (!options.solver.empty() && row.name != options.solver) continue;
      for (const bool has_colliders : {false, true}) {
        if (!bench.run(set, row, has_colliders, csv)) return 2;
      }
    }
  }
  if (options.csv_path.empty()) return 0;
  std::ofstream file(options.csv_path);
  file << csv;
  if (!file.flush()) {
    fmt::print(stderr, "{}: cannot be written\n", options.csv_path);
    return 2;
  }
  return 0;
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  const auto options = strandcast::parse(argc, argv);
  return options ? strandcast::run_bench(*options) : 2;
}
