// Prints what a hair volume takes, as CSV: processor time of all threads and time by the clock, beside a
// plain splat of the same strands on one thread and what OpenGL takes for each way to scatter, in turns in
// the same run; the last column compares processor times of these. usage: volume_bench [--groom FILE]
// [--strands N] [--resolution N] [--smoothing N] [--rounds N]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <string>

#include "common/base/check.h"
#include "common/base/quantile.h"
#include "server/scene/scene_content.h"
#include "server/sim/executor/gl_executor.h"
#include "server/sim/executor/lanes_executor.h"
#include "server/sim/volume/volume_forces.h"

namespace strandcast {
namespace {

struct Options {
  std::string groom;
  uint32_t strands = 10000;
  uint32_t resolution = 64;
  uint32_t smoothing = 1;
  int rounds = 31;
};

double cpu_ms() {
  return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}
double clock_ms() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double, std::milli>(now).count();
}

struct Times {
  std::vector<double> cpu;
  std::vector<double> wall;
  template <class Work>
  void add(Work work) {
    const double cpu_begin_ms = cpu_ms();
    const double begin_ms = clock_ms();
    work();
    wall.push_back(clock_ms() - begin_ms);
    cpu.push_back(cpu_ms() - cpu_begin_ms);
  }
  void print(const std::string& name, const std::string& ratio = "") {
    fmt::print("{},{:.2f},{:.2f},{}\n", name, median(cpu), median(wall), ratio);
  }
};

/// Volumes that OpenGL makes, in turns.
class GlScatters {
 public:
  GlScatters(const StrandLayout& layout, const HairVolume& host, uint32_t smoothing) {
    auto executor = make_gl_executor("auto");
    if (!executor) return;
    executor_ = std::move(executor).value();
    step_.world_from_head = {glm::vec4(1, 0, 0, 0), glm::vec4(0, 1, 0, 0), glm::vec4(0, 0, 1, 0)};
    step_.head_velocity.w = 1.0f / 60.0f;
    step_.shape = {layout.strand_count, layout.vertex_count, 1u, layout.vertex_count};
    position_ = executor_->make_plane("position", layout.strand_count, layout.rest);
    velocity_ = executor_->make_plane("velocity", layout.strand_count,
                                      std::vector<glm::vec4>(layout.size(), glm::vec4(0.0f)));
    table_ = executor_->make_table("volume", static_cast<uint32_t>(2 + host.most_nodes())).value();
    for (const char* name : {"sort", "atomics"}) {
      DeviceVolumeDesc desc;
      desc.scatter = name;
      desc.volume = &host;
      desc.strand_count = layout.strand_count;
      desc.vertex_count = layout.vertex_count;
      desc.smoothing = smoothing;
      auto volume = executor_->make_volume(desc);
      if (!volume) fmt::print(stderr, "{}\n", volume.error().to_string());
      if (volume) volumes_.push_back({name, std::move(volume).value(), {}});
    }
  }
  void round(bool is_timed) {
    if (!executor_ || !executor_->make_current().ok()) return;
    for (Row& row : volumes_) {
      Times unused;
      (is_timed ? row.times : unused).add([&] {
        timed_ms(*executor_, [&] { row.volume->update(step_, *position_, *velocity_, *table_); });
      });
    }
  }
  void print(uint32_t smoothing) {
    for (Row& row : volumes_)
      row.times.print(fmt::format("OpenGL {}, {} smoothings", row.name, smoothing),
                      fmt::format("{:.2f}", median(row.times.cpu) / median(volumes_.back().times.cpu)));
  }

