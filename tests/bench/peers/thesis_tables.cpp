#include "tests/bench/peers/thesis_tables.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <tuple>
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
#include "tests/bench/peers/voxel_stages.h"

namespace strandcast {
namespace {

struct ThesisSet {
  const char* name;
  uint32_t strand_count;
  uint32_t vertex_count;
  // Zappe, Table 4.2, GTX 1080 Ti; Mohawk and Short were one demo with one time.
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
                       Executor& executor) {
  const auto row = find_solver(name);
  if (!row) return NAN;  // this build does not have the model
  ASSIGN_OR_RETURN(const double probe_ms, row_step_ms(**row, groom, executor, 1));
  if (probe_ms > kSlowMs) return probe_ms;
  return row_step_ms(**row, groom, executor, options.steps);
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

/// Woodhouse's stages before a picture: naive beside optimised.
struct SimulationTimes {
  std::array<double, NaiveStrands::kStages.size()> naive_stage_ms{};
  double naive_ms = 0.0;     // all of them
  double fused_ms = 0.0;     // dftl
  double odd_even_ms = 0.0;  // dftl_parallel, as Woodhouse's faster version solves constraints
  VoxelTimes naive_voxels;
  VoxelTimes voxels;
  double difference_m = 0.0;    // between naive and dftl after the last step
  double difference_mps = 0.0;  // between the two kinds of friction
  uint64_t naive_bytes = 0;
  uint64_t fused_bytes = 0;
};

/// A row of the solver table with the groom loaded, without style.
Result<std::unique_ptr<Solver>> make_limp(const char* name, const Groom& groom, Executor& executor) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(name));
  ASSIGN_OR_RETURN(const SolverParameters complete,
                   complete_parameters(*row, {{"style_stiffness_per_s2", 0.0}, {"sag_free", 0.0}}));
  ASSIGN_OR_RETURN(auto solver, row->make(complete, {&executor, SceneFeatures{}}));
  RETURN_IF_ERROR(solver->load(groom, {1.0, 0.0, 0.0, 0.0}));
  return solver;
}

double substep_ms(Solver& solver, double h_s) {
  glFinish();
  const int64_t begin_ns = now_ns();
  solver.substep(falling_input(h_s));
  glFinish();
  return static_cast<double>(now_ns() - begin_ns) * 1e-6;
}

/// All stages in turn, step by step, so that whatever else runs meets all alike; the least of each.
Result<SimulationTimes> time_simulation(const Groom& groom, const ThesisOptions& options,
                                        Executor& executor) {
  constexpr double kStepS = 1.0 / 60.0;
  const gl::ShaderLibrary naive_shaders(options.naive_shaders);
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver("dftl"));
  ASSIGN_OR_RETURN(const SolverParameters complete,
                   complete_parameters(*row, {{"style_stiffness_per_s2", 0.0}, {"sag_free", 0.0}}));
  ASSIGN_OR_RETURN(NaiveStrands naive,
                   NaiveStrands::make(groom, read_strand_parameters(complete), naive_shaders));
  ASSIGN_OR_RETURN(const auto fused, make_limp("dftl", groom, executor));
  ASSIGN_OR_RETURN(const auto odd_even, make_limp("dftl_parallel", groom, executor));
  ASSIGN_OR_RETURN(VoxelStages voxels, VoxelStages::make(groom.rest_position_m, naive_shaders));
  SimulationTimes result;
  std::array<std::vector<double>, NaiveStrands::kStages.size()> stage_ms;
  std::vector<double> fused_ms, odd_even_ms, naive_clear_ms, naive_voxel_ms, clear_ms, voxel_ms;
  for (int step = 0; step < options.steps; ++step) {
    const auto times_ms = naive.step_ms(kStepS);
    for (size_t i = 0; i < times_ms.size(); ++i) stage_ms[i].push_back(times_ms[i]);
    fused_ms.push_back(substep_ms(*fused, kStepS));
    odd_even_ms.push_back(substep_ms(*odd_even, kStepS));
    const VoxelTimes slow = voxels.run_naive();
    naive_clear_ms.push_back(slow.clear_ms);
    naive_voxel_ms.push_back(slow.calculation_ms);
    const VoxelTimes fast = voxels.run_optimised();
    clear_ms.push_back(fast.clear_ms);
    voxel_ms.push_back(fast.calculation_ms);
  }
  for (size_t i = 0; i < stage_ms.size(); ++i) {
    result.naive_stage_ms[i] = least_ms(stage_ms[i]);
    result.naive_ms += result.naive_stage_ms[i];
  }
  result.fused_ms = least_ms(fused_ms);
  result.odd_even_ms = least_ms(odd_even_ms);
  result.naive_voxels = {least_ms(naive_clear_ms), least_ms(naive_voxel_ms)};
  result.voxels = {least_ms(clear_ms), least_ms(voxel_ms)};
  result.difference_mps = voxels.largest_difference_mps();
  SolverState state;
  fused->read(state);
  const std::vector<glm::vec3> naive_m = naive.positions_m();
  for (size_t i = 0; i < naive_m.size(); ++i)
    result.difference_m =
        std::max(result.difference_m, static_cast<double>(glm::distance(naive_m[i], state.position_m[i])));
  result.naive_bytes = naive.memory_bytes() + VoxelStages::kBytes;
  result.fused_bytes = odd_even->memory_bytes() + VoxelStages::kBytes;
  return result;
}

