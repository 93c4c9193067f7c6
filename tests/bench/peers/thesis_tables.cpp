#include "tests/bench/peers/thesis_tables.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/base/profile.h"
#include "common/gl/egl_context.h"
#include "common/groom/groom_asset.h"
#include "common/groom/groom_file.h"
#include "common/render/renderer.h"
#include "common/scene/scene_file.h"
#include "common/strands/scene_asset.h"
#include "server/scene/scene_content.h"
#include "tests/bench/peers/naive_strands.h"
#include "tests/bench/peers/row_bench.h"

namespace strandcast {
namespace {

struct ThesisSet {
  const char* name;
  uint32_t strand_count;
  uint32_t vertex_count;
  // 000 Table 4.2, GTX 1080 Ti; Mohawk and Short were one demo with one time.
  const char* cited_tressfx;
  const char* cited_emulation;
  const char* cited_split;
};
constexpr ThesisSet kSets[] = {
    {"Mohawk", 2228, 32, "", "", ""},       {"Short (Fur)", 37747, 8, "", "", ""},
    {"1k16", 1000, 16, "-", "3.5", "0.4"},  {"1k32", 1000, 32, "-", "42.5", "0.75"},
    {"10k16", 10000, 16, "-", "31", "1.4"}, {"10k32", 10000, 32, "-", "410", "5.9"},
};
constexpr const char* kCitedDemo[] = {"<1", "105", "2.7"};
// Rows that stand for the three columns of that table, then two of ours.
constexpr const char* kColumns[] = {"shape_constraints", "tractrix_emulation", "tractrix_split", "dftl",
                                    "direct_rod"};
constexpr double kSlowMs = 400.0;  // a model this slow is measured with few steps

Result<Groom> groom_of(const ThesisSet& set, const ThesisOptions& options) {
  if (std::string(set.name) != "Mohawk" || options.mohawk.empty())
    return bench_groom(set.strand_count, set.vertex_count);
  GroomFileOptions file;
  file.path = options.mohawk;
  return load_groom(file);
}

Result<double> step_ms(const char* name, const Groom& groom, const ThesisOptions& options,
                       const gl::ShaderLibrary& shaders) {
  const auto row = find_solver(name);
  if (!row) return NAN;  // this build does not have the model
  ASSIGN_OR_RETURN(const double probe_ms, row_step_ms(**row, groom, shaders, 1));
  if (probe_ms > kSlowMs) return probe_ms;
  return row_step_ms(**row, groom, shaders, options.steps);
}

std::string shown_ms(double ms) {
  return std::isnan(ms) ? "-" : fmt::format("{:.2f}", ms);
}

double least_ms(const std::vector<double>& samples_ms) {
  return samples_ms.empty() ? NAN : *std::min_element(samples_ms.begin(), samples_ms.end());
}

/// The rows' motion but with a still head and gravity alone, which is what the naive form knows.
StepInput falling_input(double h_s) {
  StepInput input;
  input.h_s = h_s;
  return input;
}

struct NaiveComparison {
  std::array<double, NaiveStrands::kStages.size()> stage_ms{};
  double fused_ms = 0.0;
  double difference_m = 0.0;  // between the two after the last step
  uint64_t naive_bytes = 0;
  uint64_t fused_bytes = 0;
};

Result<NaiveComparison> compare_naive(const Groom& groom, const ThesisOptions& options,
                                      const gl::ShaderLibrary& shaders) {
  constexpr double kStepS = 1.0 / 60.0;
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver("dftl"));
  ASSIGN_OR_RETURN(const SolverParameters complete,
                   complete_parameters(*row, {{"style_stiffness_per_s2", 0.0}, {"sag_free", 0.0}}));
  const gl::ShaderLibrary naive_shaders(options.naive_shaders);
  ASSIGN_OR_RETURN(NaiveStrands naive,
                   NaiveStrands::make(groom, read_strand_parameters(complete), naive_shaders));
  ASSIGN_OR_RETURN(const auto fused, row->make_gpu(complete, {&shaders, SceneFeatures{}}));
  RETURN_IF_ERROR(fused->load(groom, {1.0, 0.0, 0.0, 0.0}));
  NaiveComparison result;
  std::array<std::vector<double>, NaiveStrands::kStages.size()> stage_ms;
  std::vector<double> fused_ms;
  for (int step = 0; step < options.steps; ++step) {
    const auto times_ms = naive.step_ms(kStepS);
    for (size_t i = 0; i < times_ms.size(); ++i) stage_ms[i].push_back(times_ms[i]);
    glFinish();
    const int64_t begin_ns = now_ns();
    fused->substep(falling_input(kStepS));
    glFinish();
    fused_ms.push_back(static_cast<double>(now_ns() - begin_ns) * 1e-6);
  }
  for (size_t i = 0; i < stage_ms.size(); ++i) result.stage_ms[i] = least_ms(stage_ms[i]);
  result.fused_ms = least_ms(fused_ms);
  SolverState state;
  fused->read(state);
  const std::vector<glm::vec3> naive_m = naive.positions_m();
  for (size_t i = 0; i < naive_m.size(); ++i)
    result.difference_m =
        std::max(result.difference_m, static_cast<double>(glm::distance(naive_m[i], state.position_m[i])));
  result.naive_bytes = naive.memory_bytes();
  result.fused_bytes = fused->memory_bytes();
  return result;
}

/// Of one picture of 640 x 360 with 2 x 2 samples per pixel.
Result<double> draw_ms(const ThesisOptions& options, const gl::ShaderLibrary& shaders) {
  constexpr int kPictures = 7;
  ASSIGN_OR_RETURN(const SceneDesc scene, load_scene(options.scene, {"look.segments=2"}));
  ASSIGN_OR_RETURN(SceneContent content, load_scene_content(scene));
  const SceneAsset asset = make_scene_asset(content.groom, std::move(content.head));
  ASSIGN_OR_RETURN(const auto renderer, Renderer::make(shaders, options.device, asset, scene.look));
  PosedStrands strands;
  strands.position_m = asset.rest_position_m;
  std::vector<double> samples_ms;
  for (int i = 0; i < kPictures; ++i) {
    const int64_t begin_ns = now_ns();
    RETURN_IF_ERROR(renderer->draw(strands, scene.camera, RenderSize{}));
    glFinish();
    if (i > 0) samples_ms.push_back(static_cast<double>(now_ns() - begin_ns) * 1e-6);
  }
  return least_ms(samples_ms);
}

void print_table_51(const NaiveComparison& naive, double odd_even_ms, double drawing_ms) {
  double naive_ms = 0.0;
  for (const double ms : naive.stage_ms) naive_ms += ms;
  fmt::print(
      "\nIn the form of 003, Table 5.1: 242 strands x 8 particles, smoothed to 16 when drawn; ms\n"
      "{:<34}{:>12}{:>12}{:>12}\n",
      "Method", "Simulation", "Rendering", "Total");
  const auto line = [](const std::string& name, double simulation_ms, double rendering_ms) {
    fmt::print("{:<34}{:>12.3f}{:>12.2f}{:>12.2f}\n", name, simulation_ms, rendering_ms,
               simulation_ms + rendering_ms);
  };
  line("TressFX 2.0, cited, HD 6670", 9.21, 11.05);
  line("gpu, cited, HD 6670", 4.94, 15.57);
  line("optimised_gpu, cited, HD 6670", 0.65, 8.83);
  line("naive form, here", naive_ms, drawing_ms);
  line("dftl, here", naive.fused_ms, drawing_ms);
  line("dftl_parallel, here", odd_even_ms, drawing_ms);
  fmt::print(
      "Cited simulation holds a voxel grid for hair against hair, which Strandcast has not got; ours are the "
      "strands alone.\nState: cited 123,904 bytes (gpu) and 46,464 (optimised_gpu); here {} naive, {} dftl "
      "with "
      "rest shape and uniforms.\nAfter the last step the naive form and dftl differ by {:.1e} m at most.\n",
      naive.naive_bytes, naive.fused_bytes, naive.difference_m);
}

void print_table_52(const NaiveComparison& naive, double drawing_ms) {
  fmt::print("\nIn the form of 003, Table 5.2: components, ms\n{:<34}{:>14}{:>14}{:>12}{:>12}\n", "Component",
             "gpu, HD 6670", "optimised_gpu", "naive here", "dftl here");
  double naive_ms = 0.0;
  for (size_t i = 0; i < naive.stage_ms.size(); ++i) {
    fmt::print("  {:<32}{:>14}{:>14}{:>12.3f}{:>12}\n", NaiveStrands::kStages[i], "", "", naive.stage_ms[i],
               "fused");
    naive_ms += naive.stage_ms[i];
  }
  fmt::print("{:<34}{:>14}{:>14}{:>12.3f}{:>12.3f}\n", "Strand Dynamics", "0.43", "0.12", naive_ms,
             naive.fused_ms);
  fmt::print("{:<34}{:>14}{:>14}{:>12}{:>12}\n", "Clear Voxels", "0.15", "0.28", "-", "-");
  fmt::print("{:<34}{:>14}{:>14}{:>12}{:>12}\n", "Voxel Calculations", "4.36", "0.22", "-", "-");
  fmt::print("{:<34}{:>14}{:>14}{:>12.2f}{:>12.2f}\n", "Draw (with / without AA)", "15.57 / 10.58",
             "8.83 / 4.38", drawing_ms, drawing_ms);
  fmt::print("{:<34}{:>14}{:>14}{:>12.2f}{:>12.2f}\n", "Total", "20.52 / 15.52", "9.47 / 5.00",
             naive_ms + drawing_ms, naive.fused_ms + drawing_ms);
  fmt::print(
      "Here draws once, 640 x 360, always with 2 x 2 samples per pixel; both columns the same drawing.\n");
}

}  // namespace