 private:
  struct Row {
    std::string name;
    std::unique_ptr<DeviceVolume> volume;
    Times times;
  };
  std::unique_ptr<Executor> executor_;
  StepBlock step_{};
  std::unique_ptr<StrandPlane> position_, velocity_;
  std::unique_ptr<LookupTable> table_;
  std::vector<Row> volumes_;
};

/// Eight nodes a vertex, one after the other.
void splat_plainly(const StrandLayout& layout, const VolumeGrid& grid, std::vector<glm::vec4>& nodes) {
  std::fill(nodes.begin(), nodes.end(), glm::vec4(0.0f));
  const float per_cell = 1.0f / grid.cell_m;
  const glm::vec3 first(grid.first);
  for (const glm::vec4& vertex : layout.rest) {
    const glm::vec3 at = per_cell * glm::vec3(vertex) - first;
    const glm::vec3 base = glm::floor(at);
    const glm::vec3 share = at - base;
    const glm::uvec3 node(base);
    for (uint32_t corner = 0; corner < 8; ++corner) {
      const glm::uvec3 far(corner & 1u, (corner >> 1) & 1u, corner >> 2);
      const float weight = vertex.w * (far.x != 0 ? share.x : 1.0f - share.x) *
                           (far.y != 0 ? share.y : 1.0f - share.y) * (far.z != 0 ? share.z : 1.0f - share.z);
      nodes[grid.index(node.x + far.x, node.y + far.y, node.z + far.z)] += weight * glm::vec4(0, 0, 0, 1);
    }
  }
}

int run(const Options& options) {
  SceneDesc scene = built_in_scene();
  std::get<ProceduralGroomDesc>(scene.groom).strand_count = options.strands;
  if (!options.groom.empty()) {
    FileGroomDesc file;
    file.path = options.groom;
    scene.groom = file;
  }
  const auto content = load_scene_content(scene);
  if (!content) {
    fmt::print(stderr, "{}\n", content.error().to_string());
    return 2;
  }
  const StrandLayout layout = make_strand_layout(content->groom).value();
  auto volume = HairVolume::make({layout.strand_count, layout.vertex_count, layout.rest, {}},
                                 {options.resolution, options.smoothing});
  if (!volume) {
    fmt::print(stderr, "{}\n", volume.error().to_string());
    return 2;
  }
  StrandBlocks position(layout.strand_count, layout.vertex_count);
  StrandBlocks velocity(layout.strand_count, layout.vertex_count);
  pack_blocks(std::span<const glm::vec4>(layout.rest), position);
  std::vector<glm::vec4> nodes(volume->most_nodes());
  VolumeInput input;
  input.position_m = position.view();
  input.velocity_mps = velocity.view();
  input.ahead_s = 1.0f / 60.0f;
  Times sorted;
  Times plain;
  std::vector<glm::vec4> plain_nodes;
  GlScatters without_smoothing(layout, *volume, 0);
  GlScatters with_smoothing(layout, *volume, options.smoothing);
  for (int i = 0; i <= options.rounds; ++i) {
    without_smoothing.round(i > 0);
    with_smoothing.round(i > 0);
    if (i == 0) {  // the first one allocates
      volume->update(input, nodes);
      plain_nodes.resize(volume->grid().size());
      continue;
    }
    sorted.add([&] { volume->update(input, nodes); });
    plain.add([&] { splat_plainly(layout, volume->grid(), plain_nodes); });
  }
  Times forces;
  auto lanes = make_lanes_executor();
  if (lanes) {
    Executor& executor = **lanes;
    StrandState strands(executor);
    const glm::dquat upright(1.0, 0.0, 0.0, 0.0);
    CHECK(strands.load(content->groom, upright).ok());
    VolumeDesc desc;
    desc.friction_per_s = 20.0;
    desc.repulsion_per_s2 = 18000.0;
    desc.resolution = options.resolution;
    desc.smoothing = options.smoothing;
    auto pass = VolumeForces::make(executor, {}, layout, desc, nullptr).value();
    const StepInput step;
    const StepBlock block = make_step_block(step, {.max_speed_mps = 100.0}, layout.counts(), strands.head());
    pass->gather(step, strands, nullptr);
    for (int i = 0; i < options.rounds; ++i) forces.add([&] { pass->apply(block, strands, nullptr); });
  }
  size_t occupied = 0;
  for (const glm::vec4& node : plain_nodes) occupied += node.w > 0.0f ? 1 : 0;
  fmt::print(
      "# {} strands x {}, cell {:.1f} mm, grid {} x {} x {}, {:.0f} % of nodes in use, {} samples, {} kB\n",
      layout.strand_count, layout.vertex_count, 1e3f * volume->cell_m(), volume->grid().nodes.x,
      volume->grid().nodes.y, volume->grid().nodes.z,
      100.0 * static_cast<double>(occupied) / static_cast<double>(plain_nodes.size()), volume->sample_count(),
      volume->size_bytes() / 1000);
  fmt::print("variant,cpu ms,wall ms,cpu of atomics\n");
  sorted.print("volume: density, velocity, smoothing");
  if (lanes) forces.print("friction and repulsion on lanes");
  plain.print("plain splat without smoothing, one thread");
  without_smoothing.print(0);
  with_smoothing.print(options.smoothing);
  return 0;
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  strandcast::Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i];
    if (name == "--groom") options.groom = argv[i + 1];
    if (name == "--strands") options.strands = static_cast<uint32_t>(std::atoi(argv[i + 1]));
    if (name == "--resolution") options.resolution = static_cast<uint32_t>(std::atoi(argv[i + 1]));
    if (name == "--smoothing") options.smoothing = static_cast<uint32_t>(std::atoi(argv[i + 1]));
    if (name == "--rounds") options.rounds = std::max(1, std::atoi(argv[i + 1]));
  }
  return strandcast::run(options);
}