/// A picture of one of Woodhouse's versions: by the shadow that it had, with four samples per pixel or one.
struct Drawing {
  const char* shadow;
  bool has_antialiasing;
  std::unique_ptr<Renderer> renderer;
  std::vector<double> whole_ms;
  std::vector<double> shadow_ms;  // the stages that make the shadow
};
struct DrawTimes {
  double ms = 0.0;
  double shadow_ms = 0.0;
};
struct AllDrawTimes {
  DrawTimes naive, naive_without, optimised, optimised_without;
};

double shadow_stages_ms(const Renderer& renderer) {
  double ms = 0.0;
  for (const char* pass :
       {"render/expand_for_first_depth", "render/first_depth", "render/expand_for_opacity",
        "render/opacity_layers", "render/expand_for_density", "render/density", "render/density_ready"})
    ms += renderer.passes().last_ms(pass);
  return ms;
}

/// Deep opacity maps (Woodhouse's `gpu`) beside rays through the density (its `optimised_gpu`), in turn.
Result<AllDrawTimes> time_drawing(const ThesisOptions& options, const gl::ShaderLibrary& shaders) {
  constexpr int kPictures = 7;
  ASSIGN_OR_RETURN(const SceneDesc scene, load_scene(options.scene, {"look.segments=2", "look.followers=3"}));
  ASSIGN_OR_RETURN(SceneContent content, load_scene_content(scene));
  const SceneAsset asset = make_scene_asset(content.groom, std::move(content.head));
  PosedStrands strands;
  strands.position_m = asset.rest_position_m;
  Drawing drawings[] = {{"deep_opacity", true, nullptr, {}, {}},
                        {"deep_opacity", false, nullptr, {}, {}},
                        {"density_rays", true, nullptr, {}, {}},
                        {"density_rays", false, nullptr, {}, {}}};
  for (Drawing& drawing : drawings) {
    LookDesc look = scene.look;
    look.methods.shadow = drawing.shadow;
    look.methods.detail = "full";
    look.methods.antialiasing = drawing.has_antialiasing ? "msaa4" : "analytic";
    ASSIGN_OR_RETURN(drawing.renderer, Renderer::make(shaders, options.device, asset, look, segment_path()));
  }
  for (int i = 0; i < kPictures; ++i)
    for (Drawing& drawing : drawings) {
      // `analytic` has 2 x 2 samples: half the sides make it one per pixel of the other pictures.
      RenderSize size;
      if (!drawing.has_antialiasing) size = {size.width / kSamplesPerSide, size.height / kSamplesPerSide};
      const int64_t begin_ns = now_ns();
      RETURN_IF_ERROR(drawing.renderer->draw(strands, scene.camera, size));
      glFinish();
      if (i == 0) continue;
      drawing.whole_ms.push_back(static_cast<double>(now_ns() - begin_ns) * 1e-6);
      drawing.shadow_ms.push_back(shadow_stages_ms(*drawing.renderer));
    }
  const auto of = [](const Drawing& drawing) {
    return DrawTimes{least_ms(drawing.whole_ms), least_ms(drawing.shadow_ms)};
  };
  return AllDrawTimes{of(drawings[0]), of(drawings[1]), of(drawings[2]), of(drawings[3])};
}

