// Times every solver of the table on the sets of the source documents and on a mohawk, on every executor
// beside each other: OpenGL, SIMD lanes, the double-precision reference and, for dftl, plain float C++ on one
// thread. They take turns step by step, so that all meet the same machine. CPU time is of the whole process;
// a ratio of CPU times within a run is what holds from machine to machine.
//
// Work per free vertex of the serial kernel, counted from shaders/sim: about 110 floating-point operations
// without colliders (turn 15, prediction 35, placement 25, velocity 15, correction and limits 20), 8 more per
// collider tested and about 90 per collider hit. Memory: what a step has to read and write of the planes of
// its model (bytes_per_vertex). The floor printed is those bytes at the machine's own copy speed, measured at
// the start on as many threads as it has.
#include <epoxy/gl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/base/profile.h"
#include "common/groom/groom_file.h"
#include "server/sim/executor/lanes_executor.h"
#include "server/sim/solver_registry.h"
#include "server/sim/strand_parameters.h"
#include "tests/bench/float_strands.h"
#include "tests/support/sim_scene.h"

namespace strandcast {
namespace {

constexpr double kSubstepS = 1.0 / 60.0;
constexpr double kHeldRad = 20.0 * std::numbers::pi / 180.0;
constexpr double kPlaneBytes = 16.0;  // a vec4 of a vertex
/// Steps after which states are compared with the double reference's; later contacts have parted them.
constexpr int kComparedSteps = 22;

struct Options {
  int steps = 60;
  int warm_up = 10;
  std::string csv_path;
  std::string groom_path;
  std::string gl_device = "auto";
  std::string solver;  // empty = all
  std::string set;     // empty = all
};

struct BenchSet {
  std::string name;
  Groom groom;
  Groom straight;  // the same without bends; empty for a groom of a file
};

/// A row on one of the set's grooms: on straight strands direct_rod leaves out twist.
struct Model {
  std::string name;
  const SolverRow* row = nullptr;
  bool is_straight = false;
};

std::vector<Model> make_models(const Options& options) {
  std::vector<Model> models;
  for (const SolverRow& row : solver_table()) {
    if (!options.solver.empty() && row.name != options.solver) continue;
    models.push_back({row.name, &row, false});
    if (row.name == "direct_rod") models.push_back({"direct_rod, no twist", &row, true});
  }
  return models;
}

/// Read once and written once: rest (read), position and velocity, and what a model keeps beside them.
double bytes_per_vertex(const Model& model) {
  double planes = 5.0;
  if (model.row->name == "tractrix_split") planes += 2.0;                        // its second strand
  if (model.row->name == "direct_rod") planes += model.is_straight ? 5.0 : 7.0;  // history, edges, axes
  return planes * kPlaneBytes;
}

int64_t process_cpu_ns() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return time.tv_sec * 1'000'000'000 + time.tv_nsec;
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
  const auto add = [&](const std::string& name, uint32_t strand_count, uint32_t vertex_count) {
    if (!options.set.empty() && options.set != name) return;
    TestGroomDesc desc;
    desc.strand_count = strand_count;
    desc.vertex_count = vertex_count;
    Groom bent = make_test_groom(desc);
    desc.bend_rad = 0.0;
    sets.push_back({name, std::move(bent), make_test_groom(desc)});
  };
  const uint32_t sizes[][2] = {{242, 8}, {1000, 16}, {1000, 32}, {10'000, 16}, {10'000, 32}};
  for (const auto& [strands, vertices] : sizes)
    add(fmt::format("{}x{}", strands, vertices), strands, vertices);
  if (options.set == "100000x16") add("100000x16", 100'000, 16);  // only when asked for: references are slow
  if (options.groom_path.empty()) {
    add("mohawk-like 2228x32", 2228, 32);
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
  sets.push_back({name, std::move(groom).value(), {}});
  return sets;
}

/// Who takes turns with the others.
struct Contestant {
  std::string name;
  std::unique_ptr<Solver> solver;
  bool is_gl = false;
  bool is_held = false;  // roots at 20 degrees
  int every = 1;         // of so many steps one is taken: slow ones would take all the time
  std::vector<double> wall_ms = {};
  std::vector<double> cpu_ms = {};
  uint64_t memory_bytes = 0;
};

double least(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::min_element(values.begin(), values.end());
}
double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Distances of positions to the reference's after kComparedSteps: median and largest, m.
struct Distance {
  double median_m = 0.0;
  double largest_m = 0.0;
};

class Bench {
 public:
  Bench(const Options& options, std::unique_ptr<Executor> gl)
      : options_(options), gl_(std::move(gl)), copy_speed_(measure_copy_speed()) {
    for (const simd::InstructionSet set : lane_sets()) lanes_.push_back(make_lanes_executor({set}));
  }

  void print_head() const {
    fmt::print(
        "{}; {} threads; copy {:.1f} GB/s; {} steps after {} to warm up, minima of each; other programs may "
        "share "
        "the machine\n"
        "CPU: of all threads. x CPU: over that of the widest lanes. floor: bytes of the model's planes at "
        "the copy "
        "speed.\n"
        "held: with roots held at 20 degrees. error: distance to the double reference after {} steps, median "
        "/ "
        "largest\n\n",
        gl_ ? gl_->info().name : "no OpenGL", std::thread::hardware_concurrency(), copy_speed_ * 1e-9,
        options_.steps, options_.warm_up, kComparedSteps);
    fmt::print("{:20} {:20} {:9} {:22} {:>8} {:>8} {:>8} {:>7} {:>6} {:>8} {:>7} {:>19}\n", "set", "model",
               "colliders", "runs on", "wall ms", "median", "CPU ms", "x CPU", "B/vert", "floor ms",
               "x floor", "error m");
  }

  /// False when a solver cannot be made; the error is printed.
  bool run(const BenchSet& set, const Model& model, bool has_colliders, std::string& csv) {
    const Groom& groom = model.is_straight ? set.straight : set.groom;
    if (groom.strand_count() == 0) return true;
    const auto parameters = complete_parameters(*model.row, {});
    std::vector<Contestant> all;
    const auto add = [&](Executor& executor, const std::string& name, bool is_held) {
      SceneFeatures features;
      features.has_colliders = has_colliders;
      features.has_follicle_limit = is_held;
      auto made = model.row->make(*parameters, {&executor, features});
      if (!made) return Status(made.error());
      all.push_back({name + (is_held ? ", held" : ""), std::move(made).value(),
                     executor.info().device == SimDevice::Gl, is_held});
      return Status();
    };
    if (model.row->has_kernel) {
      if (gl_) {
        if (const Status made = add(*gl_, "gl", false); !made) return complain(model, made.error());
      }
      for (const bool is_held : {false, true})
        for (const auto& lanes : lanes_) {
          if (is_held && lanes != lanes_.back()) continue;
          if (const Status made = add(*lanes, lanes->info().name, is_held); !made)
            return complain(model, made.error());
        }
    }
    const bool is_slow = groom.rest_position_m.size() > 20'000;
    if (model.name == "dftl")
      all.push_back(
          {"float, one thread", std::make_unique<FloatStrands>(read_strand_parameters(*parameters))});
    all.push_back({"double, one thread", model.row->make_reference(*parameters)});
    all.back().every = is_slow ? 20 : 1;
    for (Contestant& one : all) {
      if (const Status loaded = one.solver->load(groom, {1.0, 0.0, 0.0, 0.0}); !loaded)
        return complain(model, loaded.error());
      one.memory_bytes = one.solver->memory_bytes();
    }
    take_turns(all, has_colliders);
    print_rows(set, model, has_colliders, all, csv);
    return true;
  }

 private:
  static bool complain(const Model& model, const Error& error) {
    fmt::print(stderr, "{}: {}\n", model.name, error.to_string());
    return false;
  }

  static StepInput input_of(int step, bool has_colliders, bool is_held) {
    StepInput input = moving_input(step, kSubstepS);
    input.gusts.clear();
    if (!has_colliders) input.colliders.clear();
    if (is_held) input.follicle_limit_rad = kHeldRad;
    return input;
  }

  void take_turns(std::vector<Contestant>& all, bool has_colliders) const {
    for (int step = 1; step <= options_.warm_up + options_.steps; ++step) {
      for (size_t turn = 0; turn < all.size(); ++turn) {
        Contestant& one = all[(turn + static_cast<size_t>(step)) % all.size()];
        if (step % one.every != 0) continue;
        const StepInput input = input_of(step, has_colliders, one.is_held);
        if (one.is_gl) glFinish();
        const int64_t begin_ns = now_ns();
        const int64_t begin_cpu_ns = process_cpu_ns();
        one.solver->substep(input);
        if (one.is_gl) glFinish();
        if (step <= options_.warm_up && one.every == 1) continue;
        one.cpu_ms.push_back(static_cast<double>(process_cpu_ns() - begin_cpu_ns) * 1e-6);
        one.wall_ms.push_back(static_cast<double>(now_ns() - begin_ns) * 1e-6);
      }
    }
  }

  /// Of a row on an executor, on few strands; nothing for what has no kernel.
  std::optional<Distance> distance_of(const Model& model, uint32_t vertex_count, bool has_colliders,
                                      Executor& executor) const {
    TestGroomDesc desc;
    desc.strand_count = 1000;
    desc.vertex_count = vertex_count;
    if (model.is_straight) desc.bend_rad = 0.0;
    const Groom groom = make_test_groom(desc);
    const auto parameters = complete_parameters(*model.row, {});
    SceneFeatures features;
    features.has_colliders = has_colliders;
    auto solver = model.row->make(*parameters, {&executor, features});
    const auto reference = model.row->make_reference(*parameters);
    if (!solver || !(*solver)->load(groom, {1.0, 0.0, 0.0, 0.0}) ||
        !reference->load(groom, {1.0, 0.0, 0.0, 0.0}))
      return std::nullopt;
    for (int step = 1; step <= kComparedSteps; ++step) {
      const StepInput input = input_of(step, has_colliders, false);
      (*solver)->substep(input);
      reference->substep(input);
    }
    SolverState found;
    SolverState expected;
    (*solver)->read(found);
    reference->read(expected);
    std::vector<double> distances;
    for (size_t i = 0; i < found.position_m.size(); ++i)
      distances.push_back(glm::distance(glm::dvec3(found.position_m[i]), glm::dvec3(expected.position_m[i])));
    return Distance{median(distances), *std::max_element(distances.begin(), distances.end())};
  }

  void print_rows(const BenchSet& set, const Model& model, bool has_colliders,
                  const std::vector<Contestant>& all, std::string& csv) {
    const uint64_t vertices = set.groom.rest_position_m.size();
    const double bytes = bytes_per_vertex(model);
    const double floor_ms = static_cast<double>(vertices) * bytes / copy_speed_ * 1e3;
    double widest_cpu_ms = 0.0;
    for (const Contestant& one : all)
      if (!lanes_.empty() && one.name == lanes_.back()->info().name) widest_cpu_ms = least(one.cpu_ms);
    for (const Contestant& one : all) {
      Executor* executor = one.is_gl ? gl_.get() : nullptr;
      for (const auto& lanes : lanes_)
        if (lanes->info().name == one.name) executor = lanes.get();
      std::optional<Distance> distance;
      if (executor != nullptr)
        distance = distance_of(model, set.groom.uniform_vertex_count(), has_colliders, *executor);
      const double cpu_ms = least(one.cpu_ms);
      const double ratio = widest_cpu_ms > 0.0 ? cpu_ms / widest_cpu_ms : 0.0;
      fmt::print("{:20} {:20} {:9} {:22} {:8.3f} {:8.3f} {:8.3f} {:>7} {:6.0f} {:8.3f} {:7.1f} {:>19}\n",
                 set.name, model.name, has_colliders ? "2 spheres" : "-", one.name, least(one.wall_ms),
                 median(one.wall_ms), cpu_ms, ratio > 0.0 ? fmt::format("{:.1f}", ratio) : "-", bytes,
                 floor_ms, least(one.wall_ms) / floor_ms,
                 distance ? fmt::format("{:.1e} / {:.1e}", distance->median_m, distance->largest_m) : "-");
      csv += fmt::format("{},{},{},\"{}\",{},{:.4f},{:.4f},{:.4f},{:.3f},{:.0f},{:.4f},{},{:.3e},{:.3e}\n",
                         set.name, model.name, has_colliders ? 2 : 0, one.name, vertices, least(one.wall_ms),
                         median(one.wall_ms), cpu_ms, ratio, bytes, floor_ms, one.memory_bytes,
                         distance ? distance->median_m : NAN, distance ? distance->largest_m : NAN);
    }
    std::fflush(stdout);
  }

  Options options_;
  std::unique_ptr<Executor> gl_;
  std::vector<std::unique_ptr<Executor>> lanes_;
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
    } else if (name == "--set" && !value.empty()) {
      options.set = value;
    } else if (name == "--device" && !value.empty()) {
      options.gl_device = value;
    } else {
      fmt::print(stderr,
                 "usage: sim_bench [--steps N] [--csv FILE] [--groom FILE.tfx|FILE.hair] [--device auto] "
                 "[--solver dftl] "
                 "[--set 10000x16|100000x16]\n");
      return std::nullopt;
    }
    ++i;
  }
  return options;
}

int run_bench(const Options& options) {
  ExecutorConfig config;
  config.sim_device = "gl";
  config.gl_device = options.gl_device;
  auto gl = open_executor(config);
  if (!gl) fmt::print("without OpenGL: {}\n", gl.error().to_string());
  const auto sets = make_sets(options);
  if (!sets) return 2;
  Bench bench(options, gl ? std::move(gl).value() : nullptr);
  bench.print_head();
  std::string csv =
      "set,model,colliders,runs_on,vertices,wall_minimum_ms,wall_median_ms,cpu_minimum_ms,cpu_over_lanes,"
      "bytes_per_vertex,floor_ms,memory_bytes,error_median_m,error_largest_m\n";
  for (const BenchSet& set : *sets) {
    for (const Model& model : make_models(options)) {
      for (const bool has_colliders : {false, true}) {
        if (!bench.run(set, model, has_colliders, csv)) return 2;
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
