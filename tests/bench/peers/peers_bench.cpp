// Strand models beside other programs, in one run: Bullet's soft-body rope (when built with it), what the
// source documents measured, in the form of their tables, and the rates that this project aims at. Nothing
// here passes or fails.
//
// llvmpipe runs kernels on all cores, Bullet runs on one: everything on the GL device is measured with one
// thread and with all of them, in a process of its own each, since a driver reads LP_NUM_THREADS once. On
// hardware the setting changes nothing.
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/gl/egl_context.h"
#include "tests/bench/peers/rope_peer.h"
#include "tests/bench/peers/row_bench.h"
#include "tests/bench/peers/thesis_tables.h"

namespace strandcast {
namespace {

constexpr uint32_t kStrands = 1000;
constexpr uint32_t kVertexCounts[] = {16, 32, 64};
constexpr double kDirectTargetPerS = 5e6;     // vertex-steps, two cores under llvmpipe
constexpr double kIteratedTargetPerS = 60e6;  // vertex-iterations

struct Options {
  ThesisOptions thesis;
  std::string csv_path;
  ExecutorConfig device = {"gl", "auto", {}};
};

void print_swing_of_rope() {
  fmt::print("\n{}: distance constraints, no bending; worst segment (whole rope)\n{:<18}", rope_peer_name(),
             "");
  const std::pair<int, uint32_t> settings[] = {{60, 4}, {60, 16}, {60, 64}, {240, 4}, {240, 16}, {240, 64}};
  for (const auto& [rate_hz, iterations] : settings)
    fmt::print("{:>16}", fmt::format("{} Hz, {} it", rate_hz, iterations));
  fmt::print("\n");
  for (const uint32_t nodes : {32u, 64u}) {
    fmt::print("{:<18}", fmt::format("{} nodes", nodes));
    for (const auto& [rate_hz, iterations] : settings) {
      RopeSetup setup;
      setup.node_count = nodes;
      setup.step_s = 1.0 / rate_hz;
      setup.iterations = iterations;
      const RopeStretch stretch = rope_stretch(setup, 5.0);
      fmt::print("{:>16}", fmt::format("{:.1f}% ({:.1f}%)", 100.0 * stretch.segment, 100.0 * stretch.whole));
    }
    fmt::print("\n");
  }
}

std::string shown_share(double share) {
  return share < 1e-4 ? fmt::format("{:.1e}", share) : fmt::format("{:.2f}%", 100.0 * share);
}

Status print_swings(Executor& executor, std::string& csv) {
  fmt::print(
      "\nA hair of 0.3 m, clamped at one end, let go horizontally: largest stretch of a segment over 5 s\n");
  if (*rope_peer_name() != '\0') print_swing_of_rope();
  fmt::print("\n{:<24}{:>14}{:>14}{:>14}{:>14}\n", "one step per frame, defaults", "32 at 60 Hz",
             "64 at 60 Hz", "32 at 240 Hz", "64 at 240 Hz");
  for (const SolverRow& row : solver_table()) {
    fmt::print("{:<28}", row.name + (row.as_hair ? "" : " (limp)"));
    for (const double rate_hz : {60.0, 240.0}) {
      for (const uint32_t vertices : {32u, 64u}) {
        const auto stretch = swing_stretch(row, {vertices, 1.0 / rate_hz, 5.0}, executor);
        fmt::print("{:>13} ", stretch ? shown_share(*stretch) : "refused");
        if (stretch)
          csv += fmt::format("swing,{}x{:g}Hz,{},stretch,{:.3e}\n", vertices, rate_hz, row.name, *stretch);
      }
    }
    std::fflush(stdout);
    fmt::print("\n");
  }
  return {};
}

void print_rope_times(std::string& csv) {
  if (*rope_peer_name() == '\0') return;
  fmt::print("{:<22}", fmt::format("{}, 4 it", rope_peer_name()));
  for (const uint32_t vertices : kVertexCounts) {
    RopeSetup setup;
    setup.rope_count = kStrands;
    setup.node_count = vertices;
    const double ms = rope_step_ms(setup, 15);
    const double per_s = kStrands * vertices / (ms * 1e-3);
    fmt::print("{:>9.2f}{:>9.1f}{:>9.1f}", ms, per_s * 1e-6, 4.0 * per_s * 1e-6);
    csv += fmt::format("frame,{}x{},{},step_ms,{:.4f}\n", kStrands, vertices, "bullet rope 4 it", ms);
  }
  fmt::print("  one core, whatever the others use\n");
}

/// Milliseconds per frame of every row, and the rates that are aimed at.
Status print_times(Executor& executor, const Options& options, std::string& csv) {
  fmt::print(
      "\nms per frame of 1/60 s, {} strands; million vertex-steps and vertex-iterations per second. Aims "
      "(two "
      "cores,\nllvmpipe): direct_rod 5 million vertex-steps, iterated rows 60 million "
      "vertex-iterations.\n{:<22}",
      kStrands, "");
  for (const uint32_t vertices : kVertexCounts)
    fmt::print("{:>9}{:>9}{:>9}", fmt::format("x{} ms", vertices), "Mstep/s", "Mit/s");
  fmt::print("\n");
  print_rope_times(csv);
  for (const SolverRow& row : solver_table()) {
    fmt::print("{:<22}", row.name + (row.has_kernel ? "" : " (double)"));
    double slowest_steps_per_s = INFINITY;
    for (const uint32_t vertices : kVertexCounts) {
      const Groom groom = bench_groom(kStrands, vertices);
      const int steps = row.has_kernel ? options.thesis.steps : 2;
      ASSIGN_OR_RETURN(const double ms, row_step_ms(row, groom, executor, steps));
      const double per_s = kStrands * vertices / (ms * 1e-3);
      slowest_steps_per_s = std::min(slowest_steps_per_s, per_s);
      fmt::print("{:>9.2f}{:>9.1f}{:>9.1f}", ms, per_s * 1e-6, iterations_of(row) * per_s * 1e-6);
      csv += fmt::format("frame,{}x{},{},step_ms,{:.4f}\n", kStrands, vertices, row.name, ms);
    }
    const bool is_iterated = row.effort_parameter == "iterations";
    if (row.name == "direct_rod")
      fmt::print("  {}", slowest_steps_per_s >= kDirectTargetPerS ? "reaches its aim" : "short of its aim");
    if (is_iterated)
      fmt::print("  {:g} iterations: {}", iterations_of(row),
                 iterations_of(row) * slowest_steps_per_s >= kIteratedTargetPerS ? "reaches its aim"
                                                                                 : "short of its aim");
    fmt::print("\n");
    std::fflush(stdout);
  }
  return {};
}

Status measure(const Options& options, int thread_count, bool has_swings, std::string& csv) {
  ASSIGN_OR_RETURN(const auto executor, open_executor(options.device));
  std::unique_ptr<gl::EglContext> context;  // of what is drawn, where the executor has none
  if (executor->info().device != SimDevice::Gl) {
    ASSIGN_OR_RETURN(context, gl::EglContext::make(options.device.gl_device));
  }
  fmt::print("\n==== {}, {} thread{} ====\n", executor->info().name, thread_count,
             thread_count == 1 ? "" : "s");
  if (has_swings) RETURN_IF_ERROR(print_swings(*executor, csv));
  RETURN_IF_ERROR(print_times(*executor, options, csv));
  ThesisOptions thesis = options.thesis;
  ASSIGN_OR_RETURN(thesis.device, gl::read_device_info());
  RETURN_IF_ERROR(print_tables_of_zappe(thesis, *executor, csv));
  return print_tables_of_woodhouse(thesis, *executor, csv);
}

/// In a process of its own, since the driver reads the number of threads once.
bool measure_apart(const Options& options, int thread_count, bool has_swings) {
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    setenv("LP_NUM_THREADS", std::to_string(thread_count).c_str(), 1);
    std::string csv;
    const Status status = measure(options, thread_count, has_swings, csv);
    if (!status) fmt::print(stderr, "{}\n", status.error().to_string());
    if (!options.csv_path.empty()) {
      std::ofstream file(options.csv_path, std::ios::app);
      for (size_t begin = 0; begin < csv.size();) {
        const size_t end = csv.find('\n', begin) + 1;
        file << thread_count << ',' << csv.substr(begin, end - begin);
        begin = end;
      }
    }
    std::fflush(stdout);
    _exit(status ? 0 : 2);
  }
  int result = 0;
  return child > 0 && waitpid(child, &result, 0) == child && WIFEXITED(result) && WEXITSTATUS(result) == 0;
}

std::optional<Options> parse(int argc, char** argv) {
  Options options;
  options.thesis.naive_shaders = std::string(STRANDCAST_SOURCE_DIR) + "/tests/bench/peers";
  options.thesis.scene = std::string(STRANDCAST_SOURCE_DIR) + "/deploy/scenes/bench_242x8.textproto";
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    const std::string value = i + 1 < argc ? argv[i + 1] : "";
    if (name == "--steps" && std::atoi(value.c_str()) > 0) {
      options.thesis.steps = std::atoi(value.c_str());
    } else if (name == "--csv" && !value.empty()) {
      options.csv_path = value;
    } else if (name == "--mohawk" && !value.empty()) {
      options.thesis.mohawk = value;
    } else if (name == "--device" && !value.empty()) {
      options.device.gl_device = value;
    } else if (name == "--sim-device" && is_sim_device_name(value)) {
      options.device.sim_device = value;
    } else {
      fmt::print(stderr,
                 "usage: peers_bench [--steps N] [--csv FILE] [--mohawk FILE.tfx] [--device auto] "
                 "[--sim-device gl|lanes|auto]\n");
      return std::nullopt;
    }
    ++i;
  }
  return options;
}

int run_bench(const Options& options) {
  const int thread_count = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  if (!options.csv_path.empty()) {
    std::ofstream file(options.csv_path);
    file << "threads,section,set,model,measure,value\n";
    if (!file.flush()) {
      fmt::print(stderr, "{}: cannot be written\n", options.csv_path);
      return 2;
    }
  }
  fmt::print("Best of {} steps each: other programs may share the machine.\n", options.thesis.steps);
  bool is_done = measure_apart(options, thread_count, true);
  if (thread_count > 1) is_done = measure_apart(options, 1, false) && is_done;
  return is_done ? 0 : 2;
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  const auto options = strandcast::parse(argc, argv);
  return options ? strandcast::run_bench(*options) : 2;
}