Status print_tables_of_000(const ThesisOptions& options, const gl::ShaderLibrary& shaders, std::string& csv) {
  fmt::print("\nIn the form of 000, Table 4.1: test sets\n{:<14}{:>16}{:>22}{:>16}\n", "Name",
             "Number Strands", "Particles per Strand", "Particle count");
  for (const ThesisSet& set : kSets)
    fmt::print("{:<14}{:>16}{:>22}{:>16}\n", set.name, set.strand_count, set.vertex_count,
               set.strand_count * set.vertex_count);
  fmt::print("{}\n", options.mohawk.empty() ? "Mohawk and Short: grown strands of these sizes."
                                            : "Mohawk: the file; Short: grown strands of this size.");
  fmt::print(
      "\nIn the form of 000, Table 4.2: ms per step. Cited: whole programs on a GTX 1080 Ti; here: one step "
      "of "
      "1/60 s.\n{:<16}{:>10}{:>11}{:>8} |",
      "", "TressFX", "Emulation", "Split");
  for (const char* column : kColumns) fmt::print("{:>20}", column);
  fmt::print("\n");
  std::array<double, std::size(kColumns)> demo_ms{};
  for (size_t s = 0; s < std::size(kSets); ++s) {
    const ThesisSet& set = kSets[s];
    const bool is_demo = s < 2;  // Mohawk and Short: one line, as there
    ASSIGN_OR_RETURN(const Groom groom, groom_of(set, options));
    std::array<double, std::size(kColumns)> times_ms{};
    for (size_t i = 0; i < times_ms.size(); ++i) {
      ASSIGN_OR_RETURN(times_ms[i], step_ms(kColumns[i], groom, options, shaders));
      demo_ms[i] += is_demo ? times_ms[i] : 0.0;
      if (!std::isnan(times_ms[i]))
        csv += fmt::format("000 table 4.2,{},{},step_ms,{:.4f}\n", set.name, kColumns[i], times_ms[i]);
    }
    if (s == 0) continue;
    fmt::print("{:<16}{:>10}{:>11}{:>8} |", is_demo ? "Mohawk & Short" : set.name,
               is_demo ? kCitedDemo[0] : set.cited_tressfx, is_demo ? kCitedDemo[1] : set.cited_emulation,
               is_demo ? kCitedDemo[2] : set.cited_split);
    for (size_t i = 0; i < times_ms.size(); ++i)
      fmt::print("{:>20}", shown_ms(is_demo ? demo_ms[i] : times_ms[i]));
    fmt::print("\n");
  }
  return {};
}