double simulation_ms(double strands_ms, const VoxelTimes& voxels) {
  return strands_ms + voxels.clear_ms + voxels.calculation_ms;
}

void print_table_51(const SimulationTimes& times, const AllDrawTimes& drawn) {
  fmt::print(
      "\nIn the form of Woodhouse 2017, Table 5.1: 242 strands x 8 particles, smoothed to 16 when drawn, "
      "with "
      "antialiasing; ms\n{:<16}{:>30}{:>30}{:>30}\n{:<16}",
      "Method", "Simulation", "Rendering", "Total", "");
  for (int i = 0; i < 3; ++i) fmt::print("{:>10}{:>10}{:>10}", "HD 7520G", "HD 6670", "here");
  fmt::print("\n");
  struct Row {
    const char* name;
    double simulation[3], rendering[3];
  };
  const double naive_ms = simulation_ms(times.naive_ms, times.naive_voxels);
  const double optimised_ms = simulation_ms(times.odd_even_ms, times.voxels);
  for (const Row& row :
       {Row{"TressFX 2.0", {17.15, 9.21, NAN}, {28.20, 11.05, NAN}},
        Row{"gpu", {6.84, 4.94, naive_ms}, {38.46, 15.57, drawn.naive.ms}},
        Row{"optimised_gpu", {0.93, 0.65, optimised_ms}, {16.55, 8.83, drawn.optimised.ms}}}) {
    fmt::print("{:<16}", row.name);
    for (const double ms : row.simulation) fmt::print("{:>10}", shown_ms(ms));
    for (const double ms : row.rendering) fmt::print("{:>10}", shown_ms(ms));
    for (int i = 0; i < 3; ++i) fmt::print("{:>10}", shown_ms(row.simulation[i] + row.rendering[i]));
    fmt::print("\n");
  }
  fmt::print(
      "gpu / optimised_gpu here: {:.1f} of the simulation, {:.2f} of the rendering, {:.2f} of all (cited: "
      "7.4 "
      "and 7.6, 2.3 and 1.8, 2.6 and 2.2).\n"
      "State with voxels: cited 373,904 and 296,464 bytes; here {} and {} with rest shape and uniforms.\n"
      "After the last step the first form and dftl differ by {:.1e} m at most, the two kinds of friction by "
      "{:.1e} m/s.\n",
      naive_ms / optimised_ms, drawn.naive.ms / drawn.optimised.ms,
      (naive_ms + drawn.naive.ms) / (optimised_ms + drawn.optimised.ms), times.naive_bytes, times.fused_bytes,
      times.difference_m, times.difference_mps);
}

void print_table_52(const SimulationTimes& times, const AllDrawTimes& drawn) {
  fmt::print(
      "\nIn the form of Woodhouse 2017, Table 5.2: components, ms; draw and total with / without "
      "antialiasing\n"
      "{:<24}{:>51}{:>51}\n{:<24}",
      "Component", "gpu", "optimised_gpu", "");
  for (int i = 0; i < 2; ++i) fmt::print("{:>17}{:>17}{:>17}", "HD 7520G", "HD 6670", "here");
  fmt::print("\n");
  const auto line = [](const char* name, std::array<std::string, 6> cells) {
    fmt::print("{:<24}", name);
    for (const std::string& cell : cells) fmt::print("{:>17}", cell);
    fmt::print("\n");
  };
  const auto one = [](double ms) { return fmt::format("{:.3f}", ms); };
  const auto two = [](double with, double without) { return fmt::format("{:.2f} / {:.2f}", with, without); };
  for (size_t i = 0; i < times.naive_stage_ms.size(); ++i)
    line(fmt::format("  {}", NaiveStrands::kStages[i]).c_str(),
         {"", "", one(times.naive_stage_ms[i]), "", "", "fused"});
  line("Strand Dynamics", {"1.04", "0.43", one(times.naive_ms), "0.12", "0.12", one(times.odd_even_ms)});
  line("Clear Voxels",
       {"0.47", "0.15", one(times.naive_voxels.clear_ms), "0.31", "0.28", one(times.voxels.clear_ms)});
  line("Voxel Calculations", {"5.28", "4.36", one(times.naive_voxels.calculation_ms), "0.40", "0.22",
                              one(times.voxels.calculation_ms)});
  line("  of Draw: shadow", {"", "", two(drawn.naive.shadow_ms, drawn.naive_without.shadow_ms), "", "",
                             two(drawn.optimised.shadow_ms, drawn.optimised_without.shadow_ms)});
  line("Draw", {"38.46 / 26.27", "15.57 / 10.58", two(drawn.naive.ms, drawn.naive_without.ms), "16.55 / 8.16",
                "8.83 / 4.38", two(drawn.optimised.ms, drawn.optimised_without.ms)});
  const double naive_ms = simulation_ms(times.naive_ms, times.naive_voxels);
  const double optimised_ms = simulation_ms(times.odd_even_ms, times.voxels);
  line("Total",
       {"45.30 / 33.07", "20.52 / 15.52", two(naive_ms + drawn.naive.ms, naive_ms + drawn.naive_without.ms),
        "17.49 / 8.98", "9.47 / 5.00",
        two(optimised_ms + drawn.optimised.ms, optimised_ms + drawn.optimised_without.ms)});
  fmt::print(
      "Strand Dynamics of optimised_gpu here: dftl_parallel; dftl, serial and fused: {:.3f}.\n"
      "Drawn here at 640 x 360: gpu by deep opacity maps, optimised_gpu by rays through the density of the "
      "drawn\nstrands, which is made for the picture, not left by the simulation; without antialiasing: one "
      "sample per pixel.\n",
      times.fused_ms);
}

}  // namespace

