// Prints CSV: what each stage of the tiles takes on the processor, and the least that it could take here: its
// floating-point operations and bytes over what this machine can do, measured in the same run.
//   stage_bench [--rounds N] [--scene FILE] [--size WxH]
// Without a scene: the built-in one at 1280x720, 640x360 and from four times as far, and 10,240 strands of 64
// vertices. Milliseconds are the process's CPU time, of all threads together, medians over the rounds; what
// the machine can do is measured per millisecond of one thread's CPU time, so that whatever else runs hardly
// counts. Operations are counted by hand in the laws of shaders/lib and the kernels of common/render/tiles (a
// root, division or exponential counts as 8); bytes are those that do not fit a cache. `times_floor` is how
// far a stage is from the larger of the two.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <map>
#include <string>
#include <vector>

#include "common/base/quantile.h"
#include "common/groom/groom_asset.h"
#include "common/render/render_scene.h"
#include "common/render/tiles/strand_expansion.h"
#include "common/render/tiles/strand_shading.h"
#include "common/render/tiles/tile_bins.h"
#include "common/render/tiles/tile_renderer.h"
#include "common/scene/scene_file.h"
#include "common/simd/lanes.h"
#include "common/simd/variants.h"
#include "server/scene/scene_content.h"

namespace strandcast {
namespace {

struct Options {
  int rounds = 9;
  std::string scene;
  RenderSize size{0, 0};
};

struct Case {
  std::string name;
  SceneDesc scene;
  RenderSize size;
};

// ---- what the machine can do

struct PeakArguments {
  uint64_t turns;
  float* sum;
};

STRANDCAST_LANES void multiply_and_add_lanes(const PeakArguments& a) {
  using simd::Float;
  // Enough chains to hide the latency of each.
  constexpr int kChains = 8;
  Float chain[kChains];
  for (int i = 0; i < kChains; ++i) chain[i] = Float(0.001f * static_cast<float>(i));
  for (uint64_t turn = 0; turn < a.turns; ++turn)
    for (int i = 0; i < kChains; ++i) chain[i] = chain[i] * 0.999f + 0.001f;
  for (int i = 0; i < kChains; ++i) *a.sum += chain[i].v[0];
}
STRANDCAST_KERNEL(multiply_and_add, PeakArguments);
constexpr double kOperationsPerTurn = 8 * 8 * 2;

double cpu_ms() {
  return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// Per millisecond of one thread.
struct Machine {
  double operations = 0.0;
  double bytes = 0.0;  // read or written
};

template <class Work>
double best_ms(Work work) {
  double best = 1e30;
  for (int i = 0; i < 7; ++i) {
    const double begin_ms = cpu_ms();
    work();
    best = std::min(best, cpu_ms() - begin_ms);
  }
  return best;
}

Machine measure_machine(const TileOptions& options) {
  Machine machine;
  constexpr uint64_t kTurns = 2'000'000;
  float sum = 0.0f;
  machine.operations = kOperationsPerTurn * static_cast<double>(kTurns) / best_ms([&] {
                         multiply_and_add(options.set, {kTurns, &sum});
                       });
  constexpr size_t kBytes = size_t{96} << 20;
  std::vector<char> from(kBytes, 1), to(kBytes);
  machine.bytes =
      2.0 * static_cast<double>(kBytes) / best_ms([&] { std::memcpy(to.data(), from.data(), kBytes); });
  return machine;
}

// ---- how much there is to do

struct Work {
  double operations = 0.0;
  double bytes = 0.0;
  double ms = 0.0;
};

/// By the names of the passes.
using StageWork = std::map<std::string, Work>;

/// Walks the stages by themselves, times and counts; not that of the tiles, which needs the head too.
Result<StageWork> walk_stages(const Case& one, const SceneAsset& asset, const TileOptions& options) {
  WorkerPool& workers = *options.workers;
  const RenderScene scene(asset, one.scene.look, true);
  const glm::uvec2 size_px(one.size.width, one.size.height);
  const PosedStrands strands{{}, asset.rest_position_m};
  ASSIGN_OR_RETURN(const View view, make_view(one.scene.camera, strands.world_from_head.rotation, size_px));
  DetailFacts facts = detail_facts(scene);
  facts.max_points = uint64_t{8} << 20;
  const StrandDetail detail = choose_detail(facts, scene.look, view, {});
  StrandExpansion expansion(asset, scene.rest.mean_length_m);
  expansion.set_look(scene.look);
  StrandPoints points;
  StageWork work;
  const auto timed = [&](const char* stage, auto run) {
    const double begin_ms = cpu_ms();
    run();
    work[stage].ms = cpu_ms() - begin_ms;
  };
  timed("render/expand",
        [&] { expansion.expand(asset.rest_position_m, detail, workers, options.set, points); });
  ShadeInput shade{};
  shade.look = shading_numbers(scene.look);
  shade.view = view;
  shade.width_m = drawn_width_m(facts, scene.look, std::max(points.strand_count(), 1u));
  shade.tip_scale = scene.look.tip_scale;
  shade.tip_fade = scene.look.style.tip_fade;
  shade.lights = light_directions(scene.look, strands.world_from_head.rotation, view.up);
  LightLattice lattice(describe_lattice(asset, scene, options.light_cells));
  const LatticeFrame frame = fit_lattice(lattice.desc(), shade.lights, asset.rest_position_m, 0.0f);
  timed("render/light", [&] {
    lattice.build(frame, points, {shade.width_m, shade.tip_scale, shade.tip_fade}, shade.lights, workers);
  });
  timed("render/shade", [&] {
    lattice.hide_from(view.eye_m);
    shade.lattice = lattice.view();
    shade_points(shade, workers, options.set, points);
  });
  TileBins bins;
  BinCounts counts;
  timed("render/bin", [&] { counts = bins.bin_segments(points, {size_px}, view.near_m, workers); });

  // Blocks of eight pixels that segments lie over: their length, as wide as they are and a pixel more.
  double pixels = 0.0;
  for (uint32_t strand = 0; strand < points.strand_count(); ++strand)
    for (uint32_t i = points.first_point[strand] + 1; i < points.first_point[strand + 1]; ++i) {
      const StrandPoint& a = points.point[i - 1];
      const StrandPoint& b = points.point[i];
      const glm::vec2 way(b.x - a.x, b.y - a.y);
      const float length = glm::length(way);
      const bool is_seen = a.x > 0.0f && a.y > 0.0f && a.x < view.target_px.x && a.y < view.target_px.y;
      if (is_seen && length < 1e4f) pixels += length * 2.0f;
    }
  const auto point_count = static_cast<double>(points.point.size());
  const auto segment_count = static_cast<double>(counts.segments);
  const auto pair_count = static_cast<double>(bins.segments().item.size());
  const auto cells = static_cast<double>(shade.lattice.size.x) * shade.lattice.size.y * shade.lattice.size.z;
  const double halved = cells / 8.0;
  const double picture = static_cast<double>(size_px.x) * size_px.y;
  constexpr double kPointBytes = sizeof(StrandPoint), kPairBytes = sizeof(TileSegment);
  const auto count = [&](const char* stage, double operations, double bytes) {
    work[stage].operations = operations;
    work[stage].bytes = bytes;
  };
  // Three cubics, their mix, locks, waves and frizz with four sines.
  count("render/expand", 210.0 * point_count, kPointBytes * point_count);
  // Eight cells per segment; sums swept once, two sweeps over cells twice as wide.
  count("render/light", 70.0 * point_count + 4.0 * cells + 40.0 * halved,
        kPointBytes * point_count + (4.0 + 4.0 + 2.0) * cells + 3.0 * 8.0 * halved);
  // Two lights of three lobes each, colour, two trilinear look-ups, projection, mitre.
  count("render/shade", 620.0 * point_count, 2.0 * kPointBytes * point_count);
  // Counted, then put there.
  count("render/bin", 2.0 * 30.0 * segment_count,
        2.0 * kPointBytes * point_count + 2.0 * kPairBytes * pair_count);
  // Sorted by two radix passes, set up once per pair, blended per pixel; the head and tone curve per pixel.
  count("render/draw", (40.0 + 70.0) * pair_count + 36.0 * pixels + 60.0 * picture,
        (kPairBytes + 2.0 * kPointBytes) * pair_count + 4.0 * picture);
  return work;
}

// ---- the table

Result<Options> parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string word = argv[i], value = argv[i + 1];
    if (word == "--rounds") {
      options.rounds = std::max(1, std::atoi(value.c_str()));
    } else if (word == "--scene") {
      options.scene = value;
    } else if (word != "--size" ||
               std::sscanf(value.c_str(), "%ux%u", &options.size.width, &options.size.height) != 2) {
      return make_error(ErrorCode::BadInput,
                        "unknown option {} {} (known: --rounds N --scene FILE --size WxH)", word, value);
    }
  }
  return options;
}

Result<std::vector<Case>> cases_of(const Options& options) {
  const RenderSize large{1280, 720};
  if (!options.scene.empty()) {
    ASSIGN_OR_RETURN(SceneDesc scene, load_scene(options.scene, {}));
    return std::vector<Case>{{options.scene, scene, options.size.width > 0 ? options.size : large}};
  }
  std::vector<Case> cases{{"built-in", built_in_scene(), large},
                          {"built-in", built_in_scene(), {640, 360}},
                          {"built-in far", built_in_scene(), large},
                          {"10240 x 64", built_in_scene(), large}};
  constexpr float kFar = 4.0f;
  cases[2].scene.camera.offset_m *= kFar;
  ProceduralGroomDesc many;
  many.strand_count = 10'240;
  many.vertex_count = 64;
  cases[3].scene.groom = many;
  cases[3].scene.look.followers = 0;
  return cases;
}

Status run_case(const Case& one, const Options& options, const Machine& machine) {
  ASSIGN_OR_RETURN(SceneContent content, load_scene_content(one.scene));
  const SceneAsset asset = make_scene_asset(content.groom, std::move(content.head));
  const TileOptions tiles;
  ASSIGN_OR_RETURN(const auto renderer, make_tile_renderer(asset, one.scene.look, tiles));
  std::map<std::string, std::vector<double>> ms;
  StageWork work;
  for (int round = 0; round <= options.rounds; ++round) {
    ASSIGN_OR_RETURN(work, walk_stages(one, asset, tiles));
    const double begin_ms = cpu_ms();
    RETURN_IF_ERROR(renderer->draw({{}, asset.rest_position_m}, one.scene.camera, one.size));
    work["whole"].ms = cpu_ms() - begin_ms;
    if (round == 0) continue;  // allocates
    for (const auto& [stage, measured] : work) ms[stage].push_back(measured.ms);
  }
  // The rest of the picture.
  double others_ms = 0.0;
  for (const auto& [stage, measured] : work)
    if (stage != "whole" && stage != "render/draw") others_ms += median(ms[stage]);
  ms["render/draw"] = {median(ms["whole"]) - others_ms};
  double floor_sum_ms = 0.0;
  for (auto& [stage, counted] : work) {
    const double by_operations_ms = counted.operations / machine.operations;
    const double by_bytes_ms = counted.bytes / machine.bytes;
    const double floor_ms = stage == "whole" ? floor_sum_ms : std::max(by_operations_ms, by_bytes_ms);
    floor_sum_ms += floor_ms;
    fmt::print("{},{}x{},{},{:.1f},{:.0f},{:.0f},{:.2f},{:.2f},{:.1f}\n", one.name, one.size.width,
               one.size.height, stage, median(ms[stage]), counted.operations * 1e-6, counted.bytes * 1e-6,
               by_operations_ms, by_bytes_ms, median(ms[stage]) / floor_ms);
  }
  std::fflush(stdout);
  return {};
}

Status run(int argc, char** argv) {
  ASSIGN_OR_RETURN(const Options options, parse(argc, argv));
  const TileOptions tiles;
  const Machine machine = measure_machine(tiles);
  fmt::print("# a thread, {}: {:.1f} billion operations and {:.1f} GB a second\n", to_string(tiles.set),
             machine.operations * 1e-6, machine.bytes * 1e-6);
  fmt::print(
      "scene,size,stage,ms,cpu_ms,million_operations,megabytes,floor_operations_ms,floor_bytes_ms,times_"
      "floor\n");
  ASSIGN_OR_RETURN(const std::vector<Case> cases, cases_of(options));
  for (const Case& one : cases) RETURN_IF_ERROR(run_case(one, options, machine));
  return {};
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  const strandcast::Status status = strandcast::run(argc, argv);
  if (!status) std::fprintf(stderr, "%s\n", status.error().to_string().c_str());
  return status ? 0 : 2;
}