Status print_tables_of_003(const ThesisOptions& options, const gl::ShaderLibrary& shaders, std::string& csv) {
  constexpr uint32_t kStrands = 242;
  constexpr uint32_t kParticles = 8;
  const Groom groom = bench_groom(kStrands, kParticles);
  ASSIGN_OR_RETURN(const NaiveComparison naive, compare_naive(groom, options, shaders));
  ASSIGN_OR_RETURN(const double odd_even_ms, step_ms("dftl_parallel", groom, options, shaders));
  ASSIGN_OR_RETURN(const double drawing_ms, draw_ms(options, shaders));
  print_table_51(naive, odd_even_ms, drawing_ms);
  print_table_52(naive, drawing_ms);
  for (size_t i = 0; i < naive.stage_ms.size(); ++i)
    csv +=
        fmt::format("003 table 5.2,242x8,naive,{}_ms,{:.4f}\n", NaiveStrands::kStages[i], naive.stage_ms[i]);
  csv += fmt::format("003 table 5.2,242x8,dftl,step_ms,{:.4f}\n", naive.fused_ms);
  csv += fmt::format("003 table 5.1,242x8,dftl_parallel,step_ms,{:.4f}\n", odd_even_ms);
  csv += fmt::format("003 table 5.1,242x8,renderer,draw_ms,{:.4f}\n", drawing_ms);
  return {};
}

}  // namespace strandcast