Status print_tables_of_zappe(const ThesisOptions& options, Executor& executor, std::string& csv) {
  fmt::print("\nIn the form of Zappe 2020, Table 4.1: test sets\n{:<14}{:>16}{:>22}{:>16}\n", "Name",
             "Number Strands", "Particles per Strand", "Particle count");
  for (const ThesisSet& set : kSets)
    fmt::print("{:<14}{:>16}{:>22}{:>16}\n", set.name, set.strand_count, set.vertex_count,
               set.strand_count * set.vertex_count);
  fmt::print("{}\n", options.mohawk.empty() ? "Mohawk and Short: grown strands of these sizes."
                                            : "Mohawk: the file; Short: grown strands of this size.");
  fmt::print(
      "\nIn the form of Zappe 2020, Table 4.2: ms per step. Cited: whole programs on a GTX 1080 Ti; here: "
      "one step "
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
      ASSIGN_OR_RETURN(times_ms[i], step_ms(kColumns[i], groom, options, executor));
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

Status print_tables_of_woodhouse(const ThesisOptions& options, Executor& executor, std::string& csv) {
  constexpr uint32_t kStrands = 242;
  constexpr uint32_t kParticles = 8;
  const Groom groom = bench_groom(kStrands, kParticles);
  ASSIGN_OR_RETURN(const SimulationTimes times, time_simulation(groom, options, executor));
  ASSIGN_OR_RETURN(const AllDrawTimes drawn, time_drawing(options, gl::ShaderLibrary()));
  print_table_51(times, drawn);
  print_table_52(times, drawn);
  const auto add = [&](const char* model, const std::string& measure, double value) {
    csv += fmt::format("003 table 5.2,242x8,{},{},{:.4f}\n", model, measure, value);
  };
  for (size_t i = 0; i < times.naive_stage_ms.size(); ++i)
    add("naive", fmt::format("{}_ms", NaiveStrands::kStages[i]), times.naive_stage_ms[i]);
  add("dftl", "step_ms", times.fused_ms);
  add("dftl_parallel", "step_ms", times.odd_even_ms);
  add("naive", "clear_voxels_ms", times.naive_voxels.clear_ms);
  add("naive", "voxels_ms", times.naive_voxels.calculation_ms);
  add("optimised", "clear_voxels_ms", times.voxels.clear_ms);
  add("optimised", "voxels_ms", times.voxels.calculation_ms);
  for (const auto& [model, measure, draw] :
       {std::tuple("naive", "draw", drawn.naive), std::tuple("naive", "draw_without", drawn.naive_without),
        std::tuple("optimised", "draw", drawn.optimised),
        std::tuple("optimised", "draw_without", drawn.optimised_without)}) {
    add(model, fmt::format("{}_ms", measure), draw.ms);
    add(model, fmt::format("{}_shadow_ms", measure), draw.shadow_ms);
  }
  return {};
}

}  // namespace strandcast
