// Writes the same made-up strands in motion as FOLDER/hair.usda, .usdc, .usdz and .csv, so that another
// program can compare them.
#include <cmath>
#include <cstdio>

#include "client/export/export_strands.h"

namespace strandcast {
namespace {

constexpr uint32_t kStrands = 150, kVertices = 12;
constexpr int kStates = 31;
constexpr int64_t kStepNs = 16'666'667;

std::vector<glm::vec3> positions_at(double t_s) {
  std::vector<glm::vec3> positions;
  for (uint32_t vertex = 0; vertex < kVertices; ++vertex) {
    for (uint32_t strand = 0; strand < kStrands; ++strand) {
      const double angle = 2.4 * strand, swing = 0.004 * vertex * std::sin(5.0 * t_s + strand);
      positions.emplace_back(0.1 * std::cos(angle) + swing, 0.1 - 0.02 * vertex,
                             0.1 * std::sin(angle) - swing);
    }
  }
  return positions;
}

class MadeStates : public ExportSource {
 public:
  MadeStates() {
    SceneAsset asset;
    asset.strand_count = kStrands;
    asset.vertex_count = kVertices;
    asset.rest_position_m = positions_at(0.0);
    scene_ = {std::make_shared<const SceneAsset>(asset), 0.0002f, 0.25f};
    auto origin = std::make_shared<ExportOrigin>();
    origin->object_name = {"fringe", "back"};
    for (uint32_t strand = 0; strand < kStrands; ++strand) {
      origin->place.push_back(strand);
      origin->id.push_back(1'000 - static_cast<int32_t>(strand));
      origin->group.push_back(static_cast<int32_t>(strand % 3));
      origin->object.push_back(strand % 2);
    }
    scene_.origin = std::move(origin);
  }
  const ExportScene& scene() const override { return scene_; }
  Result<std::shared_ptr<const Snapshot>> next() override {
    if (index_ == kStates) return std::shared_ptr<const Snapshot>();
    const std::vector<glm::vec3> positions = positions_at(static_cast<double>(index_ * kStepNs) * 1e-9);
    QuantiseInput input;
    input.sim_time_ns = index_++ * kStepNs;
    input.world_from_head = {{0.01 * index_, 1.6, 0.0}, glm::angleAxis(0.02 * index_, glm::dvec3(0, 1, 0))};
    input.strand_count = kStrands;
    input.vertex_count = kVertices;
    input.quantum_m = 1e-4f;
    input.position_in_head_m = positions;
    return std::make_shared<const Snapshot>(quantise(input).snapshot);
  }
  std::vector<std::string> remarks() const override { return {}; }

 private:
  ExportScene scene_;
  int64_t index_ = 0;
};

int write(const std::filesystem::path& folder) {
  for (const char* const name : {"hair.usda", "hair.usdc", "hair.usdz", "hair.csv"}) {
    MadeStates states;
    ExportOptions options;
    options.path = folder / name;
    options.fps = {24, 1};
    options.up = ExportUp::Z;
    options.space = ExportSpace::World;
    options.is_quiet = true;
    const auto report = export_strands(states, options, std::atomic<bool>(false));
    if (report) continue;
    fmt::print(stderr, "write_curves: {}\n", report.error().to_string());
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace strandcast

int main(int argument_count, char** arguments) {
  if (argument_count == 2) return strandcast::write(arguments[1]);
  fmt::print(stderr, "usage: write_curves FOLDER\n");
  return 2;
}
